"""The area of a patch: its points laid out flat, triangulated there, measured on the surface.

The layout unrolls the axis and every geodesic from it into the plane: isometric where the surface is developable,
and close to it over the extent of a contact. It serves weights, areas, boundaries and distortion; no edit uses it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray, IntArray, frozen
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape

LONGEST_EDGE = 3.0  # times the spacing of the points: longer edges bridge a gap or a notch
FLAT = 1e-9  # a triangle no higher than this part of its longest edge has no area: its three corners lie on the rim


@dataclass(frozen=True, eq=False)
class PatchArea:
    """A triangulated patch of n points. triangles: (t, 3) point indices, counter-clockwise in the layout.

    area: on the surface (square surface units). shares: (n,) of it per point. boundary: closed loops of point
    indices round the patch and round its holes.
    """

    triangles: IntArray
    area: float
    shares: FloatArray
    boundary: tuple[tuple[int, ...], ...]


def flat_layout(axis: AxisShape, coordinates: PatchCoordinates) -> ComplexArray:
    """(n,) complex positions of the points with axis and geodesics unrolled into the plane (shape units)."""
    directions = np.exp(1j * np.concatenate([[0.0], np.cumsum(axis.turning_angles)]))  # (s or 1,)
    points = np.concatenate([[0.0], np.cumsum(axis.lengths * directions[: len(axis.lengths)])])  # (m,)
    tangents = np.append(directions, directions[-1])[: axis.point_count]
    placed = points[coordinates.anchors] + coordinates.legs * tangents[coordinates.anchors]
    heading = np.exp(1j * np.angle(coordinates.legs)) * tangents[coordinates.anchors]
    for k in np.flatnonzero(np.diff(coordinates.chain_starts)):
        rows = slice(coordinates.chain_starts[k], coordinates.chain_starts[k + 1])
        turned = heading[k] * np.exp(1j * np.cumsum(coordinates.chain_angles[rows]))
        placed[k] += (turned * coordinates.chain_lengths[rows]).sum()
    return np.asarray(placed)


def measure_area(shape: PatchShape, positions: FloatArray) -> PatchArea:
    """The patch measured where its points (n, 3) are. A patch without extent has area 0 and equal shares of 1."""
    n = len(shape)
    triangles = _triangulate(flat_layout(shape.axis, shape.coordinates), positions)
    if not len(triangles):
        return PatchArea(triangles, 0.0, frozen(np.ones(n), np.float64, (n,), "shares"), ())
    areas = triangle_areas(positions, triangles)
    shares = np.bincount(triangles.ravel(), weights=np.repeat(areas / 3.0, 3), minlength=n)  # (n,)
    shares[shares <= 0.0] = np.median(shares[shares > 0.0]) if (shares > 0.0).any() else 1.0
    return PatchArea(triangles, float(areas.sum()), frozen(shares, np.float64, (n,), "shares"), _loops(triangles))


def triangle_areas(positions: FloatArray, triangles: IntArray) -> FloatArray:
    """(t,) areas."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _triangulate(layout: ComplexArray, positions: FloatArray) -> IntArray:
    """Delaunay triangles of the layout without those that bridge a gap, in the layout or in space."""
    from scipy.spatial import Delaunay, QhullError

    none = np.zeros((0, 3), np.int64)
    if len(layout) < 3:
        return none
    try:
        triangles = np.asarray(Delaunay(np.stack([layout.real, layout.imag], -1)).simplices, dtype=np.int64)
    except QhullError:  # all on a line
        return none
    corners = layout[triangles]  # (t, 3)
    cross = ((corners[:, 1] - corners[:, 0]) * np.conj(corners[:, 2] - corners[:, 0])).imag
    triangles = np.where((cross > 0.0)[:, None], triangles[:, [0, 2, 1]], triangles)
    flat = np.abs(layout[triangles] - layout[np.roll(triangles, -1, axis=1)])  # (t, 3) edge lengths
    steep = np.linalg.norm(positions[triangles] - positions[np.roll(triangles, -1, axis=1)], axis=-1)
    shortest = np.full(len(layout), np.inf)
    np.minimum.at(shortest, triangles, np.minimum(flat, np.roll(flat, 1, axis=1)))
    spacing = float(np.percentile(shortest[np.isfinite(shortest)], 90))
    kept = (flat <= LONGEST_EDGE * spacing).all(axis=1) & (steep <= 2.0 * LONGEST_EDGE * spacing).all(axis=1)
    return triangles[kept & (np.abs(cross) > FLAT * flat.max(axis=1) ** 2)]


def _loops(triangles: IntArray) -> tuple[tuple[int, ...], ...]:
    """The edges that one triangle alone has, joined into loops."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    n = int(edges.max()) + 1
    there = np.unique(edges[:, 0] * n + edges[:, 1])  # an edge as one number: of a patch of any size, all at once
    back = (there % n) * n + there // n
    onward: dict[int, list[int]] = {}
    for edge in there[~np.isin(back, there, assume_unique=True)].tolist():
        onward.setdefault(edge // n, []).append(edge % n)
    loops = []
    while onward:
        start = min(onward)
        loop, at = [start], start
        while True:
            at_next = onward[at].pop()
            if not onward[at]:
                del onward[at]
            if at_next == start or at_next not in onward:
                break
            loop.append(at_next)
            at = at_next
        loops.append(tuple(loop))
    return tuple(loops)
