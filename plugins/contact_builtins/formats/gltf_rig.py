"""Skins of a glTF file as one rig: welded skin, influences, freedoms."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_nodes import Nodes
from contact_builtins.formats.gltf_scene import Part
from contact_builtins.formats.gltf_skeleton import Skeleton, read_skeleton
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import bounded, named
from contact_builtins.formats.sidecar import Sidecar
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.hands.freedoms import guess_freedoms
from contact_core.hands.names import mirrored_pairs
from contact_core.rig.rig import JointFreedom, Rig

_ODD = 0.01  # of the vertices of a part, how many may name joints that are not there before it is damaged
LEAST = 1e-6  # weight below which a joint counts for nothing


def rig_asset(gltf: Gltf, nodes: Nodes, parts: list[Part], sidecar: Sidecar | None, notes: list[str]) -> Asset:
    """The asset of a file with skins. Raises FileRefused, InvalidInput."""
    skeleton = read_skeleton(gltf, nodes, followed_by(parts), sidecar)
    bounded(
        sum(len(part.points) for part in parts) * len(skeleton.names) // 16, "weights"
    )  # (n, j) is held at once
    points, faces, weights, left_out = _joined(gltf, nodes, parts, skeleton)
    sums = weights.sum(axis=1)
    kept, influences = _strongest(weights / sums[:, None])
    # vertices whose weights differ stay apart, else welding would tear one of them
    _, groups = np.unique(np.round(weights / sums[:, None], 3), axis=0, return_inverse=True)
    surface = surface_of(Polygons.of_triangles(points, faces), groups.reshape(-1))
    picked = surface.first_source
    rest_local = skeleton.rest.copy()
    for index, parent in enumerate(skeleton.parents):
        if parent >= 0:
            rest_local[index] = np.linalg.solve(skeleton.rest[parent], skeleton.rest[index])
    rig = Rig(
        name=gltf.path.stem,
        joints=skeleton.names,
        parents=skeleton.parents,
        rest_local=rest_local,
        bind_world=skeleton.bind,
        bind_points=surface.points,
        faces=surface.faces,
        skin_joints=kept[picked],
        skin_weights=influences[picked],
        freedoms=tuple(JointFreedom() for _ in skeleton.names),
        meters_per_unit=(sidecar and sidecar.meters_per_unit) or 1.0,
        up_axis=(sidecar and sidecar.up_axis) or "Y",
    )
    freedoms, guessed = _freedoms(rig, skeleton.own, sidecar)
    rig = replace(rig, freedoms=freedoms)
    off = float(np.abs(sums - 1.0).max())
    if off > 1e-3:
        notes.append(f"Skin weights summed to {sums.min():.4g}..{sums.max():.4g}; they were normalised.")
    return Asset(
        name=rig.name,
        mesh=rig.surface,
        rig=rig,
        source_vertices=surface.source_vertices,
        source_faces=surface.source_faces,
        meters_per_unit=rig.meters_per_unit,
        up_axis=rig.up_axis,
        notes=(*notes, *left_out, *skeleton.notes, *surface.notes, *guessed),
        details={
            "format": "gltf",
            "polygons": len(faces),
            "influences": int((weights > 0).sum(axis=1).max()),
            "weights_sum_to_1": off <= 1e-3,
            "mirror": {**mirrored_pairs(skeleton.names), **(sidecar.mirror if sidecar else {})},
            "hands": [asdict(words) for words in sidecar.hands] if sidecar else [],
        },
    )


def followed_by(parts: list[Part]) -> dict[int, IntArray]:
    """Per skin that is shown, the entries of its list of joints that some vertex follows, in that list or not."""
    found: dict[int, list[IntArray]] = {}
    for part in parts:
        if part.skin is not None:
            told = found.setdefault(part.skin, [])
            if part.joints is not None and part.weights is not None:
                told.append(part.joints[part.weights > LEAST])
                told.append(part.joints[~(part.weights > LEAST).any(axis=1), 0])  # no weight: the first is followed
    return {skin: np.unique(np.concatenate([np.zeros(0, np.int64), *told])) for skin, told in found.items()}


def _joined(
    gltf: Gltf, nodes: Nodes, parts: list[Part], skeleton: Skeleton
) -> tuple[FloatArray, IntArray, FloatArray, list[str]]:
    """All parts in the common bind space: points (n, 3), faces (m, 3), weights (n, j), and notes."""
    index_of = {node: k for k, node in reversed(list(enumerate(skeleton.nodes)))}
    points, faces, weights = list[FloatArray](), list[IntArray](), list[FloatArray]()
    offset, loose = 0, list[str]()
    notes: dict[str, None] = {}
    for part in parts:
        if part.skin is not None and part.joints is not None and part.weights is not None:
            weight = _weights(part.joints, part.weights, skeleton.tables[part.skin], len(skeleton.nodes), notes)
            bridge = skeleton.corrections[part.skin]
            placed = transform_points(bridge, part.points)
            turned = np.linalg.det(bridge[:3, :3]) < 0
        else:
            carrier = part.node
            while carrier >= 0 and carrier not in index_of:
                carrier = int(nodes.parents[carrier])
            if carrier < 0:
                loose.append(nodes.names[part.node])
                continue
            joint = index_of[carrier]  # rides rigidly: back from where it rests to where it was bound
            move = skeleton.bind[joint] @ np.linalg.inv(skeleton.rest[joint])
            placed = transform_points(move, part.points)
            turned = False  # its faces are right where it rests
            weight = np.zeros((len(part.points), len(skeleton.nodes)))
            weight[:, joint] = 1.0
        points.append(placed)
        faces.append((part.faces[:, ::-1] if turned else part.faces) + offset)
        weights.append(weight)
        offset += len(part.points)
    if loose:
        notes[f"Meshes below no joint do not move with the rig and were left out: {named(loose)}."] = None
    return np.concatenate(points), np.concatenate(faces), np.concatenate(weights), list(notes)


def _weights(
    joints: IntArray, weights: FloatArray, table: IntArray, count: int, notes: dict[str, None]
) -> FloatArray:
    """(n, count) weights of a part by joint. One odd number does not spoil a rig: what was done is noted.

    Raises InvalidInput where a vertex follows a joint that the skin does not have.
    """
    odd = ~np.isfinite(weights) | (weights < 0)
    if odd.any():
        notes[f"{int(odd.any(axis=1).sum())} vertices had weights below zero or no numbers, which count as 0."] = (
            None
        )
        weights = np.where(odd, 0.0, weights)
    none = weights.sum(axis=1) <= 0
    if none.any():
        notes[f"{int(none.sum())} vertices had no weight and follow their first joint, as in viewers."] = None
        weights = np.array(weights)
        weights[none, 0] = 1.0
        first = np.where(joints[:, 0] < len(table), joints[:, 0], 0)
        joints = np.where(none[:, None], first[:, None], joints)
    stray = (joints < 0) | (joints >= len(table))
    lost = stray & (weights > LEAST)
    if lost.any():
        many = int(lost.any(axis=1).sum())
        if many > _ODD * len(joints) or (weights * ~stray).sum(axis=1).min() <= LEAST:
            raise InvalidInput(f"a vertex names joint {int(joints[lost][0])} of {len(table)}")
        notes[f"{many} vertices name a joint that their skin does not have; they follow their others alone."] = None
    weights = np.where(stray, 0.0, weights)
    result = np.zeros((len(joints), count))
    rows = np.arange(len(joints))
    for k in range(joints.shape[1]):
        np.add.at(result, (rows, table[np.where(stray[:, k], 0, joints[:, k])]), weights[:, k])
    return result


def _strongest(weights: FloatArray) -> tuple[IntArray, FloatArray]:
    """(n, K) joints and weights, K the largest number of influences of any vertex, strongest first."""
    count = int((weights > 0).sum(axis=1).max(initial=1))
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    kept = np.take_along_axis(weights, joints, axis=1)
    return joints.astype(np.int64), kept / kept.sum(axis=1, keepdims=True)


def _freedoms(rig: Rig, own: int, sidecar: Sidecar | None) -> tuple[tuple[JointFreedom, ...], list[str]]:
    """Freedoms by the sidecar over guesses, and notes. own: joints behind the first `own` ride on one of them.

    Raises FileRefused, InvalidInput.
    """
    riders = tuple(JointFreedom(kind="fixed") for _ in rig.joints[own:])
    if riders:
        rig = _without_riders(rig, own)
    if sidecar is not None and not sidecar.guess:
        freedoms: tuple[JointFreedom, ...] = tuple(JointFreedom(kind="fixed") for _ in rig.joints)
        notes: list[str] = []
    else:
        freedoms, notes = guess_freedoms(rig, sidecar.hands if sidecar else ())
    if sidecar is not None:
        freedoms = sidecar.freedoms(rig.joints, freedoms)
        notes = [f"Joint freedoms were set by {sidecar.path.name}."]
    return (*freedoms, *riders), notes


def _without_riders(rig: Rig, own: int) -> Rig:
    """The rig bound as it rests, its skin on the first `own` joints: what the others move, theirs move alike."""
    carrier = np.concatenate([np.arange(own), rig.parents[own:]])
    return replace(
        rig,
        joints=rig.joints[:own],
        parents=rig.parents[:own],
        rest_local=rig.rest_local[:own],
        bind_world=rig.rest_world[:own],
        bind_points=rig.surface.points,
        skin_joints=carrier[rig.skin_joints],
        freedoms=rig.freedoms[:own],
    )
