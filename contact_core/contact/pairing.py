"""Which point touches which: the correspondence of two paired patches.

Patches that share a shape correspond point by point. Patches painted independently correspond through their axis
coordinates: how far along the axis, and how far to which side, each measured by the extent of its own patch.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.contact.area import flat_layout
from contact_core.contact.shape import PatchShape
from contact_core.errors import InvalidInput

FARTHEST = 0.35  # of the extent of the patch: a partner farther away in axis coordinates is none
MOST_STRETCH = 4.0  # of one axis against the other


def correspond(first: PatchShape, second: PatchShape, *, opposed: bool = True) -> IntArray:
    """(n,) for each point of `first` the point of `second` that corresponds to it in axis coordinates.

    opposed: the patches face each other, so left of one axis is right of the other. Raises InvalidInput where the
    two do not match: one has no axis to speak of, the axes differ in length too much, or regions have no
    counterpart.
    """
    a, b = axis_coordinates(first), axis_coordinates(second)
    lengths = first.axis.length * first.meters_per_unit, second.axis.length * second.meters_per_unit
    stretch = max(lengths) / min(lengths)
    if stretch > MOST_STRETCH:
        raise InvalidInput(
            f"these patches do not match: one axis is {stretch:.1f} times as long as the other. Transfer one of"
            " them, or draw axes of like length."
        )
    if opposed:
        b = b * np.array([1.0, -1.0])
    from scipy.spatial import cKDTree

    distance, nearest = cKDTree(b).query(a)
    if np.median(distance) > FARTHEST:
        raise InvalidInput(
            "these patches do not match: most points of one have none of the other near in axis coordinates."
            " Transfer one of them, or redraw the axes so that they run alike."
        )
    return np.asarray(nearest, dtype=np.int64)


def axis_coordinates(shape: PatchShape) -> FloatArray:
    """(n, 2) position along the axis and, positive to its left, across it; along from 0 to 1 over the axis, across
    in units of the patch's half width. Raises InvalidInput for an axis of one point."""
    axis, coordinates = shape.axis, shape.coordinates
    total = float(axis.lengths.sum())
    if total <= 0.0 or len(shape) < 3:
        raise InvalidInput("a patch without an axis of some length corresponds to no independently painted patch.")
    straight = flat_layout(
        type(axis)(axis.lengths, np.zeros_like(axis.turning_angles)), coordinates
    )  # unrolled along a straightened axis: real part along, imaginary part across
    across = straight.imag / max(float(np.percentile(np.abs(straight.imag), 95)), 1e-9 * total)
    return np.column_stack([straight.real / total, across])
