"""An implicit, balanced tree of boxes over triangles sorted by medians (see raycast.py).

It holds what a query cannot read from the mesh: the order of the faces and the boxes, both in 32 bits (16 bytes
a face). Boxes only say where not to look; triangles are read from the mesh in double precision,
so that results do not depend on how boxes are rounded (docs/adr/0097).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contact_core.arrays import FloatArray, Int32Array, IntArray, SingleArray
from contact_core.geometry.jit import inlined, kernel

LEAF_SIZE = 4
MARGIN = 2e-7  # of half the mesh's size: boxes are so much wider, more than rounding to single precision takes


class Tree(NamedTuple):
    """points: (n, 3) and faces: (m, 3) of the mesh itself. order: (m,) int32 source face of each sorted triangle.
    boxes: (2L - 1, 6) float32 low and high corner of each node, (point - centre) * scale. frame: (4,) centre and
    scale, a power of two: coordinates of boxes lie from -1 to 1. levels: 2^levels = L leaves; leaf i is node
    L - 1 + i, with the sorted triangles from i m / L on."""

    points: FloatArray
    faces: IntArray
    order: Int32Array
    boxes: SingleArray
    frame: FloatArray
    levels: int


class Dipoles(NamedTuple):
    """Per node: area vector (N, 3), area-weighted centre (N, 3), radius of its triangles round the centre (N,)."""

    area: FloatArray
    centre: FloatArray
    radius: FloatArray


def build(points: FloatArray, faces: IntArray) -> Tree:
    """The tree over faces (m, 3) of points (n, 3)."""
    levels = max(0, int(np.ceil(np.log2(len(faces) / LEAF_SIZE))))
    levels = min(levels, int(np.log2(len(faces))))  # no leaf may be empty
    frame = _frame(points, faces)
    order = np.arange(len(faces), dtype=np.int32)
    centres = np.empty((len(faces), 3), np.float32)
    _write_centres(points, faces, frame, centres)
    _sort_by_medians(centres, levels, order)
    return _boxed(points, faces, order, frame, levels)


def refitted(tree: Tree, points: FloatArray, faces: IntArray) -> Tree:
    """The tree of the same faces (m, 3) with other points (n, 3): sorted as it is, its boxes anew. As right as a
    new one; queries take longer the less the shapes are alike."""
    return _boxed(points, faces, tree.order, _frame(points, faces), tree.levels)


def _frame(points: FloatArray, faces: IntArray) -> FloatArray:
    """(4,) the centre of the faces' box, and the power of two that brings its half sides to at most 1."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    _bound(points, faces, low, high)
    half = float((0.5 * high - 0.5 * low).max())
    return np.array([*(0.5 * low + 0.5 * high), 2.0 ** -np.ceil(np.log2(max(half, 1e-200)))])


def _boxed(points: FloatArray, faces: IntArray, order: Int32Array, frame: FloatArray, levels: int) -> Tree:
    tree = Tree(points, faces, order, np.empty(((2 << levels) - 1, 6), np.float32), frame, levels)
    _write_boxes(*tree)
    return tree


@kernel
def _bound(points: FloatArray, faces: IntArray, low: FloatArray, high: FloatArray) -> None:
    """Write the corners (3,) of the box round all faces."""
    for f in range(len(faces)):
        for corner in range(3):
            for k in range(3):
                value = points[faces[f, corner], k]
                low[k] = min(low[k], value)
                high[k] = max(high[k], value)


@inlined
def run_of(leaf: int, order: Int32Array, levels: int) -> tuple[int, int]:
    """Where the sorted triangles of a leaf begin and end."""
    return (leaf * len(order)) >> levels, ((leaf + 1) * len(order)) >> levels


@inlined
def corners_of(points: FloatArray, faces: IntArray, f: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The corners (3,) of a face."""
    return points[faces[f, 0]], points[faces[f, 1]], points[faces[f, 2]]


@kernel
def _write_centres(points: FloatArray, faces: IntArray, frame: FloatArray, centres: SingleArray) -> None:
    """Write the middle of each face (m, 3), in the frame."""
    for f in range(len(faces)):
        a, b, c = corners_of(points, faces, f)
        for k in range(3):
            middle = (a[k] - frame[k]) + (b[k] - frame[k]) + (c[k] - frame[k])
            centres[f, k] = middle * frame[3] / 3.0


@kernel
def _write_boxes(
    points: FloatArray, faces: IntArray, order: Int32Array, boxes: SingleArray, frame: FloatArray, levels: int
) -> None:
    """Write the boxes of the leaves, then those of their parents."""
    leaves = 1 << levels
    for leaf in range(leaves):
        first, last = run_of(leaf, order, levels)
        for k in range(3):
            low, high = np.inf, -np.inf
            for t in range(first, last):
                for corner in range(3):
                    value = (points[faces[order[t], corner], k] - frame[k]) * frame[3]
                    low, high = min(low, value), max(high, value)
            boxes[leaves - 1 + leaf, k] = low - MARGIN
            boxes[leaves - 1 + leaf, 3 + k] = high + MARGIN
    for node in range(leaves - 2, -1, -1):
        for k in range(3):
            boxes[node, k] = min(boxes[2 * node + 1, k], boxes[2 * node + 2, k])
            boxes[node, 3 + k] = max(boxes[2 * node + 1, 3 + k], boxes[2 * node + 2, 3 + k])


@kernel
def _sort_by_medians(centres: SingleArray, levels: int, order: Int32Array) -> None:
    """Sort faces, with their centres, so that each half of each node's run lies on one side of the median on its
    longest axis."""
    for level in range(levels):
        for node in range(1 << level):
            first = (node * len(order)) >> level
            last = ((node + 1) * len(order)) >> level
            axis = 0
            widest = -1.0
            for k in range(3):
                low, high = np.inf, -np.inf
                for i in range(first, last):
                    low = min(low, centres[i, k])
                    high = max(high, centres[i, k])
                if high - low > widest:
                    axis, widest = k, high - low
            _select(centres, axis, order, first, last - 1, ((2 * node + 1) * len(order)) >> (level + 1))


@kernel
def _select(centres: SingleArray, axis: int, order: Int32Array, first: int, last: int, middle: int) -> None:
    """Hoare's selection: entry `middle` of order gets its sorted place, smaller ones before it, larger after."""
    while first < last:
        pivot = centres[(first + last) // 2, axis]
        i, j = first, last
        while i <= j:
            while centres[i, axis] < pivot:
                i += 1
            while centres[j, axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                for k in range(3):
                    centres[i, k], centres[j, k] = centres[j, k], centres[i, k]
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
    area, moment, mass = np.zeros((len(tree.boxes), 3)), np.zeros((len(tree.boxes), 3)), np.zeros(len(tree.boxes))
    _sum_dipoles(tree.points, tree.faces, tree.order, tree.levels, area, moment, mass)
    low, high = (tree.boxes[:, k : k + 3] / tree.frame[3] + tree.frame[:3] for k in (0, 3))
    centre = np.where(mass[:, None] > 0, moment / np.maximum(mass, 1e-300)[:, None], 0.5 * (low + high))
    reach = np.maximum(high - centre, centre - low)  # (N, 3) farthest corner of the box, per axis
    return Dipoles(area, centre, np.linalg.norm(reach, axis=1))


@kernel
def _sum_dipoles(
    points: FloatArray,
    faces: IntArray,
    order: Int32Array,
    levels: int,
    area: FloatArray,
    moment: FloatArray,
    mass: FloatArray,
) -> None:
    """Sum area vectors (N, 3), areas (N,) and areas times centres (N, 3) of the triangles of each node."""
    leaves = 1 << levels
    for leaf in range(leaves):
        node = leaves - 1 + leaf
        first, last = run_of(leaf, order, levels)
        for t in range(first, last):
            a, b, c = corners_of(points, faces, order[t])
            ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            x, y, z = 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)
            weight = np.sqrt(x * x + y * y + z * z)
            area[node, 0] += x
            area[node, 1] += y
            area[node, 2] += z
            mass[node] += weight
            for k in range(3):
                moment[node, k] += weight * (a[k] + b[k] + c[k]) / 3.0
    for node in range(leaves - 2, -1, -1):
        mass[node] = mass[2 * node + 1] + mass[2 * node + 2]
        for k in range(3):
            area[node, k] = area[2 * node + 1, k] + area[2 * node + 2, k]
            moment[node, k] = moment[2 * node + 1, k] + moment[2 * node + 2, k]
