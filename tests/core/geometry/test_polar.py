"""A surface keeps its scale and shear, and leaves rotation and translation to the scene."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from contact_core.errors import InvalidInput
from contact_core.geometry.polar import split_world_from_local
from contact_core.testing import meshes

turns = st.tuples(*4 * [st.floats(-1, 1)]).filter(lambda q: np.linalg.norm(q) > 0.1)
scales = st.tuples(*3 * [st.sampled_from([-2.0, -1.0, 0.01, 0.5, 1.0, 1.25, 100.0])])


def _world(turn: tuple[float, ...], scale: tuple[float, ...], shift: float) -> np.ndarray:
    world = np.eye(4)
    world[:3, :3] = Rotation.from_quat(turn).as_matrix() @ np.diag(scale)
    world[:3, 3] = shift
    return world


@given(turns, scales, st.floats(-1e3, 1e3), st.tuples(*3 * [st.floats(-0.3, 0.3)]))
def test_the_parts_make_the_whole_and_the_placement_is_rigid(turn, scale, shift, shear) -> None:  # type: ignore[no-untyped-def]
    world = _world(turn, scale, shift)
    world[:3, :3] = world[:3, :3] @ (np.eye(3) + np.diag(shear, 0) + np.triu(np.full((3, 3), shear[0]), 1))
    placement = split_world_from_local(world)
    rigid = placement.world_from_surface[:3, :3]
    assert np.allclose(rigid @ rigid.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rigid) > 0
    whole = rigid @ placement.surface_from_local
    assert np.abs(whole - world[:3, :3]).max() <= 2e-6 * np.linalg.norm(world[:3, :3], 2) + 1e-12
    assert placement.mirrored == (np.linalg.det(world[:3, :3]) < 0)


@given(turns, turns, scales)
def test_moving_an_object_in_single_precision_keeps_its_digest(one, other, scale) -> None:  # type: ignore[no-untyped-def]
    """The worlds that a host stores as float32, for two rotations of the same uniformly scaled object."""
    mesh = meshes.family("torus")
    uniform = (scale[0], abs(scale[0]), abs(scale[0]))
    digests = set()
    for turn in (one, other):
        world = _world(turn, uniform, 1.0).astype(np.float32)
        digests.add(mesh.with_points(split_world_from_local(world).surface_points(mesh.points)).digest)
    assert len(digests) == 1


def test_an_unscaled_object_keeps_the_very_same_numbers() -> None:
    world = _world((0.1, 0.7, -0.3, 0.5), (1.0, 1.0, 1.0), 3.0).astype(np.float32)
    placement = split_world_from_local(world)
    points = meshes.family("torus").points
    assert placement.uniform_scale == 1.0
    assert np.array_equal(placement.surface_points(points), points)


def test_scaling_changes_the_surface_and_a_mirror_along_x_is_no_rotation() -> None:
    placement = split_world_from_local(np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert np.array_equal(placement.surface_from_local, np.diag([-1.0, 1.0, 1.0]))
    assert np.array_equal(placement.world_from_surface, np.eye(4))
    assert placement.uniform_scale is None
    assert split_world_from_local(np.diag([2.0, 2.0, 2.0, 1.0])).uniform_scale == 2.0
    assert split_world_from_local(np.diag([2.0, 2.0, 1.0, 1.0])).uniform_scale is None


@pytest.mark.parametrize(
    ("matrix", "word"),
    [(np.diag([1.0, 1.0, 0.0, 1.0]), "flat"), (np.diag([1.0, 1.0, 1.0, 2.0]), "last row"), (np.eye(3), "shape")],
)
def test_what_is_no_placement_is_refused_in_words(matrix: np.ndarray, word: str) -> None:
    with pytest.raises(InvalidInput, match=word):
        split_world_from_local(matrix)
