"""A patch on a surface: its points as geodesics from the closest axis point, and back.

The paper's ParameterizePatch and ReconstructPatch (Algorithms 2 and 4) with its contradictions settled (ADR 0021).
A shortest path that bends round saddle vertices keeps its bends, so that reconstruction is exact. A patch is
parameterized once; edits change its axis, and the points follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from contact_core.contact.axis import Axis, reconstruct_axis
from contact_core.contact.placement import Root
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape
from contact_core.errors import InvalidInput, Unreached
from contact_core.geometry.engine import EXACT, ChainedLogMapResult, GeodesicEngine, LogMapResult
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains


@dataclass(frozen=True, eq=False)
class PatchPoints:
    """A reconstructed patch of n points.

    remaining: (n,) length (surface units) that could not be traced because a boundary stopped the axis or the
    geodesic from it; such points lie on the boundary and are reported, not dropped. headings: (n,) unit complex,
    the direction in which each geodesic from the axis arrives (1 where it has no length).
    """

    points: SurfacePoints
    remaining: FloatArray
    axis: Axis
    headings: ComplexArray

    def __post_init__(self) -> None:
        n = len(self.points)
        object.__setattr__(self, "remaining", frozen(self.remaining, np.float64, (n,), "remaining"))
        object.__setattr__(self, "headings", frozen(self.headings, np.complex128, (n,), "headings of a patch"))

    @property
    def ran_off(self) -> BoolArray:
        """(n,) which points a boundary stopped."""
        return np.asarray(self.remaining > 0.0)


def parameterize_patch(
    mesh: TriangleMesh,
    axis: Axis,
    points: SurfacePoints,
    *,
    anchors: IntArray | None = None,
    shape: AxisShape | None = None,
    engine: GeodesicEngine = EXACT,
) -> PatchCoordinates:
    """Coordinates of n points relative to an axis (paper: Algorithm 2, z = r theta / T).

    Each point is anchored at its closest axis point, or at the axis point that anchors (n,) name (-1: the closest).
    shape: that `axis` was reconstructed from; the coordinates returned are free of its scaling and mirroring.
    engine: measures the geodesics; reconstruction is as exact as the engine.
    Raises InvalidInput naming the first point that no axis point reaches.
    """
    if anchors is None:
        log = engine.log_map(mesh, axis.points, points)
        _check_reached(log.anchor)
        coordinates = _relative(log, axis.tangents[log.anchor], log.anchor)
    else:
        coordinates = _bound(mesh, axis, points, np.asarray(anchors, dtype=np.int64), engine)
    return coordinates if shape is None else _unshaped(coordinates, shape)


def reconstruct_patch(
    mesh: TriangleMesh,
    shape: PatchShape,
    root: Root,
    axis_shape: AxisShape | None = None,
) -> PatchPoints:
    """The patch of `shape` at a root (paper: Algorithm 4, z t' or, mirrored, conj(z) t').

    axis_shape: in place of the shape's own axis: bent, scaled, or as it lies on another surface
    (`AxisShape.transformed`).
    """
    axis_shape = axis_shape or shape.axis
    return points_from_axis(mesh, shape.coordinates, reconstruct_axis(mesh, axis_shape, root), axis_shape)


def points_from_axis(
    mesh: TriangleMesh,
    coordinates: PatchCoordinates,
    axis: Axis,
    axis_shape: AxisShape,
) -> PatchPoints:
    """The points of a patch whose axis is reconstructed: one geodesic from the axis each, all in one batch."""
    legs, angles, lengths = patch_chains(coordinates, axis_shape)
    anchors = coordinates.anchors
    trace = trace_chains(
        mesh, axis.points[anchors], legs * axis.tangents[anchors], coordinates.chain_starts, angles, lengths
    )
    return PatchPoints(trace.points, trace.remaining + axis.remaining[anchors], axis, trace.headings)


def patch_chains(
    coordinates: PatchCoordinates, axis_shape: AxisShape
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """The geodesics from the anchors to n points: first legs (n,) relative to the anchors' tangents, then turning
    angles and lengths of the legs that follow (rows by `coordinates.chain_starts`)."""
    legs, lengths = scaled_legs(coordinates, axis_shape.along, axis_shape.spread)
    angles = coordinates.chain_angles
    return (np.conj(legs), -angles, lengths) if axis_shape.mirrored else (legs, angles, lengths)


def transfer_patch(
    mesh: TriangleMesh, axis: Axis, axis_shape: AxisShape, points: SurfacePoints, target: TriangleMesh, root: Root
) -> PatchPoints:
    """Parameterize on one mesh, reconstruct as the mirror image on another: the paper's Algorithm 5 in one go."""
    coordinates = parameterize_patch(mesh, axis, points)
    mirrored = axis_shape.transformed(mirrored=True)
    return points_from_axis(target, coordinates, reconstruct_axis(target, mirrored, root), mirrored)


def scaled_legs(coordinates: PatchCoordinates, along: float, spread: float) -> tuple[ComplexArray, FloatArray]:
    """First legs stretched along and across the axis, and the legs after them by as much as the first grew."""
    legs, lengths = coordinates.legs, coordinates.chain_lengths
    if along == spread:
        return (legs, lengths) if along == 1.0 else (legs * along, lengths * along)
    stretched = legs.real * along + 1j * (legs.imag * spread)
    if not len(lengths):
        return stretched, lengths
    size = np.abs(legs)
    growth = np.divide(np.abs(stretched), size, out=np.full(len(size), np.sqrt(along * spread)), where=size > 0.0)
    return stretched, lengths * np.repeat(growth, np.diff(coordinates.chain_starts))


def _unshaped(coordinates: PatchCoordinates, shape: AxisShape) -> PatchCoordinates:
    """Coordinates measured on a scaled or mirrored axis, as they are on the axis before that."""
    legs, lengths = scaled_legs(coordinates, 1.0 / shape.along, 1.0 / shape.spread)
    angles = coordinates.chain_angles
    if shape.mirrored:
        legs, angles = np.conj(legs), -angles
    return PatchCoordinates(coordinates.anchors, legs, coordinates.chain_starts, angles, lengths)


def _relative(log: LogMapResult, tangents: ComplexArray, anchors: IntArray) -> PatchCoordinates:
    if isinstance(log, ChainedLogMapResult):
        return PatchCoordinates(
            anchors, log.first_leg / tangents, log.offsets, log.turning_angles, log.lengths
        )  # fmt: skip
    nowhere, nothing = np.zeros(len(anchors) + 1, np.int64), np.zeros(0)
    return PatchCoordinates(anchors, log.coordinates / tangents, nowhere, nothing, nothing)


def _bound(
    mesh: TriangleMesh, axis: Axis, points: SurfacePoints, anchors: IntArray, engine: GeodesicEngine
) -> PatchCoordinates:
    """Coordinates with anchors chosen by hand: one log map per anchor that is used."""
    if anchors.shape != (len(points),) or (len(anchors) and not -1 <= anchors.min() <= anchors.max() < len(axis)):
        raise InvalidInput(
            f"anchors need one axis point 0..{len(axis) - 1}, or -1, for each of {len(points)} points."
        )
    together: PatchCoordinates | None = None
    order = []
    for anchor in np.unique(anchors):
        chosen = np.flatnonzero(anchors == anchor)
        sources = axis.points if anchor < 0 else axis.points[anchor]
        log = engine.log_map(mesh, sources, points[chosen])
        _check_reached(log.anchor)
        at = log.anchor if anchor < 0 else np.full(len(chosen), anchor)
        part = _relative(log, axis.tangents[at], at)
        together = part if together is None else PatchCoordinates.concatenate(together, part)
        order.append(chosen)
    if together is None:
        whole, number = np.zeros(0, np.int64), np.zeros(0)
        return PatchCoordinates(whole, number.astype(complex), np.zeros(1, np.int64), number, number)
    return _reordered(together, np.argsort(np.concatenate(order)))


def _reordered(coordinates: PatchCoordinates, order: IntArray) -> PatchCoordinates:
    """The same points in another order."""
    counts = np.diff(coordinates.chain_starts)
    starts = np.concatenate([[0], np.cumsum(counts[order])])
    rows = np.concatenate(
        [np.arange(coordinates.chain_starts[k], coordinates.chain_starts[k + 1]) for k in order] or [np.zeros(0)]
    ).astype(np.int64)
    return PatchCoordinates(
        coordinates.anchors[order],
        coordinates.legs[order],
        starts,
        coordinates.chain_angles[rows],
        coordinates.chain_lengths[rows],
    )


def _check_reached(anchors: IntArray) -> None:
    if len(anchors) and anchors.min() < 0:
        raise Unreached(
            f"patch point {int(np.argmin(anchors))} lies on a part of the surface that the axis does not reach."
            " Split the patch by surface and keep the parts as a group."
        )
