"""Connectivity, and input that no artist meant: each gives a right answer or a sentence, never a hang."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import ContactError, InvalidInput, NotManifold
from contact_core.geometry import SurfacePoints, Topology, TriangleMesh, log_map, trace_chains, trace_geodesic
from contact_core.geometry.elements import BLOCKED, BOUNDARY, BOUNDARY_VERTEX
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
MIDDLE = [[1 / 3, 1 / 3, 1 / 3]]


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_twins_are_twins_and_angles_add_up(name: str) -> None:
    mesh = cached_family(name)
    topology = Topology.of(mesh)
    h = np.flatnonzero(topology.twin >= 0)
    twin = topology.twin[h]
    head = np.roll(mesh.faces, -1, axis=1).ravel()
    assert (topology.twin[twin] == h).all()
    assert (topology.tail[twin] == head[h]).all()
    assert (topology.shape[h, 0] == topology.shape[twin, 0]).all()  # bit for bit
    assert topology.is_manifold
    # Gauss and Bonnet: all defects together are 2 pi times the Euler characteristic
    edges = (len(topology.twin) + len(topology.boundary_halfedges)) // 2
    euler = len(mesh.points) - edges + len(mesh.faces)
    flat = np.where(topology.kind == BOUNDARY_VERTEX, np.pi, 2.0 * np.pi)
    assert (flat - topology.angle_sum).sum() == pytest.approx(2.0 * np.pi * euler, abs=1e-9)
    rim = topology.first[topology.kind == BOUNDARY_VERTEX]
    assert (topology.twin[rim] == BOUNDARY).all()


def test_topology_is_built_once_and_read_only() -> None:
    mesh = meshes.plane(3)
    topology = Topology.of(mesh)
    assert Topology.of(mesh) is topology
    for array in (topology.tail, topology.twin, topology.shape, topology.first, topology.angle_sum, topology.kind):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    "faces, offence",
    [
        ([[0, 1, 2], [0, 1, 2]], "edge"),  # a face twice
        ([[0, 1, 2], [0, 1, 3]], "edge 0-1"),  # two faces oriented against each other
        ([[0, 1, 2], [1, 0, 3], [0, 1, 3]], "edge 0-1"),  # three faces at an edge
    ],
)
def test_a_walk_over_a_blocked_edge_is_refused_by_name(faces: list[list[int]], offence: str) -> None:
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0]], faces)
    assert not Topology.of(mesh).is_manifold
    start = SurfacePoints([0], MIDDLE)
    with pytest.raises(NotManifold, match=offence):
        trace_geodesic(mesh, start, [-2j])
    far = SurfacePoints([1], MIDDLE)
    with pytest.raises(NotManifold, match=offence):
        log_map(mesh, start, far)


def test_two_fans_at_a_vertex_are_refused_only_there() -> None:
    bow = TriangleMesh([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 2, 1], [0, 3, 4]])
    centre = SurfacePoints([0], [[1, 0, 0]])
    with pytest.raises(NotManifold, match="vertex 0"):
        trace_geodesic(bow, centre, [1.0])
    with pytest.raises(NotManifold, match="vertex 0"):
        log_map(bow, centre, SurfacePoints([1], MIDDLE))
    inside = SurfacePoints([0, 0], [[0.1, 0.5, 0.4], [0.1, 0.2, 0.7]])
    assert log_map(bow, inside[0], inside[1]).anchor[0] == 0
    with pytest.raises(NotManifold, match="vertex 0"):  # the way to the other half would lead through it
        log_map(bow, inside[0], SurfacePoints([1], MIDDLE))


def test_a_mesh_that_is_broken_elsewhere_still_works() -> None:
    good = meshes.icosphere(2)
    broken = TriangleMesh(good.points, np.concatenate([good.faces, good.faces[300:301]]))
    source, targets = SurfacePoints([0], MIDDLE), SurfacePoints([1, 2], MIDDLE * 2)
    assert np.array_equal(log_map(broken, source, targets).distance, log_map(good, source, targets).distance)


def test_an_edge_without_length_is_one_vertex() -> None:
    """A square cut along a diagonal whose middle is doubled: the two faces between the doubles are segments."""
    points = [*SQUARE, [0.5, 0.5, 0], [0.5, 0.5, 0]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 5, 4], [0, 4, 5], [2, 3, 5], [3, 0, 5]]
    mesh = TriangleMesh(points, faces)
    source = SurfacePoints([0], [[0.4, 0.4, 0.2]])
    targets = SurfacePoints([1, 4, 5, 0, 4], [[0.3, 0.3, 0.4]] * 3 + [[0, 0, 1.0], [0, 0, 1.0]])
    log = log_map(mesh, source, targets)
    truth = np.linalg.norm(targets.positions(mesh) - source.positions(mesh), axis=1)
    assert np.abs(log.distance - truth).max() <= 1e-15
    end = trace_chains(mesh, source[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    assert np.abs(end.points.positions(mesh) - targets.positions(mesh)).max() <= 1e-12
    with pytest.raises(NotManifold, match="three distinct corners, but face 2"):
        log_map(mesh, SurfacePoints([2], MIDDLE), targets)


@pytest.mark.parametrize("overhang", [0.5, 0.0, 0.25])
def test_a_face_without_area_is_crossed_like_the_line_that_it_is(overhang: float) -> None:
    """A square of two triangles with a third, flat one on the diagonal."""
    points = [*SQUARE, [overhang, overhang, 0]] if overhang else [*SQUARE, [0.75, 0.75, 0]]
    faces = [[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]]
    mesh = TriangleMesh(points, faces)
    source = SurfacePoints([0], [[0.2, 0.5, 0.3]])
    targets = SurfacePoints([2, 3, 2, 3, 1], [[0.4, 0.3, 0.3], [0.3, 0.3, 0.4], [0, 0, 1], [1, 0, 0], MIDDLE[0]])
    log = log_map(mesh, source, targets)
    truth = np.linalg.norm(targets.positions(mesh) - source.positions(mesh), axis=1)
    assert np.abs(log.distance - truth).max() <= 1e-14
    end = trace_chains(mesh, source[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    assert np.abs(end.points.positions(mesh) - targets.positions(mesh)).max() <= 1e-10


@settings(max_examples=120)
@given(st.integers(0, 2**32 - 1))
def test_soups_of_triangles_answer_or_say_why_not(seed: int) -> None:
    """Points on a coarse lattice and random faces: doubled points, flat faces, fins, bow ties, several parts."""
    random = np.random.default_rng(seed)
    points = random.integers(0, 3, (9, 3)).astype(float)
    mesh = TriangleMesh(points, random.integers(0, 9, (random.integers(1, 14), 3)))
    at = SurfacePoints(random.integers(0, len(mesh.faces), 4), random.dirichlet([1.0] * 3, 4))
    for k in range(4):
        try:
            end = trace_geodesic(mesh, at[k], random.normal(size=2)[:1] + 1j)
            assert np.isfinite(end.points.positions(mesh)).all()
        except ContactError as error:
            assert str(error).endswith(".")
        try:
            log = log_map(mesh, at[k], at)
            chord = np.linalg.norm(at.positions(mesh) - at[k].positions(mesh), axis=1)
            assert (log.distance >= chord - 1e-9).all()
        except ContactError as error:
            assert str(error).endswith(".")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_points_that_are_no_numbers_are_refused(bad: float) -> None:
    with pytest.raises(InvalidInput, match="points must be finite"):
        TriangleMesh([[0, 0, 0], [1, 0, 0], [0, bad, 0]], [[0, 1, 2]])


def test_blocked_halfedges_are_blocked_from_both_sides() -> None:
    fin = TriangleMesh([*SQUARE, [0.5, 0.5, 1.0]], [[0, 1, 2], [0, 2, 3], [0, 2, 4]])
    topology = Topology.of(fin)
    assert sorted(np.flatnonzero(topology.twin == BLOCKED)) == [2, 3, 6]
