"""URDF hands as one rig: a joint per link, rigid weights, hinges with the file's limits (yourdfpy parses)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from contact_builtins.formats.mesh_files import MeshFiles
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import file_bytes, refusing
from contact_builtins.formats.sidecar import read_sidecar, sidecar_beside
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput, MissingExtra
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import JointFreedom, Rig, forward_kinematics


class UrdfFiles:
    """Reads robot hands. Joints are named after the URDF's joints, the root after its base link."""

    name = "urdf"
    suffixes = (".urdf",)
    can_read = True
    can_write = False

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The robot as a rig in metres, z up. Raises FileRefused; MissingExtra without yourdfpy."""
        path = Path(path)
        told = sidecar or sidecar_beside(path)
        robot = _parse(path)
        with refusing(path, "a URDF file"):
            joints, notes = _joints_parents_first(robot)
            rig, source_faces, more = _rig(path, robot, joints)
            if told is not None:
                words = read_sidecar(told)
                rig = replace(
                    rig,
                    freedoms=words.freedoms(rig.joints, rig.freedoms),
                    meters_per_unit=words.meters_per_unit or 1.0,
                    up_axis=words.up_axis or "Z",
                )
        mimic = {j.name: _mimic(j) for j in joints if getattr(j, "mimic", None) is not None}
        return Asset(
            name=path.stem,
            mesh=rig.surface,
            rig=rig,
            source_faces=source_faces,
            meters_per_unit=rig.meters_per_unit,
            up_axis=rig.up_axis,
            notes=(*notes, *more),
            details={"format": "urdf", "influences": 1, "weights_sum_to_1": True, "mimic": mimic},
        )

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Any]) -> None:
        """Refused: URDF holds no pose."""
        raise FileRefused(f"{path}: URDF is only read here; write a .glb file instead.")


def _parse(path: Path) -> Any:
    try:
        import yourdfpy
    except ImportError as error:
        raise MissingExtra("Reading URDF", "io") from error
    text = file_bytes(path)
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:  # no entities: they name other files
        raise FileRefused(f"{path} declares a document type, which no URDF needs and which is not read. Remove it.")
    try:
        ElementTree.fromstring(text)  # of what is no XML yourdfpy tells stderr before it raises
        return yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False).robot
    except Exception as error:  # yourdfpy and lxml raise whatever they meet
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise FileRefused(
            f"{path} was to be a URDF file, but cannot be parsed: {reason}. Check its XML."
        ) from error


def _joints_parents_first(robot: Any) -> tuple[list[Any], list[str]]:
    """The joints so that each parent link comes before its children."""
    children = {joint.child for joint in robot.joints}
    known = [link.name for link in robot.links if link.name not in children]
    if len(known) != 1:
        raise InvalidInput(f"it has {len(known)} base links ({', '.join(known[:4])}); a rig has one")
    order, waiting = list[Any](), list(robot.joints)
    while waiting:
        ready = [joint for joint in waiting if joint.parent in known]
        if not ready:
            raise InvalidInput(f"joint {waiting[0].name!r} hangs on no chain from the base link")
        order += ready
        known += [joint.child for joint in ready]
        waiting = [joint for joint in waiting if joint not in ready]
    notes = []
    held = [joint.name for joint in order if joint.type in ("prismatic", "floating", "planar")]
    if held:
        notes.append(f"Joints of a kind that is not posed here are held still: {', '.join(held)}.")
    coupled = [joint.name for joint in order if getattr(joint, "mimic", None) is not None]
    if coupled:
        notes.append(f"Coupled (mimic) joints are held where the rest pose puts them: {', '.join(coupled)}.")
    return order, notes


def _rig(path: Path, robot: Any, joints: list[Any]) -> tuple[Rig, IntArray, list[str]]:
    base = next(link.name for link in robot.links if link.name not in {joint.child for joint in joints})
    joint_of_link = {base: 0} | {joint.child: k + 1 for k, joint in enumerate(joints)}
    parents = np.array([-1, *(joint_of_link[joint.parent] for joint in joints)])
    start, notes = _starting_angles(joints)
    local = np.array([np.eye(4), *(_origin(j.origin) @ _turn(_axis(j), start[j.name]) for j in joints)])
    world = forward_kinematics(parents, local)
    points, faces, owner, left_out = _skin(path, robot, joint_of_link, world)
    surface = surface_of(Polygons.of_triangles(points, faces), owner)
    rig = Rig(
        name=path.stem,
        joints=(base, *(joint.name for joint in joints)),
        parents=parents,
        rest_local=local,
        bind_world=world,
        bind_points=surface.points,
        faces=surface.faces,
        skin_joints=owner[surface.first_source][:, None],
        skin_weights=np.ones((len(surface.points), 1)),
        freedoms=(JointFreedom(kind="ball", translates=True), *(_freedom(j, start[j.name]) for j in joints)),
        up_axis="Z",
    )
    return rig, surface.source_faces, [*notes, *left_out, *surface.notes]


def _skin(
    path: Path, robot: Any, joint_of_link: dict[str, int], world: FloatArray
) -> tuple[FloatArray, IntArray, IntArray, list[str]]:
    """All visual meshes at rest: points (n, 3), faces (m, 3), the joint of each point (n,), and notes."""
    points, faces, owners, notes = list[FloatArray](), list[IntArray](), list[IntArray](), list[str]()
    for link in robot.links:
        for visual in link.visuals:
            mesh = visual.geometry.mesh
            solid = _primitive(visual.geometry) if mesh is None else _link_mesh(path, mesh)
            if solid is None:
                notes.append(f"A visual of link {link.name!r} is neither mesh, box, cylinder nor sphere; left out.")
                continue
            placed = world[joint_of_link[link.name]] @ _origin(visual.origin)
            faces.append(solid.faces + sum(map(len, points)))
            points.append(solid.points @ placed[:3, :3].T + placed[:3, 3])
            owners.append(np.full(len(solid.points), joint_of_link[link.name]))
    if not points:
        raise InvalidInput("none of its links has a visual mesh, so there is no surface to touch with")
    return np.concatenate(points), np.concatenate(faces), np.concatenate(owners), notes


def _link_mesh(path: Path, mesh: Any) -> TriangleMesh:
    """A link's mesh file, which must lie at or below the URDF's folder; `package://x/` means that folder."""
    folder = path.resolve().parent
    name = mesh.filename.removeprefix("file://")
    if name.startswith("package://"):
        name = name.removeprefix("package://").partition("/")[2]
    wanted = (folder / name).resolve()
    if not wanted.is_relative_to(folder):
        raise FileRefused(
            f"{path} wants the mesh {mesh.filename!r}, outside its folder; only files below it are read."
        )
    solid = MeshFiles().read(wanted).mesh
    scale = np.ones(3) if mesh.scale is None else np.broadcast_to(np.asarray(mesh.scale, float), 3)
    return TriangleMesh(solid.points * scale, solid.faces if np.prod(scale) > 0 else solid.faces[:, ::-1])


def _primitive(geometry: Any) -> TriangleMesh | None:
    """Boxes, cylinders and spheres as meshes."""
    import trimesh

    if geometry.box is not None:
        solid = trimesh.creation.box(extents=geometry.box.size)
    elif geometry.cylinder is not None:
        solid = trimesh.creation.cylinder(radius=geometry.cylinder.radius, height=geometry.cylinder.length)
    elif geometry.sphere is not None:
        solid = trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)
    else:
        return None
    return TriangleMesh(solid.vertices, solid.faces)


def _starting_angles(joints: list[Any]) -> tuple[dict[str, float], list[str]]:
    """Zero where the limits allow it, else just inside them; mimics follow their leader."""
    start: dict[str, float] = {}
    for joint in joints:
        low, high = _limits(joint)
        start[joint.name] = _inside(low, high) if joint.type in ("revolute", "continuous") else 0.0
    moved = [joint.name for joint in joints if start[joint.name] != 0.0]
    for joint in joints:
        if getattr(joint, "mimic", None) is not None:
            rule = _mimic(joint)
            if rule["joint"] not in start:
                raise InvalidInput(f"joint {joint.name!r} mimics {rule['joint']!r}, which is not there")
            start[joint.name] = rule["multiplier"] * start[rule["joint"]] + rule["offset"]
    notes = [f"Zero lies outside the limits of {', '.join(moved)}; the rest pose starts inside."] if moved else []
    return start, notes


def _inside(low: float, high: float) -> float:
    """Zero, or when that is not allowed the angle a tenth of the range inside the nearer limit."""
    if low <= 0.0 <= high:
        return 0.0
    return low + 0.1 * (high - low) if low > 0.0 else high - 0.1 * (high - low)


def _freedom(joint: Any, start: float) -> JointFreedom:
    if joint.type not in ("revolute", "continuous") or getattr(joint, "mimic", None) is not None:
        return JointFreedom(kind="fixed")
    low, high = _limits(joint)
    x = _axis(joint)
    y = np.cross(np.eye(3)[int(np.abs(x).argmin())], x)
    y /= np.linalg.norm(y)
    frame = np.stack([x, y, np.cross(x, y)], axis=1)
    return JointFreedom(kind="hinge", frame=frame, lower=np.array([low - start]), upper=np.array([high - start]))


def _limits(joint: Any) -> tuple[float, float]:
    if joint.type != "revolute" or joint.limit is None:
        return -np.inf, np.inf
    low = -np.inf if joint.limit.lower is None else float(joint.limit.lower)
    high = np.inf if joint.limit.upper is None else float(joint.limit.upper)
    if not low <= high:
        raise InvalidInput(f"joint {joint.name!r} has limits from {low} to {high}")
    return low, high


def _axis(joint: Any) -> FloatArray:
    axis = np.array([1.0, 0, 0]) if joint.axis is None else np.asarray(joint.axis, float)
    length = float(np.linalg.norm(axis))
    if axis.shape != (3,) or not (np.isfinite(length) and length > 0):
        raise InvalidInput(f"joint {joint.name!r} turns about {axis.tolist()}, which is no axis")
    return axis / length


def _origin(matrix: Any) -> FloatArray:
    return np.eye(4) if matrix is None else np.asarray(matrix, float)


def _turn(axis: FloatArray, angle: float) -> FloatArray:
    """(4, 4) rotation about an axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
    return matrix


def _mimic(joint: Any) -> dict[str, Any]:
    multiplier, offset = joint.mimic.multiplier, joint.mimic.offset
    return {
        "joint": joint.mimic.joint,
        "multiplier": 1.0 if multiplier is None else float(multiplier),
        "offset": 0.0 if offset is None else float(offset),
    }
