"""Hollows filled: what no ball of a radius reaches."""

import tracemalloc

import numpy as np
import pytest

from contact_core.geometry.distance_field import DistanceField
from contact_core.grasping.filled import filled
from contact_core.testing import meshes


def longest_side(field: DistanceField) -> float:
    return field.spacing * (max(field.values.shape) - 1)


@pytest.mark.parametrize("share", [0.3, 1.0, 3.0, 1000.0])  # of the field's longest side
def test_wide_balls_fill_the_hole_of_a_ring_and_nothing_round_a_ball(share: float) -> None:
    for mesh, round_it in ((meshes.torus(), False), (meshes.icosphere(3), True)):
        field = DistanceField.of(mesh, resolution=32)
        inside = filled(field, share * longest_side(field)).values < 0.0
        assert (inside | (field.values >= 0.0)).all()
        assert inside[tuple(np.round(-field.origin / field.spacing).astype(int))]
        assert np.array_equal(inside, field.values < 0.0) == round_it


def test_a_ball_as_large_as_a_house_takes_no_more_memory_than_one_as_large_as_the_field() -> None:
    field = DistanceField.of(meshes.torus(), resolution=32)
    side = longest_side(field)
    tracemalloc.start()
    try:
        wide = filled(field, 1000.0 * side)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 500 * field.values.nbytes
    assert np.array_equal(wide.values, filled(field, side).values)
