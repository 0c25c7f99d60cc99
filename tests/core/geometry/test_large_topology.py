"""Of a large mesh records are written where queries come: results are the same, and so is the order of visits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.arrays import sparse_zeros
from contact_core.errors import ContactError
from contact_core.geometry import SurfacePoints, Topology, TriangleMesh, log_map, topology, trace_chains
from contact_core.geometry.fronts import spread_distances
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family


@pytest.fixture(autouse=True)
def every_mesh_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topology, "VISITED_AT_ONCE", 0)


def afresh(mesh: TriangleMesh) -> TriangleMesh:
    """The same mesh, that no query has seen."""
    return TriangleMesh(mesh.points, mesh.faces)


def written_at_once(mesh: TriangleMesh) -> TriangleMesh:
    result = afresh(mesh)
    topology.VISITED_AT_ONCE = len(mesh.faces)
    Topology.of(result)
    topology.VISITED_AT_ONCE = 0
    return result


def darts(mesh: TriangleMesh, seed: int, count: int) -> SurfacePoints:
    """Points in faces, on edges and at vertices."""
    random = np.random.default_rng(seed)
    weights = random.dirichlet([1.0] * 3, count)
    weights[::3, 0] = 0.0
    weights[::5] = np.eye(3)[random.integers(0, 3, len(weights[::5]))]
    return SurfacePoints(random.integers(0, len(mesh.faces), count), weights / weights.sum(axis=1, keepdims=True))


def log_maps(mesh: TriangleMesh, at: SurfacePoints) -> list[Any]:
    log = log_map(mesh, at[:2], at)
    return [log.anchor, log.distance, log.coordinates, log.headings, log.turning_angles, log.lengths]


def walks(mesh: TriangleMesh, at: SurfacePoints) -> list[Any]:
    legs = np.exp(1j * np.arange(len(at))) * 0.3 * mesh.bounding_box_diagonal
    trace = trace_chains(mesh, at, legs, np.zeros(len(at) + 1, int), [], [], polyline=True)
    assert trace.polylines is not None
    return [trace.points.faces, trace.points.barycentric, trace.headings, trace.polylines.points.barycentric]


def directions(mesh: TriangleMesh, at: SurfacePoints) -> list[Any]:
    in_space = heading_to_direction(mesh, at, np.exp(2j * np.arange(len(at))))
    return [in_space, direction_to_heading(mesh, at, in_space)]


def fronts(mesh: TriangleMesh, at: SurfacePoints) -> list[Any]:
    far = np.full(len(mesh.points), np.inf)
    return list(spread_distances(mesh, at[:1], 0.5 * mesh.bounding_box_diagonal, far))


QUERIES: list[Callable[[TriangleMesh, SurfacePoints], list[Any]]] = [log_maps, walks, directions, fronts]


def outcome(
    query: Callable[[TriangleMesh, SurfacePoints], list[Any]], mesh: TriangleMesh, at: SurfacePoints
) -> Any:
    try:
        return [np.ascontiguousarray(array).tobytes() for array in query(mesh, at)]
    except ContactError as error:
        return str(error)


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_queries_in_any_order_find_the_same_bits(name: str) -> None:
    mesh = cached_family(name)
    whole = written_at_once(mesh)
    for seed in range(6):
        random = np.random.default_rng(seed)
        fresh = afresh(mesh)
        for number in random.permutation(len(QUERIES)):
            at = darts(mesh, 7 * seed + int(number), 12)
            assert outcome(QUERIES[number], fresh, at) == outcome(QUERIES[number], whole, at)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_broken_meshes_are_refused_in_the_same_words(seed: int) -> None:
    random = np.random.default_rng(seed)
    faces = random.integers(0, 9, (random.integers(1, 14), 3))
    mesh = TriangleMesh(random.normal(size=(9, 3)), faces[[len(set(face)) == 3 for face in faces.tolist()]])
    if len(mesh.faces):
        whole, at = written_at_once(mesh), darts(mesh, seed, 5)
        for query in QUERIES:
            assert outcome(query, afresh(mesh), at) == outcome(query, whole, at)


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_the_whole_arrays_are_the_same_bits(name: str) -> None:
    mesh = cached_family(name)
    whole, fresh = Topology.of(written_at_once(mesh)), Topology.of(afresh(mesh))
    assert fresh.is_manifold == whole.is_manifold
    assert np.array_equal(fresh.boundary_halfedges, whole.boundary_halfedges)
    for array in ("tail", "first", "kind", "twin", "shape", "angle_sum"):
        assert np.array_equal(getattr(fresh, array), getattr(whole, array)), array


def test_a_query_writes_its_region_alone() -> None:
    mesh = afresh(meshes.plane(60))
    middle = SurfacePoints([len(mesh.faces) // 2], [[0.2, 0.3, 0.5]])
    log_map(mesh, middle, middle, 0.05 * mesh.bounding_box_diagonal)
    written = np.count_nonzero(Topology.of(mesh).halfedges.shape[::3, 0])
    assert 0 < written < 0.1 * len(mesh.faces)


def test_threads_that_meet_in_one_region_find_the_same() -> None:
    mesh = meshes.icosphere(4)
    at = darts(mesh, 3, 60)
    wanted = [outcome(query, written_at_once(mesh), at) for query in QUERIES]
    for _ in range(5):
        fresh, found = afresh(mesh), [None] * 8
        Topology.of(fresh)
        gate = threading.Barrier(len(found))

        def run(number: int, mesh: TriangleMesh = fresh, found: list[Any] = found, gate: Any = gate) -> None:
            gate.wait()
            found[number] = outcome(QUERIES[number % len(QUERIES)], mesh, at)

        threads = [threading.Thread(target=run, args=(number,)) for number in range(len(found))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert found == [*wanted, *wanted]


def test_sparse_zeros_are_zeros_to_write_to() -> None:
    for rows in (3, 1 << 19):
        array = sparse_zeros((rows, 2))
        assert array.shape == (rows, 2) and array.flags.writeable and not array.any()
        array[rows // 2] = 1.0
        assert array.sum() == 2.0
