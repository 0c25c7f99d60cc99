"""Kernels over the sides of polygons of any number of corners: the edge of each, vector areas, volumes, corners."""

from __future__ import annotations

import math

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import kernel

_ODD = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F)
_ONE, _SHIFT = np.uint64(1), np.uint64(29)


@kernel
def walk_round(sizes: IntArray, indices: IntArray, face: IntArray, head: IntArray) -> None:
    """Write the polygon of each side (h,), and the point that it runs to.

    sizes: (f,) corners per polygon. indices: (h,) their points, polygon after polygon.
    """
    h = np.int64(0)
    for f in range(len(sizes)):
        first = h
        for _ in range(sizes[f]):
            face[h] = f
            if h > first:
                head[h - 1] = indices[h]
            h += 1
        if h > first:
            head[h - 1] = indices[first]


@kernel
def ends_of_edges(edge: IntArray, first: IntArray, last: IntArray) -> None:
    """Write the first and the last side (edges,) at each edge; first: -1 on entry. edge: (h,) of each side."""
    for h in range(len(edge)):
        e = edge[h]
        if first[e] < 0:
            first[e] = h
        last[e] = h


@kernel
def number_edges(
    tail: IntArray,
    head: IntArray,
    degree: IntArray,
    first: IntArray,
    link: IntArray,
    far: IntArray,
    edge: IntArray,
    count: IntArray,
) -> int:
    """Write edge (h,): the number of each side's edge, by first appearance; and count: the sides of each; returns
    how many edges there are.

    degree (n,), 0, and first (n,), -1 on entry, with link, far and count (h,) hold a list of edges for each point.
    An edge is in the list of its end with fewer sides, so that no list grows long.
    """
    for h in range(len(tail)):
        degree[tail[h]] += 1
        degree[head[h]] += 1
    edges = 0
    for h in range(len(tail)):
        a, b = tail[h], head[h]
        if degree[b] < degree[a] or (degree[b] == degree[a] and b < a):
            a, b = b, a
        e = first[a]
        while e >= 0 and far[e] != b:
            e = link[e]
        if e < 0:
            e = edges
            edges += 1
            far[e], link[e], count[e] = b, first[a], 0
            first[a] = e
        edge[h] = e
        count[e] += 1
    return edges


@kernel
def number_pieces(a: IntArray, b: IntArray, piece: IntArray) -> int:
    """Write piece (f,), on entry (0, 1, 2 ...): the connected piece of each face, numbered by first faces, where
    faces a and b (m,) are neighbours; returns how many there are. Union-find with halved paths (Tarjan)."""
    for i in range(len(a)):
        x, y = a[i], b[i]
        while piece[x] != x:
            piece[x] = piece[piece[x]]
            x = piece[x]
        while piece[y] != y:
            piece[y] = piece[piece[y]]
            y = piece[y]
        if x < y:  # the least face of a piece is its root
            piece[y] = x
        else:
            piece[x] = y
    pieces = 0
    for f in range(len(piece)):  # a root comes before all others of its piece
        if piece[f] == f:
            piece[f] = -1 - pieces
            pieces += 1
        else:
            piece[f] = piece[piece[f]]
    for f in range(len(piece)):
        piece[f] = -1 - piece[f]
    return pieces


@kernel
def vector_areas(points: FloatArray, face: IntArray, tail: IntArray, head: IntArray, area: FloatArray) -> None:
    """Write area (f, 3): twice the vector area of each polygon (Newell). Sides come face after face."""
    before = np.int64(-1)
    corner = np.int64(0)
    for h in range(len(face)):
        f = face[h]
        if f != before:
            before, corner = f, tail[h]
            for k in range(3):
                area[f, k] = 0.0
        o, p, q = points[corner], points[tail[h]], points[head[h]]
        ax, ay, az = p[0] - o[0], p[1] - o[1], p[2] - o[2]
        bx, by, bz = q[0] - o[0], q[1] - o[1], q[2] - o[2]
        area[f, 0] += ay * bz - az * by
        area[f, 1] += az * bx - ax * bz
        area[f, 2] += ax * by - ay * bx


@kernel
def volumes_of_pieces(
    points: FloatArray,
    face: IntArray,
    tail: IntArray,
    normal: FloatArray,
    piece: IntArray,
    weight: FloatArray,
    centre: FloatArray,
    volume: FloatArray,
    area: FloatArray,
) -> None:
    """Write of each piece its centre (pieces, 3), the mean of its corners; six times the signed volume of the cones
    from there to its faces; and twice its area. All of them, and weight (pieces,), are 0 on entry.

    normal: (f, 3) twice the vector area of each face. piece: (f,). Sides come face after face.
    """
    for h in range(len(face)):
        p = piece[face[h]]
        weight[p] += 1.0
        for k in range(3):
            centre[p, k] += points[tail[h], k]
    for p in range(len(weight)):
        for k in range(3):
            centre[p, k] /= max(weight[p], 1.0)
    before = np.int64(-1)
    for h in range(len(face)):
        f = face[h]
        if f != before:
            before = f
            p, q, n = piece[f], points[tail[h]], normal[f]
            cone = (q[0] - centre[p, 0]) * n[0] + (q[1] - centre[p, 1]) * n[1] + (q[2] - centre[p, 2]) * n[2]
            volume[p] += cone
            area[p] += math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])


@kernel
def corners_of_faces(sizes: IntArray, place: IntArray, seen: IntArray, corners: IntArray, mixed: IntArray) -> None:
    """Write corners (f,): in how many different places the corners of each face lie; and mixed (f,): a number that
    faces of the same corners share, in whatever order these come. seen (places,): -1 on entry."""
    at = 0
    for f in range(len(sizes)):
        different, total = 0, np.uint64(0)
        for _ in range(sizes[f]):
            p = place[at]
            at += 1
            if seen[p] != f:
                seen[p] = f
                different += 1
            scrambled = (np.uint64(p) + _ONE) * _ODD[0]
            total += (scrambled ^ (scrambled >> _SHIFT)) * _ODD[1]
        corners[f], mixed[f] = different, np.int64(total)
