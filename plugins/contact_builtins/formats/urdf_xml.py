"""URDF as plain values: links with their visuals, joints with their limits. Names of elements follow the
specification (wiki.ros.org/urdf/XML); elements that say nothing about the shape or the joints are passed over.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from contact_builtins.formats.refusal import file_bytes
from contact_core.arrays import FloatArray
from contact_core.errors import FileRefused, InvalidInput

UNSAID = "a limit without lower or upper, which the URDF specification takes for 0"
_MACRO = re.compile(r"\$[{(]")


@dataclass(frozen=True, eq=False)
class Visual:
    """One shape of a link, drawn or for collisions. origin: (4, 4) link_from_visual.

    kind: "box", "mesh"...; sizes as the kind needs them.
    box: three edges; sphere: radius; cylinder, capsule: radius, length; mesh: scale (3), and `filename`.
    """

    origin: FloatArray
    kind: str
    sizes: tuple[float, ...] = ()
    filename: str = ""


@dataclass(frozen=True, eq=False)
class Link:
    """visuals: what is drawn. collisions: what physics meets instead. odd: why other visuals are no shape."""

    name: str
    visuals: tuple[Visual, ...]
    collisions: tuple[Visual, ...] = ()
    odd: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mimic:
    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class Joint:
    """origin: (4, 4) parent_from_joint at angle zero. axis: (3,) as written. limits: (lower, upper) or None where
    no limit is given. odd: what is not as the specification has it, and what was made of it."""

    name: str
    kind: str
    parent: str
    child: str
    origin: FloatArray
    axis: FloatArray
    limits: tuple[float, float] | None
    odd: tuple[str, ...]
    mimic: Mimic | None

    @property
    def turns(self) -> bool:
        """Whether it is a hinge."""
        return self.kind in ("revolute", "continuous")


def parse_urdf(path: Path) -> tuple[tuple[Link, ...], tuple[Joint, ...]]:
    """The links and joints of a file. Raises FileRefused, InvalidInput."""
    text = file_bytes(path).lstrip()  # XML must begin with its declaration, which people do not see
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:  # no entities: they name other files
        raise FileRefused(f"{path} declares a document type, which no URDF needs and which is not read. Remove it.")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        said = str(error) if isinstance(error, ElementTree.ParseError) else "its encoding is not known"
        raise FileRefused(f"{path} was to be a URDF file, but cannot be parsed: {said}. Check its XML.") from error
    if root.tag.rpartition("}")[2] != "robot":
        raise InvalidInput(f"its outermost element is <{root.tag[:60]}>, where a URDF has <robot>")
    _check_expanded(path, root)
    _without_namespace(root)
    links = tuple(_link(entry) for entry in root.findall("link"))
    joints = tuple(_joint(entry) for entry in root.findall("joint"))
    for what, names in (("link", [link.name for link in links]), ("joint", [joint.name for joint in joints])):
        twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
        if twice:
            raise InvalidInput(f"it has two {what}s named {twice[0]!r}; names are unique in a URDF")
    return links, joints


def _without_namespace(root: ElementTree.Element) -> None:
    """Takes the default namespace off all tags: URDF has none, and some tools write one."""
    space = root.tag.rpartition("}")[0]
    for element in root.iter() if space else ():
        if str(element.tag).startswith(space + "}"):
            element.tag = str(element.tag).rpartition("}")[2]


def _check_expanded(path: Path, root: ElementTree.Element) -> None:
    """Raises FileRefused where macros are left: their values are not known here."""
    for element in root.iter():
        tag = str(element.tag)
        macro = "xacro" in tag.partition("}")[0] and tag.startswith("{")
        if macro or any(_MACRO.search(value) for value in element.attrib.values()):
            raise FileRefused(
                f"{path} still holds xacro macros, so it is not a URDF yet: expand it with xacro first"
                " (xacro robot.urdf.xacro > robot.urdf)."
            )


def _link(entry: ElementTree.Element) -> Link:
    name = _named(entry, "link")
    visuals, odd = _shapes_of(entry, "visual", name)
    return Link(name, visuals, _shapes_of(entry, "collision", name)[0], odd)


def _shapes_of(entry: ElementTree.Element, kind: str, name: str) -> tuple[tuple[Visual, ...], tuple[str, ...]]:
    """The shapes of a link, drawn or for collisions, and why others are none: one odd shape spoils no robot."""
    found, odd = list[Visual](), list[str]()
    for item in entry.findall(kind):
        try:
            found += _shapes(item, f"a {kind} of link {name!r}")
        except InvalidInput as error:
            odd.append(str(error))
    return tuple(found), tuple(odd)


def _shapes(entry: ElementTree.Element, whose: str) -> Iterator[Visual]:
    origin = _origin(entry.find("origin"), whose)
    for shape in entry.findall("geometry/*"):
        if shape.tag == "mesh":
            filename = shape.get("filename") or ""
            if not filename:
                raise InvalidInput(f"{whose} is a mesh without a filename")
            yield Visual(origin, "mesh", _scale(shape, whose), filename)
        elif shape.tag == "box":
            yield Visual(origin, "box", _sizes(_numbers(shape, "size", None, 3, whose), whose))
        elif shape.tag in ("sphere", "cylinder", "capsule"):
            wanted = ("radius",) if shape.tag == "sphere" else ("radius", "length")
            sizes = [float(_numbers(shape, key, None, 1, whose)[0]) for key in wanted]
            yield Visual(origin, shape.tag, _sizes(sizes, whose))
        else:
            yield Visual(origin, str(shape.tag)[:60])


def _sizes(values: FloatArray | list[float], whose: str) -> tuple[float, ...]:
    if min(values) < 0:
        raise InvalidInput(f"{whose} has the negative size {min(values):g}")
    return tuple(float(value) for value in values)


def _scale(shape: ElementTree.Element, whose: str) -> tuple[float, ...]:
    """Three factors; a single number is meant for all axes."""
    words = (shape.get("scale") or "1 1 1").replace(",", " ").split()
    scale = _floats(words * 3 if len(words) == 1 else words, "scale", 3, whose)
    if (scale == 0).any():
        raise InvalidInput(f"{whose} has the scale {' '.join(words)}, which flattens it")
    return tuple(float(value) for value in scale)


def _joint(entry: ElementTree.Element) -> Joint:
    name = _named(entry, "joint")
    whose = f"joint {name!r}"
    kind = (entry.get("type") or "").lower()
    moves = kind in ("revolute", "continuous")
    # the axis of a joint that does not turn is never used: tools write what they like there
    axis = _axis(entry.find("axis"), whose) if moves else np.array([1.0, 0.0, 0.0])
    limits, odd = _limits(entry, kind, whose)
    return Joint(
        name,
        kind if axis is not None else "fixed",
        _end(entry, "parent", whose),
        _end(entry, "child", whose),
        _origin(entry.find("origin"), whose),
        np.array([1.0, 0.0, 0.0]) if axis is None else axis,
        limits,
        (*odd, *(["an axis of no length, about which nothing turns"] if axis is None else [])),
        _mimic(entry.find("mimic"), whose) if moves and axis is not None else None,
    )


def _end(entry: ElementTree.Element, tag: str, whose: str) -> str:
    link = next((end.get("link") for end in entry.findall(tag)), None)
    if not link:
        raise InvalidInput(f"{whose} names no {tag} link")
    return link


def _limits(
    entry: ElementTree.Element, kind: str, whose: str
) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """The limits of a revolute joint, and what is odd about them. No number is no limit; inf is one, of its own."""
    limit = entry.find("limit") if kind == "revolute" else None
    if limit is None:
        return None, ()
    ends, odd = list[float](), list[str]()
    for key, free in (("lower", -math.inf), ("upper", math.inf)):
        if limit.get(key) is None:
            odd.append(UNSAID)
        try:
            ends.append(float((limit.get(key) or "0").strip()))
        except ValueError:
            raise InvalidInput(
                f"{whose}: {key} is {str(limit.get(key))[:60]!r}, where a number must stand"
            ) from None
        if math.isnan(ends[-1]):
            ends[-1] = free
            odd.append("a limit that is no number, which limits nothing")
    if ends[0] > ends[1]:
        odd.append("a lower limit above its upper one: they were exchanged")
    return (min(ends), max(ends)), tuple(dict.fromkeys(odd))


def _axis(entry: ElementTree.Element | None, whose: str) -> FloatArray | None:
    """(3,) unit axis; +x where none is given, None where it has no length."""
    if entry is None:
        return np.array([1.0, 0.0, 0.0])
    axis = _numbers(entry, "xyz", "1 0 0", 3, whose)
    length = float(np.linalg.norm(axis))
    return axis / length if 0.0 < length < math.inf else None


def _mimic(entry: ElementTree.Element | None, whose: str) -> Mimic | None:
    if entry is None:
        return None
    if not entry.get("joint"):
        raise InvalidInput(f"{whose} mimics a joint that it does not name")
    multiplier, offset = (
        float(_numbers(entry, key, default, 1, whose)[0]) for key, default in (("multiplier", "1"), ("offset", "0"))
    )
    return Mimic(str(entry.get("joint")), multiplier, offset)


def _origin(entry: ElementTree.Element | None, whose: str) -> FloatArray:
    """(4, 4) from xyz and rpy: turns about the fixed axes x, then y, then z."""
    matrix = np.eye(4)
    if entry is not None:
        matrix[:3, 3] = _numbers(entry, "xyz", "0 0 0", 3, whose)
        roll, pitch, yaw = _numbers(entry, "rpy", "0 0 0", 3, whose)
        turns = [turn(axis, angle) for axis, angle in zip(np.eye(3), (roll, pitch, yaw), strict=True)]
        matrix[:3, :3] = (turns[2] @ turns[1] @ turns[0])[:3, :3]
    return matrix


def turn(axis: FloatArray, angle: float) -> FloatArray:
    """(4, 4) rotation about a unit axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
    return matrix


def _named(entry: ElementTree.Element, what: str) -> str:
    name = entry.get("name")
    if not name:
        raise InvalidInput(f"it has a {what} without a name")
    return name


def _numbers(entry: ElementTree.Element, key: str, default: str | None, count: int, whose: str) -> FloatArray:
    """(count,) finite numbers of an attribute. default: what stands where the attribute is left out."""
    text = entry.get(key, default)
    if text is None:
        raise InvalidInput(f"{whose}: its <{entry.tag}> has no {key}")
    words = text.split() or (default or "").split()
    if len(words) != count or any("," in word for word in words):
        words = text.replace(",", " ").split() if count > 1 else words  # "0, 0, 1": still as many numbers
    return _floats(words, key, count, whose)


def _floats(words: list[str], key: str, count: int, whose: str) -> FloatArray:
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.array([np.nan])
    if len(values) != count or not np.isfinite(values).all():
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise InvalidInput(f"{whose}: {key} is {' '.join(words)[:60]!r}, where {wanted} must stand")
    return values
