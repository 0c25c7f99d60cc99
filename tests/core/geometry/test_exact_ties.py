"""Lattices: straight ways pass saddles exactly, many are equally long, and yet every log can be walked again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from contact_core.geometry import SurfacePoints, TriangleMesh, log_map, trace_chains
from contact_core.testing import meshes


def terraces(seed: int) -> TriangleMesh:
    """Stairs down both ways: flat treads, creases, saddles where they cross."""
    mesh = meshes.lattice(11)
    rises = np.cumsum(np.random.default_rng(seed).integers(0, 2, (2, 11)), axis=1)
    column, row = mesh.points[:, :2].astype(int).T
    heights = rises[0][column] + rises[1][row]
    return mesh.with_points(np.column_stack([mesh.points[:, :2], heights]))


def plateaus(seed: int) -> TriangleMesh:
    """A plain with raised rectangles: flat vertices beside saddles and right angles."""
    mesh = meshes.lattice(11)
    random = np.random.default_rng(seed)
    heights = np.zeros((11, 11))
    for _ in range(4):
        (i, j), (height, width) = random.integers(0, 9, 2), random.integers(1, 5, 2)
        heights[i : i + height, j : j + width] += random.integers(1, 3)
    return mesh.with_points(np.column_stack([mesh.points[:, :2], heights.ravel()]))


def ring(seed: int) -> TriangleMesh:
    """Cubes round a hole."""
    random = np.random.default_rng(seed)
    solid = np.ones((5, 4, 2), bool)
    solid[1 : random.integers(2, 5), 1 : random.integers(2, 4), :] = False
    return meshes.blocks(solid)


def with_hole(seed: int) -> TriangleMesh:
    """A lattice without a square in its middle: ways along the rim and round its reflex corners."""
    mesh = meshes.lattice(9, 2, seed)
    middles = mesh.points[mesh.faces].mean(axis=1)[:, :2]
    return meshes.without_unused(mesh.points, mesh.faces[(np.abs(middles - 4.0) > 1.0).any(axis=1)])


KINDS = {
    "two levels": lambda seed: meshes.lattice(9, 2, seed),
    "three levels": lambda seed: meshes.lattice(9, 3, seed),
    "terraces": terraces,
    "plateaus": plateaus,
    "box": lambda seed: meshes.blocks(np.ones(tuple(np.random.default_rng(seed).integers(1, 4, 3)), bool)),
    "ring": ring,
    "ring, subdivided": lambda seed: meshes.subdivided(ring(seed)),
    "with a hole": with_hole,
}


def special_points(mesh: TriangleMesh, count: int, random: np.random.Generator) -> SurfacePoints:
    """Vertices, points of edges and faces at simple fractions, and some points anywhere."""
    weights = np.empty((count, 3))
    for k in range(count):
        eighth = random.integers(1, 8) / 8.0
        choices = ([1, 0, 0], [0.5, 0.5, 0], [eighth, 1 - eighth, 0], [1 / 3, 1 / 3, 1 / 3], [0.25, 0.25, 0.5])
        chosen = int(random.integers(0, 6))
        weights[k] = np.roll(choices[chosen], random.integers(3)) if chosen < 5 else random.dirichlet([1, 1, 1])
    return SurfacePoints(random.integers(0, len(mesh.faces), count), weights)


def queries(kind: str, seeds: int = 12) -> Iterator[tuple[TriangleMesh, SurfacePoints, SurfacePoints]]:
    """(mesh, sources, targets): one source and three in turn."""
    for seed in range(seeds):
        mesh, random = KINDS[kind](seed), np.random.default_rng(1000 + seed)
        for k in range(6):
            yield mesh, special_points(mesh, 1 + 2 * (k % 2), random), special_points(mesh, 100, random)


@pytest.mark.parametrize("kind", KINDS)
def test_exp_after_log_is_the_identity_on_lattices(kind: str) -> None:
    for mesh, sources, targets in queries(kind):
        log = log_map(mesh, sources, targets)
        end = trace_chains(mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
        gap = np.linalg.norm(end.points.positions(mesh) - targets.positions(mesh), axis=1)
        assert gap.max() <= 1e-11 * mesh.bounding_box_diagonal
        bends = np.diff(log.offsets)
        total = np.abs(log.first_leg) + np.bincount(
            np.repeat(np.arange(len(bends)), bends), log.lengths, minlength=len(bends)
        )
        np.testing.assert_allclose(total, log.distance, rtol=1e-13, atol=1e-13)


def test_of_two_images_on_one_ray_both_go_on() -> None:
    """A source seen past a saddle, and the saddle itself: of one distance, on one ray, and yet rays part behind."""
    mesh = KINDS["two levels"](103)
    middle, edge = SurfacePoints([52], [[1 / 3, 1 / 3, 1 / 3]]), SurfacePoints([14], [[0.5, 0.0, 0.5]])
    everything = SurfacePoints.at_vertices(mesh, np.arange(len(mesh.points)))
    there, back = log_map(mesh, middle, everything), log_map(mesh, everything, middle)
    each = [log_map(mesh, everything[k], middle[[0, 0]]).distance[0] for k in range(len(everything))]
    np.testing.assert_allclose(there.distance, each, rtol=1e-13)
    assert back.distance[0] == pytest.approx(min(each), rel=1e-13)
    assert log_map(mesh, middle, edge[[0, 0]]).distance[0] == pytest.approx(5.857351157794078, rel=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_distances_on_lattices_are_the_same_both_ways(kind: str) -> None:
    for seed in range(100, 106):
        mesh, random = KINDS[kind](seed), np.random.default_rng(seed)
        points = special_points(mesh, 24, random)
        d = np.stack([log_map(mesh, points[k], points).distance for k in range(len(points))])
        np.testing.assert_allclose(d, d.T, rtol=1e-12, atol=1e-14)
