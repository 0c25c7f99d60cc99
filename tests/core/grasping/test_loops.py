"""Loops of objects are found wherever they stand, and a digit goes through one where its line crosses it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.hand import turn_about
from contact_core.grasping.loops import crossed, digits_through, loops_near
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.testing import meshes
from contact_core.testing.grasp_sampler_contract import hand

HOLE = 0.6  # radius of the torus's hole, its own rim at z = 0
numbers = st.floats(-1.0, 1.0)
ways = st.tuples(numbers, numbers, numbers).map(np.array).filter(lambda way: np.linalg.norm(way) > 0.1)


def ring(turn: np.ndarray, middle: np.ndarray, hole: float) -> TriangleMesh:
    mesh = meshes.torus()
    return TriangleMesh(hole / HOLE * mesh.points @ turn.T + middle, mesh.faces)


@settings(max_examples=15)
@given(ways, numbers, st.floats(0.05, 0.3), ways)
def test_a_ring_has_one_loop_across_its_hole_wherever_it_is(
    axis: np.ndarray, angle: float, hole: float, middle: np.ndarray
) -> None:
    turn = turn_about(axis / np.linalg.norm(axis), 3.0 * angle)
    mesh = ring(turn, middle, hole)
    (found,) = loops_near(mesh, 1.0, middle + hole * turn[:, 0])
    assert np.linalg.norm(found.middle - middle) < 0.05 * hole
    assert abs(found.way @ turn[:, 2]) > 0.99
    assert np.linalg.norm(found.rim - found.middle, axis=1) == pytest.approx(np.full(16, hole), rel=0.05)
    assert not loops_near(mesh, 1.0, middle + 3.0 * turn[:, 0]), "none is near"


def test_handles_and_scissors_have_loops_and_what_is_only_hollow_has_none() -> None:
    plugins = PluginManager()

    def count(name: str, *at: float) -> int:
        return len(loops_near(read_asset(name, plugins).mesh, 0.2, np.array(at)))

    assert count("sample:mug", 0.076, 0.047, 0.0) == 1
    assert count("sample:scissors", 0.0, -0.062, 0.0) == 2
    assert count("sample:mug", -0.041, 0.06, 0.0) == 0, "a cup's inside is open on one side only"
    assert count("sample:baseball", 0.036, 0.0, 0.0) == 0
    assert loops_near(read_asset("sample:mug", plugins).mesh, 0.2, None) == ()


@settings(max_examples=25)
@given(st.integers(0, 4), st.floats(-2.0, 3.0), ways, numbers)
def test_a_digit_is_through_a_ring_between_its_root_and_its_tip_and_no_other_is(
    digit: int, share: float, axis: np.ndarray, angle: float
) -> None:
    """However hand and ring are turned together; a ring before the tip or behind the root has nothing in it."""
    one = hand()
    placed = np.eye(4)
    placed[:3, :3] = turn_about(axis / np.linalg.norm(axis), 3.0 * angle)
    still = np.zeros((1, len(one.joints)))
    frames = one.frames(placed[None], still, np.tile(np.eye(3), (1, len(one.bones) - 1, 1, 1)))
    last = int(one.bones[digit + 1]) - 1
    start, end = one.capsules[last] @ frames[0, last, :3, :3].T + frames[0, last, :3, 3]
    end = end + one.radii[last] * (end - start) / np.linalg.norm(end - start)
    way = (end - start) / np.linalg.norm(end - start)
    across = np.cross(way, np.eye(3)[np.abs(way).argmin()])
    across /= np.linalg.norm(across)
    turn = np.stack([across, np.cross(way, across), way], axis=1)
    middle, hole = start + max(share, 0.02) * (end - start), 1.1 * float(one.radii[last])
    mesh = ring(turn, middle, hole)
    (found,) = loops_near(mesh, 30.0 * hole, middle + hole * across)
    expected = [d == digit and share < 0.98 for d in range(len(one.bones) - 1)]
    if not 0.98 < share < 1.02:
        assert crossed(one, frames, found)[0].tolist() == expected
    assert (digits_through(one, frames, (found, found)) == crossed(one, frames, found)[:, None]).all()
    assert digits_through(one, frames, ()).shape == (1, 0, len(one.bones) - 1)
