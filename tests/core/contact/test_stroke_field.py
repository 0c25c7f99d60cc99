"""The preview of a stroke grows by what is new and is at every moment that of the whole stroke."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.contact.stroke_field import StrokeField
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family

FAMILIES = ["plane", "saddle", "torus", "noisy", "holes"]


@settings(max_examples=30)
@given(st.sampled_from(FAMILIES), st.integers(0, 2**32 - 1), st.lists(st.integers(0, 6), min_size=1, max_size=5))
def test_batches_give_the_distances_of_all_points_at_once(name: str, seed: int, sizes: list[int]) -> None:
    """Against one search over the whole mesh; `changed` names exactly what was lowered."""
    mesh, random = cached_family(name), np.random.default_rng(seed)
    radius = 0.1 * mesh.bounding_box_diagonal
    field, passed = StrokeField.begun(mesh, radius), []
    for size in sizes:
        batch = SurfacePoints(random.integers(len(mesh.faces), size=size), random.dirichlet(np.ones(3), size))
        before, field = field, field.extended(batch)
        np.testing.assert_array_equal(np.flatnonzero(field.distances != before.distances), field.changed)
        passed.append(batch)
    together = SurfacePoints.concatenate(passed)
    used = np.unique(mesh.faces)
    whole = np.full(len(mesh.points), np.inf)
    if len(together):
        whole[used] = log_map(mesh, together, SurfacePoints.at_vertices(mesh, used)).distance
    near = whole <= field.reach * (1.0 - 1e-9)
    np.testing.assert_allclose(field.distances[near], whole[near], rtol=0, atol=1e-9 * mesh.bounding_box_diagonal)
    assert np.isinf(field.distances[whole > field.reach * (1.0 + 1e-9)]).all()
    assert (field.covered() == np.flatnonzero(field.distances <= radius)).all()


def test_the_field_before_is_left_alone_and_a_radius_must_be_one() -> None:
    mesh = meshes.icosphere(2)
    field = StrokeField.begun(mesh, 0.3)
    field.extended(SurfacePoints([0], [[1.0, 1.0, 1.0]] / np.float64(3.0)))
    assert np.isinf(field.distances).all() and not len(field.covered())
    for radius in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InvalidInput, match="positive"):
            StrokeField.begun(mesh, radius)
