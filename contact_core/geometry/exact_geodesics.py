"""Exact polyhedral geodesics: the log map of many targets in one propagation, and single shortest paths.

Source: Mitchell, Mount and Papadimitriou 1987; Chen and Han 1990; Xin and Wang 2009. The paper's ExactGeodesic,
InitialDirection, EndingDirection and ClosestPoints are fields of these results.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.kernel_arrays import Goal, Points, plain
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology
from contact_core.geometry.tracing import require_on_surface, trace_chains
from contact_core.geometry.workspace import Workspace


@dataclass(frozen=True, eq=False, slots=True)
class LogMap:
    """Shortest paths from the nearest of several sources to each of k targets.

    A shortest path runs straight until it bends round a saddle vertex or a reflex vertex of the boundary, so it is
    a chain: a first leg, then legs that turn and run on. `trace_chains` walks it again and ends at the target.

    anchor: (k,) index of the nearest source, -1 where none is in reach.
    distance: (k,) length of the whole path, inf where none.
    coordinates: (k,) complex; absolute value = distance, argument = initial direction in the source's tangent
    frame.
    headings: (k,) unit complex, forward direction at the target in its tangent frame (1 where nothing is walked).
    first_leg: (k,) complex tangent vector of the straight beginning; equal to coordinates where the path never
    bends.
    offsets: (k + 1,) rows offsets[i]:offsets[i + 1] of the two below are the further legs of path i.
    turning_angles, lengths: (c,) radians counter-clockwise from straight on (rescaled at the vertex), surface
    units.
    pops: windows and vertices that the search took from its heap: the work done.
    Where no source is in reach, coordinates and first_leg are 0.
    """

    anchor: IntArray
    distance: FloatArray
    coordinates: ComplexArray
    headings: ComplexArray
    first_leg: ComplexArray
    offsets: IntArray
    turning_angles: FloatArray
    lengths: FloatArray
    pops: int


@dataclass(frozen=True, eq=False, slots=True)
class Geodesic:
    """One shortest path.

    points: (c,) surface points: the start, each edge or vertex that it crosses, the end. length: surface units.
    heading, ending_heading: unit complex, forward directions at start and end in their tangent frames.
    log: the log map (one target) that it was traced from.
    """

    points: SurfacePoints
    length: float
    heading: complex
    ending_heading: complex
    log: LogMap

    def transport(self, vectors: Any) -> ComplexArray:
        """Parallel transport of tangent vectors (k,), complex, from the start to the end."""
        return np.asarray(vectors, np.complex128) * self._turn

    @property
    def _turn(self) -> complex:
        """A carried vector keeps its angle to the path, and does not turn with it where it bends."""
        bends = np.exp(-1j * self.log.turning_angles.sum())
        return complex(self.ending_heading / self.heading * bends)


def log_map(
    mesh: TriangleMesh,
    sources: SurfacePoints,
    targets: SurfacePoints,
    max_distance: float | None = None,
    *,
    seek: bool = False,
) -> LogMap:
    """The log map of k targets from the nearest of s >= 1 sources, exact, in one propagation for all of them.

    seek: a target that is alone is sought by A*, many times quicker (ADR 0014); of paths of one length another may
    be found.

    The search ends as soon as every target is final, and never goes beyond max_distance (surface units): its time
    and memory depend on that region, not on the mesh. A target on another component costs a search of the whole
    component unless max_distance is given. Raises InvalidInput, and NotManifold where the search meets a place that
    is not.
    """
    from contact_core.geometry.path_kernels import read_chains, read_targets

    limit = _limit(max_distance)
    topology = Topology.of(mesh)
    require_on_surface(topology, sources, "sources")
    require_on_surface(topology, targets, "targets")
    if not len(sources):
        raise InvalidInput("a log map needs at least one source, but got none.")
    count = len(targets)
    anchor, offsets = np.empty(count, np.int64), np.zeros(count + 1, np.int64)
    distance, headings = np.empty(count), np.empty(count, np.complex128)
    goal = _goal(mesh, targets, seek)
    halfedges, starts = plain(topology.halfedges), plain(sources.arrays)
    with Workspace.lent(mesh) as work:
        records = plain(work.targets(count))
        _search(topology, sources, targets, limit, work, records, goal)
        labels = plain(work.labels)
        bends = read_targets(
            limit, anchor, distance, headings.view(np.float64).reshape(-1, 2), offsets,
            halfedges, labels, records, _NO_LINE,
        )  # fmt: skip
        first_leg = np.empty(count, np.complex128)
        turning_angles, lengths = np.empty(bends), np.empty(bends)
        read_chains(
            starts, anchor, offsets, first_leg.view(np.float64).reshape(-1, 2), turning_angles, lengths,
            halfedges, labels, records,
        )  # fmt: skip
        pops = work.pops
    coordinates = first_leg
    if bends:
        coordinates = first_leg.copy()
        bent = offsets[1:] > offsets[:-1]
        coordinates[bent] *= distance[bent] / np.abs(first_leg[bent])
    for array in (anchor, distance, coordinates, headings, first_leg, offsets, turning_angles, lengths):
        array.setflags(write=False)
    return LogMap(anchor, distance, coordinates, headings, first_leg, offsets, turning_angles, lengths, pops)


def lowered_distances(
    mesh: TriangleMesh,
    sources: SurfacePoints,
    vertices: IntArray,
    known: FloatArray,
    max_distance: float,
    sought: BoolArray,
) -> FloatArray:
    """Distances (k,) of vertices (k,), without doubles, from earlier sources and further ones together.

    known: (k,) exact distances from the earlier ones, inf where none lies within max_distance; every vertex within
    max_distance of a further source is among them. sought: (k,) false where no further source can be nearer.

    What no further source comes nearer to costs nothing: a window that an earlier path beats ends there, like one
    that a path through a vertex beats (Xin and Wang 2009). Raises as log_map; what lies farther than max_distance
    may stay as it was known.
    """
    topology, targets = Topology.of(mesh), SurfacePoints.at_vertices(mesh, vertices[sought])
    require_on_surface(topology, sources, "sources")
    require_on_surface(topology, targets, "targets")
    with Workspace.lent(mesh) as work:
        records, goal = plain(work.targets(len(targets))), _goal(mesh, targets, False)
        _search(topology, sources, targets, _limit(max_distance), work, records, goal, (vertices, known))
        return work.labels.reach[vertices, 1]


def _search(
    topology: Topology,
    sources: SurfacePoints,
    targets: SurfacePoints,
    limit: float,
    work: Workspace,
    records: Any,
    goal: Goal,
    known: tuple[IntArray, FloatArray] | None = None,
) -> None:
    """Label the vertices and the targets' records in a workspace; refused where a place is not manifold.

    known: vertices and the distances that they have already.
    """
    from contact_core.geometry import log_map_kernels as kernels

    halfedges, starts, ends = plain(topology.halfedges), plain(sources.arrays), plain(targets.arrays)
    while True:
        if known is not None:
            work.label(*known)
        labels, windows, queue = plain(work.labels), plain(work.windows), plain(work.queue)
        status, element = kernels.search(starts, ends, limit, halfedges, labels, windows, queue, records, goal)
        if status != kernels.NO_ROOM:
            break
        work.grow()
    if status == kernels.MET_BLOCKED_EDGE:
        raise topology.refuse_halfedge(element, "a log map")
    if status == kernels.MET_BLOCKED_VERTEX:
        raise topology.refuse_vertex(element, "a log map")


def exact_geodesic(mesh: TriangleMesh, start: SurfacePoints, end: SurfacePoints) -> Geodesic:
    """The shortest path between two points (batches of one). Raises InvalidInput where no path joins them."""
    for name, point in (("start", start), ("end", end)):
        if len(point) != 1:
            raise InvalidInput(f"a geodesic has one {name} point, but got {len(point)}.")
    log = log_map(mesh, start, end)
    if log.anchor[0] < 0:
        raise InvalidInput("no path joins the two points: they lie on parts of the surface that are not connected.")
    path = trace_chains(mesh, start, log.first_leg, log.offsets, log.turning_angles, log.lengths, polyline=True)
    assert path.polylines is not None
    leg = complex(log.first_leg[0])
    heading = leg / abs(leg) if leg else 1.0 + 0.0j
    return Geodesic(path.polylines[0], float(log.distance[0]), heading, complex(log.headings[0]), log)


def parallel_transport(mesh: TriangleMesh, start: SurfacePoints, end: SurfacePoints, vectors: Any) -> ComplexArray:
    """Tangent vectors (k,), complex, carried from one point to another along the shortest geodesic.

    Source: Sharp, Soliman and Crane 2019, section 5.2: angles to the geodesic stay. Raises as exact_geodesic.
    """
    return exact_geodesic(mesh, start, end).transport(vectors)


def _goal(mesh: TriangleMesh, targets: SurfacePoints, seek: bool) -> Goal:
    """Where the search goes, as kernels take it: straight for a target that is alone, else nowhere."""
    alone = seek and len(targets) == 1
    x, y, z = targets.positions(mesh)[0].tolist() if alone else (0.0, 0.0, 0.0)
    return plain(Goal(mesh.points, x, y, z, int(alone)))


_NO_LINE = plain(Points(np.empty(0, np.int64), np.empty((0, 3))))  # no polyline is asked for


def _limit(max_distance: float | None) -> float:
    if max_distance is None:
        return float("inf")
    try:
        limit = float(max_distance)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"max_distance must be a length of at least 0, but is {max_distance!r}.") from error
    if not limit >= 0.0:
        raise InvalidInput(f"max_distance must be a length of at least 0, but is {max_distance}.")
    return limit
