"""Polygons to triangles by ear clipping, with the index of the polygon that each triangle came from.

A fan is wrong on concave polygons (it covered 14.0 of a pentagon of area 10.0), so every reader and every
adapter triangulates here. Quads take a vectorised path; larger polygons are clipped one by one, best ear
first (Meisters 1975; the choice of the ear with the largest smallest angle keeps slivers away).
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput


def triangulate(face_sizes: Any, face_indices: Any, points: Any) -> tuple[IntArray, IntArray, tuple[str, ...]]:
    """Triangles of a polygon mesh, in the order of its faces and with their winding.

    face_sizes: (f,) corners per polygon. face_indices: (sum of sizes,) point indices, polygon after polygon.
    points: (n, 3). Returns triangles (m, 3), source_face (m,) the polygon of each triangle, and notes:
    sentences on polygons that were dropped (fewer than 3 different corners) or have no ears (self-crossing).
    Triangles without area are kept where their three indices differ: dropping them would open a crack.
    Raises InvalidInput on sizes that do not fit and indices out of range.
    """
    sizes = frozen(face_sizes, np.int64, (None,), "face_sizes")
    corners = frozen(face_indices, np.int64, (None,), "face_indices")
    positions = frozen(points, np.float64, (None, 3), "points")
    check_polygons(sizes, corners, len(positions))
    if (sizes == 3).all():
        return _only_triangles(corners.reshape(-1, 3))
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if len(sizes) else np.zeros(0, np.int64)

    triangles = [corners[starts[sizes == 3][:, None] + np.arange(3)]]  # (t, 3)
    sources = [np.flatnonzero(sizes == 3)]
    quads = np.flatnonzero(sizes == 4)
    quad_corners = corners[starts[quads][:, None] + np.arange(4)]  # (q, 4)
    simple = _all_different(quad_corners)
    triangles.append(_split_quads(quad_corners[simple], positions))
    sources.append(np.repeat(quads[simple], 2))

    earless = 0
    for face in np.concatenate([quads[~simple], np.flatnonzero(sizes > 4)]):
        polygon = corners[starts[face] : starts[face] + sizes[face]]
        polygon = polygon[polygon != np.roll(polygon, -1)]  # a corner repeated in a row is one corner
        if len(polygon) >= 3:
            clipped, complete = clip_ears(polygon, positions[polygon])
            earless += not complete
            triangles.append(clipped)
            sources.append(np.full(len(clipped), face))

    joined, source = np.concatenate(triangles), np.concatenate(sources)
    real = _all_different(joined)
    joined, source = joined[real], source[real]
    order = np.argsort(source, kind="stable")
    notes = _notes(int((np.bincount(source, minlength=len(sizes)) == 0).sum()), earless)
    return joined[order].astype(np.int64), source[order].astype(np.int64), notes


def _only_triangles(triangles: IntArray) -> tuple[IntArray, IntArray, tuple[str, ...]]:
    """The shortcut for what is a triangle mesh already: (m, 3) triangles with three corners are kept."""
    real = _all_different(triangles)
    if real.all():
        return triangles.copy(), np.arange(len(triangles)), ()
    return triangles[real], np.flatnonzero(real), _notes(int((~real).sum()), 0)


def clip_ears(polygon: IntArray, corners: FloatArray) -> tuple[IntArray, bool]:
    """Triangles (k - 2, 3) of one polygon, and whether every cut was a true ear.

    polygon: (k,) indices that the triangles are made of. corners: (k, 3) their positions, nearly in a plane.
    """
    from contact_core.geometry.clip_kernels import clip

    flat = _in_its_plane(corners)  # (k, 2), counter-clockwise
    count = len(polygon)
    before, after = np.roll(np.arange(count), 1), np.roll(np.arange(count), -1)
    cut = np.empty((count - 2, 3), np.int64)
    level = 1e-12 * float(np.abs(flat).max(initial=0.0)) ** 2
    complete = clip(flat, before, after, np.ones(count, np.int64), np.empty(count), np.empty(count), level, cut)
    return polygon[cut], bool(complete)


def _split_quads(quads: IntArray, points: FloatArray) -> IntArray:
    """(2q, 3): each quad cut along the diagonal that keeps both halves turned alike, else the shorter one."""
    x, y, z = (points[:, k][quads.T] for k in range(3))  # each (4, q): columns are several times as fast as rows

    def area(a: int, b: int, c: int, d: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The cross product of a -> b and c -> d, each component (q,)."""
        ux, uy, uz = x[b] - x[a], y[b] - y[a], z[b] - z[a]
        vx, vy, vz = x[d] - x[c], y[d] - y[c], z[d] - z[c]
        return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx

    nx, ny, nz = area(0, 2, 1, 3)  # twice the vector area

    def worst_half(first: int) -> FloatArray:
        """(q,) the smaller signed area of the two halves on the diagonal from corner `first`."""
        a, b, c, d = ((first + k) % 4 for k in range(4))
        halves = (area(a, b, a, c), area(a, c, a, d))
        one, two = (hx * nx + hy * ny + hz * nz for hx, hy, hz in halves)
        return np.asarray(np.minimum(one, two))

    def squared_diagonal(a: int, b: int) -> FloatArray:
        return np.asarray((x[b] - x[a]) ** 2 + (y[b] - y[a]) ** 2 + (z[b] - z[a]) ** 2)

    straight, other = worst_half(0), worst_half(1)
    first_is_shorter = squared_diagonal(0, 2) <= squared_diagonal(1, 3)
    both = (straight > 0) & (other > 0)
    first = np.where(both, first_is_shorter, straight >= other)
    cut = np.where(first[:, None], [[0, 1, 2, 0, 2, 3]], [[1, 2, 3, 1, 3, 0]])  # (q, 6)
    return np.take_along_axis(quads, cut, axis=1).reshape(-1, 3)


def _in_its_plane(corners: FloatArray) -> FloatArray:
    """(k, 2) coordinates in the polygon's mean plane, counter-clockwise (Newell's normal)."""
    centred = corners - corners.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    if not normal.any():
        normal = np.array([0.0, 0.0, 1.0])
    x = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    y = np.cross(normal, x)
    return np.stack([centred @ (x / np.linalg.norm(x)), centred @ (y / np.linalg.norm(y))], axis=1)


def _all_different(corners: IntArray) -> BoolArray:
    """(q,) whether no index repeats within a row."""
    columns = corners.T.copy()
    different = np.ones(len(corners), bool)
    for one, other in itertools.combinations(columns, 2):
        different &= one != other
    return different


def check_polygons(sizes: IntArray, corners: IntArray, count: int) -> None:
    """Raises InvalidInput on sizes (f,) that do not fit the corners, and corners beyond `count` points."""
    if len(sizes) and sizes.min() < 0:
        raise InvalidInput(f"face sizes must not be negative, but face {int(sizes.argmin())} has {sizes.min()}.")
    if int(sizes.sum()) != len(corners):
        raise InvalidInput(f"face sizes add up to {int(sizes.sum())} corners, but got {len(corners)} indices.")
    if len(corners) and not (corners.min() >= 0 and corners.max() < count):
        bad = int(np.argmax((corners < 0) | (corners >= count)))
        raise InvalidInput(f"face indices must be in 0..{count - 1}, but corner {bad} is {int(corners[bad])}.")


def _notes(dropped: int, earless: int) -> tuple[str, ...]:
    notes = []
    if dropped:
        notes.append(f"{dropped} faces with fewer than 3 different corners were dropped.")
    if earless:
        notes.append(f"{earless} polygons cross themselves; their triangles may overlap.")
    return tuple(notes)
