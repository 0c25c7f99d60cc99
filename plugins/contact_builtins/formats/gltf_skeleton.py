"""The joints of a glTF file's skins as one skeleton: hierarchy, rest, and where each skin was bound.

A reflection between where a skin was bound and where it is shown (a node scaled by -1 above it) is taken into the
data: the bound skin is mirrored, and the joints keep right-handed axes. Joints that a second skin binds elsewhere
come twice: linear blending has one bind matrix per joint, so the second is a joint that rides on the first.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_nodes import Nodes, opened
from contact_builtins.formats.refusal import MAX_JOINTS, bounded, named
from contact_builtins.formats.sidecar import Sidecar
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import FileRefused, InvalidInput
from contact_core.hands.names import tree_from_names

SAME = 1e-4  # relative difference up to which two transforms count as one
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
_BRIDGES = 8  # common joints that are tried as the bridge between two skins


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints of all skins, parents first; the first `own` are nodes, those behind ride on one of them.

    nodes: (j,) glTF node of each. rest, bind: (j, 4, 4) world_from_joint of the nodes, and as the skin was bound.
    tables: per skin, the joint of each entry of its list. corrections: per skin, the (4, 4) that takes its bind
    space to the common one.
    """

    nodes: tuple[int, ...]
    own: int
    names: tuple[str, ...]
    parents: IntArray
    rest: FloatArray
    bind: FloatArray
    tables: dict[int, IntArray]
    corrections: dict[int, FloatArray]
    notes: tuple[str, ...]


def read_skeleton(gltf: Gltf, nodes: Nodes, followed: Mapping[int, IntArray], sidecar: Sidecar | None) -> Skeleton:
    """The joints that skins name. followed: per skin, the entries of its list that move a vertex.

    Raises FileRefused, InvalidInput.
    """
    world, hidden = opened(gltf, nodes, {int(j) for skin in followed for j in gltf.entry("skins", skin)["joints"]})
    nodes = replace(nodes, world=world)
    slots, binds, entries, corrections, odd = _slots(gltf, nodes, followed)
    bounded(len(slots), "joints", MAX_JOINTS)
    position = {node: k for k, node in enumerate(nodes.order)}
    first = {node: k for k, node in reversed(list(enumerate(slots)))}  # the slot in which a node is bound first
    order = sorted(first, key=lambda node: position[node])
    names = _unique_names(nodes, order)
    parents, notes = _parents(gltf.path, nodes, order, names, sidecar)
    if hidden:
        notes.append(
            f"Joints scaled to nothing, which hides what they carry, were read in their full size: {named(hidden)}."
        )
    if odd:
        told = named([nodes.names[node] for node in odd])
        notes.append(
            f"Damaged bind matrices of joints that move nothing were replaced, as these joints rest: {told}."
        )
    sequence = _sorted_parents_first(parents)
    rank = {old: new for new, old in enumerate(sequence)}
    parents = np.array([rank[int(parents[k])] if parents[k] >= 0 else -1 for k in sequence])
    order, names = [order[k] for k in sequence], [names[k] for k in sequence]
    taken = [first[node] for node in order]
    riders = sorted(set(range(len(slots))) - set(taken))
    place = {node: k for k, node in enumerate(order)}
    taken += riders
    if riders:
        notes.append(
            f"{len(riders)} joints are bound elsewhere by a second skin; each has a second joint that rides on it."
        )
    joint_of = {slot: k for k, slot in enumerate(taken)}
    rest, bind, scaled = _normalised(nodes.world[[slots[k] for k in taken]], np.array([binds[k] for k in taken]))
    tables = {skin: np.array([joint_of[slot] for slot in listed]) for skin, listed in entries.items()}
    bind, corrections, mirrored = _unmirrored(rest, bind, corrections, tables)
    if mirrored:
        what = "The rig stands" if mirrored == len(tables) else f"{mirrored} of {len(tables)} skins stand"
        notes.append(f"{what} mirrored in the scene (a negative scale above); it was read as it stands there.")
    if scaled:
        notes.append(f"Uniform joint scales ({scaled}) were taken out of the joint frames; the skin is unchanged.")
    return Skeleton(
        tuple(slots[k] for k in taken),
        len(order),
        (*names, *(f"{names[place[slots[k]]]}#bound{k}" for k in riders)),
        np.array([*parents, *(place[slots[k]] for k in riders)]),
        rest,
        bind,
        tables,
        corrections,
        tuple(notes),
    )


def _slots(
    gltf: Gltf, nodes: Nodes, followed: Mapping[int, IntArray]
) -> tuple[list[int], list[FloatArray], dict[int, list[int]], dict[int, FloatArray], list[int]]:
    """Distinct pairs of joint and bind matrix: the nodes, the matrices, the pair of each skin's entries, the (4, 4)
    per skin that takes its bind space to the common one, and the nodes whose bind matrices were replaced."""
    slots, binds = list[int](), list[FloatArray]()
    of_node: dict[int, list[int]] = defaultdict(list)
    entries: dict[int, list[int]] = {}
    corrections: dict[int, FloatArray] = {}
    replaced: dict[int, None] = {}
    for skin in sorted(followed):
        entry = gltf.entry("skins", skin)
        joints = [int(joint) for joint in entry["joints"]]
        for joint in joints:
            gltf.entry("nodes", joint)
        own, damaged = _bind_matrices(gltf, entry, joints, followed[skin])
        _bind_as_carried(own, damaged, joints, nodes)
        replaced |= dict.fromkeys(joints[k] for k in damaged)
        bridge = corrections[skin] = _bridge(
            [(binds[of_node[j][0]], own[k]) for k, j in enumerate(joints) if j in of_node]
        )
        entries[skin] = []
        for joint, matrix in zip(joints, bridge @ own, strict=True):
            slot = next((k for k in of_node[joint] if _same(binds[k], matrix)), len(slots))
            if slot == len(slots):
                slots.append(joint)
                binds.append(matrix)
                of_node[joint].append(slot)
            entries[skin].append(slot)
    return slots, binds, entries, corrections, list(replaced)


def _bridge(common: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """(4, 4) from a skin's own bind space to the common one, by the joints (common bind, own bind) of both.

    Skins of one skeleton may be bound in spaces of their own. The bridge is the one that most joints agree on.
    """
    tried = [bind @ np.linalg.inv(own) for bind, own in common[:_BRIDGES]]
    tried.append(np.eye(4))
    return max(tried, key=lambda bridge: sum(_same(bind, bridge @ own) for bind, own in common))


def _bind_matrices(
    gltf: Gltf, entry: dict[str, Any], joints: list[int], followed: IntArray
) -> tuple[FloatArray, IntArray]:
    """(k, 4, 4) world_from_joint at which a skin was bound, and which of them cannot be told, identity here.

    Raises InvalidInput where one that moves a vertex cannot be told: no other number says how the vertex moves.
    """
    if "inverseBindMatrices" not in entry:
        return np.tile(np.eye(4), (len(joints), 1, 1)), np.zeros(0, np.int64)
    inverse = gltf.accessor(entry["inverseBindMatrices"]).astype(np.float64)
    if inverse.shape[1] != 16 or len(inverse) < len(joints):
        raise InvalidInput(f"a skin has {len(joints)} joints, but {len(inverse)} inverse bind matrices")
    inverse = inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    odd = ~np.isfinite(inverse).all(axis=(1, 2))
    inverse[odd] = 0.0
    odd |= np.abs(np.linalg.det(inverse)) < 1e-30
    if odd.all() or odd[followed[(followed >= 0) & (followed < len(joints))]].any():
        raise InvalidInput("an inverse bind matrix is singular or not finite")
    inverse[odd] = np.eye(4)
    return np.asarray(np.linalg.inv(inverse), np.float64), np.flatnonzero(odd)


def _bind_as_carried(bind: FloatArray, damaged: IntArray, joints: list[int], nodes: Nodes) -> None:
    """Fill in where damaged joints were bound: as they rest to the nearest sound joint above, else to any."""
    sound = {joint: k for k, joint in enumerate(joints) if k not in set(damaged.tolist())}
    for k in damaged:
        above = joints[k]
        while above >= 0 and above not in sound:
            above = int(nodes.parents[above])
        carrier = above if above >= 0 else next(iter(sound))
        rest = nodes.world[carrier]
        if np.abs(np.linalg.det(rest)) > 1e-30:
            bind[k] = bind[sound[carrier]] @ np.linalg.solve(rest, nodes.world[joints[k]])


def _normalised(rest: FloatArray, bind: FloatArray) -> tuple[FloatArray, FloatArray, str]:
    """Rest and bind with each joint's uniform scale and reflection divided out of both: the skin stays as it is.

    Non-uniform scales are left alone: with them a turn before and after the scale differ.
    """
    rest, bind = rest.copy(), bind.copy()
    scaled = set[str]()
    for k in range(len(rest)):
        if np.linalg.det(rest[k, :3, :3]) < 0:
            rest[k], bind[k] = rest[k] @ MIRROR, bind[k] @ MIRROR
        linear = rest[k, :3, :3]
        size = float(np.cbrt(np.linalg.det(linear)))
        if size > 1e-9 and np.abs(linear.T @ linear / size**2 - np.eye(3)).max() < SAME:
            u, _, v = np.linalg.svd(linear / size)
            rest[k, :3, :3] = u @ v
            bind[k, :3, :3] /= size
            if abs(size - 1.0) > SAME:
                scaled.add(f"{size:.4g}")
    return rest, bind, ", ".join(sorted(scaled))


def _unmirrored(
    rest: FloatArray, bind: FloatArray, corrections: dict[int, FloatArray], tables: dict[int, IntArray]
) -> tuple[FloatArray, dict[int, FloatArray], int]:
    """The bind side mirrored for skins that (most of) their joints show mirrored, and how many skins that are.

    Skins that share a joint go together. rest: right-handed already.
    """
    turned = np.linalg.det(bind[:, :3, :3]) < 0
    bind, corrections, count = bind.copy(), dict(corrections), 0
    for skins in _sharing(tables):
        own = np.unique(np.concatenate([tables[skin] for skin in skins]))
        if 2 * np.count_nonzero(turned[own]) > len(own):
            bind[own] = MIRROR @ bind[own]
            corrections |= {skin: MIRROR @ corrections[skin] for skin in skins}
            count += len(skins)
    return bind, corrections, count


def _sharing(tables: dict[int, IntArray]) -> list[list[int]]:
    """The skins in groups, such that no two groups have a joint in common."""
    groups = list[tuple[list[int], set[int]]]()
    for skin, table in tables.items():
        joints, skins = set(table.tolist()), [skin]
        for other in [group for group in groups if group[1] & joints]:
            groups.remove(other)
            skins, joints = other[0] + skins, other[1] | joints
        groups.append((skins, joints))
    return [skins for skins, _ in groups]


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


def _same(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.abs(a - b).max() <= SAME * max(1.0, float(np.abs(b).max())))
