"""Which points lie at one place: the copies that files make along texture and normal seams.

Close by distance, not by rounding to a grid: a grid line between two copies tears a seam open.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray

_STEP, _LEVELS = 8.0, 8  # reaches of one level differ by less than the step


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
    return _joined(len(points), first, group, pairs)


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


def _joined(total: int, first: IntArray, group: IntArray, pairs: IntArray) -> IntArray:
    """The group of each row after the groups of each of the pairs (p, 2) became one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    count, label = connected_components(graph, directed=False)
    earliest = np.full(count, total, np.int64)
    np.minimum.at(earliest, label, first)
    return _by_first_appearance(earliest, label[group].astype(np.int64))[1]


def _by_first_appearance(first: IntArray, group: IntArray) -> tuple[IntArray, IntArray]:
    """Renumber groups so that their first rows ascend."""
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[group]
