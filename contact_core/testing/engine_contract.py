"""The contract of geodesic engines: what every engine answers, each within the tolerances that it declares.

A third party writes

    class TestMyEngine(EngineContract):
        @pytest.fixture
        def engine(self) -> GeodesicEngine:
            return MyEngine()

Lengths are judged relative to the bounding-box diagonal, by `engine.tolerances`.
"""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.arrays import ComplexArray, FloatArray
from contact_core.geometry.engine import GeodesicEngine
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.testing import meshes
from contact_core.testing.contract import Contract

RADIUS = 0.5  # of the sphere and the cylinder below


def scattered(mesh: TriangleMesh, count: int, seed: int = 0) -> SurfacePoints:
    """`count` reproducible points well inside faces."""
    random = np.random.default_rng(seed)
    weights = random.uniform(0.2, 1.0, (count, 3))
    return SurfacePoints(random.integers(0, len(mesh.faces), count), weights / weights.sum(axis=1, keepdims=True))


def close_to(mesh: TriangleMesh, positions: FloatArray, expected: FloatArray, tolerance: float, what: str) -> None:
    """Positions (k, 3) agree within tolerance x diagonal; the message holds the worst pair."""
    miss = np.linalg.norm(positions - expected, axis=1)
    worst = int(miss.argmax())
    limit = tolerance * mesh.bounding_box_diagonal
    assert miss[worst] <= limit, (
        f"{what}: point {worst} came to {positions[worst]}, expected {expected[worst]}:"
        f" {miss[worst]:.3g} > {limit:.3g}"
    )


def direction_vectors(mesh: TriangleMesh, points: SurfacePoints, vectors: ComplexArray) -> FloatArray:
    """(k, 3) tangent vectors in space of complex vectors (k,) at surface points."""
    length = np.abs(vectors)
    headings = np.where(length > 0, vectors / np.maximum(length, 1e-300), 1.0)
    return np.asarray(length[:, None] * heading_to_direction(mesh, points, headings))


def distance_matrix(engine: GeodesicEngine, mesh: TriangleMesh, points: SurfacePoints) -> FloatArray:
    """(k, k) geodesic distances, each row by one query."""
    return np.stack([engine.log_map(mesh, points[i], points).distance for i in range(len(points))])


class EngineContract(Contract):
    """Distances are a metric, plane and cylinder are exact, exp undoes log, results say what they could not do."""

    about, letter = "geodesic engine", "E"

    @pytest.fixture
    def engine(self) -> GeodesicEngine:
        raise AssertionError(f"{type(self).__name__} must give a fixture `engine` that returns a GeodesicEngine.")

    def test_e01_declares_itself(self, engine: GeodesicEngine) -> None:
        """An engine has a name and a summary, says whether it is exact, and declares its tolerances."""
        assert isinstance(engine, GeodesicEngine), f"{engine!r} lacks a member of GeodesicEngine"
        assert len(engine.summary.split()) >= 3, engine.summary
        assert engine.name and isinstance(engine.exact, bool)
        assert 0 < engine.tolerances.distance < 1 and 0 < engine.tolerances.trace < 1

    def test_e02_distance_to_itself_is_zero(self, engine: GeodesicEngine) -> None:
        """A point is at distance 0 from itself, and nothing else is nearer."""
        mesh = meshes.noisy()
        points = scattered(mesh, 5)
        log = engine.log_map(mesh, points, points)
        limit = engine.tolerances.distance * mesh.bounding_box_diagonal
        np.testing.assert_array_equal(log.anchor, np.arange(5))
        assert np.abs(log.distance).max() <= limit, log.distance

    def test_e03_symmetry_and_triangle_inequality(self, engine: GeodesicEngine) -> None:
        """Distances are symmetric and obey the triangle inequality."""
        mesh = meshes.icosphere(3)
        distance = distance_matrix(engine, mesh, scattered(mesh, 6))
        limit = 2 * engine.tolerances.distance * mesh.bounding_box_diagonal
        assert np.abs(distance - distance.T).max() <= limit, distance - distance.T
        detour = (distance[:, :, None] + distance[None, :, :]).min(axis=1)
        assert (distance - detour).max() <= 1.5 * limit, distance - detour

    def test_e04_never_shorter_than_the_chord(self, engine: GeodesicEngine) -> None:
        """No geodesic is shorter than the straight line in space."""
        mesh = meshes.torus()
        points = scattered(mesh, 8)
        positions = points.positions(mesh)
        chord = np.linalg.norm(positions - positions[:1], axis=1)
        distance = engine.log_map(mesh, points[0], points).distance
        assert (chord - distance).max() <= engine.tolerances.distance * mesh.bounding_box_diagonal, distance - chord

    def test_e05_plane_logs_are_straight_lines(self, engine: GeodesicEngine) -> None:
        """On a plane the log map is the difference of positions, length and direction."""
        mesh = meshes.plane(16)
        points = scattered(mesh, 12)
        log = engine.log_map(mesh, points[0], points)
        there = points.positions(mesh)[:1] + direction_vectors(mesh, points[np.zeros(12, int)], log.coordinates)
        close_to(mesh, there, points.positions(mesh), engine.tolerances.distance, "position + log")

    def test_e06_cylinder_unrolls(self, engine: GeodesicEngine) -> None:
        """On a tube distances within a third of its turn are those of its unrolled polygon."""
        mesh = meshes.cylinder(around=48, along=24, radius=RADIUS)
        points = scattered(mesh, 30)
        position = points.positions(mesh)
        points = points[position[:, :2] @ position[0, :2] > -0.5 * RADIUS * RADIUS]
        flat = _unrolled(mesh, points)  # (k, 2)
        around = 48 * 2 * RADIUS * np.sin(np.pi / 48)
        step = np.abs(flat - flat[0])
        step[:, 0] = np.minimum(step[:, 0], around - step[:, 0])
        miss = np.abs(engine.log_map(mesh, points[0], points).distance - np.linalg.norm(step, axis=1))
        assert miss.max() <= engine.tolerances.distance * mesh.bounding_box_diagonal, miss

    def test_e07_nearest_source_is_nearest(self, engine: GeodesicEngine) -> None:
        """With several sources each target gets the nearest and its distance."""
        mesh = meshes.icosphere(3)
        sources, targets = scattered(mesh, 4, seed=1), scattered(mesh, 20, seed=2)
        each = np.stack([engine.log_map(mesh, sources[i], targets).distance for i in range(4)])  # (4, 20)
        log = engine.log_map(mesh, sources, targets)
        limit = 2 * engine.tolerances.distance * mesh.bounding_box_diagonal
        assert np.abs(log.distance - each.min(axis=0)).max() <= limit
        assert (each[log.anchor, np.arange(20)] - each.min(axis=0)).max() <= limit

    def test_e08_coordinates_have_the_length_of_the_distance(self, engine: GeodesicEngine) -> None:
        """The modulus of the coordinates is the distance."""
        mesh = meshes.torus()
        log = engine.log_map(mesh, scattered(mesh, 2), scattered(mesh, 20, seed=3))
        np.testing.assert_allclose(np.abs(log.coordinates), log.distance, rtol=1e-9, atol=1e-12)

    def test_e09_plane_traces_are_straight(self, engine: GeodesicEngine) -> None:
        """On a plane a trace ends at start + vector."""
        mesh = meshes.plane(16)
        starts = SurfacePoints([_face_at(mesh, 0.5, 0.5)] * 12, [[0.3, 0.3, 0.4]] * 12)
        angles = np.linspace(0, 2 * np.pi, 12, endpoint=False) + 0.1
        vectors = 0.37 * np.exp(1j * angles)
        trace = engine.trace_geodesic(mesh, starts, vectors)
        expected = starts.positions(mesh) + direction_vectors(mesh, starts, vectors)
        close_to(mesh, trace.points.positions(mesh), expected, engine.tolerances.trace, "end of the trace")
        assert np.abs(trace.remaining).max() <= engine.tolerances.trace * mesh.bounding_box_diagonal

    def test_e10_traces_follow_great_circles(self, engine: GeodesicEngine) -> None:
        """On a fine sphere a trace stays within a hundredth of the radius of its great circle."""
        mesh = meshes.icosphere(4)
        starts = scattered(mesh, 8, seed=4)
        vectors = np.exp(1j * np.linspace(0, 6, 8))
        trace = engine.trace_geodesic(mesh, starts, vectors)
        origin = starts.positions(mesh)
        origin /= np.linalg.norm(origin, axis=1, keepdims=True)
        tangent = direction_vectors(mesh, starts, vectors)
        tangent -= np.einsum("ki,ki->k", tangent, origin)[:, None] * origin
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        close_to(
            mesh, trace.points.positions(mesh), np.cos(1.0) * origin + np.sin(1.0) * tangent,
            max(0.01 / mesh.bounding_box_diagonal, engine.tolerances.trace), "end of the great arc",
        )  # fmt: skip

    def test_e11_exp_undoes_log(self, engine: GeodesicEngine) -> None:
        """Tracing the log map of a nearby target reaches the target."""
        mesh = meshes.icosphere(3)
        source, targets = scattered(mesh, 1, seed=5), scattered(mesh, 40, seed=6)
        log = engine.log_map(mesh, source, targets)
        near = np.linalg.norm(targets.positions(mesh) - source.positions(mesh), axis=1) < 1.2
        trace = engine.trace_geodesic(mesh, source[np.zeros(near.sum(), int)], log.coordinates[near])
        close_to(
            mesh,
            trace.points.positions(mesh),
            targets[near].positions(mesh),
            engine.tolerances.round_trip,
            "exp(log)",
        )

    def test_e12_a_trace_stops_at_the_boundary(self, engine: GeodesicEngine) -> None:
        """A trace that leaves the surface stops on its boundary and tells the length that remains."""
        mesh = meshes.plane(12)
        start = SurfacePoints([_face_at(mesh, 0.5, 0.5)], [[0.3, 0.3, 0.4]])
        trace = engine.trace_geodesic(mesh, start, np.array([3.0 * np.exp(0.3j)]))
        end, begin = trace.points.positions(mesh)[0], start.positions(mesh)[0]
        limit = engine.tolerances.trace * mesh.bounding_box_diagonal
        assert min(end[0], end[1], 1 - end[0], 1 - end[1]) <= limit, end
        assert abs(float(np.linalg.norm(end - begin)) + trace.remaining[0] - 3.0) <= 2 * limit, trace.remaining

    def test_e13_says_what_it_did_not_reach(self, engine: GeodesicEngine) -> None:
        """Targets on another component, or beyond max_distance, get anchor -1 and infinite distance."""
        mesh = meshes.copies(meshes.icosphere(2), 2)
        half = len(mesh.faces) // 2
        source = SurfacePoints([0], [[0.3, 0.3, 0.4]])
        log = engine.log_map(mesh, source, SurfacePoints([half + 3, 1], [[0.3, 0.3, 0.4]] * 2))
        assert log.anchor[0] == -1 and np.isinf(log.distance[0]), log.distance
        assert log.anchor[1] == 0 and np.isfinite(log.distance[1]), log.distance
        bounded = engine.log_map(mesh, source, scattered(meshes.icosphere(2), 200), 0.6)
        inside = bounded.anchor == 0
        assert inside.any() and not inside.all()
        assert bounded.distance[inside].max() <= 0.6 * (1 + engine.tolerances.distance)

    def test_e14_rigid_motion_and_scale(self, engine: GeodesicEngine) -> None:
        """Distances are invariant under rigid motion and scale with the mesh."""
        mesh = meshes.torus()
        points = scattered(mesh, 6)
        spin = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
        moved = mesh.with_points(7.0 * mesh.points @ spin.T + np.array([3.0, -2.0, 5.0]))
        first = engine.log_map(mesh, points[0], points).distance
        second = engine.log_map(moved, points[0], points).distance
        limit = 10 * engine.tolerances.distance * moved.bounding_box_diagonal
        assert np.abs(second - 7.0 * first).max() <= limit, second - 7.0 * first

    def test_e15_leaves_its_input_alone_and_repeats_itself(self, engine: GeodesicEngine) -> None:
        """Asking twice gives the same answer bit for bit."""
        mesh = meshes.with_holes()
        sources, targets = scattered(mesh, 2), scattered(mesh, 10, seed=1)
        first, second = (engine.log_map(mesh, sources, targets) for _ in range(2))
        np.testing.assert_array_equal(first.coordinates, second.coordinates)


def _face_at(mesh: TriangleMesh, x: float, y: float) -> int:
    centres = mesh.points[mesh.faces].mean(axis=1)
    return int(np.linalg.norm(centres[:, :2] - [x, y], axis=1).argmin())


def _unrolled(mesh: TriangleMesh, points: SurfacePoints) -> FloatArray:
    """(k, 2) coordinates of points of a 48-sided tube on its flat unrolling."""
    position = points.positions(mesh)
    side = 2 * RADIUS * np.sin(np.pi / 48)
    panel = np.floor(np.mod(np.arctan2(position[:, 1], position[:, 0]), 2 * np.pi) / (2 * np.pi / 48))
    angle = 2 * np.pi / 48 * panel
    corner = RADIUS * np.stack([np.cos(angle), np.sin(angle)], -1)
    along = np.linalg.norm(position[:, :2] - corner, axis=1)
    return np.stack([panel * side + along, position[:, 2]], -1)
