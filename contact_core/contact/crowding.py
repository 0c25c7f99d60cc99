"""Parts of a transfer that land on one another, though they are apart where they come from.

A transfer keeps lengths and angles along a surface, and knows nothing of what else lies there: a strip may run once
round a pole and over its own start, and two pads of a tree may meet behind a small ball. No fold shows it, for each
part is well laid; so it is looked for by distance.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.thinning import meeting, spacing_of

MEET = 0.75  # times the spacing of the points: so near they lie on one another there
APART = 4.0  # times the spacing: so far they are different parts here
SAMPLED = 100  # points, at least, whose spacing is measured


def crowded_points(here: FloatArray, there: FloatArray) -> BoolArray:
    """(n,) which of n points (n, 3) `there` lie on another one that `here` belongs to another part.

    Both in the same units. None is crowded where there are fewer than two points, or all lie in one place here.
    """
    if len(here) < 2:
        return np.zeros(len(here), bool)
    spacing = spacing_of(here, SAMPLED)
    return meeting(there, here, MEET * spacing, APART * spacing)
