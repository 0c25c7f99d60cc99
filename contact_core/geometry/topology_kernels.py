"""Kernels that build a Topology: lengths and apexes, twins, fans of faces round vertices.

Of a large mesh records are written face by face, where queries come (`Halfedges`): most of them are never read.
"""

from __future__ import annotations

import math

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry import elements
from contact_core.geometry.elements import EXCESS
from contact_core.geometry.flat_faces import FLAT
from contact_core.geometry.jit import constant, inlined, inner, kernel, memory_fence
from contact_core.geometry.kernel_arrays import Halfedges

BOUNDARY = constant(elements.BOUNDARY)
BLOCKED = constant(elements.BLOCKED)
UNVISITED = constant(elements.UNVISITED)
INTERIOR_VERTEX = constant(elements.INTERIOR_VERTEX)
BOUNDARY_VERTEX = constant(elements.BOUNDARY_VERTEX)
BLOCKED_VERTEX = constant(elements.BLOCKED_VERTEX)


@inlined
def wide(number: int) -> int:
    """A number of an array of 32 bits in 64, like all integers of kernels."""
    return np.int64(number)  # type: ignore[return-value]


@inlined
def following(h: int) -> int:
    """The next halfedge of the same face."""
    return h + 1 if h % 3 != 2 else h - 2


@inlined
def preceding(h: int) -> int:
    """The previous halfedge of the same face."""
    return h - 1 if h % 3 != 0 else h + 2


@inlined
def corner_shape(a: int, b: int, c: int, points: FloatArray) -> tuple[float, float, float]:
    """Length of the halfedge from a to b of face a, b, c, and the apex x, y in its frame; no length, no apex.

    A length is bitwise the same from both sides of an edge: squares do not see the sign of a difference.
    """
    ex, ey, ez = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    cx, cy, cz = ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx
    return length, (ex * wx + ey * wy + ez * wz) / length, math.sqrt(cx * cx + cy * cy + cz * cz) / length


@kernel
def measure(points: FloatArray, faces: IntArray, shape: FloatArray, keep: bool) -> tuple[int, int]:
    """Length and apex of every halfedge, written into shape (3m, 4) if kept; returns how many have no length, and
    how many lie along a flat face."""
    lengthless, flat = 0, 0
    for f in range(len(faces)):
        for k in range(3):
            length, x, y = corner_shape(faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3], points)
            if keep:
                record = shape[3 * f + k]
                record[0], record[1], record[2] = length, x, y
            if length == 0.0:
                lengthless += 1
            elif y <= FLAT * length:
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
        other = wide(link[h])
        while other >= 0:  # every earlier halfedge of the same edge
            same_way = tail[other] == tail[h] and tail[following(other)] == tail[following(h)]
            opposed = tail[other] == tail[following(h)] and tail[following(other)] == tail[h]
            if same_way or opposed:
                if opposed and twin[other] == BOUNDARY and twin[h] == BOUNDARY:
                    twin[h], twin[other] = other, h
                else:
                    _block(twin, h)
                    _block(twin, other)
            other = wide(link[other])


@inner
def _block(twin: IntArray, h: int) -> None:
    """Block a halfedge and whatever it was joined to."""
    other = wide(twin[h])
    if other >= 0:
        twin[other] = BLOCKED
    twin[h] = BLOCKED


@inlined
def angle_at(h: int, tail: IntArray, points: FloatArray) -> float:
    """The angle of its face at the tail of halfedge h (radians), from the points; bitwise as from its record."""
    _, x, y = corner_shape(tail[h], tail[following(h)], tail[preceding(h)], points)
    return math.atan2(y, x)


@inlined
def onward(h: int, twin: IntArray) -> int:
    """The next halfedge counter-clockwise round the tail of h, whether or not its face is written; or a negative
    twin."""
    other = wide(twin[preceding(h)])
    return other if other >= BLOCKED else UNVISITED - other


@kernel
def order_fans(
    tail: IntArray,
    twin: IntArray,
    shape: FloatArray,
    points: FloatArray,
    degree: IntArray,
    first: IntArray,
    angle_sum: FloatArray,
    kind: IntArray,
    bends: BoolArray,
    keep: bool,
) -> None:
    """Write first, angle_sum, kind, bends (n,) and, if kept, the angles shape[:, 3]; first is -1 and kind UNUSED on
    entry."""
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
            if keep:
                shape[h, 3] = angle
            angle += math.atan2(shape[h, 2], shape[h, 1]) if keep else angle_at(h, tail, points)
            seen += 1
            h = onward(h, twin)
            if h < 0 or h == first[v]:
                break
        angle_sum[v] = angle
        if h == BLOCKED or twin[first[v]] == BLOCKED or seen != degree[v]:
            kind[v], bends[v] = BLOCKED_VERTEX, True
        elif h == BOUNDARY:
            kind[v], bends[v] = BOUNDARY_VERTEX, angle > math.pi + EXCESS
        else:
            kind[v], bends[v] = INTERIOR_VERTEX, angle > 2.0 * math.pi + EXCESS


@kernel
def leave_unvisited(twin: IntArray, angle_sum: FloatArray) -> None:
    """Mark everything as not written yet."""
    for h in range(len(twin)):
        if twin[h] >= 0:
            twin[h] = UNVISITED - twin[h]
    for v in range(len(angle_sum)):
        angle_sum[v] = -angle_sum[v]


@inner
def write_angles(v: int, mesh: Halfedges) -> None:
    """Write the angles of the halfedges that leave v, in the order in which `order_fans` adds them up.

    Not from records of faces: another thread may be in the middle of one.
    """
    h, angle = mesh.first[v], 0.0
    while True:
        mesh.shape[h, 3] = angle
        angle += angle_at(h, mesh.tail, mesh.points)
        h = onward(h, mesh.twin)
        if h < 0 or h == mesh.first[v]:
            break
    memory_fence()
    mesh.angle_sum[v] = abs(mesh.angle_sum[v])


@inner
def write_face(f: int, mesh: Halfedges) -> None:
    """Write the records of face f and the angles round its corners, then let its neighbours see it.

    Threads may write one face at once, for they write the same; the length of its first halfedge is written last,
    so that whoever sees that sees all.
    """
    for h in range(3 * f, 3 * f + 3):
        if mesh.angle_sum[mesh.tail[h]] < 0.0:
            write_angles(mesh.tail[h], mesh)
    for h in range(3 * f + 2, 3 * f - 1, -1):
        length, x, y = corner_shape(mesh.tail[h], mesh.tail[following(h)], mesh.tail[preceding(h)], mesh.points)
        mesh.shape[h, 1], mesh.shape[h, 2] = x, y
        if h == 3 * f:
            memory_fence()
        mesh.shape[h, 0] = length
    memory_fence()
    for h in range(3 * f, 3 * f + 3):
        other = wide(mesh.twin[h])
        if other < BLOCKED:
            other = UNVISITED - other
        if other >= 0:
            mesh.twin[other] = h


@inlined
def visit(f: int, mesh: Halfedges) -> None:
    """Begin in face f: from here on its records can be read, and its corners' `angle_sum`."""
    if mesh.shape[3 * f, 0] == 0.0:
        write_face(f, mesh)
    memory_fence()


@inlined
def first_of(v: int, mesh: Halfedges) -> int:
    """The first halfedge of vertex v, which has one, in a face that can be read."""
    visit(mesh.first[v] // 3, mesh)
    return mesh.first[v]


@inlined
def twin_of(h: int, mesh: Halfedges) -> int:
    """The twin of h, in a face that can be read; or BOUNDARY or BLOCKED."""
    other = wide(mesh.twin[h])
    if other < BLOCKED:
        other = UNVISITED - other
        write_face(other // 3, mesh)
    return other


@kernel
def write_all(mesh: Halfedges) -> None:
    """Write whatever no query has come to yet."""
    mesh = Halfedges(*mesh)
    for f in range(len(mesh.tail) // 3):
        if has_three_corners(mesh.tail, f):
            visit(f, mesh)
