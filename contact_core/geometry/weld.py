"""Welding: points at one position become one point, with the map from the old points to the new.

Files split vertices along texture and normal seams; geodesics need the surface that the eye sees.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput

RELATIVE_TOLERANCE = 1e-6  # of the bounding box diagonal: above float32 rounding, far below any real edge
_STEP, _LEVELS = 8.0, 8


def weld(points: Any, tolerance: float | None = None) -> tuple[FloatArray, IntArray]:
    """Merge points closer than `tolerance` (surface units; None: 1e-6 of the bounding box diagonal).

    points: (n, 3). Returns the kept points (k, 3), bit-equal to the first of each group and in the order of
    first appearance, and map (n,) with `kept[map[i]]` the point that i became. Closeness chains: a row of points,
    each within tolerance of the next, becomes one. Tolerance 0 merges equal positions only. Raises InvalidInput.
    """
    positions = frozen(points, np.float64, (None, 3), "points")
    if tolerance is None:
        tolerance = RELATIVE_TOLERANCE * float(np.linalg.norm(np.ptp(positions, axis=0))) if len(positions) else 0.0
    if not tolerance >= 0.0:
        raise InvalidInput(f"the weld tolerance must be zero or positive, but {tolerance} came.")
    if tolerance == 0.0 and _all_apart(positions):
        return positions, np.arange(len(positions))
    first, group = _equal_rows(positions)
    if tolerance > 0.0 and len(first) > 1:
        first, group = _join_close(positions, first, group, tolerance)
    return positions[first], group


def close_points(points: FloatArray, reach: FloatArray) -> IntArray:
    """(n,) group of each point: two points join within the smaller reach of both, equal ones always, and
    chains of such.

    points: (n, 3). reach: (n,) surface units. Groups are numbered by first appearance.
    """
    if _all_apart(points) and not reach.any():
        return np.arange(len(points))
    first, group = _equal_rows(points)
    shortest = np.full(len(first), np.inf)
    np.minimum.at(shortest, group, reach)
    pairs = _pairs_within(points[first], shortest)
    if not len(pairs):
        return group
    return _joined(len(points), first, group, pairs)[1]


def _pairs_within(points: FloatArray, reach: FloatArray) -> IntArray:
    """(p, 2) rows within the smaller reach of both. Rows of like reach are searched together, so that a large reach
    far away costs nothing where points are dense."""
    from scipy.spatial import cKDTree

    largest = float(reach.max(initial=0.0))
    found = [np.zeros((0, 2), np.int64)]
    for level in range(_LEVELS):
        until = largest / _STEP**level
        rows = np.flatnonzero(reach > until / _STEP) if until > 0.0 else np.zeros(0, np.int64)
        if len(rows) > 1:
            pairs = rows[cKDTree(points[rows]).query_pairs(until, output_type="ndarray")]
            gap = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
            found.append(pairs[gap <= reach[pairs].min(axis=1)])
    return np.concatenate(found)


def _all_apart(positions: FloatArray) -> bool:
    """Whether surely no two positions are equal: a hash of each, sorted, is far cheaper than sorting rows."""
    bits = (positions + 0.0).view(np.uint64)  # (n, 3); -0.0 and 0.0 are one position
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * odd  # wraps around, as hashes do
    ordered = np.sort(mixed[:, 0] ^ (mixed[:, 1] << np.uint64(1)) ^ (mixed[:, 2] << np.uint64(2)))
    return not (ordered[1:] == ordered[:-1]).any()


def _equal_rows(positions: FloatArray) -> tuple[IntArray, IntArray]:
    """Row of the first of each group of equal positions, ascending, and the group of each row."""
    exact = positions + 0.0  # -0.0 and 0.0 are one position
    order = np.lexsort(exact.T)  # stable: equal rows keep their order
    fresh = np.ones(len(exact), bool)
    fresh[1:] = (exact[order[1:]] != exact[order[:-1]]).any(axis=1)
    group = np.empty(len(exact), np.int64)
    group[order] = np.cumsum(fresh) - 1
    return _by_first_appearance(order[fresh], group)


def _join_close(
    positions: FloatArray, first: IntArray, group: IntArray, tolerance: float
) -> tuple[IntArray, IntArray]:
    """The same, after joining groups whose positions are within tolerance of one another."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(positions[first]).query_pairs(tolerance, output_type="ndarray")  # (p, 2)
    return _joined(len(positions), first, group, pairs) if len(pairs) else (first, group)


def _joined(total: int, first: IntArray, group: IntArray, pairs: IntArray) -> tuple[IntArray, IntArray]:
    """First rows and groups after the groups of each of the pairs (p, 2) became one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    count, label = connected_components(graph, directed=False)
    earliest = np.full(count, total, np.int64)
    np.minimum.at(earliest, label, first)
    return _by_first_appearance(earliest, label[group].astype(np.int64))


def _by_first_appearance(first: IntArray, group: IntArray) -> tuple[IntArray, IntArray]:
    """Renumber groups so that their first rows ascend."""
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[group]
