"""Kernels of the locator: an implicit tree of boxes over Morton-sorted triangles (see raycast.py)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import kernel

LEAF_SIZE = 4
STACK = 128  # the tree is balanced: its depth is log2 of the leaf count, and a stack holds one sibling a level


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
    """The tree over faces (m, 3) of points (n, 3), by sorting and reductions."""
    corners = points[faces]  # (m, 3, 3)
    centres = corners.mean(axis=1)
    low, extent = centres.min(axis=0), np.ptp(centres, axis=0)
    cells = ((centres - low) / np.where(extent > 0, extent, 1.0) * (2**21 - 1)).astype(np.uint64)  # (m, 3)
    code = np.zeros(len(faces), np.uint64)
    for axis in range(3):
        code |= _spread(cells[:, axis]) << np.uint64(axis)
    order = np.argsort(code, kind="stable").astype(np.int64)
    leaves = 1 << max(0, int(np.ceil(np.log2(len(faces) / LEAF_SIZE))))
    leaves = min(leaves, 1 << int(np.log2(len(faces))))  # no leaf may be empty
    starts = np.arange(leaves + 1, dtype=np.int64) * len(faces) // leaves
    triangles = corners[order].reshape(-1, 9)
    boxes_low, boxes_high = np.empty((2 * leaves - 1, 3)), np.empty((2 * leaves - 1, 3))
    sorted_corners = corners[order]
    boxes_low[leaves - 1 :] = np.minimum.reduceat(sorted_corners.min(axis=1), starts[:-1], axis=0)
    boxes_high[leaves - 1 :] = np.maximum.reduceat(sorted_corners.max(axis=1), starts[:-1], axis=0)
    first = leaves // 2
    while first >= 1:  # nodes first - 1 .. 2 first - 2 are one level
        level, children = slice(first - 1, 2 * first - 1), slice(2 * first - 1, 4 * first - 1)
        boxes_low[level] = boxes_low[children].reshape(-1, 2, 3).min(axis=1)
        boxes_high[level] = boxes_high[children].reshape(-1, 2, 3).max(axis=1)
        first //= 2
    return Tree(order, triangles, boxes_low, boxes_high, starts)


def _spread(value: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Put two zero bits between the 21 bits of each value (Morton code)."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        value = (value | (value << np.uint64(shift))) & np.uint64(mask)
    return value


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
    first = leaves // 2
    while first >= 1:
        level, children = slice(first - 1, 2 * first - 1), slice(2 * first - 1, 4 * first - 1)
        for values in (area, moment):
            values[level] = values[children].reshape(-1, 2, 3).sum(axis=1)
        mass[level] = mass[children].reshape(-1, 2).sum(axis=1)
        first //= 2
    middle = 0.5 * (tree.low + tree.high)
    centre = np.where(mass[:, None] > 0, moment / np.maximum(mass, 1e-300)[:, None], middle)
    reach = np.maximum(tree.high - centre, centre - tree.low)  # (N, 3) farthest corner of the box, per axis
    return Dipoles(area, centre, np.linalg.norm(reach, axis=1))


@kernel
def _box_entry(low: FloatArray, high: FloatArray, node: int, origin: FloatArray, inverse: FloatArray) -> float:
    """Where a ray enters a node's box, inf if it misses it; the slab test, kept conservative by one rounding."""
    near = 0.0
    far = np.inf
    for axis in range(3):
        a = (low[node, axis] - origin[axis]) * inverse[axis]
        b = (high[node, axis] - origin[axis]) * inverse[axis]
        if a > b:
            a, b = b, a
        # NaN (0 * inf: the origin lies in a slab's plane) compares false and leaves the interval alone.
        if a > near:
            near = a
        if b < far:
            far = b
    if near > far * (1.0 + 4e-16):
        return np.inf
    return near


@kernel
def _cast_one(
    tree: Tree, origin: FloatArray, direction: FloatArray, limit: float, stack: IntArray, out: FloatArray
) -> int:
    """First hit of one ray: the sorted triangle (-1: none); out = (distance, u, v, w)."""
    order, triangles, low, high, starts = tree
    leaves = len(starts) - 1
    inverse = np.empty(3)
    kz = 0
    for axis in range(3):
        inverse[axis] = 1.0 / direction[axis] if direction[axis] != 0.0 else np.inf
        if abs(direction[axis]) > abs(direction[kz]):
            kz = axis
    kx = (kz + 1) % 3
    ky = (kz + 2) % 3
    sx = direction[kx] / direction[kz]
    sy = direction[ky] / direction[kz]
    sz = 1.0 / direction[kz]
    best = limit
    found = -1
    top = 0
    stack[0] = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if _box_entry(low, high, node, origin, inverse) > best:
            continue
        if node < leaves - 1:
            left = _box_entry(low, high, 2 * node + 1, origin, inverse)
            right = _box_entry(low, high, 2 * node + 2, origin, inverse)
            near_child = 2 * node + 1 if left <= right else 2 * node + 2
            far_child = 4 * node + 3 - near_child
            if max(left, right) <= best and max(left, right) < np.inf:
                top += 1
                stack[top] = far_child
            if min(left, right) <= best and min(left, right) < np.inf:
                top += 1
                stack[top] = near_child
            continue
        for t in range(starts[node - leaves + 1], starts[node - leaves + 2]):
            az = triangles[t, kz] - origin[kz]
            bz = triangles[t, 3 + kz] - origin[kz]
            cz = triangles[t, 6 + kz] - origin[kz]
            ax = triangles[t, kx] - origin[kx] - sx * az
            ay = triangles[t, ky] - origin[ky] - sy * az
            bx = triangles[t, 3 + kx] - origin[kx] - sx * bz
            by = triangles[t, 3 + ky] - origin[ky] - sy * bz
            cx = triangles[t, 6 + kx] - origin[kx] - sx * cz
            cy = triangles[t, 6 + ky] - origin[ky] - sy * cz
            u = cx * by - cy * bx
            v = ax * cy - ay * cx
            w = bx * ay - by * ax
            if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
                continue
            total = u + v + w
            if total == 0.0:
                continue
            distance = sz * (u * az + v * bz + w * cz) / total
            if distance < 0.0 or distance > best:
                continue
            if distance == best and found >= 0 and order[t] > order[found]:
                continue
            best = distance
            found = t
            out[0] = distance
            out[1] = u / total
            out[2] = v / total
            out[3] = w / total
    return found


@kernel
def cast(
    tree: Tree, origins: FloatArray, directions: FloatArray, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """First hits of k rays: faces (k,), barycentric (k, 3), distance (k,)."""
    k = len(origins)
    faces = np.full(k, -1, np.int64)
    barycentric = np.zeros((k, 3))
    barycentric[:, 0] = 1.0
    distance = np.full(k, np.inf)
    stack = np.empty(STACK, np.int64)
    out = np.empty(4)
    for i in range(k):
        t = _cast_one(tree, origins[i], directions[i], limit, stack, out)
        if t >= 0:
            faces[i] = tree[0][t]
            distance[i] = out[0]
            barycentric[i] = out[1:]
    return faces, barycentric, distance


@kernel
def _box_distance(low: FloatArray, high: FloatArray, node: int, p: FloatArray) -> float:
    """Squared distance of a point to a node's box."""
    total = 0.0
    for axis in range(3):
        gap = max(low[node, axis] - p[axis], p[axis] - high[node, axis], 0.0)
        total += gap * gap
    return total


@kernel
def _closest_on_triangle(t: FloatArray, p: FloatArray, out: FloatArray) -> float:
    """Barycentric coordinates of the closest point of a triangle (9,) to p into out; its squared distance."""
    abx, aby, abz = t[3] - t[0], t[4] - t[1], t[5] - t[2]
    acx, acy, acz = t[6] - t[0], t[7] - t[1], t[8] - t[2]
    apx, apy, apz = p[0] - t[0], p[1] - t[1], p[2] - t[2]
    bpx, bpy, bpz = p[0] - t[3], p[1] - t[4], p[2] - t[5]
    cpx, cpy, cpz = p[0] - t[6], p[1] - t[7], p[2] - t[8]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
    va = d3 * d6 - d5 * d4
    vb = d5 * d2 - d1 * d6
    vc = d1 * d4 - d3 * d2
    v = 0.0
    w = 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    elif va + vb + vc > 0.0:
        v = vb / (va + vb + vc)
        w = vc / (va + vb + vc)
    dx = apx - v * abx - w * acx
    dy = apy - v * aby - w * acy
    dz = apz - v * abz - w * acz
    out[0] = max(0.0, 1.0 - v - w)
    out[1] = v
    out[2] = w
    return dx * dx + dy * dy + dz * dz


@kernel
def closest(
    tree: Tree, normals: FloatArray, points: FloatArray, facing: FloatArray, facing_limit: float, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Closest points of k queries: faces (-1: none), barycentric (k, 3), distance. facing: (k, 3) or (0, 3)."""
    order, triangles, low, high, starts = tree
    leaves = len(starts) - 1
    k = len(points)
    faces = np.full(k, -1, np.int64)
    barycentric = np.zeros((k, 3))
    barycentric[:, 0] = 1.0
    distance = np.full(k, np.inf)
    stack = np.empty(STACK, np.int64)
    out = np.empty(3)
    for i in range(k):
        p = points[i]
        best = limit * limit
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _box_distance(low, high, node, p) > best:
                continue
            if node < leaves - 1:
                left = _box_distance(low, high, 2 * node + 1, p)
                right = _box_distance(low, high, 2 * node + 2, p)
                near_child = 2 * node + 1 if left <= right else 2 * node + 2
                if max(left, right) <= best:
                    top += 1
                    stack[top] = 4 * node + 3 - near_child
                if min(left, right) <= best:
                    top += 1
                    stack[top] = near_child
                continue
            for t in range(starts[node - leaves + 1], starts[node - leaves + 2]):
                f = order[t]
                if len(facing) and (
                    normals[f, 0] * facing[i, 0] + normals[f, 1] * facing[i, 1] + normals[f, 2] * facing[i, 2]
                    > facing_limit
                ):
                    continue
                squared = _closest_on_triangle(triangles[t], p, out)
                if squared > best or (squared == best and faces[i] >= 0 and f > faces[i]):
                    continue
                best = squared
                faces[i] = f
                barycentric[i] = out
                distance[i] = np.sqrt(squared)
    return faces, barycentric, distance


@kernel
def _solid_angle(t: FloatArray, p: FloatArray) -> float:
    """Signed solid angle of a triangle (9,) seen from p (van Oosterom and Strackee 1983)."""
    ax, ay, az = t[0] - p[0], t[1] - p[1], t[2] - p[2]
    bx, by, bz = t[3] - p[0], t[4] - p[1], t[5] - p[2]
    cx, cy, cz = t[6] - p[0], t[7] - p[1], t[8] - p[2]
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    det = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
    ab = ax * bx + ay * by + az * bz
    bc = bx * cx + by * cy + bz * cz
    ca = cx * ax + cy * ay + cz * az
    return 2.0 * np.arctan2(det, a * b * c + ab * c + bc * a + ca * b)


@kernel
def winding(tree: Tree, nodes: Dipoles, points: FloatArray, accuracy: float) -> FloatArray:
    """(k,) generalised winding numbers of points (k, 3)."""
    triangles, starts = tree[1], tree[4]
    area, centre, radius = nodes
    leaves = len(starts) - 1
    result = np.zeros(len(points))
    stack = np.empty(STACK, np.int64)
    for i in range(len(points)):
        p = points[i]
        total = 0.0
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            dx, dy, dz = centre[node, 0] - p[0], centre[node, 1] - p[1], centre[node, 2] - p[2]
            squared = dx * dx + dy * dy + dz * dz
            reach = accuracy * radius[node]
            if squared > reach * reach:
                total += (area[node, 0] * dx + area[node, 1] * dy + area[node, 2] * dz) / (
                    squared * np.sqrt(squared)
                )
            elif node < leaves - 1:
                stack[top + 1] = 2 * node + 1
                stack[top + 2] = 2 * node + 2
                top += 2
            else:
                for t in range(starts[node - leaves + 1], starts[node - leaves + 2]):
                    total += _solid_angle(triangles[t], p)
        result[i] = total / (4.0 * np.pi)
    return result
