"""A glTF scene as polygons and skins in world space: primitives, default shapes, influences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from contact_builtins.formats.gltf_container import COMPRESSED, INSTANCING, Gltf
from contact_builtins.formats.gltf_draco import without_draco
from contact_builtins.formats.gltf_nodes import Nodes
from contact_builtins.formats.refusal import NoSurface, bounded, named
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.scene.mesh_names import MOST_AROUND, MeshNames, shown

POINTS, LINES, TRIANGLES, STRIP, FAN = 0, (1, 2, 3), 4, 5, 6
MAX_COPIES = 50_000  # of meshes by nodes, and of vertices and faces that no bytes of the file pay for
MAX_COPIED = 4_000_000


@dataclass(frozen=True, eq=False)
class Part:
    """The triangles of one mesh node. points: (n, 3) world space, or the skin's bind space. faces: (m, 3).

    joints, weights: (n, K) influences, joints index the skin's own list; None without a skin.
    """

    node: int
    skin: int | None
    points: FloatArray
    faces: IntArray
    joints: IntArray | None
    weights: FloatArray | None


@dataclass(frozen=True, eq=False)
class _Primitive:
    """A primitive as stored. points: (n, 3). faces: (m, 3)."""

    points: FloatArray
    faces: IntArray
    joints: IntArray | None
    weights: FloatArray | None


@dataclass
class _Reading:
    """What was met so far. known: primitives by mesh, number, and the shape weights they were read with."""

    known: dict[tuple[Any, ...], _Primitive] = field(default_factory=dict)
    notes: dict[str, None] = field(default_factory=dict)
    total: int = 0
    copied: int = 0


def read_parts(gltf: Gltf, nodes: Nodes) -> tuple[list[Part], list[str]]:
    """All mesh nodes that the scene shows, and notes on what is left out. Raises FileRefused, InvalidInput."""
    meshes = [index for index in nodes.order if index in nodes.active and "mesh" in gltf.entry("nodes", index)]
    bounded(len(meshes), "nodes with meshes", MAX_COPIES)
    drawn = [index for index in meshes if index not in nodes.hidden]
    kept, stand_ins = shown([_names(gltf, nodes, index) for index in drawn])
    reading = _Reading(notes=dict.fromkeys((*nodes.notes, *stand_ins)))
    parts = [part for k in kept for part in _node_parts(gltf, nodes, drawn[k], reading)]
    hidden = [nodes.names[index] for index in meshes if index in nodes.hidden]
    if hidden:
        reading.notes[f"Hidden meshes were left out, as a viewer leaves them: {named(hidden)}."] = None
    if not parts and hidden:
        raise NoSurface(f"shows no triangles: hidden are {named(hidden)}. Make one of them visible.")
    return parts, list(reading.notes)


def _names(gltf: Gltf, nodes: Nodes, index: int) -> MeshNames:
    """What the node of a mesh is called, its mesh, and the nodes above it."""
    mesh = gltf.entry("meshes", gltf.entry("nodes", index)["mesh"]).get("name")
    around, above = list[str](), int(nodes.parents[index])
    while above >= 0 and len(around) < MOST_AROUND:
        around.append(nodes.names[above])
        above = int(nodes.parents[above])
    return MeshNames((nodes.names[index], *([str(mesh)] if mesh else [])), tuple(around))


def _node_parts(gltf: Gltf, nodes: Nodes, node: int, reading: _Reading) -> list[Part]:
    entry = gltf.entry("nodes", node)
    mesh = gltf.entry("meshes", entry["mesh"])
    shape = entry.get("weights") or mesh.get("weights") or ()
    shape = tuple(float(weight) for weight in shape)
    parts = []
    for number, primitive in enumerate(mesh["primitives"]):
        if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
            reading.notes["Points and lines were left out; only triangles make a surface."] = None
            continue
        if "POSITION" not in primitive["attributes"]:
            reading.notes["Primitives without positions, which draw nothing, were left out."] = None
            continue
        key = (entry["mesh"], number, shape, entry.get("skin") is not None)
        new = key not in reading.known
        if new:
            reading.known[key] = _primitive(gltf, primitive, shape, key[-1], reading)
        found = reading.known[key]
        size = len(found.points) + len(found.faces)
        reading.total = bounded(reading.total + size, "vertices and faces in all")
        what = "vertices and faces in copies of its meshes"
        if not new:
            reading.copied = bounded(reading.copied + size, what, MAX_COPIED)
        if found.joints is not None:  # a skin's primitive stays in the space in which it was bound
            parts.append(Part(node, entry["skin"], found.points, found.faces, found.joints, found.weights))
            continue
        copies = _copies(gltf, entry, reading)
        reading.copied = bounded(reading.copied + size * (len(copies) - 1), what, MAX_COPIED)
        parts += [_placed(nodes.world[node] @ local, node, found) for local in copies]
    return parts


def _copies(gltf: Gltf, entry: dict[str, Any], reading: _Reading) -> FloatArray:
    """(k, 4, 4) where a node's mesh is drawn, in the node's space: once, or as EXT_mesh_gpu_instancing says."""
    said = (entry.get("extensions") or {}).get(INSTANCING)
    if not said:
        return np.eye(4)[None]
    columns = {key: gltf.accessor(index).astype(np.float64) for key, index in said.get("attributes", {}).items()}
    usual = {"TRANSLATION": np.zeros(3), "ROTATION": np.array([0.0, 0.0, 0.0, 1.0]), "SCALE": np.ones(3)}
    counts = {len(columns[key]) for key in usual if key in columns}
    if len(counts) != 1:
        raise InvalidInput(f"the instances of a mesh have {sorted(counts) or 'no'} places")
    count = bounded(counts.pop(), "copies of a mesh", MAX_COPIES)
    moves, turns, scales = (
        columns.get(key, np.broadcast_to(value, (count, len(value)))) for key, value in usual.items()
    )
    copies = np.tile(np.eye(4), (count, 1, 1))
    copies[:, :3, :3] = Rotation.from_quat(turns).as_matrix() * scales[:, None, :]
    copies[:, :3, 3] = moves
    reading.notes["Copies of a mesh (EXT_mesh_gpu_instancing) are part of the surface."] = None
    return copies


def _placed(world: FloatArray, node: int, found: _Primitive) -> Part:
    """A primitive where its node, or one of its copies, puts it."""
    faces = found.faces
    if np.linalg.det(world[:3, :3]) < 0:  # a mirrored node turns its faces round (glTF 2.0, 3.7.4)
        faces = faces[:, ::-1]
    return Part(node, None, transform_points(world, found.points), faces, None, None)


def _primitive(
    gltf: Gltf, primitive: dict[str, Any], shape: tuple[float, ...], skinned: bool, reading: _Reading
) -> _Primitive:
    attributes = primitive["attributes"]
    read: Callable[[Any], npt.NDArray[Any]] = gltf.accessor
    extensions = primitive.get("extensions", {})
    if "bufferView" not in gltf.entry("accessors", attributes["POSITION"]) and "sparse" not in gltf.entry(
        "accessors", attributes["POSITION"]
    ):
        if "KHR_draco_mesh_compression" in extensions:
            read = without_draco(gltf, primitive)
        elif any(name in COMPRESSED for name in extensions):
            raise FileRefused(f"{gltf.path} is compressed in a way that is not read here. Export it without that.")
    points = read(attributes["POSITION"]).astype(np.float64)  # (n, 3)
    if points.shape[1] != 3:
        raise InvalidInput("positions are not of type VEC3")
    points = _shaped(gltf, points, primitive.get("targets") or [], shape, reading)
    if "indices" in primitive:
        corners = read(primitive["indices"])[:, 0].astype(np.int64)
    else:
        corners = np.arange(len(points))
    faces = _triangles(corners, primitive.get("mode", TRIANGLES))
    if len(faces) and faces.max() >= len(points):
        raise InvalidInput(f"a primitive names vertex {int(faces.max())} of {len(points)}")
    joints, weights = _influences(read, attributes, len(points)) if skinned else (None, None)
    return _Primitive(points, faces, joints, weights)


def _shaped(
    gltf: Gltf, points: FloatArray, targets: list[dict[str, Any]], shape: tuple[float, ...], reading: _Reading
) -> FloatArray:
    """Points with the morph targets at their default weights, which is how the file is first seen."""
    if not targets:
        return points
    for target, weight in zip(targets, shape, strict=False):
        if weight and "POSITION" in target:
            moves = gltf.accessor(target["POSITION"]).astype(np.float64)
            if moves.shape != points.shape:
                raise InvalidInput(f"a morph target moves {len(moves)} of {len(points)} vertices")
            points = points + weight * moves
    if any(shape):
        reading.notes["Morph targets stand at their default weights; a pose is made of joints here."] = None
    else:
        reading.notes["Morph targets were left out: a pose is made of joints here."] = None
    return points


def _influences(
    read: Callable[[Any], npt.NDArray[Any]], attributes: dict[str, int], count: int
) -> tuple[IntArray | None, FloatArray | None]:
    """All sets JOINTS_0, JOINTS_1, ... side by side."""
    joints, weights = list[Any](), list[Any]()
    while f"JOINTS_{len(joints)}" in attributes and f"WEIGHTS_{len(joints)}" in attributes:
        k = len(joints)
        joints.append(read(attributes[f"JOINTS_{k}"]).astype(np.int64))
        weights.append(read(attributes[f"WEIGHTS_{k}"]).astype(np.float64))
    if not joints:
        return None, None
    all_joints, all_weights = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    if all_joints.shape != (count, all_weights.shape[1]):
        raise InvalidInput(f"influences of shape {all_joints.shape} do not fit {count} vertices")
    return all_joints, all_weights


def _triangles(corners: IntArray, mode: int) -> IntArray:
    """(m, 3) triangles of a list, a strip or a fan."""
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == FAN:
        return np.stack([np.broadcast_to(corners[0], len(corners) - 2), corners[1:-1], corners[2:]], axis=1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    strip[1::2] = strip[1::2, [1, 0, 2]]
    return strip
