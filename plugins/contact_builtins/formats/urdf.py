"""URDF hands as one rig: a joint per link, rigid weights, hinges with the file's limits."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_builtins.formats.any_mesh import read_any_mesh
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import MAX_JOINTS, NoSurface, bounded, named, refusing
from contact_builtins.formats.sidecar import read_sidecar, sidecar_beside
from contact_builtins.formats.urdf_paths import MeshPaths
from contact_builtins.formats.urdf_xml import Joint, Link, Mimic, Visual, parse_urdf, turn
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput, MissingExtra, shortened
from contact_core.geometry import solids
from contact_core.geometry.transform import transform_points
from contact_core.rig.rig import JointFreedom, Rig, forward_kinematics

_TURNS = 2 * np.pi + 0.01  # a limit beyond is no stop of a finger, and mostly one in degrees


class UrdfFiles:
    """Reads robot hands. Joints are named after the URDF's joints, the root after its base link.

    package_roots: folders in which `package://NAME/` is sought besides the URDF's own package and ROS_PACKAGE_PATH.
    """

    name = "urdf"
    summary = "robots as URDF describes them, links and joints"
    suffixes = (".urdf", ".xacro")  # an expanded robot often keeps the ending; one with macros is refused in words
    can_read = True
    can_write = False

    def __init__(self, package_roots: Sequence[Path] = ()) -> None:
        self._roots = tuple(Path(root) for root in package_roots)

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The robot as a rig in metres, z up. Raises FileRefused; MissingExtra where a mesh needs a library."""
        path = Path(path)
        with refusing(path, "a URDF file"):
            told = sidecar or sidecar_beside(path)
            links, joints = parse_urdf(path)
            bounded(len(joints), "joints", MAX_JOINTS)
            links, joints, apart = _parents_first(links, joints)
            joints, strangers = _without_strangers(joints)
            rig, source_faces, notes = _rig(MeshPaths(path, self._roots), links, joints)
            hands: list[dict[str, Any]] = []
            if told is not None:
                words = read_sidecar(told)
                hands = [asdict(hand) for hand in words.hands]
                rig = replace(
                    rig,
                    freedoms=words.freedoms(rig.joints, rig.freedoms),
                    meters_per_unit=words.meters_per_unit or 1.0,
                    up_axis=words.up_axis or "Z",
                )
            mesh = rig.surface
        mimic = {j.name: vars(j.mimic) for j in joints if j.mimic is not None}
        return Asset(
            name=path.stem,
            mesh=mesh,
            rig=rig,
            source_faces=source_faces,
            meters_per_unit=rig.meters_per_unit,
            up_axis=rig.up_axis,
            notes=(*apart, *strangers, *_joint_notes(joints), *notes),
            details={"format": "urdf", "influences": 1, "weights_sum_to_1": True, "mimic": mimic, "hands": hands},
        )

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Any]) -> None:
        """Refused: URDF holds no pose."""
        raise FileRefused(f"{path}: URDF is only read here; write a .glb file instead.")


def _parents_first(
    links: tuple[Link, ...], joints: tuple[Joint, ...]
) -> tuple[tuple[Link, ...], tuple[Joint, ...], list[str]]:
    """The links and joints of the largest tree, joints level by level from its base link, and notes.

    Raises InvalidInput where they are no trees.
    """
    below: dict[str, list[Joint]] = defaultdict(list)
    names = {link.name for link in links}
    children = set[str]()
    for joint in joints:
        lost = next((end for end in (joint.parent, joint.child) if end not in names), None)
        if lost is not None:
            raise InvalidInput(f"joint {joint.name!r} names the link {lost!r}, which is not there")
        if joint.child in children:
            raise InvalidInput(f"link {joint.child!r} is the child of two joints")
        children.add(joint.child)
        below[joint.parent].append(joint)
    trees = {link.name: list(below[link.name]) for link in links if link.name not in children}
    if not trees:
        raise InvalidInput("it has no base link, one that is the child of no joint")
    for order in trees.values():
        for joint in order:  # grows while it is walked
            order += below[joint.child]
    if sum(map(len, trees.values())) != len(joints):
        reached = {joint.name for order in trees.values() for joint in order}
        lost = next(joint.name for joint in joints if joint.name not in reached)
        raise InvalidInput(f"joint {lost!r} is part of a ring, and connected to no base link")
    base = max(trees, key=lambda name: len(trees[name]))
    kept = {base, *(joint.child for joint in trees[base])}
    others = [link.name for link in links if link.name not in kept]
    told = (
        [f"Links that no joint connects with {base}, its base, were left out: {named(others)}."] if others else []
    )
    return tuple(link for link in links if link.name in kept), tuple(trees[base]), told


def _without_strangers(joints: tuple[Joint, ...]) -> tuple[tuple[Joint, ...], list[str]]:
    """The joints, of which those that mimic one that is not there mimic none, and a note."""
    names = {joint.name for joint in joints}
    odd = [joint.name for joint in joints if joint.mimic is not None and joint.mimic.joint not in names]
    told = (
        [f"What they are to mimic is not there, so these joints move by themselves: {named(odd)}."] if odd else []
    )
    return tuple(replace(j, mimic=None) if j.name in set(odd) else j for j in joints), told


def _joint_notes(joints: tuple[Joint, ...]) -> list[str]:
    notes = []
    held = [joint.name for joint in joints if joint.kind not in ("revolute", "continuous", "fixed")]
    if held:
        notes.append(f"Joints of a kind that is not posed here are held still: {named(held)}.")
    coupled = [joint.name for joint in joints if joint.mimic is not None and joint.turns]
    if coupled:
        notes.append(f"Coupled (mimic) joints turn with the joints that they mimic: {named(coupled)}.")
    for odd in dict.fromkeys(odd for joint in joints for odd in joint.odd):
        whose = [joint.name for joint in joints if odd in joint.odd]
        notes.append(f"{odd[0].upper()}{odd[1:]}: {named(whose)}.")
    degrees = [joint for joint in joints if _TURNS < _largest(joint) < np.inf]
    if degrees:
        notes.append(
            f"The limits of {named([joint.name for joint in degrees])} are beyond a turn"
            f" ({max(map(_largest, degrees)):g}), as if they were degrees; URDF takes them for radians, and so they"
            " were read."
        )
    free = [joint.name for joint in joints if joint.kind == "revolute" and joint.limits is None]
    if free:
        notes.append(f"Revolute joints without the limit that URDF asks for turn freely: {named(free)}.")
    return notes


def _largest(joint: Joint) -> float:
    return max((abs(limit) for limit in joint.limits or () if np.isfinite(limit)), default=0.0)


def _rig(paths: MeshPaths, links: tuple[Link, ...], joints: tuple[Joint, ...]) -> tuple[Rig, IntArray, list[str]]:
    children = {joint.child for joint in joints}
    base = next(link.name for link in links if link.name not in children)
    joint_of_link = {base: 0} | {joint.child: k + 1 for k, joint in enumerate(joints)}
    parents = np.array([-1, *(joint_of_link[joint.parent] for joint in joints)])
    rules = _followers(joints)
    limits = _coupled_limits(joints, rules)
    start, notes = _starting_angles(joints, rules, limits)
    hinges = {joint.name for joint in joints if joint.turns}
    local = np.array([np.eye(4), *(j.origin @ turn(j.axis, start[j.name]) for j in joints)])
    world = forward_kinematics(parents, local)
    points, faces, owner, told = _skin(paths, links, joint_of_link, world)
    surface = surface_of(Polygons.of_triangles(points, faces), owner)
    rig = Rig(
        name=paths.urdf.stem,
        joints=(base, *(joint.name for joint in joints)),
        parents=parents,
        rest_local=local,
        bind_world=world,
        bind_points=surface.points,
        faces=surface.faces,
        skin_joints=owner[surface.first_source][:, None],
        skin_weights=np.ones((len(surface.points), 1)),
        freedoms=(
            JointFreedom(kind="ball", translates=True),
            *(
                _freedom(j, start[j.name], limits[j.name], rule, rule is not None and rule.joint in hinges)
                for j in joints
                for rule in [rules.get(j.name)]
            ),
        ),
        up_axis="Z",
    )
    return rig, surface.source_faces, [*notes, *told, *surface.notes]


def _skin(
    paths: MeshPaths, links: tuple[Link, ...], joint_of_link: dict[str, int], world: FloatArray
) -> tuple[FloatArray, IntArray, IntArray, list[str]]:
    """All shapes at rest: points (n, 3), faces (m, 3), the joint of each point (n,), and notes.

    Raises FileRefused where no link has a shape that can be read.
    """
    reading = _Reading(paths)
    hulls = not any(link.visuals for link in links)
    points, faces, owners = list[FloatArray](), list[IntArray](), list[IntArray]()
    total, size = 0, 0
    for link in links:
        joint = joint_of_link[link.name]
        for visual, solid in reading.shapes_of(link, hulls):
            size = bounded(size + len(solid[0]) + len(solid[1]), "vertices and faces of links in all")
            faces.append(solid[1] + total)
            points.append(transform_points(world[joint] @ visual.origin, solid[0]))
            owners.append(np.full(len(solid[0]), joint))
            total += len(solid[0])
    if not points:
        if reading.refused is not None:
            raise reading.refused
        if reading.odd:
            raise InvalidInput(reading.odd[0])
        raise NoSurface(
            "gives none of its links a <visual> with a shape, so there is nothing to touch with; add some."
        )
    return np.concatenate(points), np.concatenate(faces), np.concatenate(owners), reading.told(hulls)


@dataclass
class _Reading:
    """The shapes of links as they are read. refused: why the first mesh that could not be read was refused.

    missing: by link the meshes that could not be read; replaced: links that stand in their collision shapes for it.
    """

    paths: MeshPaths
    known: dict[Path, solids.Solid | FileRefused | MissingExtra] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    missing: dict[str, list[str]] = field(default_factory=dict)
    replaced: list[str] = field(default_factory=list)
    unseen: list[str] = field(default_factory=list)
    odd: list[str] = field(default_factory=list)
    refused: FileRefused | MissingExtra | None = None

    def shapes_of(self, link: Link, hulls: bool) -> list[tuple[Visual, solids.Solid]]:
        """What is drawn of a link; its collision shapes where nothing of that can be read, or `hulls` asks for
        them."""
        self.odd += link.odd
        if hulls:
            return self._read(link, link.collisions)
        found = self._read(link, link.visuals)
        if found or not link.collisions:
            return found
        if not link.visuals:
            self.unseen.append(link.name)
            return []
        found = self._read(link, link.collisions)
        if found:
            self.replaced.append(link.name)
        return found

    def told(self, hulls: bool) -> list[str]:
        """The notes on all of it."""
        told = []
        if hulls:
            told.append("No link has a <visual>: its <collision> shapes, which are often coarser, are the surface.")
        if self.unseen:
            told.append(
                f"Links with a <collision> and no <visual> are not drawn, and left out: {named(self.unseen)}."
            )
        if self.missing:
            names = [f"{', '.join(dict.fromkeys(files))} of {link}" for link, files in self.missing.items()]
            told.append(f"Meshes that could not be read were left out: {named(names)}. {self.refused}")
        if self.replaced:
            told.append(f"In place of such meshes stand the <collision> shapes of {named(self.replaced)}.")
        if self.odd:
            told.append(f"Shapes that are none were left out: {named(self.odd)}.")
        return [*told, *self.notes]

    def _read(self, link: Link, visuals: Sequence[Visual]) -> list[tuple[Visual, solids.Solid]]:
        found = []
        for visual in visuals:
            try:
                solid = _solid(self.paths, visual, self.known, self.notes)
            except (FileRefused, MissingExtra) as error:
                self.refused = self.refused or error
                self.missing.setdefault(link.name, []).append(shortened(visual.filename))
                continue
            if solid is None:
                self.notes[f"A shape of link {link.name!r} is a <{visual.kind}>, which is not known; left out."] = (
                    None
                )
                continue
            found.append((visual, solid))
        return found


def _solid(
    paths: MeshPaths,
    visual: Visual,
    known: dict[Path, solids.Solid | FileRefused | MissingExtra],
    notes: dict[str, None],
) -> solids.Solid | None:
    """Points and faces of a visual in its own frame; None for a kind that is not known. known: meshes read before,
    and why some were refused. Raises FileRefused, MissingExtra."""
    if visual.kind != "mesh":
        makers: dict[str, Callable[..., solids.Solid]] = {
            "box": solids.box,
            "sphere": solids.sphere,
            "capsule": solids.capsule,
            "cylinder": lambda radius, length: solids.cone(radius, length, radius),
        }
        return makers[visual.kind](*visual.sizes) if visual.kind in makers else None
    path = paths.find(visual.filename)
    if path not in known:
        try:
            mesh, told = read_any_mesh(path)
            known[path] = (mesh.points, mesh.faces)
            notes |= dict.fromkeys(f"{visual.filename}: {note}" for note in told)
        except (FileRefused, MissingExtra) as error:
            known[path] = error
    solid = known[path]
    if isinstance(solid, Exception):
        raise solid
    points, faces = solid
    scale = np.array(visual.sizes)
    return points * scale, faces if np.prod(scale) > 0 else faces[:, ::-1]


def _followers(joints: tuple[Joint, ...]) -> dict[str, Mimic]:
    """By name of each coupled hinge what it turns with in the end: a hinge that mimics none, multiplier and offset.

    Raises InvalidInput where that goes in a circle.
    """
    by_name, result = {joint.name: joint for joint in joints}, dict[str, Mimic]()
    for joint in joints:
        rule, seen = joint.mimic, {joint.name}
        while rule is not None:
            if rule.joint in seen:
                raise InvalidInput(f"joint {joint.name!r} mimics itself by way of {', '.join(sorted(seen))}")
            seen.add(rule.joint)
            result[joint.name] = rule
            further = by_name[rule.joint].mimic
            rule = further and Mimic(
                further.joint,
                rule.multiplier * further.multiplier,
                rule.multiplier * further.offset + rule.offset,
            )
    return result


def _coupled_limits(joints: tuple[Joint, ...], rules: Mapping[str, Mimic]) -> dict[str, tuple[float, float]]:
    """Limits by joint; those of a leader keep its followers in theirs. A follower whose limits leave its leader no
    place is not limited itself."""
    limits = {joint.name: _limits(joint) for joint in joints}
    for name, rule in rules.items():
        if rule.multiplier == 0.0:
            continue
        ends = sorted((end - rule.offset) / rule.multiplier for end in limits[name])
        low, high = max(limits[rule.joint][0], ends[0]), min(limits[rule.joint][1], ends[1])
        if low < high:
            limits[rule.joint] = low, high
        else:
            limits[name] = -np.inf, np.inf
    return limits


def _starting_angles(
    joints: tuple[Joint, ...], rules: Mapping[str, Mimic], limits: Mapping[str, tuple[float, float]]
) -> tuple[dict[str, float], list[str]]:
    """Zero where the limits allow it, else just inside them; mimics follow their leader."""
    start = {joint.name: _inside(*limits[joint.name]) for joint in joints}
    moved = [joint.name for joint in joints if start[joint.name] != 0.0 and joint.name not in rules]
    for name, rule in rules.items():
        start[name] = rule.multiplier * start[rule.joint] + rule.offset
    notes = [f"Zero lies outside the limits of {named(moved)}; the rest pose starts inside."] if moved else []
    loose = [j.name for j in joints if j.name in rules and j.limits and not np.isfinite(limits[j.name]).any()]
    if loose:
        notes.append(f"What {named(loose)} mimics has no place within its limits; they are not kept.")
    return start, notes


def _inside(low: float, high: float) -> float:
    """Zero, or when that is not allowed the angle a tenth of the range inside the nearer limit."""
    if low <= 0.0 <= high:
        return 0.0
    return low + 0.1 * (high - low) if low > 0.0 else high - 0.1 * (high - low)


def _freedom(
    joint: Joint, start: float, limits: tuple[float, float], rule: Mimic | None, leads: bool
) -> JointFreedom:
    """leads: whether what it mimics is a hinge; a joint that mimics a slide is held as the slide is."""
    if not joint.turns or (rule is not None and not leads):
        return JointFreedom(kind="fixed")
    x = joint.axis
    y = np.cross(np.eye(3)[int(np.abs(x).argmin())], x)
    y /= np.linalg.norm(y)
    frame = np.stack([x, y, np.cross(x, y)], axis=1)
    lower, upper = (np.array([end - start]) for end in limits)
    if rule is None:
        return JointFreedom("hinge", frame, lower=lower, upper=upper)
    return JointFreedom("hinge", frame, lower=lower, upper=upper, follows=rule.joint, ratio=rule.multiplier)


def _limits(joint: Joint) -> tuple[float, float]:
    return (-np.inf, np.inf) if joint.limits is None else joint.limits
