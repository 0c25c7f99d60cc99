"""Kernels of the locator: an implicit tree of boxes over triangles sorted by medians (see raycast.py)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

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
    """The tree over faces (m, 3) of points (n, 3)."""
    corners = points[faces]  # (m, 3, 3)
    leaves = 1 << max(0, int(np.ceil(np.log2(len(faces) / LEAF_SIZE))))
    leaves = min(leaves, 1 << int(np.log2(len(faces))))  # no leaf may be empty
    starts = np.arange(leaves + 1, dtype=np.int64) * len(faces) // leaves
    order = np.arange(len(faces), dtype=np.int64)
    _sort_by_medians(np.ascontiguousarray(corners.mean(axis=1)), starts, order)
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
def _sort_by_medians(centres, starts, order):  # type: ignore[no-untyped-def]
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
def _select(centres, axis, order, first, last, middle):  # type: ignore[no-untyped-def]
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


# The kernels below allocate nothing and take flat arrays: the callers own results and scratch memory.


def cast(
    tree: Tree, origins: FloatArray, directions: FloatArray, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """First hits of k rays: faces (k,; -1 none), barycentric (k, 3), distance (k,)."""
    faces, barycentric, distance = _blank(len(origins))
    _cast(*tree, origins, directions, limit, np.empty(STACK, np.int64), faces, barycentric, distance)
    return faces, barycentric, distance


def closest(
    tree: Tree, normals: FloatArray, points: FloatArray, facing: FloatArray, facing_limit: float, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Closest points of k queries: faces (-1: none), barycentric (k, 3), distance. facing: (k, 3) or (0, 3)."""
    faces, barycentric, distance = _blank(len(points))
    scratch = np.empty(3), np.empty(STACK, np.int64)
    _closest(*tree, normals, points, facing, facing_limit, limit, *scratch, faces, barycentric, distance)
    return faces, barycentric, distance


def winding(tree: Tree, nodes: Dipoles, points: FloatArray, accuracy: float) -> FloatArray:
    """(k,) generalised winding numbers of points (k, 3)."""
    result = np.zeros(len(points))
    _winding(tree.triangles, tree.starts, *nodes, points, accuracy, np.empty(STACK, np.int64), result)
    return result


def _blank(k: int) -> tuple[IntArray, FloatArray, FloatArray]:
    return np.full(k, -1, np.int64), np.tile([1.0, 0.0, 0.0], (k, 1)), np.full(k, np.inf)


@kernel
def _box_entry(low, high, node, ox, oy, oz, ix, iy, iz):  # type: ignore[no-untyped-def]
    """Where a ray enters a node's box, inf if it misses it: the slab test, kept conservative by rounding out."""
    ax, bx = (low[node, 0] - ox) * ix, (high[node, 0] - ox) * ix
    ay, by = (low[node, 1] - oy) * iy, (high[node, 1] - oy) * iy
    az, bz = (low[node, 2] - oz) * iz, (high[node, 2] - oz) * iz
    near, far = 0.0, np.inf
    # NaN (0 * inf: the origin lies in a slab's plane) compares false and leaves the interval alone.
    if min(ax, bx) > near:
        near = min(ax, bx)
    if max(ax, bx) < far:
        far = max(ax, bx)
    if min(ay, by) > near:
        near = min(ay, by)
    if max(ay, by) < far:
        far = max(ay, by)
    if min(az, bz) > near:
        near = min(az, bz)
    if max(az, bz) < far:
        far = max(az, bz)
    return near if near <= far * (1.0 + 4e-16) else np.inf


@kernel
def _cast(order, triangles, low, high, starts, origins, directions, limit, stack, faces, barycentric, distances):  # type: ignore[no-untyped-def]
    """First hits of rays into faces, barycentric, distances."""
    leaves = len(starts) - 1
    for i in range(len(origins)):
        kz = 0
        for axis in range(1, 3):
            if abs(directions[i, axis]) > abs(directions[i, kz]):
                kz = axis
        kx = (kz + 1) % 3
        ky = (kz + 2) % 3
        sx = directions[i, kx] / directions[i, kz]
        sy = directions[i, ky] / directions[i, kz]
        sz = 1.0 / directions[i, kz]
        ox, oy, oz = origins[i, 0], origins[i, 1], origins[i, 2]
        ix = 1.0 / directions[i, 0] if directions[i, 0] != 0.0 else np.inf
        iy = 1.0 / directions[i, 1] if directions[i, 1] != 0.0 else np.inf
        iz = 1.0 / directions[i, 2] if directions[i, 2] != 0.0 else np.inf
        best = limit
        found = -1
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _box_entry(low, high, node, ox, oy, oz, ix, iy, iz) > best:
                continue
            if node < leaves - 1:
                left = _box_entry(low, high, 2 * node + 1, ox, oy, oz, ix, iy, iz)
                right = _box_entry(low, high, 2 * node + 2, ox, oy, oz, ix, iy, iz)
                near_child = 2 * node + 1 if left <= right else 2 * node + 2
                if max(left, right) <= best and max(left, right) < np.inf:
                    top += 1
                    stack[top] = 4 * node + 3 - near_child
                if min(left, right) <= best and min(left, right) < np.inf:
                    top += 1
                    stack[top] = near_child
                continue
            for t in range(starts[node - leaves + 1], starts[node - leaves + 2]):
                az = triangles[t, kz] - origins[i, kz]
                bz = triangles[t, 3 + kz] - origins[i, kz]
                cz = triangles[t, 6 + kz] - origins[i, kz]
                ax = triangles[t, kx] - origins[i, kx] - sx * az
                ay = triangles[t, ky] - origins[i, ky] - sy * az
                bx = triangles[t, 3 + kx] - origins[i, kx] - sx * bz
                by = triangles[t, 3 + ky] - origins[i, ky] - sy * bz
                cx = triangles[t, 6 + kx] - origins[i, kx] - sx * cz
                cy = triangles[t, 6 + ky] - origins[i, ky] - sy * cz
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
                barycentric[i, 0] = u / total
                barycentric[i, 1] = v / total
                barycentric[i, 2] = w / total
        if found >= 0:
            faces[i] = order[found]
            distances[i] = best


@kernel
def _box_distance(low, high, node, x, y, z):  # type: ignore[no-untyped-def]
    """Squared distance of a point to a node's box."""
    dx = max(low[node, 0] - x, x - high[node, 0], 0.0)
    dy = max(low[node, 1] - y, y - high[node, 1], 0.0)
    dz = max(low[node, 2] - z, z - high[node, 2], 0.0)
    return dx * dx + dy * dy + dz * dz


@kernel
def _closest_on_triangle(triangles, t, x, y, z, out):  # type: ignore[no-untyped-def]
    """Barycentric coordinates of the closest point of triangle t to (x, y, z) into out; its squared distance."""
    abx, aby, abz = (
        triangles[t, 3] - triangles[t, 0],
        triangles[t, 4] - triangles[t, 1],
        triangles[t, 5] - triangles[t, 2],
    )
    acx, acy, acz = (
        triangles[t, 6] - triangles[t, 0],
        triangles[t, 7] - triangles[t, 1],
        triangles[t, 8] - triangles[t, 2],
    )
    apx, apy, apz = x - triangles[t, 0], y - triangles[t, 1], z - triangles[t, 2]
    bpx, bpy, bpz = x - triangles[t, 3], y - triangles[t, 4], z - triangles[t, 5]
    cpx, cpy, cpz = x - triangles[t, 6], y - triangles[t, 7], z - triangles[t, 8]
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
def _closest(  # type: ignore[no-untyped-def]
    order,
    triangles,
    low,
    high,
    starts,
    normals,
    points,
    facing,
    facing_limit,
    limit,
    out,
    stack,
    faces,
    barycentric,
    distance,
):
    """Closest points of queries into faces, barycentric, distance."""
    leaves = len(starts) - 1
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best = limit * limit
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _box_distance(low, high, node, x, y, z) > best:
                continue
            if node < leaves - 1:
                left = _box_distance(low, high, 2 * node + 1, x, y, z)
                right = _box_distance(low, high, 2 * node + 2, x, y, z)
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
                if len(facing):
                    cosine = (
                        normals[f, 0] * facing[i, 0] + normals[f, 1] * facing[i, 1] + normals[f, 2] * facing[i, 2]
                    )
                    if cosine > facing_limit:
                        continue
                squared = _closest_on_triangle(triangles, t, x, y, z, out)
                if squared > best or (squared == best and faces[i] >= 0 and f > faces[i]):
                    continue
                best = squared
                faces[i] = f
                barycentric[i, 0] = out[0]
                barycentric[i, 1] = out[1]
                barycentric[i, 2] = out[2]
                distance[i] = np.sqrt(squared)


@kernel
def _solid_angle(triangles, t, x, y, z):  # type: ignore[no-untyped-def]
    """Signed solid angle of triangle t seen from (x, y, z) (van Oosterom and Strackee 1983)."""
    ax, ay, az = triangles[t, 0] - x, triangles[t, 1] - y, triangles[t, 2] - z
    bx, by, bz = triangles[t, 3] - x, triangles[t, 4] - y, triangles[t, 5] - z
    cx, cy, cz = triangles[t, 6] - x, triangles[t, 7] - y, triangles[t, 8] - z
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    det = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
    ab = ax * bx + ay * by + az * bz
    bc = bx * cx + by * cy + bz * cz
    ca = cx * ax + cy * ay + cz * az
    return 2.0 * np.arctan2(det, a * b * c + ab * c + bc * a + ca * b)


@kernel
def _winding(triangles, starts, area, centre, radius, points, accuracy, stack, result):  # type: ignore[no-untyped-def]
    """Generalised winding numbers of points into result."""
    leaves = len(starts) - 1
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        total = 0.0
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            dx, dy, dz = centre[node, 0] - x, centre[node, 1] - y, centre[node, 2] - z
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
                    total += _solid_angle(triangles, t, x, y, z)
        result[i] = total / (4.0 * np.pi)
