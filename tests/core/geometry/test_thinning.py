"""Thinning by the hash grid chooses exactly what the plain definition chooses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.thinning import first_of_each
from contact_core.testing import meshes


def by_definition(at: FloatArray, apart: float) -> IntArray:
    """The slow reference: each point, in order, takes away all later ones in its reach (k-d tree)."""
    alive = np.ones(len(at), bool)
    if len(at):
        for k, neighbours in enumerate(cKDTree(at).query_ball_point(at, apart)):
            if alive[k]:
                alive[neighbours] = False
                alive[k] = True
    return np.flatnonzero(alive)


def darts(name: str, count: int, seed: int) -> FloatArray:
    """Random points on a family's mesh, (count, 3)."""
    mesh, random = meshes.family(name), np.random.default_rng(seed)
    faces, weights = random.integers(len(mesh.faces), size=count), random.dirichlet(np.ones(3), count)
    return np.asarray(np.einsum("kc,kcx->kx", weights, mesh.points[mesh.faces[faces]]))


@pytest.mark.parametrize("name", meshes.FAMILIES)
@pytest.mark.parametrize("share", [0.003, 0.05, 0.4])
def test_on_every_family_the_choice_is_that_of_the_definition(name: str, share: float) -> None:
    at = darts(name, 2000, 3)
    apart = share * float(np.linalg.norm(np.ptp(at, axis=0)))
    np.testing.assert_array_equal(first_of_each(at, apart), by_definition(at, apart))


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 300),
    scale=st.sampled_from([1e-6, 1.0, 1e5]),
    away=st.sampled_from([0.0, 10.0, -1e4]),
    share=st.sampled_from([0.0, 1e-9, 0.01, 0.2, 1.0, 100.0, np.inf]),
)
def test_on_random_points_the_choice_is_that_of_the_definition(
    seed: int, count: int, scale: float, away: float, share: float
) -> None:
    """Among them points in one place, clusters, flat sets, sets far from the origin."""
    random = np.random.default_rng(seed)
    at = random.random((count, 3)) * random.choice([0.0, 1.0], 3)
    at[: count // 4] = at[count // 4 : 2 * (count // 4)]
    at = scale * (at + away)
    apart = share * scale if share else 0.0
    np.testing.assert_array_equal(first_of_each(at, apart), by_definition(at, apart))


@given(st.integers(1, 6), st.integers(0, 2**16))
def test_on_a_lattice_points_exactly_apart_are_too_near(steps: int, seed: int) -> None:
    """Powers of two, so that distances are exact and ties happen at every point."""
    axis = np.arange(8) * 2.0**-3
    at = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    at = np.random.default_rng(seed).permutation(at)
    np.testing.assert_array_equal(first_of_each(at, steps * 2.0**-3), by_definition(at, steps * 2.0**-3))


def test_a_distance_that_is_none_is_refused() -> None:
    for apart in (-1.0, np.nan):
        with pytest.raises(InvalidInput, match="0 or more"):
            first_of_each(np.zeros((2, 3)), apart)
