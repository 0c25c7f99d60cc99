"""The slot for geodesic engines: what an engine returns, and the exact engine of this package as the default.

A plugin registers another engine through `contact_geodesic_engines`, and `Session(engine=NAME)` measures the
coordinates of painted points with it. What a document holds is walked again by the exact tracer alone, whoever
measured it: opening a document, undo and replay ask no plugin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from contact_core.arrays import ComplexArray, FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints

if TYPE_CHECKING:
    from contact_core.geometry.exact_geodesics import Geodesic, LogMap
    from contact_core.geometry.tracing import Trace


class TraceResult(Protocol):
    """Where geodesics end. points: (k). headings: (k,) unit complex, forward direction at the end in its
    tangent frame. remaining: (k,) length left where a boundary stopped the trace."""

    @property
    def points(self) -> SurfacePoints: ...
    @property
    def headings(self) -> ComplexArray: ...
    @property
    def remaining(self) -> FloatArray: ...


class LogMapResult(Protocol):
    """The log map of k targets. anchor: (k,) nearest source, -1 if out of reach. distance: (k,), inf if out of
    reach. coordinates: (k,) complex, |z| = distance, argument = initial direction in the source's frame."""

    @property
    def anchor(self) -> IntArray: ...
    @property
    def distance(self) -> FloatArray: ...
    @property
    def coordinates(self) -> ComplexArray: ...


@runtime_checkable
class ChainedLogMapResult(LogMapResult, Protocol):
    """A log map that also knows how its paths bend round saddle vertices, as `LogMap` says. An engine returns this
    where it can; without chains a path that bends is taken for straight, and misses its target behind the bend."""

    @property
    def first_leg(self) -> ComplexArray: ...
    @property
    def offsets(self) -> IntArray: ...
    @property
    def turning_angles(self) -> FloatArray: ...
    @property
    def lengths(self) -> FloatArray: ...


@dataclass(frozen=True)
class EngineTolerances:
    """What an engine promises, relative to the bounding-box diagonal; the contract holds it to these.

    distance: error of distances. trace: error of traced end points. round_trip: distance between a target and
    the trace of its log map.
    """

    distance: float
    trace: float
    round_trip: float


@runtime_checkable
class GeodesicEngine(Protocol):
    """Answers geodesic questions on any triangle mesh (hook `contact_geodesic_engines`)."""

    name: str
    summary: str
    exact: bool
    tolerances: EngineTolerances

    def log_map(
        self, mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints, max_distance: float | None = None
    ) -> LogMapResult:
        """Nearest source, distance and coordinates of every target. Raises InvalidInput, NotManifold."""
        ...

    def trace_geodesic(self, mesh: TriangleMesh, starts: SurfacePoints, vectors: ComplexArray) -> TraceResult:
        """The exponential map: straight walks from starts (k) along tangent vectors (k,). Raises as above."""
        ...


class ExactEngine:
    """The engine of this package: exact in the polyhedral sense, at the cost of the patch, not of the mesh."""

    name = "exact"
    summary = "exact geodesics of the mesh, whatever its triangles"
    exact = True
    tolerances = EngineTolerances(distance=1e-12, trace=1e-12, round_trip=1e-8)

    def log_map(
        self, mesh: TriangleMesh, sources: SurfacePoints, targets: SurfacePoints, max_distance: float | None = None
    ) -> LogMap:
        from contact_core.geometry.exact_geodesics import log_map

        return log_map(mesh, sources, targets, max_distance)

    def trace_geodesic(self, mesh: TriangleMesh, starts: SurfacePoints, vectors: ComplexArray) -> Trace:
        from contact_core.geometry.tracing import trace_geodesic

        return trace_geodesic(mesh, starts, vectors)

    def exact_geodesic(self, mesh: TriangleMesh, start: SurfacePoints, end: SurfacePoints) -> Geodesic:
        """The shortest path between two points, with its edge crossings."""
        from contact_core.geometry.exact_geodesics import exact_geodesic

        return exact_geodesic(mesh, start, end)

    def __repr__(self) -> str:
        return "ExactEngine()"


EXACT: GeodesicEngine = ExactEngine()
