"""Writing a GLB that other tools open: skins with their joints in the pose, objects as plain meshes."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_builtins.formats.glb_scene import GlbScene
from contact_builtins.formats.gltf_animation import add_animation
from contact_builtins.formats.gltf_container import BINARY_CHUNK, JSON_CHUNK, MAGIC
from contact_core._version import __version__
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.clip import Clip
from contact_core.rig.rig import Pose, Rig

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
# glTF is y-up and in metres: what turns another up axis to +y.
Y_FROM_UP = {
    "Y": np.eye(3),
    "Z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "X": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
}


def glb_bytes(assets: Sequence[Asset], poses: Mapping[str, Pose], clip: Clip | None = None) -> bytes:
    """The bytes of a GLB. A rig takes the pose under its asset's name, else rests; an asset without a rig is
    moved by a pose of one joint, its world transform. clip: its one animation, by the names of assets. Raises
    InvalidInput on poses and keys that fit nothing."""
    unknown = sorted(set(poses) - {asset.name for asset in assets})
    if unknown:
        raise InvalidInput(
            f"there is a pose for {unknown[0]!r}, but no such asset; assets: {[a.name for a in assets]}."
        )
    scene = GlbScene()
    nodes: dict[str, list[int | None]] = {}
    for asset in assets:
        holder = scene.node(name=asset.name, children=[], matrix=_columns(_to_gltf(asset)))
        scene.roots.append(holder)
        if asset.rig is not None:
            nodes[asset.name] = _add_rig(scene, holder, asset.rig, poses.get(asset.name, Pose.rest(asset.rig)))
        else:
            nodes[asset.name] = [_add_object(scene, holder, asset, poses.get(asset.name))]
    if clip is not None:
        add_animation(scene, clip, assets, nodes)
    return _container(scene)


def _add_object(scene: GlbScene, holder: int, asset: Asset, pose: Pose | None) -> int | None:
    """The node that stands for it, None where it takes two."""
    if pose is not None and len(pose.joints) != 1:
        raise InvalidInput(f"{asset.name!r} has no rig: its pose is one transform, but got {len(pose.joints)}.")
    mesh = _add_mesh(scene, asset.name, asset.mesh.points, asset.mesh.faces, asset.mesh.vertex_normals, {})
    world = np.eye(4) if pose is None else pose.local[0]
    outer, inner = node_transforms(world)
    child = scene.node(name=f"{asset.name} mesh", mesh=mesh, **inner)
    if outer is not None:
        child = scene.node(name=f"{asset.name} stretch", children=[child], **outer)
    scene.nodes[holder]["children"].append(child)
    return None if outer is not None else child


def _add_rig(scene: GlbScene, holder: int, rig: Rig, pose: Pose) -> list[int | None]:
    """The node of each joint, None where it takes two."""
    local = rig.rest_local.copy()
    for name, matrix in zip(pose.joints, pose.local, strict=True):
        local[rig.joint_index(name)] = matrix
    first = len(scene.nodes)
    split = [node_transforms(matrix) for matrix in local]
    for name, (_, inner) in zip(rig.joints, split, strict=True):
        scene.node(name=name, **inner)
    for index, (parent, (outer, _)) in enumerate(zip(rig.parents, split, strict=True)):
        owner = scene.nodes[first + int(parent)] if parent >= 0 else scene.nodes[holder]
        child = first + index
        if outer is not None:
            child = scene.node(name=f"{rig.joints[index]} stretch", children=[child], **outer)
        owner.setdefault("children", []).append(child)
    inverse = np.linalg.inv(rig.bind_world).transpose(0, 2, 1).reshape(-1, 16).astype("<f4")
    joints = [first + index for index in range(len(rig.joints))]
    scene.skins.append({"name": rig.name, "joints": joints, "inverseBindMatrices": scene.accessor(inverse)})
    normals = rig.surface.with_points(rig.bind_points).vertex_normals
    mesh = _add_mesh(scene, rig.name, rig.bind_points, rig.faces, normals, _influences(rig))
    scene.nodes[holder]["children"].append(
        scene.node(name=f"{rig.name} skin", mesh=mesh, skin=len(scene.skins) - 1)
    )
    return [joint if outer is None else None for joint, (outer, _) in zip(joints, split, strict=True)]


def _influences(rig: Rig) -> dict[str, npt.NDArray[Any]]:
    """JOINTS_k and WEIGHTS_k in sets of four."""
    count = rig.skin_joints.shape[1]
    padding = (-count) % 4
    joints = np.pad(rig.skin_joints, ((0, 0), (0, padding))).astype("<u2")
    weights = np.pad(rig.skin_weights, ((0, 0), (0, padding))).astype("<f4")
    joints[weights == 0] = 0  # the specification asks for joint 0 where the weight is 0
    sets = {}
    for k in range((count + padding) // 4):
        sets[f"JOINTS_{k}"] = joints[:, 4 * k : 4 * k + 4]
        sets[f"WEIGHTS_{k}"] = weights[:, 4 * k : 4 * k + 4]
    return sets


def _add_mesh(
    scene: GlbScene,
    name: str,
    points: FloatArray,
    faces: Any,
    normals: FloatArray,
    more: dict[str, npt.NDArray[Any]],
) -> int:
    filled = np.where(np.abs(normals).sum(axis=1, keepdims=True) > 0, normals, [0.0, 0.0, 1.0])
    attributes = {
        "POSITION": scene.accessor(points.astype("<f4"), ARRAY_BUFFER, bounds=True),
        "NORMAL": scene.accessor(filled.astype("<f4"), ARRAY_BUFFER),
    }
    attributes |= {key: scene.accessor(values, ARRAY_BUFFER) for key, values in more.items()}
    indices = scene.accessor(np.asarray(faces).reshape(-1, 1).astype("<u4"), ELEMENT_ARRAY_BUFFER)
    scene.meshes.append({"name": name, "primitives": [{"attributes": attributes, "indices": indices}]})
    return len(scene.meshes) - 1


def _to_gltf(asset: Asset) -> FloatArray:
    """(4, 4) from the asset's units and up axis to metres and y up."""
    matrix = np.eye(4)
    matrix[:3, :3] = Y_FROM_UP[asset.up_axis] * (asset.meters_per_unit or 1.0)
    return matrix


def node_transforms(matrix: FloatArray) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """A (4, 4) as the nodes that viewers multiply to it: (None, node), or (node above, node) where it is sheared.

    A node is a translation, a rotation and a scale, or a matrix that splits into them (glTF 2.0, 3.5.3); a joint of
    uneven scales that turns is not. Any matrix is U S V^T (singular values): U and S go into the node above.
    """
    linear = matrix[:3, :3]
    scale = np.linalg.norm(linear, axis=0)
    if np.linalg.det(linear) < 0:
        scale[0] = -scale[0]
    if scale.all():
        rotation = linear / scale
        if np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-6:
            return None, _trs(matrix[:3, 3], rotation, scale)
    u, size, vt = np.linalg.svd(linear)
    if np.linalg.det(vt) < 0:
        vt, size = -vt, -size
    if np.linalg.det(u) < 0:
        u, size = -u, -size
    return _trs(matrix[:3, 3], u, size), _trs(np.zeros(3), vt, np.ones(3))


def _trs(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> dict[str, Any]:
    w, x, y, z = quaternion(rotation)
    trs: dict[str, Any] = {"translation": translation.tolist(), "rotation": [x, y, z, w]}
    return trs if np.abs(scale - 1).max() < 1e-7 else {**trs, "scale": scale.tolist()}


def quaternion(rotation: FloatArray) -> list[float]:
    """[w, x, y, z] of a (3, 3) rotation (Bar-Itzhack 2000: the dominant eigenvector, stable everywhere)."""
    m = rotation
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    vector = np.linalg.eigh(k)[1][:, -1]
    return [float(value) for value in (vector if vector[0] >= 0 else -vector)]


def _columns(matrix: FloatArray) -> list[float]:
    return [float(value) for value in matrix.T.ravel()]


def _container(scene: GlbScene) -> bytes:
    document = {
        "asset": {"version": "2.0", "generator": f"contact-core {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": scene.roots}],
        "nodes": [_without_empty(node) for node in scene.nodes],
        "meshes": scene.meshes,
        "skins": scene.skins,
        "animations": scene.animations,
        "accessors": scene.accessors,
        "bufferViews": scene.views,
        "buffers": [{"byteLength": len(scene.binary)}],
    }
    text = json.dumps(_without_empty(document), separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary = bytes(scene.binary) + b"\0" * (-len(scene.binary) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<III", MAGIC, 2, total)
    return (
        head
        + struct.pack("<II", len(text), JSON_CHUNK)
        + text
        + struct.pack("<II", len(binary), BINARY_CHUNK)
        + binary
    )


def _without_empty(entry: dict[str, Any]) -> dict[str, Any]:
    """glTF forbids empty lists."""
    return {key: value for key, value in entry.items() if value != []}
