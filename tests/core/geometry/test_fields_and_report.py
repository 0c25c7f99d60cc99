"""Laws of the distance field, the heat method and the mesh report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.heat import heat_distance
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.report import report
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_distance_field_gradient_is_its_derivative(seed: int) -> None:
    field = DistanceField.of(cached_family("torus"), resolution=24)
    points = np.random.default_rng(seed).uniform(-2.0, 2.0, (60, 3))  # in the grid and outside of it
    cells = (points - field.origin) / field.spacing
    points = points[(np.abs(cells - np.round(cells)) > 1e-3).all(axis=1)]  # away from the kinks between cells
    step = 1e-7
    numeric = np.stack(
        [(field.distances(points + step * e) - field.distances(points - step * e)) / (2 * step) for e in np.eye(3)],
        axis=-1,
    )
    distance, gradient = field.sample(points)
    np.testing.assert_allclose(gradient, numeric, atol=1e-6)
    assert np.array_equal(distance, field.distances(points))
    assert all(len(empty) == 0 for empty in field.sample(points[:0]))


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_a_field_within_a_box_is_the_whole_one_there(seed: int) -> None:
    mesh = cached_family("torus")
    random = np.random.default_rng(seed)
    middle = mesh.points[random.integers(len(mesh.points))] + random.normal(0.0, 0.1, 3)
    part = DistanceField.within(mesh, middle - 0.4, middle + 0.4, 0.04)
    assert part is not None
    points = middle + random.uniform(-0.35, 0.35, (200, 3))
    near = Locator.of(mesh).closest(points)
    sign = np.where(Locator.of(mesh).winding_number(points) > 0.5, -1.0, 1.0)
    exact = sign * near.distance
    shallow = np.abs(exact) < 0.25  # farther in, what is nearest may lie outside of the box
    assert np.abs(part.distances(points) - exact)[shallow].max(initial=0.0) < 0.06
    assert DistanceField.within(mesh, middle + 50.0, middle + 51.0, 0.1) is None
    with pytest.raises(InvalidInput, match="at most"):
        DistanceField.within(mesh, middle - 1.0, middle + 1.0, 1e-4)


def test_distance_field_converges_and_knows_inside_from_outside() -> None:
    mesh = meshes.icosphere(3)
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (400, 3))
    exact = Locator.of(mesh).closest(points).distance
    inside = Locator.of(mesh).winding_number(points, accuracy=np.inf) > 0.5
    signed = np.where(inside, -exact, exact)
    near = exact < 0.1  # in the band, where values at the nodes are exact
    errors = []
    for resolution in (12, 24, 48):
        field = DistanceField.of(mesh, resolution=resolution)
        value = field.sample(points)[0]
        assert np.abs(value - signed).max() < field.spacing, "nowhere off by more than a cell"
        errors.append(np.abs(value - signed)[near].mean())
    assert errors[1] < 0.5 * errors[0] and errors[2] < 0.5 * errors[1]


def test_a_distance_field_is_built_once_and_survives_a_damaged_cache(tmp_path: Path) -> None:
    mesh = meshes.torus()
    before = Locator.builds
    first = DistanceField.of(mesh, resolution=16)
    again = DistanceField.of(meshes.torus(), resolution=16)
    assert Locator.builds == before + 1, "the second field must come from the cache"
    np.testing.assert_array_equal(first.values, again.values)
    for file in tmp_path.rglob("*.npz"):
        file.write_bytes(b"not an archive")
    np.testing.assert_array_equal(DistanceField.of(meshes.torus(), resolution=16).values, first.values)


def test_heat_distance_converges_on_plane_and_sphere() -> None:
    plane_errors, sphere_errors = [], []
    for resolution in (10, 20, 40):
        mesh = meshes.plane(resolution)
        edge = np.flatnonzero(mesh.points[:, 0] == 0.0)
        field = heat_distance(mesh, np.arange(len(mesh.faces)), edge)
        plane_errors.append(np.abs(field.distance - mesh.points[field.vertices, 0]).max())
    for subdivisions in (2, 3, 4):
        mesh = meshes.icosphere(subdivisions)
        field = heat_distance(mesh, np.arange(len(mesh.faces)), [0])
        exact = np.arccos(np.clip(mesh.points @ mesh.points[0], -1, 1))[field.vertices]
        sphere_errors.append(np.abs(field.distance - exact).mean())
    for errors in (plane_errors, sphere_errors):
        assert errors[1] < 0.6 * errors[0] and errors[2] < 0.6 * errors[1]


def test_heat_distance_stays_on_its_region_and_leaves_other_parts_infinite() -> None:
    twin = meshes.copies(meshes.icosphere(1), 2)
    half = len(twin.faces) // 2
    field = heat_distance(twin, np.arange(len(twin.faces)), [0])
    on_first = field.vertices < len(twin.points) // 2
    assert np.isfinite(field.distance[on_first]).all() and np.isinf(field.distance[~on_first]).all()
    part = heat_distance(twin, np.arange(half), [0])
    np.testing.assert_array_equal(part.vertices, field.vertices[on_first])
    with pytest.raises(InvalidInput, match="sources"):
        heat_distance(twin, np.arange(half), [len(twin.points) - 1])


@pytest.mark.parametrize(
    ("name", "genus", "loops"),
    [("sphere", 0, 0), ("torus", 1, 0), ("cylinder", 0, 2), ("holes", 0, 3), ("plane", 0, 1), ("sliver", 0, 1)],
)
def test_report_of_families(name: str, genus: int, loops: int) -> None:
    facts = report(cached_family(name))
    assert (facts.genus, facts.boundary_loops, facts.components) == (genus, loops, 1)
    assert facts.is_manifold and facts.is_watertight == (loops == 0)
    assert not facts.degenerate_faces and not facts.duplicate_faces


def test_report_adds_up_over_copies_and_under_subdivision() -> None:
    one = report(meshes.torus())
    two = report(meshes.subdivided(meshes.copies(meshes.torus(), 3)))
    assert two.components == 3 and two.genus == 3 * (one.genus or 0)
    np.testing.assert_allclose(two.area, 3 * one.area, rtol=1e-12)
    np.testing.assert_allclose(two.volume, 3 * (one.volume or 0.0), rtol=1e-9)


def test_report_names_what_is_broken() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [-1, 0, 0], [-1, -1, 0.0]])
    crowded = report(TriangleMesh(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4]]))
    assert crowded.non_manifold_edges == ((0, 1),) and crowded.genus is None
    bow_tie = report(TriangleMesh(points, [[0, 1, 2], [0, 5, 6]]))
    assert bow_tie.non_manifold_vertices == (0,) and bow_tie.components == 2
    flipped = report(TriangleMesh(points, [[0, 1, 2], [0, 1, 4]]))
    assert flipped.misoriented_edges == 1 and not flipped.is_manifold
    poor = report(TriangleMesh(points, [[0, 1, 1], [0, 1, 2], [2, 0, 1]]))
    assert poor.degenerate_faces == (0,) and poor.duplicate_faces == (2,) and poor.unused_vertices == 4
    empty = report(TriangleMesh(np.zeros((2, 3)), np.zeros((0, 3), int)))
    assert empty.components == 0 and empty.genus is None


def test_a_field_reads_nothing_outside_of_its_grid() -> None:
    field = DistanceField(np.zeros(3), 1.0, np.arange(27.0).reshape(3, 3, 3))
    odd = np.array([[np.nan, 0.5, 0.5], [np.inf, 0.5, 0.5], [-np.inf, np.nan, 1e300], [1.0, 1.0, 1.0]])
    assert field.distances(odd)[3] == field.sample(odd)[0][3] == 13.0
    assert not np.isfinite(field.distances(odd)[:3]).any()
    with pytest.raises(InvalidInput, match="2 nodes along each axis"):
        DistanceField(np.zeros(3), 1.0, np.zeros((1, 3, 3)))
