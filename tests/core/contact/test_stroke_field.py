"""The preview of a stroke grows by what is new and is at every moment that of the whole stroke."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.contact.stroke_field import StrokeField
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.fronts import spread_distances
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


@pytest.mark.parametrize("name", ["saddle", "torus", "holes"])
def test_on_a_dense_mesh_the_preview_is_within_a_small_part_of_the_radius(name: str) -> None:
    """The rim hardly moves when the stroke is let go."""
    mesh, random = cached_family(name), np.random.default_rng(3)
    for _ in range(2):
        mesh = meshes.subdivided(mesh)
    sources = SurfacePoints(random.integers(len(mesh.faces), size=4), random.dirichlet(np.ones(3), 4))
    reach = 0.2 * mesh.bounding_box_diagonal
    distances, lowered = spread_distances(mesh, sources, reach, np.full(len(mesh.points), np.inf))
    used = np.unique(mesh.faces)
    exact = log_map(mesh, sources, SurfacePoints.at_vertices(mesh, used)).distance
    surely = used[exact < 0.97 * reach]
    assert (
        np.isin(surely, lowered).all()
        and (np.isfinite(distances) == np.isin(np.arange(len(distances)), lowered)).all()
    )
    off = (distances[used] - exact)[exact < 0.97 * reach] / reach
    assert np.abs(off).max() < 0.05 and np.abs(off).mean() < 0.002, (np.abs(off).max(), np.abs(off).mean())


@given(st.integers(0, 2**32 - 1))
def test_fronts_are_exact_where_the_surface_is_flat(seed: int) -> None:
    mesh, random = meshes.plane(24), np.random.default_rng(seed)
    source = SurfacePoints(random.integers(len(mesh.faces), size=1), random.dirichlet(np.ones(3), 1))
    distances, _ = spread_distances(
        mesh, source, 10.0 * mesh.bounding_box_diagonal, np.full(len(mesh.points), np.inf)
    )
    straight = np.linalg.norm(mesh.points - source.positions(mesh), axis=1)
    np.testing.assert_allclose(distances, straight, rtol=0, atol=1e-7 * mesh.bounding_box_diagonal)


def test_a_dense_stroke_grows_by_what_is_new_and_many_waiting_vertices_find_room() -> None:
    mesh = meshes.plane(160)
    field = StrokeField.begun(mesh, 0.7 * mesh.bounding_box_diagonal)
    first = field.extended(SurfacePoints([0], [[0.2, 0.3, 0.5]]))
    again = first.extended(SurfacePoints([0], [[0.2, 0.3, 0.5]]))
    assert len(first.changed) > 10_000 and not len(again.changed)
    far = SurfacePoints([len(mesh.faces) - 1], [[0.2, 0.3, 0.5]])
    both, other = first.extended(far), field.extended(far)
    np.testing.assert_allclose(both.distances, np.minimum(first.distances, other.distances), rtol=0, atol=1e-6)
