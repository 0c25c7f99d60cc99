"""Laws of welding: a projection, in order, that never moves what it keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.geometry.weld import weld


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), distinct=st.integers(1, 30), copies=st.integers(1, 4))
def test_copies_within_tolerance_become_one(seed: int, distinct: int, copies: int) -> None:
    random = np.random.default_rng(seed)
    # positions one apart in the first coordinate, so that groups are known by construction
    base = np.stack([np.arange(distinct), *random.normal(size=(2, distinct))], axis=1)
    owner = random.permutation(np.repeat(np.arange(distinct), copies))
    jitter = random.uniform(-1, 1, (len(owner), 3)) * 1e-7
    kept, where = weld(base[owner] + jitter, tolerance=1e-5)
    assert len(kept) == distinct
    assert all(len(set(where[owner == k])) == 1 for k in range(distinct))
    firsts = [int(np.argmax(where == k)) for k in range(distinct)]
    assert firsts == sorted(firsts)  # in the order of first appearance
    assert np.array_equal(kept, (base[owner] + jitter)[firsts])  # bit-equal
    again, same = weld(kept, tolerance=1e-5)
    assert np.array_equal(again, kept) and np.array_equal(same, np.arange(distinct))


def test_zero_tolerance_joins_equal_positions_only() -> None:
    points = np.array([[0.0, 0, 0], [1e-12, 0, 0], [-0.0, 0, 0], [5, 0, 0]])
    kept, where = weld(points, tolerance=0.0)
    assert where.tolist() == [0, 1, 0, 2] and len(kept) == 3


def test_neighbours_across_a_grid_line_are_joined() -> None:
    """Rounding to a grid would tear this pair apart."""
    points = np.array([[0.49999999e-6, 0, 0], [0.50000001e-6, 0, 0], [1.0, 0, 0]])
    assert weld(points, tolerance=1e-6)[1].tolist() == [0, 0, 1]


def test_default_tolerance_scales_with_the_mesh() -> None:
    points = np.array([[0.0, 0, 0], [3e-7, 0, 0], [1, 0, 0]])
    for scale in (1e-3, 1.0, 1e4):
        assert weld(points * scale)[1].tolist() == [0, 0, 1]


def test_no_points_and_bad_points() -> None:
    assert weld(np.zeros((0, 3)))[0].shape == (0, 3)
    with pytest.raises(InvalidInput, match="finite"):
        weld([[np.nan, 0, 0]])
    with pytest.raises(InvalidInput, match="tolerance"):
        weld([[0, 0, 0]], tolerance=-1.0)
