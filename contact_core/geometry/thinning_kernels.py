"""Kernels that compare points with those in their own and the 26 neighbouring cells of a grid (see thinning.py).

Cells are found by a hash table of chains. Two cells that share a chain do no harm, because the distance to every
candidate is measured.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined, kernel

OWN = constant(13)
_X, _Y, _Z = constant(73856093), constant(19349663), constant(83492791)  # primes, Teschner et al. 2003


@inlined
def chain_of(cells: IntArray, k: int, step: int, mask: int) -> int:
    """Where the chain begins of the cell of row k, or of one beside it: step 13 of 27 is its own."""
    i, j, h = cells[k, 0] + step % 3 - 1, cells[k, 1] + step // 3 % 3 - 1, cells[k, 2] + step // 9 - 1
    return (i * _X ^ j * _Y ^ h * _Z) & mask


@inlined
def square_distance(points: FloatArray, k: int, other: int) -> float:
    """Of rows k and other of points (n, 3)."""
    x, y, z = points[k, 0] - points[other, 0], points[k, 1] - points[other, 1], points[k, 2] - points[other, 2]
    return x * x + y * y + z * z


@kernel
def keep_first(
    points: FloatArray, cells: IntArray, apart: float, heads: IntArray, later: IntArray, kept: BoolArray
) -> None:
    """Mark in `kept` (n,) the points (n, 3) that are farther than `apart` from every earlier one that is kept.

    cells: (n, 3) each point's cell; points within `apart` differ by at most 1. heads: (2^b,) filled with -1.
    later: (n,) scratch, the next point of a chain. kept: (n,) filled with False.
    """
    mask = len(heads) - 1
    limit = apart * apart
    for k in range(len(points)):
        free = True
        for step in range(27):
            other = heads[chain_of(cells, k, step, mask)]
            while other >= 0 and square_distance(points, k, other) > limit:
                other = later[other]
            if other >= 0:
                free = False
                break
        if free:
            slot = chain_of(cells, k, OWN, mask)
            later[k] = heads[slot]
            heads[slot] = k
            kept[k] = True


@kernel
def find_meeting(
    points: FloatArray, others: FloatArray, cells: IntArray, near: float, apart: float, heads: IntArray,
    later: IntArray, meets: BoolArray,
) -> None:  # fmt: skip
    """Mark in `meets` (n,) the points (n, 3) that have one within `near` whose row of others (n, 3) is farther than
    `apart` from theirs. The rest as for `keep_first`."""
    mask = len(heads) - 1
    for k in range(len(points)):
        slot = chain_of(cells, k, OWN, mask)
        later[k] = heads[slot]
        heads[slot] = k
    for k in range(len(points)):
        for step in range(27):
            if meets[k]:
                break
            other = heads[chain_of(cells, k, step, mask)]
            while other >= 0 and not meets[k]:
                if square_distance(points, k, other) <= near * near:
                    meets[k] = square_distance(others, k, other) > apart * apart
                other = later[other]


@kernel
def find_nearest(points: FloatArray, every: int, distances: FloatArray) -> None:
    """Write the distance of each `every`-th point (n, 3) from the nearest other one."""
    for i in range(len(distances)):
        least = np.inf
        for other in range(len(points)):
            if other != every * i:
                least = min(least, square_distance(points, every * i, other))
        distances[i] = np.sqrt(least)
