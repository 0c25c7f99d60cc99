"""Tracks as sparse matrices: every operation is that of the dense matrix."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.rig.track import Track

JOINTS = 7


def random_track(random: np.random.Generator, rows: int, width: int) -> Track:
    """Rows with 0 to 6 entries, of a few bones, some of which carry a row twice."""
    owner = np.sort(random.integers(0, rows, random.integers(0, 6 * rows)))
    bones = random.choice(random.permutation(JOINTS)[:4], len(owner))
    return Track.gathered(owner, bones, random.normal(size=(len(owner), width)), rows)


def dense(track: Track) -> np.ndarray:
    """(k, width j) the matrix for all bones of the problem."""
    result = np.zeros((len(track), JOINTS, track.width))
    result[:, track.bones] = track.blocks
    return result.reshape(len(track), -1)


seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 9), st.sampled_from([3, 4]))
def test_products_are_those_of_the_dense_matrix(seed: int, rows: int, width: int) -> None:
    random = np.random.default_rng(seed)
    track = random_track(random, rows, width)
    matrix, own = dense(track), track.blocks.reshape(rows, -1)
    carrier, forces, weights = (
        random.normal(size=(width * JOINTS, 3)),
        random.normal(size=(rows, 3)),
        random.random(rows),
    )
    other = random.normal(size=(own.shape[1], 5))
    assert track.carried(carrier) == pytest.approx(matrix @ carrier)
    assert track.times(other) == pytest.approx(own @ other)
    assert track.gathered_by_bones(forces) == pytest.approx(own.T @ forces)
    assert track.gram(weights).matrix == pytest.approx(own.T @ (weights[:, None] * own))


@given(seeds, st.integers(1, 9), st.sampled_from([3, 4]))
def test_tracks_are_made_of_tracks_as_matrices_of_matrices(seed: int, rows: int, width: int) -> None:
    random = np.random.default_rng(seed)
    one, two = random_track(random, rows, width), random_track(random, rows, width)
    index, factors = random.integers(0, rows, 5), random.normal(size=rows)
    assert dense(one.combined(two, -0.5)) == pytest.approx(dense(one) - 0.5 * dense(two))
    assert dense(one.rows(index)) == pytest.approx(dense(one)[index])
    assert dense(one.scaled(factors)) == pytest.approx(factors[:, None] * dense(one))
    assert dense(one.summed(factors)) == pytest.approx(factors[None] @ dense(one))
    assert dense(Track.stacked([one, two, one])) == pytest.approx(
        np.concatenate([dense(one), dense(two), dense(one)])
    )
    both = one.combined(two, 2.0)  # bones that carry a row twice are one after the other, and count twice
    assert both.gram(np.ones(rows)).matrix == pytest.approx(
        both.blocks.reshape(rows, -1).T @ both.blocks.reshape(rows, -1)
    )


@given(seeds)
def test_entries_of_one_bone_in_one_row_are_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    owner, bones = random.integers(0, 4, 30), random.integers(0, 3, 30)
    entries = random.normal(size=(30, 4))
    track = Track.gathered(owner, bones, entries, 4)
    added = np.zeros((4, 3, 4))
    np.add.at(added, (owner, bones), entries)
    assert dense(track).reshape(4, JOINTS, 4)[:, :3] == pytest.approx(added)
    assert len(track.entries) == len(set(zip(owner.tolist(), bones.tolist(), strict=True)))


def test_axes_are_the_axes_of_bones() -> None:
    carrier = np.arange(9.0 * JOINTS).reshape(-1, 3)  # three rows each
    assert Track.axes(np.array([5, 2])).carried(carrier) == pytest.approx(carrier[[15, 16, 17, 6, 7, 8]])


def test_points_and_normals_do_not_add() -> None:
    with pytest.raises(InvalidInput, match="row by row"):
        Track.empty(4).combined(Track.empty(3))
