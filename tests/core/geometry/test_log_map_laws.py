"""Laws of exact geodesics, over every mesh family and real scans."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from contact_core.arrays import ComplexArray, FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry import (
    LogMap,
    SurfacePoints,
    Topology,
    TriangleMesh,
    exact_geodesic,
    log_map,
    parallel_transport,
    trace_chains,
    trace_geodesic,
)
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family, family_names, headings, surface_points

geodesic = pytest.importorskip("pygeodesic.geodesic", reason="pygeodesic, the independent truth, is not installed")


def scattered(mesh: TriangleMesh, count: int, seed: int) -> SurfacePoints:
    """Points inside faces, a fifth of them on edges and a fifth on vertices."""
    random = np.random.default_rng(seed)
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    fifth = count // 5
    weights[:fifth] = np.eye(3)[random.integers(0, 3, fifth)]
    weights[fifth : 2 * fifth, 1] = 0.0
    return SurfacePoints(random.integers(0, len(mesh.faces), count), weights / weights.sum(axis=1, keepdims=True))


def walked_again(mesh: TriangleMesh, sources: SurfacePoints, log: LogMap) -> tuple[FloatArray, ComplexArray]:
    """Positions and headings at the ends of the chains of a log map."""
    end = trace_chains(mesh, sources[log.anchor], log.first_leg, log.offsets, log.turning_angles, log.lengths)
    return end.points.positions(mesh), end.headings


def all_vertices(mesh: TriangleMesh) -> SurfacePoints:
    return SurfacePoints.at_vertices(mesh, np.arange(len(mesh.points)))


@lru_cache(maxsize=8)
def scan(path: Path) -> TriangleMesh:
    """A real mesh from a wavefront file of triangles."""
    points, faces = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(word) for word in line.split()[1:4]])
        elif line.startswith("f "):
            faces.append([int(word.split("/")[0]) - 1 for word in line.split()[1:4]])
    return meshes.without_unused(np.array(points), np.array(faces))


SCANS = ["stanford_bunny_7k_closed.obj", "cup_with_handle_genus1.obj", "ycb_scissors.obj"]


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_exp_after_log_is_the_identity(name: str) -> None:
    mesh = cached_family(name)
    sources, targets = scattered(mesh, 5, 1), scattered(mesh, 150, 2)
    for k in range(len(sources)):
        log = log_map(mesh, sources[k], targets)
        positions, arrived = walked_again(mesh, sources[k], log)
        gap = np.linalg.norm(positions - targets.positions(mesh), axis=1)
        assert gap.max() <= 1e-11 * mesh.bounding_box_diagonal
        inside = (targets.barycentric.min(axis=1) > 0.0) & (log.distance > 0.0)
        assert np.abs(arrived - log.headings)[inside].max() <= 1e-9
        assert np.allclose(np.abs(log.coordinates), log.distance, rtol=1e-13, atol=0.0)


@pytest.mark.assets
@pytest.mark.parametrize("name", SCANS)
def test_exp_after_log_is_the_identity_on_scans(name: str, assets: Path) -> None:
    mesh = scan(assets / "objects" / name)
    sources, targets = scattered(mesh, 3, 1), scattered(mesh, 300, 2)
    bent = 0
    for k in range(len(sources)):
        log = log_map(mesh, sources[k], targets)
        reached = np.flatnonzero(log.anchor >= 0)
        positions, _ = walked_again(mesh, sources[k], log)
        gap = np.linalg.norm(positions - targets.positions(mesh), axis=1)[reached]
        assert gap.max() <= 1e-9 * mesh.bounding_box_diagonal
        bent += len(log.lengths)
    assert bent > 0  # chains were really walked


@pytest.mark.parametrize("name", [name for name in meshes.FAMILIES if name != "sliver"])
def test_distances_equal_an_independent_exact_engine(name: str) -> None:
    mesh = cached_family(name)
    peer = geodesic.PyGeodesicAlgorithmExact(mesh.points.copy(), mesh.faces.astype(np.int32))
    everywhere = all_vertices(mesh)
    for v in np.random.default_rng(3).integers(0, len(mesh.points), 4):
        truth, _ = peer.geodesicDistances(np.array([v], np.int32))
        ours = log_map(mesh, everywhere[int(v)], everywhere).distance
        assert np.abs(ours - truth).max() <= 1e-12 * truth.max()


@pytest.mark.assets
@pytest.mark.parametrize("name", SCANS[:2])
def test_distances_equal_an_independent_exact_engine_on_scans(name: str, assets: Path) -> None:
    mesh = scan(assets / "objects" / name)
    peer = geodesic.PyGeodesicAlgorithmExact(mesh.points.copy(), mesh.faces.astype(np.int32))
    sources = np.array([11, 1000, 3000], np.int32)
    truth, nearest = peer.geodesicDistances(sources)
    log = log_map(mesh, SurfacePoints.at_vertices(mesh, sources), all_vertices(mesh))
    assert np.abs(log.distance - truth).max() <= 1e-12 * truth.max()
    assert (log.anchor == nearest).mean() > 0.99  # the rest are ties


@pytest.mark.parametrize("ratio", [1e3, 1e6])
def test_slivers_against_the_unrolled_sheet(ratio: float) -> None:
    mesh = meshes.sliver(ratio)
    along = np.linspace(0.0, 5.0, 6)
    unrolled = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(along), np.diff(0.1 * along * along / 5.0)))])
    flat = np.stack([unrolled[np.rint(mesh.points[:, 0]).astype(int)], mesh.points[:, 1]], axis=1)  # (n, 2)
    everywhere = all_vertices(mesh)
    for v in range(0, len(flat), 5):
        truth = np.linalg.norm(flat - flat[v], axis=1)
        assert np.abs(log_map(mesh, everywhere[v], everywhere).distance - truth).max() <= 1e-12 * truth.max()
    sources, targets = scattered(mesh, 4, 5), scattered(mesh, 200, 6)
    for k in range(len(sources)):
        positions, _ = walked_again(mesh, sources[k], log_map(mesh, sources[k], targets))
        gap = np.linalg.norm(positions - targets.positions(mesh), axis=1).max()
        assert gap <= (1e-11 if ratio < 1e4 else 1e-7) * mesh.bounding_box_diagonal


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_midpoint_subdivision_changes_no_distance(name: str) -> None:
    mesh = cached_family(name)
    fine = meshes.subdivided(mesh)
    vertices = np.arange(len(mesh.points))
    for v in (0, len(vertices) // 2):
        coarse = log_map(mesh, SurfacePoints.at_vertices(mesh, v), SurfacePoints.at_vertices(mesh, vertices))
        finer = log_map(fine, SurfacePoints.at_vertices(fine, v), SurfacePoints.at_vertices(fine, vertices))
        assert np.abs(coarse.distance - finer.distance).max() <= 1e-12 * coarse.distance.max()


@settings(max_examples=80)
@given(st.data(), family_names())
def test_metric_axioms_and_chords(data: st.DataObject, name: str) -> None:
    mesh = cached_family(name)
    points = data.draw(surface_points(mesh, count=3))
    d = np.stack([log_map(mesh, points[k], points).distance for k in range(3)])
    size = mesh.bounding_box_diagonal
    assert np.abs(np.diag(d)).max() == 0.0
    assert np.abs(d - d.T).max() <= 1e-12 * size
    assert d[0, 2] <= d[0, 1] + d[1, 2] + 1e-12 * size
    positions = points.positions(mesh)
    assert (np.linalg.norm(positions[:, None] - positions[None], axis=2) <= d + 1e-12 * size).all()


@settings(max_examples=80)
@given(st.data(), family_names())
def test_the_way_back_is_the_way_there(data: st.DataObject, name: str) -> None:
    mesh = cached_family(name)
    points = data.draw(surface_points(mesh, count=2))
    there, back = log_map(mesh, points[0], points[1]), log_map(mesh, points[1], points[0])
    assume(there.distance[0] > 1e-6)
    if len(there.lengths) or len(back.lengths):
        return  # the same bends in the other order; the ends are what the next law compares
    same_way = abs(there.headings[0] + back.first_leg[0] / abs(back.first_leg[0])) <= 1e-7
    end = trace_geodesic(mesh, points[1], -there.headings * there.distance)
    assert same_way or np.linalg.norm(end.points.positions(mesh) - points[0].positions(mesh)) <= 1e-9  # a tie


@settings(max_examples=60)
@given(st.data(), family_names(), headings(), st.floats(0.01, 0.8))
def test_no_walk_is_shorter_than_the_distance(
    data: st.DataObject, name: str, heading: complex, length: float
) -> None:
    mesh = cached_family(name)
    start = data.draw(surface_points(mesh))
    end = trace_geodesic(mesh, start, [heading * length])
    shortest = log_map(mesh, start, end.points).distance[0]
    assert shortest <= length - end.remaining[0] + 1e-12 * mesh.bounding_box_diagonal


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_many_sources_are_the_nearest_of_each(name: str) -> None:
    mesh = cached_family(name)
    sources, targets = scattered(mesh, 7, 8), scattered(mesh, 100, 9)
    log = log_map(mesh, sources, targets)
    each = np.stack([log_map(mesh, sources[k], targets).distance for k in range(7)])  # (7, 100)
    assert np.abs(log.distance - each.min(axis=0)).max() <= 1e-12 * mesh.bounding_box_diagonal
    assert np.abs(each[log.anchor, np.arange(100)] - log.distance).max() <= 1e-12 * mesh.bounding_box_diagonal


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_a_bound_hides_what_is_farther_and_changes_nothing_else(name: str) -> None:
    mesh = cached_family(name)
    source, targets = scattered(mesh, 5, 10)[4], scattered(mesh, 200, 11)
    free = log_map(mesh, source, targets)
    bound = float(np.median(free.distance))
    held = log_map(mesh, source, targets, bound)
    near = free.distance <= bound
    assert (held.anchor == np.where(near, 0, -1)).all()
    assert np.isinf(held.distance[~near]).all()
    assert np.abs(held.distance[near] - free.distance[near]).max() <= 1e-13 * free.distance.max()
    assert held.pops < free.pops


@settings(max_examples=40)
@given(st.data(), family_names(without=("plane", "cylinder", "creased")), st.integers(0, 2**32 - 1))
def test_rigid_motion_and_relabelling_change_nothing(data: st.DataObject, name: str, seed: int) -> None:
    mesh = cached_family(name)
    random = np.random.default_rng(seed)
    points = data.draw(surface_points(mesh, count=2, inside_only=True))
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    order = random.permutation(len(mesh.points))
    number = np.argsort(order)  # old vertex -> new
    faces = random.permutation(len(mesh.faces))
    moved = TriangleMesh((mesh.points @ turn.T + [3.0, -2.0, 1.0])[order], number[mesh.faces][faces])
    there = SurfacePoints(np.argsort(faces)[points.faces], points.barycentric)
    first, second = log_map(mesh, points[0], points[1]), log_map(moved, there[0], there[1])
    assert abs(first.distance[0] - second.distance[0]) <= 1e-12 * mesh.bounding_box_diagonal


def test_a_plane_has_straight_lines() -> None:
    mesh = cached_family("plane")
    sources, targets = scattered(mesh, 10, 12), scattered(mesh, 200, 13)
    for k in range(10):
        log = log_map(mesh, sources[k], targets)
        truth = np.linalg.norm(targets.positions(mesh) - sources[k].positions(mesh), axis=1)
        assert np.abs(log.distance - truth).max() <= 1e-14
        assert len(log.lengths) <= 4  # nothing bends, but for ties along the rim


def test_a_cylinder_is_its_unrolled_polygon() -> None:
    mesh = meshes.cylinder(around=10, along=7, radius=0.5, height=2.0)
    side = 2.0 * 0.5 * np.sin(np.pi / 10)
    turn = np.rint(np.arctan2(mesh.points[:, 1], mesh.points[:, 0]) / (2.0 * np.pi / 10)).astype(int) % 10
    everywhere = all_vertices(mesh)
    for v in (0, 33, 52):
        steps = np.abs(turn - turn[v])
        across = np.minimum(steps, 10 - steps) * side
        truth = np.hypot(across, mesh.points[:, 2] - mesh.points[v, 2])
        assert np.abs(log_map(mesh, everywhere[v], everywhere).distance - truth).max() <= 1e-14


def test_distances_on_finer_spheres_converge_with_second_order() -> None:
    errors = []
    for level in (1, 2, 3):
        mesh = meshes.icosphere(level)
        everywhere = all_vertices(mesh)
        truth = np.arccos(np.clip(mesh.points @ mesh.points[0], -1.0, 1.0))
        errors.append(np.abs(log_map(mesh, everywhere[0], everywhere).distance - truth).max())
    order = np.log2(errors[1] / errors[2])
    assert 1.7 < order < 2.3
    assert errors[0] > errors[1] > errors[2]


@settings(max_examples=60)
@given(st.data(), family_names())
def test_exact_geodesic_is_a_path_of_its_length(data: st.DataObject, name: str) -> None:
    mesh = cached_family(name)
    start, end = data.draw(surface_points(mesh)), data.draw(surface_points(mesh))
    path = exact_geodesic(mesh, start, end)
    line = path.points.positions(mesh)
    size = mesh.bounding_box_diagonal
    assert abs(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() - path.length) <= 1e-10 * size
    assert np.abs(line[0] - start.positions(mesh)[0]).max() <= 1e-15 * size
    assert np.abs(line[-1] - end.positions(mesh)[0]).max() <= 1e-10 * size
    assert (path.points.barycentric[1:-1].min(axis=1) <= 1e-15).all()


@settings(max_examples=60)
@given(st.data(), family_names(), headings(), headings())
def test_transport_keeps_lengths_and_angles_and_comes_back(
    data: st.DataObject, name: str, one: complex, other: complex
) -> None:
    mesh = cached_family(name)
    start, end = data.draw(surface_points(mesh)), data.draw(surface_points(mesh))
    carried = parallel_transport(mesh, start, end, [one, 2.0 * other])
    assert abs(abs(carried[0]) - 1.0) <= 1e-12
    assert abs(carried[1] / carried[0] - 2.0 * other / one) <= 1e-12
    path = exact_geodesic(mesh, start, end)
    if path.length > 1e-9 and not len(path.log.lengths):  # the path's own direction stays its own
        assert abs(path.transport(path.heading) - path.ending_heading) <= 1e-12


def test_transport_on_a_plane_turns_nothing() -> None:
    mesh = cached_family("plane")
    points = scattered(mesh, 20, 14)[8:]
    corners = mesh.points[mesh.faces[points.faces]]
    axis = (corners[:, 1] - corners[:, 0]) @ [1.0, 1j, 0.0]  # the faces' x axes in the plane
    axis /= np.abs(axis)
    for k in range(1, len(points)):
        carried = parallel_transport(mesh, points[0], points[k], [1.0])
        assert abs(carried[0] * axis[k] - axis[0]) <= 1e-12


def test_work_depends_on_the_patch_and_not_on_the_mesh() -> None:
    small = meshes.noisy(3)
    large = meshes.copies(small, 30)
    last = 29 * len(small.faces)
    source, targets = SurfacePoints([5], [[0.2, 0.3, 0.5]]), scattered(small, 40, 15)
    near = log_map(small, source, targets).distance < 0.4
    targets = targets[np.flatnonzero(near)]
    there = (
        SurfacePoints(source.faces + last, source.barycentric),
        SurfacePoints(targets.faces + last, targets.barycentric),
    )
    one, many = log_map(small, source, targets), log_map(large, *there)
    assert np.allclose(one.distance, many.distance, rtol=1e-11)
    assert abs(one.pops - many.pops) <= 0.01 * one.pops
    assert one.pops < len(small.faces)


def test_other_components_are_out_of_reach() -> None:
    mesh = meshes.copies(meshes.icosphere(1), 2)
    half = len(mesh.faces) // 2
    targets = SurfacePoints([half, half + 1, 3], [[0.2, 0.3, 0.5], [1, 0, 0], [0.2, 0.3, 0.5]])
    log = log_map(mesh, SurfacePoints([0], [[0.2, 0.3, 0.5]]), targets)
    assert log.anchor.tolist() == [-1, -1, 0]
    assert np.isinf(log.distance[:2]).all()
    assert (log.coordinates[:2] == 0.0).all()
    with pytest.raises(InvalidInput, match="not connected"):
        exact_geodesic(mesh, SurfacePoints([0], [[0.2, 0.3, 0.5]]), targets[0])


def test_what_makes_no_sense_is_refused_in_a_sentence() -> None:
    mesh = cached_family("sphere")
    one = SurfacePoints([0], [[0.2, 0.3, 0.5]])
    none = SurfacePoints(np.zeros(0, np.int64), np.zeros((0, 3)))
    with pytest.raises(InvalidInput, match="at least one source"):
        log_map(mesh, none, one)
    with pytest.raises(InvalidInput, match="max_distance must be a length"):
        log_map(mesh, one, one, float("nan"))
    with pytest.raises(InvalidInput, match="targets must lie in faces"):
        log_map(mesh, one, SurfacePoints([10**6], [[1, 0, 0]]))
    assert len(log_map(mesh, one, none).distance) == 0
    assert Topology.of(mesh) is Topology.of(mesh)
