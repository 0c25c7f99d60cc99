"""The axis of a patch on a surface: drawn through picked points, taken apart into a shape, traced again elsewhere.

The paper's ParameterizeAxis and ReconstructAxis, with its contradictions settled (ADR 0021): the tangent of the
last point is the forward ending direction in both, and an axis of one point keeps the direction that it was given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray, IntArray, frozen
from contact_core.contact.placement import Root
from contact_core.contact.shape import AxisShape
from contact_core.errors import InvalidInput, Unreached
from contact_core.geometry.exact_geodesics import LogMap, log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis of m points on a surface.

    tangents: (m,) unit complex, the initial direction of the segment that leaves each point; at the last point the
    ending direction of the last segment. remaining: (m,) length that a boundary kept from being walked up to each
    point (surface units), 0 where the axis fits.
    """

    points: SurfacePoints
    tangents: ComplexArray
    remaining: FloatArray

    def __post_init__(self) -> None:
        m = len(self.points)
        object.__setattr__(self, "tangents", frozen(self.tangents, np.complex128, (m,), "tangents of an axis"))
        object.__setattr__(self, "remaining", frozen(self.remaining, np.float64, (m,), "remaining"))

    def __len__(self) -> int:
        return len(self.points)

    def root(self) -> Root:
        """Where the axis starts, and how."""
        return Root.at(self.points[0], complex(self.tangents[0]))


class Chains(NamedTuple):
    """k chains of legs in the form that `trace_chains` takes: the lengths of the first legs, then the others."""

    first: FloatArray  # (k,)
    offsets: IntArray  # (k + 1,)
    turns: FloatArray
    lengths: FloatArray


def draw_axis(
    mesh: TriangleMesh, picks: SurfacePoints, heading: complex | None = None, *, dense: bool = True
) -> tuple[AxisShape, Axis]:
    """The axis through picked points (k >= 1), joined by shortest geodesics.

    dense: every edge crossing on its path becomes an axis point, which spreads the anchors of patch points evenly;
    otherwise only the picks and the saddle vertices that a geodesic bends round. One pick needs a heading (unit
    complex in its tangent frame). Repeated picks are taken once. Raises InvalidInput for picks not connected.
    """
    if not len(picks):
        raise InvalidInput("an axis needs at least one point, but got none.")
    lengths: list[float] = []
    turns: list[float] = []  # at the start of each segment
    start, arrived, heading_at_start = picks[0], None, heading
    for k in range(1, len(picks)):
        leg = log_map(mesh, start, picks[k])
        if leg.anchor[0] < 0:
            raise Unreached(f"axis points {k - 1} and {k} lie on parts of the surface that are not connected.")
        if leg.distance[0] <= 1e-12 * mesh.bounding_box_diagonal:
            continue
        leaving = complex(leg.first_leg[0]) / abs(complex(leg.first_leg[0]))
        if arrived is None:
            heading_at_start, turn = leaving, 0.0
        else:
            turn = float(np.angle(leaving / arrived))
        new_lengths, new_turns = _segments(mesh, start, leg, dense)
        lengths.extend(new_lengths)
        turns.extend([turn, *new_turns])
        start, arrived = picks[k], complex(leg.headings[0])
    if heading_at_start is None:
        raise InvalidInput("an axis of one point needs a heading; give one, or a second point.")
    shape = AxisShape(np.array(lengths), np.array(turns[1:]))
    return shape, reconstruct_axis(mesh, shape, Root.at(picks[0], heading_at_start))


def parameterize_axis(mesh: TriangleMesh, points: SurfacePoints, heading: complex | None = None) -> AxisShape:
    """The shape of the axis with exactly these points, and saddle vertices between them (paper: Algorithm 1)."""
    shape, _ = draw_axis(mesh, points, heading, dense=False)
    return shape


def reconstruct_axis(mesh: TriangleMesh, shape: AxisShape, root: Root) -> Axis:
    """The axis of `shape` traced from a root (paper: Algorithm 3). shape: as it lies on that surface
    (`AxisShape.transformed`).

    Where a boundary stops the axis, its further points lie at the stop.
    """
    if shape.point_count == 1:
        return Axis(root.point(), np.array([root.heading]), np.zeros(1))
    chains, bends = axis_chains(shape)
    starts = root.point()[np.zeros(len(bends), np.int64)]
    trace = trace_chains(mesh, starts, chains.first * root.heading, chains.offsets, chains.turns, chains.lengths)
    tangents = np.concatenate([[root.heading], trace.headings * bends])  # (m,)
    points = SurfacePoints.concatenate([root.point(), trace.points])
    return Axis(points, tangents / np.abs(tangents), np.concatenate([[0.0], trace.remaining]))


def axis_chains(shape: AxisShape) -> tuple[Chains, ComplexArray]:
    """The walks from the root to the m - 1 further points of an axis, and how its tangent turns where each arrives
    (unit complex, (m - 1,))."""
    turns = shape.traced_turns  # (m - 2,)
    bends = np.exp(1j * np.concatenate([turns, np.zeros(shape.point_count - 1 - len(turns))]))
    return _prefix_chains(shape.lengths * shape.along, turns), bends


def root_from_point(
    mesh: TriangleMesh,
    shape: AxisShape,
    index: int,
    point: SurfacePoints,
    tangent: complex,
) -> tuple[Root, float]:
    """The root from which the axis passes its point `index` at `point` with `tangent` there.

    Walks the axis backwards. Also returns the length that a boundary cut off; unless that is 0, the root lies at
    the boundary and the axis does not pass the point.
    """
    if index == 0:
        return Root.at(point, tangent), 0.0
    turns = shape.traced_turns
    lengths = shape.lengths[:index][::-1] * shape.along
    last = index == shape.point_count - 1
    arriving = tangent if last else tangent * np.exp(-1j * turns[index - 1])  # of the forward segment at `index`
    back = trace_chains(
        mesh,
        point,
        np.array([-arriving * lengths[0]]),
        np.array([0, index - 1]),
        -turns[: index - 1][::-1],
        lengths[1:],
    )
    return Root.at(back.points, -complex(back.headings[0])), float(back.remaining[0])


def _segments(
    mesh: TriangleMesh, start: SurfacePoints, leg: LogMap, dense: bool
) -> tuple[list[float], list[float]]:
    """Lengths of the segments of one geodesic, and the turns between them."""
    first, turns, rest = leg.first_leg, leg.turning_angles, leg.lengths
    knots = np.concatenate([[abs(complex(first[0]))], rest])  # lengths of the straight legs
    if not dense:
        return knots.tolist(), turns.tolist()
    path = trace_chains(mesh, start, first, np.array([0, len(rest)]), turns, rest, polyline=True)
    assert path.polylines is not None
    steps = np.linalg.norm(np.diff(path.polylines[0].positions(mesh), axis=0), axis=1)
    total, bends = float(knots.sum()), np.cumsum(knots)
    marks = np.cumsum(steps)[:-1]  # distances of the crossings from the start
    near = 1e-9 * max(total, 1e-300)
    marks = marks[(marks > near) & (marks < total - near)]
    marks = marks[np.abs(marks[:, None] - bends[None, :-1]).min(axis=1, initial=np.inf) > near]
    stops = np.concatenate([marks, bends])
    order = np.argsort(stops, kind="stable")
    turn_at = np.concatenate([np.zeros(len(marks)), turns, [0.0]])[order]
    stops = stops[order]
    keep = np.concatenate([np.diff(stops, prepend=0.0) > near])
    keep |= turn_at != 0.0
    return np.diff(stops[keep], prepend=0.0).tolist(), turn_at[keep][:-1].tolist()


def _prefix_chains(lengths: FloatArray, turns: FloatArray) -> Chains:
    """The chain from the root to each further point of an axis; segments in a straight run become one leg."""
    along = np.concatenate([[0.0], np.cumsum(lengths)])  # (m,) distance of each point from the root
    knots = np.concatenate([[0], np.flatnonzero(turns) + 1])  # points where a straight run starts
    points = np.arange(1, len(along))
    run = np.searchsorted(knots, points, side="left") - 1  # (m - 1,) the run that ends at or holds each point
    partial = along[points] - along[knots[run]]  # (m - 1,)
    whole = np.diff(along[knots])  # lengths of the whole runs
    offsets = np.concatenate([[0], np.cumsum(run)])
    first = np.where(run == 0, partial, whole[0] if len(whole) else 0.0)
    bend = turns[knots[1:] - 1]
    step = np.arange(offsets[-1]) - np.repeat(offsets[:-1], run)  # how many bends a leg comes after the first
    chain_lengths = whole[np.minimum(step + 1, len(whole) - 1)] if len(whole) else whole
    chain_lengths[offsets[1:][run > 0] - 1] = partial[run > 0]
    return Chains(first, offsets, bend[step], chain_lengths)
