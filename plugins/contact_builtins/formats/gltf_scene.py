"""A glTF scene as polygons and skins in world space: nodes, primitives, influences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_builtins.formats.gltf_container import COMPRESSED, Gltf
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.transform import transform_points

POINTS, LINES, TRIANGLES, STRIP, FAN = 0, (1, 2, 3), 4, 5, 6


@dataclass(frozen=True, eq=False)
class Nodes:
    """The node tree. parents: (k,) -1 for roots. world: (k, 4, 4) world_from_node. order: parents first."""

    names: tuple[str, ...]
    parents: IntArray
    world: FloatArray
    order: tuple[int, ...]
    active: frozenset[int]  # nodes of the scene that is shown


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


def read_nodes(gltf: Gltf) -> Nodes:
    """The tree with world transforms. Raises InvalidInput when it is not a tree."""
    entries = gltf.entries("nodes")
    parents = np.full(len(entries), -1)
    for index, entry in enumerate(entries):
        for child in entry.get("children", []):
            gltf.entry("nodes", child)
            if parents[child] != -1:
                raise InvalidInput(f"node {child} has two parents")
            parents[child] = index
    order = _parents_first(entries, parents)
    local = np.array([_local(entry, index) for index, entry in enumerate(entries)]).reshape(-1, 4, 4)
    world = local.copy()
    for index in order:
        if parents[index] >= 0:
            world[index] = world[parents[index]] @ local[index]
    names = tuple(str(entry.get("name") or f"node_{index}") for index, entry in enumerate(entries))
    return Nodes(names, parents, world, order, _shown(gltf, order, parents))


def read_parts(gltf: Gltf, nodes: Nodes) -> tuple[list[Part], list[str]]:
    """All mesh nodes of the scene, and notes on what is no triangle."""
    parts, notes, total = list[Part](), dict[str, None](), 0
    for index in nodes.order:
        entry = gltf.entry("nodes", index)
        if index not in nodes.active or "mesh" not in entry:
            continue
        for primitive in gltf.entry("meshes", entry["mesh"])["primitives"]:
            mode = primitive.get("mode", TRIANGLES)
            if mode not in (TRIANGLES, STRIP, FAN):
                notes["Points and lines were left out; only triangles make a surface."] = None
                continue
            if primitive.get("targets"):
                notes["Morph targets were left out: a pose is made of joints here."] = None
            part = _part(gltf, nodes, index, entry.get("skin"), primitive, mode)
            total = bounded(total + len(part.points) + len(part.faces), "vertices and faces in all")
            parts.append(part)
    return parts, list(notes)


def _part(gltf: Gltf, nodes: Nodes, node: int, skin: Any, primitive: dict[str, Any], mode: int) -> Part:
    attributes = primitive["attributes"]
    squeezed = [name for name in primitive.get("extensions", {}) if name in COMPRESSED]
    if squeezed and "bufferView" not in gltf.entry("accessors", attributes["POSITION"]):
        raise FileRefused(
            f"{gltf.path} is compressed with {COMPRESSED[squeezed[0]]}, which is not read here."
            " Export it without mesh compression."
        )
    points = gltf.accessor(attributes["POSITION"]).astype(np.float64)  # (n, 3)
    if points.shape[1] != 3:
        raise InvalidInput("positions are not of type VEC3")
    if "indices" in primitive:
        corners = gltf.accessor(primitive["indices"])[:, 0].astype(np.int64)
    else:
        corners = np.arange(len(points))
    faces = _triangles(corners, mode)
    if len(faces) and faces.max() >= len(points):
        raise InvalidInput(f"a primitive names vertex {int(faces.max())} of {len(points)}")
    joints, weights = _influences(gltf, attributes, len(points)) if skin is not None else (None, None)
    if joints is None:
        world = nodes.world[node]
        points = transform_points(world, points)
        if np.linalg.det(world[:3, :3]) < 0:  # a mirrored node turns its faces round (glTF 2.0, 3.7.4)
            faces = faces[:, ::-1]
    return Part(node, skin if joints is not None else None, points, faces, joints, weights)


def _influences(gltf: Gltf, attributes: dict[str, int], count: int) -> tuple[IntArray | None, FloatArray | None]:
    """All sets JOINTS_0, JOINTS_1, ... side by side."""
    joints, weights = list[Any](), list[Any]()
    while f"JOINTS_{len(joints)}" in attributes and f"WEIGHTS_{len(joints)}" in attributes:
        k = len(joints)
        joints.append(gltf.accessor(attributes[f"JOINTS_{k}"]).astype(np.int64))
        weights.append(gltf.accessor(attributes[f"WEIGHTS_{k}"]).astype(np.float64))
    if not joints:
        return None, None
    all_joints, all_weights = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    if all_joints.shape != (count, all_weights.shape[1]):
        raise InvalidInput(f"influences of shape {all_joints.shape} do not fit {count} vertices")
    if not np.isfinite(all_weights).all() or (all_weights < 0).any():
        raise InvalidInput("skin weights are negative or not finite")
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


def _local(entry: dict[str, Any], index: int) -> FloatArray:
    """(4, 4) parent_from_node of a node's matrix or TRS."""
    if "matrix" in entry:
        matrix = np.array(entry["matrix"], np.float64).reshape(4, 4).T  # stored column by column
    else:
        x, y, z, w = _numbers(entry, "rotation", (0, 0, 0, 1))
        norm = math.hypot(x, y, z, w)
        if not 0.0 < norm < math.inf:
            raise InvalidInput(f"node {index} has a rotation quaternion of length {norm}")
        matrix = np.eye(4)
        matrix[:3, :3] = rotation_matrix(np.array([w, x, y, z]) / norm) * _numbers(entry, "scale", (1, 1, 1))
        matrix[:3, 3] = _numbers(entry, "translation", (0, 0, 0))
    if not np.isfinite(matrix).all():
        raise InvalidInput(f"node {index} has a transform that is not finite")
    return matrix


def rotation_matrix(wxyz: FloatArray) -> FloatArray:
    """(3, 3) rotation of a unit quaternion."""
    w, x, y, z = wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _numbers(entry: dict[str, Any], key: str, default: tuple[float, ...]) -> FloatArray:
    values = np.array(entry.get(key, default), np.float64)
    if values.shape != (len(default),):
        raise InvalidInput(f"a node's {key} is {entry[key]!r}, not {len(default)} numbers")
    return values


def _parents_first(entries: list[dict[str, Any]], parents: IntArray) -> tuple[int, ...]:
    order, waiting = list[int](), [int(k) for k in np.flatnonzero(parents < 0)[::-1]]
    while waiting:
        index = waiting.pop()
        order.append(index)
        waiting.extend(reversed(entries[index].get("children", [])))
    if len(order) != len(entries):
        raise InvalidInput("its nodes form a ring instead of a tree")
    return tuple(order)


def _shown(gltf: Gltf, order: tuple[int, ...], parents: IntArray) -> frozenset[int]:
    """Nodes of the default scene (else of the first; all where there is none)."""
    scenes = gltf.entries("scenes")
    if not scenes:
        return frozenset(order)
    roots = set(gltf.entry("scenes", gltf.document.get("scene", 0)).get("nodes", []))
    shown = set[int]()
    for index in order:
        if index in roots or int(parents[index]) in shown:
            shown.add(index)
    return frozenset(shown)
