"""The exponential map: walk straight from surface points along tangent vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.kernel_arrays import Points, plain
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology


@dataclass(frozen=True, eq=False, slots=True)
class Polylines:
    """k polylines on a surface: rows begins[i]:ends[i] of points are polyline i, start and end included.

    points: (c) surface points; those between start and end lie on edges or vertices. begins, ends: (k,).
    """

    points: SurfacePoints
    begins: IntArray
    ends: IntArray

    def __len__(self) -> int:
        return len(self.begins)

    def __getitem__(self, index: int) -> SurfacePoints:
        """The surface points of one polyline."""
        return self.points[self.begins[index] : self.ends[index]]


@dataclass(frozen=True, eq=False, slots=True)
class Trace:
    """Where k geodesics end.

    points: (k). headings: (k,) unit complex, forward direction at the end in its tangent frame (1 where nothing was
    walked along a zero vector). remaining: (k,) length left where a boundary stopped the walk, else 0 (surface
    units). polylines: the paths, when asked for.
    """

    points: SurfacePoints
    headings: ComplexArray
    remaining: FloatArray
    polylines: Polylines | None = None


def trace_geodesic(mesh: TriangleMesh, starts: SurfacePoints, vectors: Any, *, polyline: bool = False) -> Trace:
    """The exponential map of k starts along vectors (k,), complex, surface units, in the starts' tangent frames.

    Straight through vertices: equal angles on both sides in the rescaled frame. A boundary stops the walk. Raises
    InvalidInput, and NotManifold where a walk meets a place that is not. Source: Polthier and Schmies 2006.
    """
    return trace_chains(mesh, starts, vectors, _NO_OFFSETS, _NO_NUMBERS, _NO_NUMBERS, polyline=polyline)


def trace_chains(
    mesh: TriangleMesh,
    starts: SurfacePoints,
    first_leg: Any,
    offsets: Any,
    turning_angles: Any,
    lengths: Any,
    *,
    polyline: bool = False,
) -> Trace:
    """Trace k chains of straight legs: the exact inverse of `log_map`.

    first_leg: (k,) complex tangent vectors at the starts. Chain i goes on with legs offsets[i]:offsets[i + 1]: each
    turns by turning_angles (radians, counter-clockwise from straight on, tangent frame) and runs for lengths.
    remaining counts all legs that were not walked. Raises as trace_geodesic.
    """
    from contact_core.geometry.tracing_kernels import NO_ROOM, trace

    topology = Topology.of(mesh)
    require_on_surface(topology, starts, "starts")
    count = len(starts)
    first_leg = _complex_vectors(first_leg, count)
    turning_angles, lengths = _numbers(turning_angles), _numbers(lengths)
    no_chains = offsets is _NO_OFFSETS
    offsets = _read_only(np.zeros(count + 1, np.int64)) if no_chains else _offsets(offsets, count, lengths)
    if len(turning_angles) != len(lengths):
        raise InvalidInput(
            f"a chain has one turning angle for each length, but got {len(turning_angles)} and {len(lengths)}."
        )
    ends = Points(np.empty(count, np.int64), np.empty((count, 3)))
    headings, remaining = np.empty(count, np.complex128), np.empty(count)
    order = _walking_order(mesh, starts) if count >= _WORTH_SORTING else np.arange(count)
    room = 64 * (count + len(lengths)) if polyline else 0
    while True:
        line = Points(np.empty(room, np.int64), np.empty((room, 3)))
        line_ends = np.zeros((count, 2), np.int64)
        status, where, element = trace(
            plain(starts.arrays), first_leg.view(np.float64).reshape(-1, 2),
            offsets, turning_angles, lengths,
            plain(ends), headings.view(np.float64).reshape(-1, 2), remaining, line_ends, order,
            plain(topology.halfedges), plain(line),
        )  # fmt: skip
        if status != NO_ROOM:
            break
        room *= 4
    if status:
        raise _refusal(topology, status, where, element)
    lines = None
    if polyline:
        points = SurfacePoints.trusted(line.faces[:where], line.barycentric[:where])
        lines = Polylines(points, _read_only(line_ends[:, 0]), _read_only(line_ends[:, 1]))
    return Trace(SurfacePoints.trusted(*ends), _read_only(headings), _read_only(remaining), lines)


_NO_OFFSETS: Any = object()
_WORTH_SORTING = 1024
_NO_NUMBERS: FloatArray = np.zeros(0)


def _walking_order(mesh: TriangleMesh, starts: SurfacePoints) -> IntArray:
    """(k,) who walks when: along a curve that fills space, so that neighbours, who cross the same faces, find them
    in the cache, in whatever order the mesh stores them (1.4 times faster than by face on a scan)."""
    from contact_core.geometry.tracing_kernels import keys_along_curve

    keys = np.empty(len(starts), np.int64)
    keys_along_curve(mesh.points, mesh.faces, starts.faces, keys)
    return np.argsort(keys)


def require_on_surface(topology: Topology, points: SurfacePoints, name: str) -> None:
    """Raise InvalidInput if points are none, or name faces that the mesh does not have."""
    if not isinstance(points, SurfacePoints):
        raise InvalidInput(f"{name} must be SurfacePoints(faces, barycentric), but got {type(points).__name__}.")
    m = len(topology.tail) // 3
    if len(points.faces) and (points.faces.min() < 0 or points.faces.max() >= m):
        bad = int(np.argmax((points.faces < 0) | (points.faces >= m)))
        raise InvalidInput(f"{name} must lie in faces 0..{m - 1}, but point {bad} names face {points.faces[bad]}.")


def _complex_vectors(values: Any, count: int) -> ComplexArray:
    try:
        array = np.atleast_1d(np.asarray(values))
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"vectors must be complex numbers, one for each start; got {error}.") from error
    if array.shape != (count,):
        raise InvalidInput(f"vectors must have shape ({count},), one for each start, but have {array.shape}.")
    return frozen(array, np.complex128, (count,), "vectors")


def _numbers(values: Any) -> FloatArray:
    return frozen(values, np.float64, (None,), "turning angles and lengths of chains")


def _offsets(values: Any, count: int, lengths: FloatArray) -> IntArray:
    offsets = frozen(values, np.int64, (count + 1,), "offsets of chains")
    if offsets[0] < 0 or offsets[-1] > len(lengths) or (np.diff(offsets) < 0).any():
        raise InvalidInput(f"offsets of chains must rise from 0 to {len(lengths)}, but are {offsets.tolist()[:8]}.")
    if (lengths < 0).any():
        raise InvalidInput(f"lengths of chains must not be negative, but one is {lengths.min()}.")
    return offsets


def _refusal(topology: Topology, status: int, which: int, element: int) -> Exception:
    from contact_core.geometry import tracing_kernels as kernels

    if status == kernels.MET_BLOCKED_EDGE:
        return topology.refuse_halfedge(element, "tracing a geodesic")
    if status == kernels.MET_BLOCKED_VERTEX:
        return topology.refuse_vertex(element, "tracing a geodesic")
    return InvalidInput(
        f"geodesic {which} would cross more than {kernels.MOST_CROSSINGS} edges. Its length is far too great for "
        f"this surface: check the units of the vectors."
    )


def _read_only(array: Any) -> Any:
    array.setflags(write=False)
    return array
