"""Skins of a glTF file as one rig: joints, hierarchy, rest and bind, welded skin, influences."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_scene import Nodes, Part
from contact_builtins.formats.polygons import Polygons, surface_of
from contact_builtins.formats.refusal import bounded
from contact_builtins.formats.sidecar import Sidecar
from contact_core.arrays import FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.hands.freedoms import guess_freedoms
from contact_core.hands.names import mirrored_pairs, tree_from_names
from contact_core.rig.rig import JointFreedom, Rig

MAX_JOINTS = 4096
SAME = 1e-4  # relative difference up to which two transforms count as one


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints of all skins, parents first. nodes: (j,) glTF node of each.

    rest, bind: (j, 4, 4) world_from_joint of the nodes, and as the skin was bound.
    corrections: per skin, the (4, 4) that takes its bind space to the common one.
    """

    nodes: tuple[int, ...]
    names: tuple[str, ...]
    parents: IntArray
    rest: FloatArray
    bind: FloatArray
    corrections: dict[int, FloatArray]
    notes: tuple[str, ...]


def rig_asset(gltf: Gltf, nodes: Nodes, parts: list[Part], sidecar: Sidecar | None, notes: list[str]) -> Asset:
    """The asset of a file with skins. Raises FileRefused, InvalidInput."""
    skeleton = _skeleton(gltf, nodes, sorted({p.skin for p in parts if p.skin is not None}), sidecar)
    bounded(
        sum(len(part.points) for part in parts) * len(skeleton.names) // 16, "weights"
    )  # (n, j) is held at once
    points, faces, weights, left_out = _joined(gltf, nodes, parts, skeleton)
    sums = weights.sum(axis=1)
    if (sums <= 0).any():
        raise InvalidInput(f"skin vertex {int(np.argmax(sums <= 0))} has no weight")
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
    freedoms, guessed = _freedoms(rig, sidecar)
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


def _skeleton(gltf: Gltf, nodes: Nodes, skins: list[int], sidecar: Sidecar | None) -> Skeleton:
    bind: dict[int, FloatArray] = {}
    corrections: dict[int, FloatArray] = {}
    for skin in skins:
        entry = gltf.entry("skins", skin)
        joints = [int(joint) for joint in entry["joints"]]
        for joint in joints:
            gltf.entry("nodes", joint)
        own = _bind_matrices(gltf, entry, joints)
        # skins of one skeleton may be bound in spaces of their own: take the common joints as the bridge
        bridges = [bind[j] @ np.linalg.inv(own[k]) for k, j in enumerate(joints) if j in bind]
        bridge = bridges[0] if bridges else np.eye(4)
        if any(not _same(other, bridge) for other in bridges):
            raise FileRefused(
                f"{gltf.path} binds the joints of skin {skin} otherwise than those of skin {skins[0]};"
                " one bind pose per joint is read. Join the meshes in your DCC and export again."
            )
        corrections[skin] = bridge
        bind |= {j: bridge @ own[k] for k, j in enumerate(joints) if j not in bind}
    order = [index for index in nodes.order if index in bind]
    if len(order) > MAX_JOINTS:
        raise InvalidInput(f"it has {len(order)} joints; up to {MAX_JOINTS} are read")
    names = _unique_names(nodes, order)
    parents, notes = _parents(gltf.path, nodes, order, names, sidecar)
    sequence = _sorted_parents_first(parents)
    order = [order[k] for k in sequence]
    rank = {old: new for new, old in enumerate(sequence)}
    parents = np.array([rank[int(parents[k])] if parents[k] >= 0 else -1 for k in sequence])
    placed, bound, mirror = _unmirrored(nodes.world[order], np.array([bind[index] for index in order]))
    if np.linalg.det(mirror) < 0:
        corrections = {skin: mirror @ bridge for skin, bridge in corrections.items()}
        notes.append(
            "The rig stands mirrored in its scene (a negative scale above it); it was read as it stands there."
        )
    rest, bound, scaled = _normalised(placed, bound)
    if scaled:
        notes.append(f"Uniform joint scales ({scaled}) were taken out of the joint frames; the skin is unchanged.")
    return Skeleton(
        tuple(order), tuple(names[k] for k in sequence), parents, rest, bound, corrections, tuple(notes)
    )


def _bind_matrices(gltf: Gltf, entry: dict[str, Any], joints: list[int]) -> FloatArray:
    """(k, 4, 4) world_from_joint at which a skin was bound."""
    if "inverseBindMatrices" not in entry:
        return np.tile(np.eye(4), (len(joints), 1, 1))
    inverse = gltf.accessor(entry["inverseBindMatrices"]).astype(np.float64)
    if inverse.shape[1] != 16 or len(inverse) < len(joints):
        raise InvalidInput(f"a skin has {len(joints)} joints, but {len(inverse)} inverse bind matrices")
    inverse = inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    if not np.isfinite(inverse).all() or (np.abs(np.linalg.det(inverse)) < 1e-30).any():
        raise InvalidInput("an inverse bind matrix is singular or not finite")
    return np.asarray(np.linalg.inv(inverse), np.float64)


def _unmirrored(rest: FloatArray, bind: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rest and bind (j, 4, 4) with right-handed joint frames, and the (4, 4) from the old bind space to the new.

    Where every joint rests mirrored against its bind, the bind pose is mirrored too; the skin stays as it is.
    """
    rest, bind = rest.copy(), bind.copy()
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    resting, bound = np.linalg.det(rest[:, :3, :3]), np.linalg.det(bind[:, :3, :3])
    mirrored = bool((resting * bound < 0).all())
    if mirrored:
        bind = flip @ bind
    if mirrored or (resting * bound > 0).all():
        left = resting < 0
        rest[left], bind[left] = rest[left] @ flip, bind[left] @ flip
    return rest, bind, flip if mirrored else np.eye(4)


def _normalised(rest: FloatArray, bind: FloatArray) -> tuple[FloatArray, FloatArray, str]:
    """Rest and bind with each joint's uniform scale divided out of both, so that the skin stays as it is.

    Non-uniform and negative scales are left alone: with them a turn before and after the scale differ.
    """
    rest, bind = rest.copy(), bind.copy()
    scaled = set[str]()
    for k in range(len(rest)):
        linear = rest[k, :3, :3]
        size = float(np.cbrt(np.linalg.det(linear)))
        if size > 1e-9 and np.abs(linear.T @ linear / size**2 - np.eye(3)).max() < SAME:
            u, _, v = np.linalg.svd(linear / size)
            rest[k, :3, :3] = u @ v
            bind[k, :3, :3] /= size
            if abs(size - 1.0) > SAME:
                scaled.add(f"{size:.4g}")
    return rest, bind, ", ".join(sorted(scaled))


def _parents(
    path: Path, nodes: Nodes, order: list[int], names: list[str], sidecar: Sidecar | None
) -> tuple[IntArray, list[str]]:
    """Parent of each joint as an index into `order`: nearest joint above; else by sidecar; else by names."""
    position = {node: k for k, node in enumerate(order)}
    parents = np.full(len(order), -1)
    for k, node in enumerate(order):
        above = int(nodes.parents[node])
        while above >= 0 and above not in position:
            above = int(nodes.parents[above])
        parents[k] = position.get(above, -1)
    given = sidecar.parents(names) if sidecar else {}
    notes = []
    if len(order) > 1 and (parents == -1).all() and len(given) < len(order) - 1:
        found = tree_from_names(names)
        if found is None:
            raise FileRefused(
                f"{path} has {len(order)} joints without a hierarchy, and their names do not tell it. Say each"
                ' parent in a rig.toml beside it: [[joint]] match = "name" parent = "other".'
            )
        given = found | given
        notes.append("The joints come without a hierarchy; their tree was taken from their names.")
    for k, name in enumerate(names):
        if name in given:
            parents[k] = names.index(given[name]) if given[name] else -1
    return parents, notes


def _sorted_parents_first(parents: IntArray) -> list[int]:
    """Joints ordered so that parents come first; as they were when they do. Raises InvalidInput on a ring."""
    if (parents < np.arange(len(parents))).all():
        return list(range(len(parents)))
    children: dict[int, list[int]] = defaultdict(list)
    for index, parent in enumerate(parents.tolist()):
        children[parent].append(index)
    order = list(children[-1])
    for index in order:  # grows while it is walked: level after level
        order += children[index]
    if len(order) != len(parents):
        raise InvalidInput("its joints form a ring instead of a tree")
    return order


def _unique_names(nodes: Nodes, order: list[int]) -> list[str]:
    """Node names, made unique by their parents' names where they repeat, and by a number where that repeats."""
    uses = Counter(nodes.names[index] for index in order)
    names, taken = list[str](), Counter[str]()
    for index in order:
        name, above = nodes.names[index], int(nodes.parents[index])
        if uses[name] > 1 and above >= 0:
            name = f"{nodes.names[above]}/{name}"
        taken[name] += 1
        names.append(name if taken[name] == 1 else f"{name}_{taken[name]}")
    if len(set(names)) != len(names):
        raise InvalidInput(
            "its joint names repeat even with their parents' names; give each joint a name of its own"
        )
    return names


def _joined(
    gltf: Gltf, nodes: Nodes, parts: list[Part], skeleton: Skeleton
) -> tuple[FloatArray, IntArray, FloatArray, list[str]]:
    """All parts in the common bind space: points (n, 3), faces (m, 3), weights (n, j), and notes."""
    index_of = {node: k for k, node in enumerate(skeleton.nodes)}
    points, faces, weights, notes = list[FloatArray](), list[IntArray](), list[FloatArray](), list[str]()
    offset = 0
    for part in parts:
        if part.skin is not None and part.joints is not None and part.weights is not None:
            table = np.array([index_of[int(joint)] for joint in gltf.entry("skins", part.skin)["joints"]])
            if len(part.joints) and part.joints.max() >= len(table):
                raise InvalidInput(f"a vertex names joint {int(part.joints.max())} of {len(table)}")
            own = np.zeros((len(part.points), len(table)))
            rows = np.arange(len(part.points))
            for k in range(part.joints.shape[1]):
                np.add.at(own, (rows, part.joints[:, k]), part.weights[:, k])
            weight = np.zeros((len(part.points), len(index_of)))
            weight[:, table] = own
            bridge = skeleton.corrections[part.skin]
            placed = transform_points(bridge, part.points)
        else:
            carrier = part.node
            while carrier >= 0 and carrier not in index_of:
                carrier = int(nodes.parents[carrier])
            if carrier < 0:
                notes.append(f"The mesh of node {nodes.names[part.node]!r} hangs on no joint and was left out.")
                continue
            joint = index_of[carrier]  # rides rigidly: back from where it rests to where it was bound
            move = skeleton.bind[joint] @ np.linalg.inv(skeleton.rest[joint])
            placed = transform_points(move, part.points)
            weight = np.zeros((len(part.points), len(index_of)))
            weight[:, joint] = 1.0
        points.append(placed)
        turned = part.skin is not None and np.linalg.det(skeleton.corrections[part.skin][:3, :3]) < 0
        faces.append((part.faces[:, ::-1] if turned else part.faces) + offset)
        weights.append(weight)
        offset += len(part.points)
    return np.concatenate(points), np.concatenate(faces), np.concatenate(weights), notes


def _strongest(weights: FloatArray) -> tuple[IntArray, FloatArray]:
    """(n, K) joints and weights, K the largest number of influences of any vertex, strongest first."""
    count = int((weights > 0).sum(axis=1).max(initial=1))
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    kept = np.take_along_axis(weights, joints, axis=1)
    return joints.astype(np.int64), kept / kept.sum(axis=1, keepdims=True)


def _freedoms(rig: Rig, sidecar: Sidecar | None) -> tuple[tuple[JointFreedom, ...], list[str]]:
    """Freedoms by the sidecar over guesses, and notes. Raises FileRefused, InvalidInput."""
    if sidecar is not None and not sidecar.guess:
        freedoms: tuple[JointFreedom, ...] = tuple(JointFreedom(kind="fixed") for _ in rig.joints)
        notes: list[str] = []
    else:
        freedoms, notes = guess_freedoms(rig, sidecar.hands if sidecar else ())
    if sidecar is not None:
        freedoms = sidecar.freedoms(rig.joints, freedoms)
        notes = [f"Joint freedoms were set by {sidecar.path.name}."]
    return freedoms, notes


def _same(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.abs(a - b).max() <= SAME * max(1.0, float(np.abs(b).max())))
