"""A search for one place leaves out what leads elsewhere, and finds what one that spreads everywhere finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.geometry import LogMap, SurfacePoints, TriangleMesh, log_map, trace_chains
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family, family_names, surface_points
from tests.core.geometry.test_exact_ties import KINDS, special_points


def everywhere(
    mesh: TriangleMesh, sources: SurfacePoints, target: SurfacePoints, limit: float | None = None
) -> LogMap:
    """The same by a search that spreads like a wave."""
    return log_map(mesh, sources, target, limit)


def agrees(mesh: TriangleMesh, sources: SurfacePoints, target: SurfacePoints) -> tuple[int, int]:
    """Hold one against the other; returns the work of both. Of paths of one length either may have been found."""
    log, full = log_map(mesh, sources, target, seek=True), everywhere(mesh, sources, target)
    assert (log.anchor[0] < 0) == (full.anchor[0] < 0)
    if log.anchor[0] < 0:
        return log.pops, full.pops
    size = mesh.bounding_box_diagonal
    assert abs(log.distance[0] - full.distance[0]) <= 1e-12 * min(full.distance[0], size) + 1e-15 * size
    end = trace_chains(mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    gap = np.linalg.norm(end.points.positions(mesh) - target.positions(mesh), axis=1)
    assert gap[0] <= 1e-11 * size
    return log.pops, full.pops


@settings(max_examples=300)
@given(st.data(), family_names(), st.integers(1, 3))
def test_the_distance_is_that_of_a_full_search(data: st.DataObject, name: str, count: int) -> None:
    mesh = cached_family(name)
    agrees(mesh, data.draw(surface_points(mesh, count)), data.draw(surface_points(mesh)))


@pytest.mark.parametrize("kind", KINDS)
def test_among_paths_of_one_length_a_shortest_is_found(kind: str) -> None:
    """Lattices, where many ways are equally long and pass vertices exactly."""
    for seed in range(6):
        mesh, random = KINDS[kind](seed), np.random.default_rng(seed)
        for k in range(60):
            agrees(mesh, special_points(mesh, 1 + 2 * (k % 2), random), special_points(mesh, 1, random))


@settings(max_examples=60)
@given(st.data(), family_names(), st.floats(0.3, 1.7))
def test_a_limit_is_one_for_it_too(data: st.DataObject, name: str, share: float) -> None:
    mesh = cached_family(name)
    source, target = data.draw(surface_points(mesh)), data.draw(surface_points(mesh))
    distance = everywhere(mesh, source, target).distance[0]
    if not np.isfinite(distance) or abs(share - 1.0) < 1e-6:
        return
    log = log_map(mesh, source, target, share * distance, seek=True)
    assert log.distance[0] == pytest.approx(
        everywhere(mesh, source, target, share * distance).distance[0], rel=1e-12
    )


def test_the_work_is_that_of_the_way_and_not_of_the_disk() -> None:
    """On a plane only the straight strip between the two is looked at, however dense the mesh is."""
    work = []
    for resolution in (20, 80):
        mesh = meshes.plane(resolution)
        random = np.random.default_rng(3)
        pairs = [special_points(mesh, 2, random) for _ in range(20)]
        work.append(np.median([agrees(mesh, each[0], each[1]) for each in pairs], axis=0))
    (narrow, whole), (narrow_dense, whole_dense) = work
    assert narrow < 0.5 * whole and narrow_dense < 0.1 * whole_dense
    assert narrow_dense < 6.0 * narrow  # as long a way crosses four times as many edges
