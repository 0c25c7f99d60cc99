"""The kernel of thinning: points in order, each against the kept ones in its own and the 26 neighbouring cells.

Cells are found by a hash table of chains. Two cells that share a chain do no harm, because the distance to every
candidate is measured.
"""

from __future__ import annotations

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.jit import constant, kernel

_X, _Y, _Z = constant(73856093), constant(19349663), constant(83492791)  # primes, Teschner et al. 2003


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
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        i, j, h = cells[k, 0], cells[k, 1], cells[k, 2]
        free = True
        for step in range(27):
            slot = ((i + step % 3 - 1) * _X ^ (j + step // 3 % 3 - 1) * _Y ^ (h + step // 9 - 1) * _Z) & mask
            other = heads[slot]
            while other >= 0:
                u, v, w = points[other, 0] - x, points[other, 1] - y, points[other, 2] - z
                if u * u + v * v + w * w <= limit:
                    free = False
                    break
                other = later[other]
            if not free:
                break
        if free:
            slot = (i * _X ^ j * _Y ^ h * _Z) & mask
            later[k] = heads[slot]
            heads[slot] = k
            kept[k] = True
