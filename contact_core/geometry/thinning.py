"""Points in space compared with their neighbours by cells of a grid, in linear time: thinning (the greedy choice of
a maximal Poisson-disk sample), and points that meet though they are apart elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput

_FINEST = 2.0**-40  # of the extent: cells stay small integers, and rounding stays below the margin of a cell


def first_of_each(points: Any, apart: float) -> IntArray:
    """Indices of points (n, 3), in order, that are farther than `apart` from every earlier one that stayed.

    apart: surface units, 0 or more; at 0 points in one place come once. Raises InvalidInput.
    """
    from contact_core.geometry.thinning_kernels import keep_first

    at = frozen(points, np.float64, (None, 3), "points")
    if not apart >= 0.0:
        raise InvalidInput(f"the distance between points must be 0 or more, but got {apart}.")
    if not len(at):
        return np.zeros(0, np.int64)
    kept = np.zeros(len(at), bool)
    keep_first(at, _cells(at, apart), float(apart), *_chains(len(at)), kept)
    return np.flatnonzero(kept)


def meeting(points: FloatArray, others: FloatArray, near: float, apart: float) -> BoolArray:
    """(n,) which of points (n, 3) have one within `near` whose row of others (n, 3) is farther than `apart` from
    theirs."""
    from contact_core.geometry.thinning_kernels import find_meeting

    meets = np.zeros(len(points), bool)
    if len(points):
        find_meeting(points, others, _cells(points, near), near, apart, *_chains(len(points)), meets)
    return meets


def spacing_of(points: FloatArray, sampled: int) -> float:
    """The median distance of points (n, 3), n >= 2, from their nearest one, measured at `sampled` or more."""
    from contact_core.geometry.thinning_kernels import find_nearest

    every = max(1, len(points) // sampled)
    distances = np.empty(len(range(0, len(points), every)))
    find_nearest(points, every, distances)
    return float(np.median(distances))


def _cells(points: FloatArray, apart: float) -> IntArray:
    """(n, 3) the cells of points, n >= 1, such that those within `apart` of one another are neighbours."""
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max())
    size = max(1.001 * apart, _FINEST * extent) or 1.0  # rounding never puts a neighbour two cells away
    return np.floor((points - low) / size).astype(np.int64)


def _chains(count: int) -> tuple[IntArray, IntArray]:
    return np.full(1 << count.bit_length(), -1, np.int64), np.empty(count, np.int64)
