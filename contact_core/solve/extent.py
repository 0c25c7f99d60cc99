"""How long a manipulator is: what all distances of a solve are judged against."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, IntArray
from contact_core.solve.body import manipulator_length, uniform_scale
from contact_core.solve.layout import DofLayout


def length_of(layout: DofLayout) -> float:
    """Largest rest extent of the skin that the free joints of a layout drive, world units (over all bodies)."""
    lengths = [
        manipulator_length(body.rig, _driven(layout, index)) * uniform_scale(body.world_from_rig)
        for index, body in enumerate(layout.bodies)
        if len(layout.free_of_body[index]) and len(body.rig.joints) > 1
    ]
    lengths += [body.black_box.world_length for body in layout.bodies if body.black_box is not None]
    lengths = [length for length in lengths if length > 0.0]
    if not lengths:  # only rigid things move
        lengths = [
            manipulator_length(body.rig) * uniform_scale(body.world_from_rig)
            for index, body in enumerate(layout.bodies)
            if len(layout.free_of_body[index])
        ]
    return max(lengths, default=1.0) or 1.0


def _driven(layout: DofLayout, index: int) -> IntArray:
    """Joints that the free dofs of a body move, and where several chains hang from one joint, that joint."""
    chart = layout.charts[index]
    driven: BoolArray = np.any(chart.moves[layout.free_of_body[index]], axis=0)
    parents = chart.rig.parents[driven]
    tops = parents[(parents >= 0) & ~driven[parents]]
    shared, count = np.unique(tops, return_counts=True)
    driven[shared[count > 1]] = True
    return np.flatnonzero(driven)
