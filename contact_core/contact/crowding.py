"""Parts of a transfer that land on one another, though they are apart where they come from.

A transfer keeps lengths and angles along a surface, and knows nothing of what else lies there: a strip may run once
round a pole and over its own start, and two pads of a tree may meet behind a small ball. No fold shows it, for each
part is well laid; so it is looked for by distance.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray

MEET = 0.75  # times the spacing of the points: so near they lie on one another there
APART = 4.0  # times the spacing: so far they are different parts here
NEIGHBOURS = 8  # there, of each point, that are looked at


def crowded_points(here: FloatArray, there: FloatArray) -> BoolArray:
    """(n,) which of n points (n, 3) `there` lie on another one that `here` belongs to another part.

    Both in the same units. None is crowded where there are fewer than two points, or all lie in one place here.
    """
    from scipy.spatial import cKDTree

    n = len(here)
    crowded = np.zeros(n, bool)
    if n < 2:
        return crowded
    nearest = cKDTree(here).query(here, k=2)[0][:, 1]  # (n,)
    spacing = float(np.median(nearest))
    k = min(NEIGHBOURS, n)
    distance, other = cKDTree(there).query(there, k=k, distance_upper_bound=MEET * spacing)  # (n, k)
    found = np.isfinite(distance)
    apart = np.linalg.norm(here[:, None] - here[np.where(found, other, 0)], axis=2)  # (n, k)
    return np.asarray((found & (apart > APART * spacing)).any(axis=1))
