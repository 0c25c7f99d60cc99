"""Thinning points in space: the greedy choice of a maximal Poisson-disk sample, in linear time."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import IntArray, frozen
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
    low = at.min(axis=0)
    extent = float((at.max(axis=0) - low).max())
    size = max(1.001 * apart, _FINEST * extent) or 1.0  # rounding never puts a neighbour two cells away
    cells = np.floor((at - low) / size).astype(np.int64)
    heads = np.full(1 << len(at).bit_length(), -1, np.int64)
    later, kept = np.empty(len(at), np.int64), np.zeros(len(at), bool)
    keep_first(at, cells, float(apart), heads, later, kept)
    return np.flatnonzero(kept)
