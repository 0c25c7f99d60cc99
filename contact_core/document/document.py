"""The document: an immutable value that says which surfaces there are and what contact lies on them.

It holds no mesh and no reconstructed point. Surfaces are remembered by name and content digest; points follow
from shape and placement (see ADR 0020). Everything is plain data: equal documents have equal bytes on disk.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeVar

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.contact.placement import Link, Placement
from contact_core.contact.shape import AxisShape, PatchShape
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.timeline import FILM, Span, Timeline, Track, gain_of, of_address
from contact_core.errors import CommandRejected, InvalidInput, quoted
from contact_core.geometry.transform import is_rigid
from contact_core.rig.rig import Pose
from contact_core.solve.body import Hold, check_hold

Color = tuple[float, float, float]
MAX_NAME = 200


@dataclass(frozen=True, eq=False)
class Proxy:
    """The closed manifold surface that the contacts of a surface run on, where its own mesh is broken.

    maker: the name of the proxy maker (hook `contact_proxy_makers`), with its settings: they make the same mesh
    elsewhere; "" for a mesh that was brought. digest: of the TriangleMesh. faces: how many it has.
    """

    maker: str
    settings: FrozenMap[Any]
    digest: str
    faces: int

    def __post_init__(self) -> None:
        if self.faces < 1:
            raise InvalidInput(f"a proxy has faces, but got {self.faces}.")


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface as the document remembers it: enough to recognise it, not to draw it.

    digest, topology_digest: of its TriangleMesh. world_from_surface: (4, 4) rigid; where the object, or the rig's
    own space, stands in the scene. rig: name of the rig whose rest pose this is, None for an object. proxy: what
    contacts run on in place of the mesh: roots are on the proxy's faces, points are given on the surface's own.
    """

    name: str
    digest: str
    topology_digest: str
    points: int
    faces: int
    meters_per_unit: float = 1.0
    up_axis: Literal["X", "Y", "Z"] = "Y"
    rig: str | None = None
    world_from_surface: FloatArray = field(default_factory=lambda: np.eye(4))
    proxy: Proxy | None = None

    def __post_init__(self) -> None:
        check_name(self.name, "a surface")
        matrix = frozen(self.world_from_surface, np.float64, (4, 4), "world_from_surface")
        object.__setattr__(self, "world_from_surface", matrix)
        if not is_rigid(matrix):
            raise InvalidInput(
                f"world_from_surface of {self.name!r} must be rigid: apply scale and shear to the points instead."
            )
        if not 0.0 < self.meters_per_unit < np.inf:
            raise InvalidInput(f"meters_per_unit is a positive number, but got {self.meters_per_unit}.")
        if min(self.points, self.faces) < 0:
            raise InvalidInput(f"{self.name!r} cannot have {self.points} points and {self.faces} faces.")

    def told(self, length: float) -> str:
        """A length in this surface's units for a person to read: "4.2 mm", "1.35 m"."""
        meters = length * self.meters_per_unit
        return f"{meters:.3g} m" if meters >= 0.9995 else f"{1e3 * meters:.3g} mm"

    @property
    def carrier_digest(self) -> str:
        """Of the mesh that contacts run on: its proxy's, where it has one."""
        return self.digest if self.proxy is None else self.proxy.digest

    @property
    def carrier_faces(self) -> int:
        """How many faces the mesh has that contacts run on."""
        return self.faces if self.proxy is None else self.proxy.faces


@dataclass(frozen=True, slots=True)
class Patch:
    """One contact patch: a shape, placed on a surface.

    shape: key into the document's shapes; a transferred patch shares the key of its source. original: it was
    painted here, so its edits of the shape reach all partners; a transferred patch keeps its own deviation
    instead: turns (axis point, radians added to the turning angle there), along and spread (factors).
    mirrored: reconstructed as the mirror image of the shape.
    """

    name: str
    surface: str
    shape: str
    placement: Placement
    original: bool = True
    mirrored: bool = False
    color: Color = (0.9, 0.4, 0.3)
    turns: tuple[tuple[int, float], ...] = ()
    along: float = 1.0
    spread: float = 1.0

    def __post_init__(self) -> None:
        check_name(self.name, "a patch")
        object.__setattr__(self, "color", _checked_color(self.color))
        if not (0.0 < self.along < np.inf and 0.0 < self.spread < np.inf):
            raise InvalidInput(f"along and spread are positive factors, but got {self.along} and {self.spread}.")


@dataclass(frozen=True, slots=True)
class ContactPair:
    """Two patches that are to touch, how much this pair counts, and how far it is on.

    gain: 0 is off, 1 is on; unlike weights, the gain of one pair leaves the others as strong as they were.
    hold: points meet and may face anywhere ("point"), face each other at any distance ("direction"), or "both".
    """

    name: str
    manipulator: str
    object: str
    weight: float = 1.0
    gain: float = 1.0
    hold: Hold = "both"

    def __post_init__(self) -> None:
        check_name(self.name, "a pair")
        if self.manipulator == self.object:
            raise InvalidInput(f"a pair joins two patches, but got {self.object!r} twice.")
        if not 0.0 <= self.weight < np.inf:
            raise InvalidInput(f"the weight of a pair is not negative, but got {self.weight}.")
        if not 0.0 <= self.gain <= 1.0:
            raise InvalidInput(f"the gain of a pair is 0..1, but got {self.gain}.")
        check_hold(self.hold)


@dataclass(frozen=True, eq=False)
class ContactDocument:
    """The whole document; every part a read-only mapping by name.

    shapes: by key. groups: names of patches that belong together across surfaces. poses: by surface, the pose its
    rig is in. extras: JSON values of hosts and plugins by namespace ("host.blender"). timelines: under "film" the
    range and the rate, if they were set. tracks: by address (`timeline.address`), keys of what changes over time.
    spans: by pair, when it holds; always where none are.
    """

    surfaces: FrozenMap[Surface] = field(default_factory=FrozenMap)
    patches: FrozenMap[Patch] = field(default_factory=FrozenMap)
    shapes: FrozenMap[PatchShape] = field(default_factory=FrozenMap)
    pairs: FrozenMap[ContactPair] = field(default_factory=FrozenMap)
    groups: FrozenMap[tuple[str, ...]] = field(default_factory=FrozenMap)
    poses: FrozenMap[Pose] = field(default_factory=FrozenMap)
    extras: FrozenMap[Any] = field(default_factory=FrozenMap)
    timelines: FrozenMap[Timeline] = field(default_factory=FrozenMap)
    tracks: FrozenMap[Track] = field(default_factory=FrozenMap)
    spans: FrozenMap[tuple[Span, ...]] = field(default_factory=FrozenMap)

    @property
    def timeline(self) -> Timeline:
        """The range and the rate of the film; one frame where nobody has set any."""
        return self.timelines.get(FILM, Timeline())

    @property
    def is_timed(self) -> bool:
        """Whether anything in it changes over time."""
        return bool(self.tracks or self.spans)

    def at(self, frame: float) -> ContactDocument:
        """The document as it is at a frame, without tracks and spans: every value is what it comes to there.

        The very same document where nothing changes over time. A patch between two keys has a `Walk` for its
        placement, so no mesh is needed.
        """
        if not self.is_timed:
            return self
        patches, surfaces, pairs, poses = (
            dict[str, Any](part) for part in (self.patches, self.surfaces, self.pairs, self.poses)
        )
        for where, track in self.tracks.items():
            kind, name = of_address(where)
            if kind == "placement":
                patches[name] = replace(patches[name], placement=track.placement_at(frame))
            elif kind == "place":
                surfaces[name] = replace(surfaces[name], world_from_surface=track.place_at(frame))
            elif kind == "weight":
                pairs[name] = replace(pairs[name], weight=track.weight_at(frame))
            else:
                poses[name] = track.pose_at(frame)
        for name, spans in self.spans.items():
            held = max(spans, key=lambda span: span.gain(frame))
            pairs[name] = replace(pairs[name], gain=gain_of(spans, frame), hold=held.hold)
        return replace(
            self,
            surfaces=FrozenMap(surfaces),
            patches=FrozenMap(patches),
            pairs=FrozenMap(pairs),
            poses=FrozenMap(poses),
            tracks=FrozenMap(),
            spans=FrozenMap(),
        )

    def patch(self, name: str) -> Patch:
        """The patch. Raises CommandRejected naming those that exist."""
        return named(self.patches, name, "patch")

    def surface(self, name: str) -> Surface:
        """The surface. Raises CommandRejected naming those that exist."""
        return named(self.surfaces, name, "surface")

    def shape_of(self, name: str) -> PatchShape:
        """The shape that a patch shares with its partners, before its own deviation."""
        return self.shapes[self.patch(name).shape]

    def effective_axis(self, name: str) -> AxisShape:
        """The axis shape of a patch with its own deviation, as drawn (not mirrored)."""
        patch = self.patch(name)
        axis = self.shapes[patch.shape].axis
        if not patch.turns and patch.along == 1.0 and patch.spread == 1.0:
            return axis
        angles = axis.turning_angles.copy()
        for point, angle in patch.turns:
            if 1 <= point <= len(angles):  # a new, shorter axis of the source may have dropped the point
                angles[point - 1] += angle
        return AxisShape(axis.lengths, angles, axis.along * patch.along, axis.spread * patch.spread)

    def unit(self, name: str) -> float:
        """Units of a patch's surface per unit of its shape."""
        patch = self.patch(name)
        return self.shapes[patch.shape].meters_per_unit / self.surface(patch.surface).meters_per_unit

    def surface_axis(self, name: str) -> AxisShape:
        """The axis shape of a patch as it is traced on its surface: its own deviation, mirrored where the patch
        is, in the surface's units."""
        return self.effective_axis(name).transformed(mirrored=self.patch(name).mirrored, unit=self.unit(name))

    def partners(self, name: str) -> tuple[str, ...]:
        """All other patches that share the shape of a patch."""
        key = self.patch(name).shape
        return tuple(other.name for other in self.patches.values() if other.shape == key and other.name != name)

    def children(self, name: str) -> tuple[str, ...]:
        """The patches that are children of a patch."""
        return tuple(
            other.name
            for other in self.patches.values()
            if isinstance(other.placement, Link) and other.placement.parent == name
        )

    def descendants(self, name: str) -> Iterator[str]:
        """All patches below a patch, parents before children."""
        waiting = list(self.children(name))
        while waiting:
            child = waiting.pop(0)
            yield child
            waiting.extend(self.children(child))

    def ancestors(self, name: str) -> Iterator[str]:
        """The parent of a patch, its parent, and so on."""
        placement = self.patch(name).placement
        while isinstance(placement, Link):
            yield placement.parent
            placement = self.patch(placement.parent).placement

    def with_patches(self, *patches: Patch) -> ContactDocument:
        """A copy with patches put in or replaced."""
        return replace(self, patches=self.patches.updated({patch.name: patch for patch in patches}))

    def with_shape(self, key: str, shape: PatchShape) -> ContactDocument:
        """A copy with a shape put in or replaced."""
        return replace(self, shapes=self.shapes.with_item(key, shape))

    def free_name(self, wanted: str, among: Mapping[str, Any] | None = None) -> str:
        """`wanted`, or the first of wanted.2, wanted.3 ... that no patch (or nothing of `among`) has."""
        taken = self.patches if among is None else among
        name, number = wanted, 2
        while name in taken:
            name, number = f"{wanted}.{number}", number + 1
        return name


T = TypeVar("T")


def named(items: Mapping[str, T], name: str, kind: str) -> T:
    """The item called `name`. Raises CommandRejected with near names where there is none."""
    try:
        return items[name]
    except KeyError:
        near = difflib.get_close_matches(name, items, n=3) or sorted(items)[:5]
        there = f"near names: {', '.join(near)}" if near else f"the document has no {kind} at all"
        raise CommandRejected(f"there is no {kind} {name!r}; {there}.") from None


def _checked_color(color: Any) -> Color:
    try:
        r, g, b = (float(number) for number in color)
    except (TypeError, ValueError):
        raise InvalidInput(f"a colour is three numbers in 0..1, but got {str(color)[:60]!r}.") from None
    if not (0.0 <= r <= 1.0 and 0.0 <= g <= 1.0 and 0.0 <= b <= 1.0):
        raise InvalidInput(f"a colour is three numbers in 0..1, but got {color}.")
    return r, g, b


def is_name(name: object) -> bool:
    """Whether something can be a name: printable text, trimmed, not empty and of bounded length."""
    if not isinstance(name, str) or not 0 < len(name) <= MAX_NAME:
        return False
    return name.isprintable() and name == name.strip()


def check_name(name: str, kind: str) -> None:
    """Raises InvalidInput unless `name` can be a name: printable, trimmed, not empty and of bounded length."""
    if not is_name(name):
        raise InvalidInput(
            f"the name of {kind} is 1..{MAX_NAME} printable characters, trimmed; got {quoted(name)}."
        )
