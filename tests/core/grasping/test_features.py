"""Rims: where plates and walls end, and that round things have none."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.features import rims_of
from contact_core.testing import meshes

LENGTH = 1.0  # of the hand
SIDES = np.array([4.0, 3.0, 0.4])


def plate(turn: np.ndarray, at: np.ndarray) -> TriangleMesh:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * SIDES
    quads = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
    faces = np.array([[q[0], *pair] for q in quads for pair in (q[1:3], q[2:4])])
    return TriangleMesh(corners @ turn.T + at, faces)


@pytest.mark.parametrize("seed", [0, 1])
def test_rims_of_a_plate_are_its_sides_and_look_into_it_wherever_it_is(seed: int) -> None:
    random = np.random.default_rng(seed)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn = turn * np.sign(np.linalg.det(turn))
    at = random.normal(size=3)
    found = rims_of(plate(turn, at), LENGTH, 0.6, seed)
    assert len(found.points) > 200, "there are sides all round"
    own = (found.points - at) @ turn
    to_sides = np.abs(np.abs(own[:, :2]) - 0.5 * SIDES[:2])
    assert np.allclose(to_sides.min(axis=1), 0.0, atol=1e-6) and np.allclose(own[:, 2], 0.0, atol=1e-6)
    assert np.allclose(np.abs(found.across @ turn[:, 2]), 1.0) and np.allclose(found.thickness, SIDES[2])
    assert np.allclose(np.einsum("ki,ki->k", found.across, found.inwards), 0.0, atol=1e-9)
    inwards = own + 0.1 * found.inwards @ turn
    assert (np.abs(inwards[:, :2]) < 0.5 * SIDES[:2] + 1e-9).all()
    assert set(to_sides.argmin(axis=1)) == {0, 1}, "along both ways"


def test_what_is_thicker_than_is_asked_for_and_what_is_round_has_no_rim() -> None:
    assert not len(rims_of(plate(np.eye(3), np.zeros(3)), LENGTH, 0.3, 0).points)
    assert not len(rims_of(meshes.icosphere(3), LENGTH, 3.0, 0).points), "a ball is no deeper than it is thick"


def test_only_rims_near_a_place_count_and_those_against_a_wall_do_not() -> None:
    at = np.array([2.0, 0.3, 0.0])
    near = rims_of(plate(np.eye(3), np.zeros(3)), LENGTH, 0.6, 0, at)
    assert len(near.points) and (np.linalg.norm(near.points - at, axis=1) < 0.3 * LENGTH + 1e-9).all()
    alone, wall = plate(np.eye(3), np.zeros(3)), plate(np.eye(3), np.array([4.1, 0.0, 0.0]))
    both = TriangleMesh(np.concatenate([alone.points, wall.points]), np.concatenate([alone.faces, wall.faces + 8]))
    gap = rims_of(both, LENGTH, 0.6, 0).points
    assert len(gap) and not (np.abs(gap[:, 0] - 2.05) < 0.06).any(), "no palm fits between two plates"
