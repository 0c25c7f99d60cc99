"""Kernels that build a Topology: lengths and apexes, twins, fans of faces round vertices."""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry import elements
from contact_core.geometry.flat_faces import FLAT
from contact_core.geometry.jit import constant, inlined, inner, kernel

BOUNDARY = constant(elements.BOUNDARY)
BLOCKED = constant(elements.BLOCKED)
INTERIOR_VERTEX = constant(elements.INTERIOR_VERTEX)
BOUNDARY_VERTEX = constant(elements.BOUNDARY_VERTEX)
BLOCKED_VERTEX = constant(elements.BLOCKED_VERTEX)


@inlined
def following(h: int) -> int:
    """The next halfedge of the same face."""
    return h + 1 if h % 3 != 2 else h - 2


@inlined
def preceding(h: int) -> int:
    """The previous halfedge of the same face."""
    return h - 1 if h % 3 != 0 else h + 2


@kernel
def measure(points: FloatArray, faces: IntArray, shape: FloatArray) -> tuple[int, int]:
    """Write length and apex of every halfedge into shape (3m, 4); returns how many have no length, and how many lie
    along a flat face.

    A length is bitwise the same from both sides of an edge: squares do not see the sign of a difference.
    """
    lengthless, flat = 0, 0
    for f in range(len(faces)):
        for k in range(3):
            a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
            ex, ey, ez = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
            length = math.sqrt(ex * ex + ey * ey + ez * ez)
            record = shape[3 * f + k]
            record[0] = length
            if length == 0.0:
                lengthless += 1
                continue
            cx, cy, cz = ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx
            record[1] = (ex * wx + ey * wy + ez * wz) / length
            record[2] = math.sqrt(cx * cx + cy * cy + cz * cz) / length
            if record[2] <= FLAT * length:
                flat += 1
    return lengthless, flat


@kernel
def merge_lengthless_edges(faces: IntArray, shape: FloatArray, parent: IntArray, tail: IntArray) -> None:
    """Write tail (3m,): corners with ends of length-less edges united (union-find over parent (n,), 0..n-1)."""
    for h in range(3 * len(faces)):
        if shape[h, 0] == 0.0:
            a, b = faces[h // 3, h % 3], faces[h // 3, (h + 1) % 3]
            while parent[a] != a:
                a = parent[a]
            while parent[b] != b:
                b = parent[b]
            parent[max(a, b)] = min(a, b)
    for h in range(3 * len(faces)):
        v = faces[h // 3, h % 3]
        while parent[v] != v:
            v = parent[v]
        tail[h] = v


@inner
def _home(tail: IntArray, degree: IntArray, h: int) -> int:
    """The bucket of a halfedge's edge: the end with fewer halfedges (no bucket grows long), ties by index."""
    a, b = tail[h], tail[following(h)]
    if degree[a] != degree[b]:
        return a if degree[a] < degree[b] else b
    return min(a, b)


@inner
def has_three_corners(tail: IntArray, f: int) -> bool:
    """Whether face f is a triangle, and not a segment or a point."""
    a, b, c = tail[3 * f], tail[3 * f + 1], tail[3 * f + 2]
    return a != b and b != c and c != a


@kernel
def pair_halfedges(tail: IntArray, degree: IntArray, head: IntArray, link: IntArray, twin: IntArray) -> None:
    """Write twin (3m,), all BOUNDARY on entry, and degree (n,): halfedges that leave each vertex.

    Faces without three distinct corners are points or segments: they take no part, so that their neighbours meet.
    head (n,), -1 on entry, and link (3m,) are scratch: lists of halfedges by the home vertex of their edge.
    """
    for h in range(len(tail)):
        if has_three_corners(tail, h // 3):
            degree[tail[h]] += 1
    for h in range(len(tail)):
        if not has_three_corners(tail, h // 3):
            twin[h] = BLOCKED
            continue
        v = _home(tail, degree, h)
        link[h] = head[v]
        head[v] = h
        other = link[h]
        while other >= 0:  # every earlier halfedge of the same edge
            same_way = tail[other] == tail[h] and tail[following(other)] == tail[following(h)]
            opposed = tail[other] == tail[following(h)] and tail[following(other)] == tail[h]
            if same_way or opposed:
                if opposed and twin[other] == BOUNDARY and twin[h] == BOUNDARY:
                    twin[h], twin[other] = other, h
                else:
                    _block(twin, h)
                    _block(twin, other)
            other = link[other]


@inner
def _block(twin: IntArray, h: int) -> None:
    """Block a halfedge and whatever it was joined to."""
    other = twin[h]
    if other >= 0:
        twin[other] = BLOCKED
    twin[h] = BLOCKED


@kernel
def order_fans(
    tail: IntArray,
    twin: IntArray,
    shape: FloatArray,
    degree: IntArray,
    first: IntArray,
    angle_sum: FloatArray,
    kind: IntArray,
) -> None:
    """Write first, angle_sum, kind (n,) and the angles shape[:, 3]; first is -1 and kind UNUSED on entry."""
    for h in range(len(tail)):
        v = tail[h]
        if not has_three_corners(tail, h // 3):
            continue
        if first[v] < 0 or (twin[h] == BOUNDARY and twin[first[v]] != BOUNDARY):
            first[v] = h
    for v in range(len(first)):
        if first[v] < 0:
            continue
        h, angle, seen = first[v], 0.0, 0
        while True:
            shape[h, 3] = angle
            angle += math.atan2(shape[h, 2], shape[h, 1])
            seen += 1
            h = twin[preceding(h)]
            if h < 0 or h == first[v]:
                break
        angle_sum[v] = angle
        if h == BLOCKED or twin[first[v]] == BLOCKED or seen != degree[v]:
            kind[v] = BLOCKED_VERTEX
        elif h == BOUNDARY:
            kind[v] = BOUNDARY_VERTEX
        else:
            kind[v] = INTERIOR_VERTEX
