"""Kernels of the locator: rays, closest points and winding numbers over a tree of boxes (see raycast.py).

The kernels allocate nothing and take flat arrays: the three functions at the top own results and scratch.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, Int32Array, IntArray, SingleArray
from contact_core.geometry.box_tree import Dipoles, Tree, corners_of, run_of
from contact_core.geometry.jit import inner, kernel

STACK = 128  # the tree is balanced: its depth is log2 of the leaf count, and a stack holds one sibling a level


def cast(
    tree: Tree, origins: FloatArray, directions: FloatArray, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """First hits of k rays: faces (k,; -1 none), barycentric (k, 3), distance (k,)."""
    faces, barycentric, distance = _blank(len(origins))
    _cast(*tree, origins, directions, limit, np.empty(STACK, np.int64), faces, barycentric, distance)
    return faces, barycentric, distance


def closest(
    tree: Tree, points: FloatArray, facing: FloatArray, facing_limit: float, limit: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Closest points of k queries: faces (-1: none), barycentric (k, 3), distance. facing: (k, 3) or (0, 3)."""
    faces, barycentric, distance = _blank(len(points))
    stack = np.empty(STACK, np.int64)
    _closest(*tree, points, facing, facing_limit, limit, np.empty(3), stack, faces, barycentric, distance)
    return faces, barycentric, distance


def winding(tree: Tree, nodes: Dipoles, points: FloatArray, accuracy: float) -> FloatArray:
    """(k,) generalised winding numbers of points (k, 3)."""
    result = np.zeros(len(points))
    _winding(
        tree.points,
        tree.faces,
        tree.order,
        tree.levels,
        *nodes,
        points,
        accuracy,
        np.empty(STACK, np.int64),
        result,
    )
    return result


def _blank(k: int) -> tuple[IntArray, FloatArray, FloatArray]:
    return np.full(k, -1, np.int64), np.tile([1.0, 0.0, 0.0], (k, 1)), np.full(k, np.inf)


@inner
def _in_frame(frame: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A point in the frame that boxes are in."""
    return (x - frame[0]) * frame[3], (y - frame[1]) * frame[3], (z - frame[2]) * frame[3]


@inner
def _box_entry(
    boxes: SingleArray, node: int, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float
) -> float:
    """Where a ray enters a node's box, inf if it misses it: the slab test, kept conservative by rounding out."""
    ax, bx = (boxes[node, 0] - ox) * ix, (boxes[node, 3] - ox) * ix
    ay, by = (boxes[node, 1] - oy) * iy, (boxes[node, 4] - oy) * iy
    az, bz = (boxes[node, 2] - oz) * iz, (boxes[node, 5] - oz) * iz
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
def _cast(
    mesh_points: FloatArray,
    mesh_faces: IntArray,
    order: Int32Array,
    boxes: SingleArray,
    frame: FloatArray,
    levels: int,
    origins: FloatArray,
    directions: FloatArray,
    limit: float,
    stack: IntArray,
    faces: IntArray,
    barycentric: FloatArray,
    distances: FloatArray,
) -> None:
    """First hits of rays into faces, barycentric, distances."""
    leaves = 1 << levels
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
        ox, oy, oz = _in_frame(frame, origins[i, 0], origins[i, 1], origins[i, 2])
        ix = 1.0 / (directions[i, 0] * frame[3]) if directions[i, 0] != 0.0 else np.inf
        iy = 1.0 / (directions[i, 1] * frame[3]) if directions[i, 1] != 0.0 else np.inf
        iz = 1.0 / (directions[i, 2] * frame[3]) if directions[i, 2] != 0.0 else np.inf
        best = limit
        found = -1
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _box_entry(boxes, node, ox, oy, oz, ix, iy, iz) > best:
                continue
            if node < leaves - 1:
                left = _box_entry(boxes, 2 * node + 1, ox, oy, oz, ix, iy, iz)
                right = _box_entry(boxes, 2 * node + 2, ox, oy, oz, ix, iy, iz)
                near_child = 2 * node + 1 if left <= right else 2 * node + 2
                if max(left, right) <= best and max(left, right) < np.inf:
                    top += 1
                    stack[top] = 4 * node + 3 - near_child
                if min(left, right) <= best and min(left, right) < np.inf:
                    top += 1
                    stack[top] = near_child
                continue
            first, last = run_of(node - leaves + 1, order, levels)
            for t in range(first, last):
                f = order[t]
                a, b, c = corners_of(mesh_points, mesh_faces, f)
                az = a[kz] - origins[i, kz]
                bz = b[kz] - origins[i, kz]
                cz = c[kz] - origins[i, kz]
                ax = a[kx] - origins[i, kx] - sx * az
                ay = a[ky] - origins[i, ky] - sy * az
                bx = b[kx] - origins[i, kx] - sx * bz
                by = b[ky] - origins[i, ky] - sy * bz
                cx = c[kx] - origins[i, kx] - sx * cz
                cy = c[ky] - origins[i, ky] - sy * cz
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
                if distance == best and found >= 0 and f > found:
                    continue
                best = distance
                found = f
                barycentric[i, 0] = u / total
                barycentric[i, 1] = v / total
                barycentric[i, 2] = w / total
        if found >= 0:
            faces[i] = found
            distances[i] = best


@inner
def _box_distance(boxes: SingleArray, node: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point to a node's box."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@inner
def _closest_on_triangle(
    a: FloatArray, b: FloatArray, c: FloatArray, x: float, y: float, z: float, out: FloatArray
) -> float:
    """Barycentric coordinates of the closest point of triangle abc to (x, y, z) into out; its squared distance."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = x - a[0], y - a[1], z - a[2]
    bpx, bpy, bpz = x - b[0], y - b[1], z - b[2]
    cpx, cpy, cpz = x - c[0], y - c[1], z - c[2]
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
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 > d3:  # else corners a and b are one
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
def _closest(
    mesh_points: FloatArray,
    mesh_faces: IntArray,
    order: Int32Array,
    boxes: SingleArray,
    frame: FloatArray,
    levels: int,
    points: FloatArray,
    facing: FloatArray,
    facing_limit: float,
    limit: float,
    out: FloatArray,
    stack: IntArray,
    faces: IntArray,
    barycentric: FloatArray,
    distance: FloatArray,
) -> None:
    """Closest points of queries into faces, barycentric, distance."""
    leaves = 1 << levels
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        qx, qy, qz = _in_frame(frame, x, y, z)
        best = limit * limit
        near = best * frame[3] * frame[3]  # in the frame
        top = 0
        stack[0] = 0
        while top >= 0:
            node = stack[top]
            top -= 1
            if _box_distance(boxes, node, qx, qy, qz) > near:
                continue
            if node < leaves - 1:
                left = _box_distance(boxes, 2 * node + 1, qx, qy, qz)
                right = _box_distance(boxes, 2 * node + 2, qx, qy, qz)
                near_child = 2 * node + 1 if left <= right else 2 * node + 2
                if max(left, right) <= near:
                    top += 1
                    stack[top] = 4 * node + 3 - near_child
                if min(left, right) <= near:
                    top += 1
                    stack[top] = near_child
                continue
            first, last = run_of(node - leaves + 1, order, levels)
            for t in range(first, last):
                f = order[t]
                a, b, c = corners_of(mesh_points, mesh_faces, f)
                if len(facing) and _looks_away(a, b, c, facing[i, 0], facing[i, 1], facing[i, 2], facing_limit):
                    continue
                squared = _closest_on_triangle(a, b, c, x, y, z, out)
                if squared > best or (squared == best and faces[i] >= 0 and f > faces[i]):
                    continue
                best = squared
                near = best * frame[3] * frame[3]
                faces[i] = f
                barycentric[i, 0] = out[0]
                barycentric[i, 1] = out[1]
                barycentric[i, 2] = out[2]
                distance[i] = np.sqrt(squared)


@inner
def _looks_away(a: FloatArray, b: FloatArray, c: FloatArray, x: float, y: float, z: float, limit: float) -> bool:
    """Whether the normal of triangle abc (0: no area) and a unit vector (x, y, z) have a cosine above a limit."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    return nx * x + ny * y + nz * z > limit * length if length > 0.0 else limit < 0.0


@inner
def _solid_angle(p: FloatArray, q: FloatArray, r: FloatArray, x: float, y: float, z: float) -> float:
    """Signed solid angle of triangle pqr seen from (x, y, z) (van Oosterom and Strackee 1983)."""
    ax, ay, az = p[0] - x, p[1] - y, p[2] - z
    bx, by, bz = q[0] - x, q[1] - y, q[2] - z
    cx, cy, cz = r[0] - x, r[1] - y, r[2] - z
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    det = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
    ab = ax * bx + ay * by + az * bz
    bc = bx * cx + by * cy + bz * cz
    ca = cx * ax + cy * ay + cz * az
    return 2.0 * np.arctan2(det, a * b * c + ab * c + bc * a + ca * b)


@kernel
def _winding(
    mesh_points: FloatArray,
    mesh_faces: IntArray,
    order: Int32Array,
    levels: int,
    area: FloatArray,
    centre: FloatArray,
    radius: FloatArray,
    points: FloatArray,
    accuracy: float,
    stack: IntArray,
    result: FloatArray,
) -> None:
    """Generalised winding numbers of points into result."""
    leaves = 1 << levels
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
                first, last = run_of(node - leaves + 1, order, levels)
                for t in range(first, last):
                    f = order[t]
                    p, q, r = corners_of(mesh_points, mesh_faces, f)
                    total += _solid_angle(p, q, r, x, y, z)
        result[i] = total / (4.0 * np.pi)
