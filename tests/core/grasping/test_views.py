"""A grasp is looked at from where it is seen."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasp_files.views import seen_from_eyes, views
from contact_core.testing import meshes

numbers = st.floats(-1.0, 1.0)
ways = st.tuples(numbers, numbers, numbers).map(np.array).filter(lambda way: np.linalg.norm(way) > 0.1)


@settings(max_examples=30)
@given(ways, ways)
def test_both_sides_see_a_hand_that_lies_on_a_wall_however_it_stands(normal: np.ndarray, way: np.ndarray) -> None:
    normal, way = normal / np.linalg.norm(normal), way / np.linalg.norm(way)
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    turn = np.stack([first, np.cross(normal, first), normal], axis=1)
    flat = meshes.plane(4, 40.0)
    wall = TriangleMesh((flat.points - flat.points.mean(axis=0)) @ turn.T, flat.faces)
    hand = np.random.default_rng(0).uniform(-0.5, 0.5, (80, 3)) * (1.0, 1.0, 0.2) + (0.0, 0.0, 0.15)
    eyes = np.array(views(wall, hand @ turn.T, way, 1.0))
    assert (seen_from_eyes(wall, hand @ turn.T, eyes, 1.0) > 0.9).all()
    assert eyes[0] @ eyes[1] < 0.35, "from two sides"


def test_the_usual_sides_are_kept_where_nothing_hides_the_hand() -> None:
    ball, way = meshes.icosphere(2), np.array([0.0, 0.0, 1.0])
    hand = np.random.default_rng(0).normal(size=(50, 3)) - (0.0, 0.0, 3.0)
    first, second = views(ball, hand, way, 1.0)
    assert np.allclose(first, views(ball, hand - np.eye(3)[2], way, 1.0)[0])
    assert first @ second < -0.7
