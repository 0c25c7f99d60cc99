"""An approximate engine on potpourri3d: logarithms by the vector heat method, traces by geometry-central.

It proves that the engine slot is real, and it answers as the paper's plugin did for closest points: "we use the
fast but approximate Vector Heat Method to do closest-point interpolation" (paper, discrete implementation;
Sharp, Soliman and Crane, TOG 2019). Sources inside faces are inserted as vertices; targets interpolate the
coordinates of their corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import ComplexArray, FloatArray, IntArray
from contact_core.errors import InvalidInput, MissingExtra, NotManifold
from contact_core.geometry.engine import EngineTolerances
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction

INSIDE = (
    1e-3  # a source on an edge is moved this far (barycentric) into its face; one nearer a corner is the corner
)


@dataclass(frozen=True, eq=False)
class ApproximateLogMap:
    """See contact_core.geometry.engine.LogMapResult."""

    anchor: IntArray
    distance: FloatArray
    coordinates: ComplexArray


@dataclass(frozen=True, eq=False)
class ApproximateTrace:
    """See contact_core.geometry.engine.TraceResult."""

    points: SurfacePoints
    headings: ComplexArray
    remaining: FloatArray


@dataclass(frozen=True, eq=False)
class _Refined:
    """The mesh with its sources as vertices. source_vertices: (s,). parent: (m',) original face of each face."""

    mesh: TriangleMesh
    source_vertices: IntArray
    parent: IntArray


class VectorHeatEngine:
    """The GeodesicEngine of potpourri3d; approximate, by the tolerances below."""

    name = "vector-heat"
    summary = "logarithmic maps by the vector heat method: approximate, fast far away"
    exact = False
    tolerances = EngineTolerances(distance=0.03, trace=1e-6, round_trip=0.05)

    def log_map(
        self, mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints, max_distance: float | None = None
    ) -> ApproximateLogMap:
        """Nearest source, distance and coordinates of each target, approximately.

        Raises InvalidInput, NotManifold.
        """
        if not len(sources):
            raise InvalidInput("a log map needs at least one source, but got none.")
        refined = _with_sources(mesh, sources)
        solver = _solver(refined.mesh)
        label = _components(refined.mesh)
        corners, weights = _corners_of(refined, mesh, targets)  # (k, 3), (k, 3)
        anchor = self._nearest(refined, solver, label, corners, weights)
        coordinates = np.full(len(targets), np.inf + 0j)
        bases = solver.get_tangent_frames()
        for source in np.unique(anchor[anchor >= 0]):
            mine = anchor == source
            flat = solver.compute_log_map(int(refined.source_vertices[source]))  # (n', 2)
            local = _interpolated(refined.mesh, flat, corners[mine], weights[mine])
            to_ours = _frame_change(mesh, refined, sources[source], int(refined.source_vertices[source]), bases)
            coordinates[mine] = (local[:, 0] + 1j * local[:, 1]) * to_ours
        distance = np.abs(coordinates)
        beyond = distance > (np.inf if max_distance is None else max_distance)
        return ApproximateLogMap(
            np.where(beyond, -1, anchor), np.where(beyond, np.inf, distance), np.where(beyond, np.inf, coordinates)
        )

    def nearest_source(self, mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints) -> IntArray:
        """(k,) the paper's ClosestPoints: nearest source of each target by heat-diffused interpolation; -1 where
        no source lies on the target's component."""
        refined = _with_sources(mesh, sources)
        corners, weights = _corners_of(refined, mesh, targets)
        return self._nearest(refined, _solver(refined.mesh), _components(refined.mesh), corners, weights)

    def _nearest(
        self, refined: _Refined, solver: Any, label: IntArray, corners: IntArray, weights: FloatArray
    ) -> IntArray:
        """Extend the sources' positions over the surface, and take the source next to what arrives.

        Positions and not indices: between the regions of sources 3 and 17 a blend of indices would say 10.
        """
        where = refined.mesh.points[refined.source_vertices]  # (s, 3)
        indices = [int(v) for v in refined.source_vertices]
        extended = np.stack([solver.extend_scalar(indices, where[:, k].tolist()) for k in range(3)], -1)  # (n', 3)
        arrived = np.einsum("kc,kci->ki", weights, extended[corners])  # (k, 3)
        gap = np.linalg.norm(arrived[:, None] - where[None], axis=2)  # (k, s)
        gap[label[corners[:, 0]][:, None] != label[refined.source_vertices][None]] = np.inf
        nearest = gap.argmin(axis=1)
        return np.where(np.isfinite(gap.min(axis=1)), nearest, -1)

    def trace_geodesic(self, mesh: TriangleMesh, starts: SurfacePoints, vectors: ComplexArray) -> ApproximateTrace:
        """Straight walks; end points are put back onto the surface by the closest point. Raises InvalidInput."""
        vectors = np.asarray(vectors, np.complex128)
        tracer = _potpourri().GeodesicTracer(mesh.points, mesh.faces)
        length = np.abs(vectors)
        safe = np.where(length > 0, vectors / np.maximum(length, 1e-300), 1.0)
        directions = heading_to_direction(mesh, starts, safe)  # (k, 3)
        ends, arrivals, walked = starts.positions(mesh), directions.copy(), np.zeros(len(starts))
        for k in np.flatnonzero(length > 0):
            start = np.clip(starts.barycentric[k], INSIDE * 1e-3, None)
            path = tracer.trace_geodesic_from_face(
                int(starts.faces[k]), start / start.sum(), directions[k] * length[k]
            )
            legs = np.diff(path, axis=0)
            legs = legs[np.linalg.norm(legs, axis=1) > 0]
            if len(legs):
                ends[k], arrivals[k], walked[k] = path[-1], legs[-1], np.linalg.norm(legs, axis=1).sum()
        points = Locator.of(mesh).closest(ends).points
        remaining = np.maximum(length - walked, 0.0)
        remaining[remaining < 1e-6 * mesh.bounding_box_diagonal] = 0.0
        return ApproximateTrace(points, direction_to_heading(mesh, points, arrivals), remaining)


def _potpourri() -> Any:
    try:
        import potpourri3d
    except ImportError as error:
        raise MissingExtra("the vector-heat engine", "engines") from error
    return potpourri3d


def _solver(mesh: TriangleMesh) -> Any:
    try:
        return _potpourri().MeshVectorHeatSolver(mesh.points, mesh.faces)
    except RuntimeError as error:  # geometry-central refuses the whole mesh
        raise NotManifold(f"the vector-heat engine needs a manifold mesh throughout: {error}") from error


def _components(mesh: TriangleMesh) -> IntArray:
    """(n,) label of the component of each vertex."""
    rows, columns = mesh.faces[:, [0, 1]].ravel(), mesh.faces[:, [1, 2]].ravel()
    graph = coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape=2 * (len(mesh.points),))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _with_sources(mesh: TriangleMesh, sources: SurfacePoints) -> _Refined:
    """Split faces at the sources, one by one; a source at a corner is that vertex."""
    points, faces = [*mesh.points], [*mesh.faces]
    parent = [*range(len(mesh.faces))]
    children: dict[int, list[int]] = {}
    vertices = np.empty(len(sources), np.int64)
    for s, (face, weights) in enumerate(zip(sources.faces, sources.barycentric, strict=True)):
        if weights.max() > 1.0 - INSIDE:
            vertices[s] = mesh.faces[face, weights.argmax()]
            continue
        inside = np.maximum(weights, INSIDE)
        position = (inside / inside.sum()) @ mesh.points[mesh.faces[face]]
        family = children.setdefault(int(face), [int(face)])
        host = max(family, key=lambda f: _barycentric(np.array(points)[faces[f]], position).min())
        a, b, c = faces[host]
        vertices[s] = len(points)
        points.append(position)
        faces[host] = np.array([a, b, vertices[s]])
        for corner in ([b, c, vertices[s]], [c, a, vertices[s]]):
            family.append(len(faces))
            faces.append(np.array(corner))
            parent.append(int(face))
    return _Refined(TriangleMesh(np.array(points), np.array(faces)), vertices, np.array(parent))


def _barycentric(corners: FloatArray, position: FloatArray) -> FloatArray:
    """Barycentric coordinates (3,) of a position in the plane of a triangle (3, 3)."""
    solved = np.linalg.lstsq((corners[1:] - corners[0]).T, position - corners[0], rcond=None)[0]
    return np.array([1.0 - solved.sum(), *solved])


def _corners_of(refined: _Refined, mesh: TriangleMesh, targets: SurfacePoints) -> tuple[IntArray, FloatArray]:
    """Corner vertices (k, 3) of the refined face that holds each target, and its weights there (k, 3)."""
    corners, weights = mesh.faces[targets.faces].copy(), targets.barycentric.copy()
    split = set(refined.parent[len(mesh.faces) :].tolist())
    for k in [k for k, face in enumerate(targets.faces.tolist()) if face in split]:
        position = weights[k] @ mesh.points[corners[k]]
        family = np.flatnonzero(refined.parent == targets.faces[k])
        options = [_barycentric(refined.mesh.points[refined.mesh.faces[f]], position) for f in family]
        best = int(np.argmax([option.min() for option in options]))
        corners[k] = refined.mesh.faces[family[best]]
        weights[k] = np.maximum(options[best], 0.0) / np.maximum(options[best], 0.0).sum()
    return corners, weights


def _interpolated(mesh: TriangleMesh, flat: FloatArray, corners: IntArray, weights: FloatArray) -> FloatArray:
    """(k, 2) coordinates inside faces. Where a face lies across the cut locus its corners hold two answers: only
    those that agree with the heaviest corner, to twice the length of the face's edges, are blended."""
    values = flat[corners]  # (k, 3, 2)
    main = weights.argmax(axis=1)[:, None]
    apart = np.linalg.norm(values - np.take_along_axis(values, main[..., None], axis=1), axis=2)  # (k, 3)
    position = mesh.points[corners]
    edge = np.linalg.norm(position - np.take_along_axis(position, main[..., None], axis=1), axis=2)
    share = np.where(apart <= 2.0 * edge + 1e-12, weights, 0.0)
    return np.einsum("kc,kci->ki", share / share.sum(axis=1, keepdims=True), values)


def _frame_change(
    mesh: TriangleMesh, refined: _Refined, source: SurfacePoints, vertex: int, bases: tuple[FloatArray, ...]
) -> complex:
    """Unit complex number from geometry-central's frame at a vertex to our tangent frame at the source.

    Its x axis is one of the vertex's edges, projected; that edge lies in a face, so both frames know its angle.
    """
    x, y = bases[0][vertex], bases[1][vertex]
    if vertex >= len(mesh.points):  # inside a face: the frame is flat, any direction in the face will do
        return complex(direction_to_heading(mesh, source, x[None])[0])
    beside = refined.mesh.faces[(refined.mesh.faces == vertex).any(axis=1)]
    edges = refined.mesh.points[np.setdiff1d(beside, [vertex])] - refined.mesh.points[vertex]
    flat = np.stack([edges @ x, edges @ y], -1)  # (e, 2)
    reference = edges[np.argmax(flat[:, 0] / np.linalg.norm(flat, axis=1))]
    return complex(direction_to_heading(mesh, source, reference[None])[0])
