"""A grasp is looked at from where it is seen."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasp_files.views import seen_from_eyes, views
from contact_core.testing import meshes

AWAY = 4.0
NOTHING = np.zeros((0, 3))
numbers = st.floats(-1.0, 1.0)
ways = st.tuples(numbers, numbers, numbers).map(np.array).filter(lambda way: np.linalg.norm(way) > 0.1)


def eye_of(way: np.ndarray) -> np.ndarray:
    return AWAY * way


def points(low: float) -> np.ndarray:
    """Of a hand that is flat, over the plane z = 0."""
    return np.random.default_rng(0).uniform(-0.5, 0.5, (80, 3)) * (1.0, 1.0, 0.2) + (0.0, 0.0, low)


def turned(normal: np.ndarray) -> np.ndarray:
    """(3, 3) that takes z to a unit way."""
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


@settings(max_examples=30)
@given(ways, ways)
def test_both_sides_see_a_hand_that_lies_on_a_wall_however_it_stands(normal: np.ndarray, way: np.ndarray) -> None:
    normal, way = normal / np.linalg.norm(normal), way / np.linalg.norm(way)
    turn, flat = turned(normal), meshes.plane(4, 40.0)
    wall = TriangleMesh((flat.points - flat.points.mean(axis=0)) @ turn.T, flat.faces)
    hand = points(0.15) @ turn.T
    first, second = views((wall,), hand, NOTHING, way, eye_of)
    assert (seen_from_eyes((wall,), hand, AWAY * np.array([first, second])) > 0.65).all()
    assert first @ second < 0.35, "from two sides"


@settings(max_examples=20)
@given(ways)
def test_no_eye_is_inside_a_body_beside_the_hand(beside: np.ndarray) -> None:
    beside = beside / np.linalg.norm(beside)
    ball = meshes.icosphere(3)
    body = TriangleMesh(2.5 * ball.points + AWAY * beside, ball.faces)
    hand = points(0.0)
    for way in views((body,), hand, NOTHING, np.eye(3)[2], eye_of):
        assert np.linalg.norm(AWAY * way - AWAY * beside) > 2.4
        assert seen_from_eyes((body,), hand, AWAY * way[None])[0] > 0.65


def test_what_is_held_is_seen_too() -> None:
    thing = np.random.default_rng(1).uniform(-0.2, 0.2, (30, 3))
    hand = meshes.plane(4, 2.0)
    hand = TriangleMesh(
        (hand.points - hand.points.mean(axis=0)) @ turned(np.eye(3)[0]).T + (0.5, 0.0, 0.0), hand.faces
    )
    for way in (np.eye(3)[2], -np.eye(3)[2]):
        eyes = AWAY * np.array(views((hand,), hand.points - (0.05, 0.0, 0.0), thing, way, eye_of))
        assert seen_from_eyes((hand,), thing, eyes).max() > 0.9


def test_the_usual_sides_are_kept_where_nothing_is_hidden() -> None:
    ball, way = meshes.icosphere(2), np.eye(3)[2]
    far = TriangleMesh(ball.points + 30.0 * way, ball.faces)
    first, second = views((far,), points(0.0), NOTHING, way, eye_of)
    assert first @ second < -0.7
    assert np.allclose(first, np.array([-1.0, 0.25, 0.35]) / np.linalg.norm([-1.0, 0.25, 0.35]))
