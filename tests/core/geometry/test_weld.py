"""Laws of finding copies of points: groups in order, by distance, each point by its own reach."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.geometry.weld import close_points


@given(seed=st.integers(0, 2**32 - 1), distinct=st.integers(1, 30), copies=st.integers(1, 4))
def test_copies_within_reach_become_one(seed: int, distinct: int, copies: int) -> None:
    random = np.random.default_rng(seed)
    # positions one apart in the first coordinate, so that groups are known by construction
    base = np.stack([np.arange(distinct), *random.normal(size=(2, distinct))], axis=1)
    owner = random.permutation(np.repeat(np.arange(distinct), copies))
    jitter = random.uniform(-1, 1, (len(owner), 3)) * 1e-7
    group = close_points(base[owner] + jitter, np.full(len(owner), 1e-5))
    assert group.max() + 1 == distinct
    assert all(len(set(group[owner == k])) == 1 for k in range(distinct))
    firsts = np.unique(group, return_index=True)[1]
    assert (np.diff(firsts) > 0).all()  # in the order of first appearance


@given(seed=st.integers(0, 2**32 - 1))
def test_each_point_reaches_as_far_as_it_may(seed: int) -> None:
    """Against all pairs, with reaches over many magnitudes."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(30, 3)) * 10.0 ** random.uniform(-6, 0, (30, 1))
    points[10:14] = points[:4]  # equal points reach as far as the shortest of their reaches, here the same
    reach = 10.0 ** random.uniform(-5, 0, 30)
    reach[10:14] = reach[:4]
    group = close_points(points, reach)
    gap = np.linalg.norm(points[:, None] - points[None], axis=2)
    linked = (gap <= np.minimum(reach[:, None], reach[None])) | (gap == 0.0)
    for _ in range(5):
        linked = linked @ linked
    assert np.array_equal(linked, group[:, None] == group[None])


def test_without_reach_equal_positions_alone_are_one() -> None:
    points = np.array([[0.0, 0, 0], [1e-12, 0, 0], [-0.0, 0, 0], [5, 0, 0]])
    assert close_points(points, np.zeros(4)).tolist() == [0, 1, 0, 2]
    assert close_points(np.zeros((0, 3)), np.zeros(0)).tolist() == []


@pytest.mark.parametrize("shift", [0.0, 1e-9])
def test_neighbours_across_a_grid_line_are_joined(shift: float) -> None:
    """Rounding to a grid would tear this pair apart."""
    points = np.array([[0.49999999e-6, 0, 0], [0.50000001e-6, 0, 0], [1.0, 0, 0]]) + shift
    assert close_points(points, np.full(3, 1e-6)).tolist() == [0, 0, 1]
