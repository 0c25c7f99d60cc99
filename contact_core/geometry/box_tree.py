"""An implicit, balanced tree of boxes over triangles sorted by medians (see raycast.py)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import kernel

LEAF_SIZE = 4


class Tree(NamedTuple):
    """order: (m,) source face of each sorted triangle. triangles: (m, 9) corners. low, high: (2L - 1, 3) boxes.
    starts: (L + 1,) first sorted triangle of each of the L leaves; leaf i is node L - 1 + i."""

    order: IntArray
    triangles: FloatArray
    low: FloatArray
    high: FloatArray
    starts: IntArray


class Dipoles(NamedTuple):
    """Per node: area vector (N, 3), area-weighted centre (N, 3), radius of its triangles round the centre (N,)."""

    area: FloatArray
    centre: FloatArray
    radius: FloatArray


def build(points: FloatArray, faces: IntArray) -> Tree:
    """The tree over faces (m, 3) of points (n, 3)."""
    corners = points[faces]  # (m, 3, 3)
    leaves = 1 << max(0, int(np.ceil(np.log2(len(faces) / LEAF_SIZE))))
    leaves = min(leaves, 1 << int(np.log2(len(faces))))  # no leaf may be empty
    starts = np.arange(leaves + 1, dtype=np.int64) * len(faces) // leaves
    order = np.arange(len(faces), dtype=np.int64)
    _sort_by_medians(np.ascontiguousarray(corners.mean(axis=1)), starts, order)
    return _boxed(corners, order, starts)


def refitted(tree: Tree, points: FloatArray, faces: IntArray) -> Tree:
    """The tree of the same faces (m, 3) with other points (n, 3): sorted as it is, its boxes anew. As right as a
    new one; queries take longer the less the shapes are alike."""
    return _boxed(points[faces], tree.order, tree.starts)


def _boxed(corners: FloatArray, order: IntArray, starts: IntArray) -> Tree:
    """The tree over triangles (m, 3, 3) in an order."""
    leaves = len(starts) - 1
    corners = np.ascontiguousarray(corners[order])
    low, high = np.empty((2 * leaves - 1, 3)), np.empty((2 * leaves - 1, 3))
    low[leaves - 1 :] = np.minimum.reduceat(corners.min(axis=1), starts[:-1], axis=0)
    high[leaves - 1 :] = np.maximum.reduceat(corners.max(axis=1), starts[:-1], axis=0)
    for level, children in _levels(leaves):
        low[level] = low[children].reshape(-1, 2, 3).min(axis=1)
        high[level] = high[children].reshape(-1, 2, 3).max(axis=1)
    return Tree(order, corners.reshape(-1, 9), low, high, starts)


def _levels(leaves: int) -> Iterator[tuple[slice, slice]]:
    """The inner nodes level by level, lowest first, each with the slice of their children."""
    first = leaves // 2
    while first >= 1:
        yield slice(first - 1, 2 * first - 1), slice(2 * first - 1, 4 * first - 1)
        first //= 2


@kernel
def _sort_by_medians(centres: FloatArray, starts: IntArray, order: IntArray) -> None:
    """Sort faces so that each half of each node's run lies on one side of the median on its longest axis."""
    leaves = len(starts) - 1
    nodes = 1
    while nodes < leaves:
        step = leaves // nodes
        for node in range(nodes):
            first, last = starts[node * step], starts[(node + 1) * step]
            axis = 0
            widest = -1.0
            for k in range(3):
                low, high = np.inf, -np.inf
                for i in range(first, last):
                    low = min(low, centres[order[i], k])
                    high = max(high, centres[order[i], k])
                if high - low > widest:
                    axis, widest = k, high - low
            _select(centres, axis, order, first, last - 1, starts[node * step + step // 2])
        nodes *= 2


@kernel
def _select(centres: FloatArray, axis: int, order: IntArray, first: int, last: int, middle: int) -> None:
    """Hoare's selection: entry `middle` of order gets its sorted place, smaller ones before it, larger after."""
    while first < last:
        pivot = centres[order[(first + last) // 2], axis]
        i, j = first, last
        while i <= j:
            while centres[order[i], axis] < pivot:
                i += 1
            while centres[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            last = j
        elif middle >= i:
            first = i
        else:
            return


def dipoles(tree: Tree) -> Dipoles:
    """Dipoles of every node, leaves first (Barill et al. 2018, first order)."""
    corners = tree.triangles.reshape(-1, 3, 3)
    vector = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # (m, 3)
    weight = np.linalg.norm(vector, axis=1)
    leaves = len(tree.starts) - 1
    area, moment, mass = np.empty((2 * leaves - 1, 3)), np.empty((2 * leaves - 1, 3)), np.empty(2 * leaves - 1)
    area[leaves - 1 :] = np.add.reduceat(vector, tree.starts[:-1], axis=0)
    moment[leaves - 1 :] = np.add.reduceat(corners.mean(axis=1) * weight[:, None], tree.starts[:-1], axis=0)
    mass[leaves - 1 :] = np.add.reduceat(weight, tree.starts[:-1])
    for level, children in _levels(leaves):
        for values in (area, moment):
            values[level] = values[children].reshape(-1, 2, 3).sum(axis=1)
        mass[level] = mass[children].reshape(-1, 2).sum(axis=1)
    middle = 0.5 * (tree.low + tree.high)
    centre = np.where(mass[:, None] > 0, moment / np.maximum(mass, 1e-300)[:, None], middle)
    reach = np.maximum(tree.high - centre, centre - tree.low)  # (N, 3) farthest corner of the box, per axis
    return Dipoles(area, centre, np.linalg.norm(reach, axis=1))
