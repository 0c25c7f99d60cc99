"""The node tree of a glTF file: transforms, what the scene shows, and what is there but not drawn."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput

MAX_NODES = 200_000


@dataclass(frozen=True, eq=False)
class Nodes:
    """The node tree. parents: (k,) -1 for roots. world: (k, 4, 4) world_from_node. order: parents first.

    active: nodes of the scene that is shown. hidden: those of them that a viewer does not draw.
    """

    names: tuple[str, ...]
    parents: IntArray
    world: FloatArray
    order: tuple[int, ...]
    active: frozenset[int]
    hidden: frozenset[int]
    notes: tuple[str, ...]


def read_nodes(gltf: Gltf) -> Nodes:
    """The tree with world transforms. Raises InvalidInput when it is not a tree."""
    entries = gltf.entries("nodes")
    bounded(len(entries), "nodes", MAX_NODES)
    parents = np.full(len(entries), -1)
    for index, entry in enumerate(entries):
        for child in entry.get("children", []):
            gltf.entry("nodes", child)
            if parents[child] != -1:
                raise InvalidInput(f"node {child} has two parents")
            parents[child] = index
    order = _parents_first(entries, parents)
    notes: dict[str, None] = {}
    local = np.array([_local(entry, index, notes) for index, entry in enumerate(entries)]).reshape(-1, 4, 4)
    world = local.copy()
    for index in order:
        if parents[index] >= 0:
            world[index] = world[parents[index]] @ local[index]
    names = tuple(str(entry.get("name") or f"node_{index}") for index, entry in enumerate(entries))
    hidden = _hidden(entries, order, parents, world)
    return Nodes(names, parents, world, order, _shown(gltf, order, parents), hidden, tuple(notes))


def opened(gltf: Gltf, nodes: Nodes, shown: Collection[int]) -> tuple[FloatArray, list[str]]:
    """(k, 4, 4) world_from_node with scales of 0 taken for 1, and the names of those of `shown` that this moves.

    A joint scaled to nothing hides what it carries; nothing can be said of how it turns.
    """
    entries = gltf.entries("nodes")
    flat = {index for index, entry in enumerate(entries) if 0 in entry.get("scale", ())}
    if not flat:
        return nodes.world, []
    local = [_local(_unflattened(entry), index, {}) for index, entry in enumerate(entries)]
    world, below = np.array(local), set[int]()
    for index in nodes.order:
        parent = int(nodes.parents[index])
        world[index] = world[parent] @ local[index] if parent >= 0 else local[index]
        if index in flat or parent in below:
            below.add(index)
    return world, [nodes.names[index] for index in nodes.order if index in below and index in shown]


def _unflattened(entry: dict[str, Any]) -> dict[str, Any]:
    return entry | ({"scale": [value or 1.0 for value in entry["scale"]]} if "scale" in entry else {})


def _hidden(
    entries: list[dict[str, Any]], order: tuple[int, ...], parents: IntArray, world: FloatArray
) -> frozenset[int]:
    """Nodes switched off by KHR_node_visibility and coarser levels of another (MSFT_lod), with all below them, and
    nodes scaled to nothing."""
    hidden = {
        int(coarser)
        for entry in entries
        for coarser in ((entry.get("extensions") or {}).get("MSFT_lod") or {}).get("ids", ())
    }
    for index in order:
        said = (entries[index].get("extensions") or {}).get("KHR_node_visibility") or {}
        off = said.get("visible", True) is False
        if off or int(parents[index]) in hidden or not world[index][:3, :3].any():
            hidden.add(index)
    return frozenset(hidden)


def _local(entry: dict[str, Any], index: int, notes: dict[str, None]) -> FloatArray:
    """(4, 4) parent_from_node of a node's matrix or TRS."""
    matrix = np.eye(4)
    if "matrix" in entry:
        matrix = np.array(entry["matrix"], np.float64).reshape(4, 4).T  # stored column by column
    else:
        if "rotation" in entry:
            x, y, z, w = _numbers(entry, "rotation", 4)
            norm = math.hypot(x, y, z, w)
            if not math.isfinite(norm):
                raise InvalidInput(f"node {index} has a rotation quaternion of length {norm}")
            if norm > 0.0:
                matrix[:3, :3] = rotation_matrix(np.array([w, x, y, z]) / norm)
            else:
                notes["A rotation of zero length was read as no rotation, as viewers do."] = None
        if "scale" in entry:
            matrix[:3, :3] *= _numbers(entry, "scale", 3)
        if "translation" in entry:
            matrix[:3, 3] = _numbers(entry, "translation", 3)
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


def _numbers(entry: dict[str, Any], key: str, count: int) -> FloatArray:
    values = np.array(entry[key], np.float64)
    if values.shape != (count,):
        raise InvalidInput(f"a node's {key} is {str(entry[key])[:60]}, not {count} numbers")
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
