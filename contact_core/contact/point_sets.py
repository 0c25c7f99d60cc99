"""Sets of painted points: disks, each place once, and split where the surface is not connected."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_geodesic

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def without_doubles(
    mesh: TriangleMesh, points: SurfacePoints, strength: Any = None, known: SurfacePoints | None = None
) -> tuple[SurfacePoints, FloatArray]:
    """The points that are not doubles of one another or of known ones, with their strengths (n,), 1 by default.

    Doubles lie at the same place (1e-9 in barycentrics), whichever of its faces an edge or vertex point names.
    Raises InvalidInput where strengths and points differ in number.
    """
    n = len(points)
    given = frozen(np.ones(n) if strength is None else strength, np.float64, (n,), "strength of points")
    before = len(known) if known is not None else 0
    together = SurfacePoints.concatenate([known, points]) if known is not None else points
    weights = np.round(together.barycentric * 1e9).astype(np.int64)  # (n, 3)
    corners = np.where(weights > 0, mesh.faces[together.faces], -1)  # (n, 3)
    order = np.argsort(corners, axis=1)
    rows = np.column_stack([np.take_along_axis(part, order, axis=1) for part in (corners, weights)])
    _, first = np.unique(rows, axis=0, return_index=True)
    keep = np.sort(first[first >= before]) - before
    return points[keep], given[keep]


def connected_parts(mesh: TriangleMesh, points: SurfacePoints) -> list[SurfacePoints]:
    """Points split by the connected part of the mesh that they lie on, in order of their first point."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not len(points):
        return []
    edges = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=2 * (len(mesh.points),))
    _, part_of_vertex = connected_components(graph, directed=False)
    part = part_of_vertex[mesh.faces[points.faces, 0]]  # (n,)
    _, first = np.unique(part, return_index=True)
    return [points[np.flatnonzero(part == part[k])] for k in np.sort(first)]


def geodesic_disk(mesh: TriangleMesh, centre: SurfacePoints, radius: float, count: int) -> SurfacePoints:
    """`count` points within a geodesic radius of a point (one, as a batch), evenly spread, the centre first.

    The exponential map of a sunflower: its ring i lies at radius sqrt(i / (count - 1)), so equal areas carry equal
    numbers of points.
    """
    place = np.arange(count)
    spokes = radius * np.sqrt(place / max(count - 1, 1)) * np.exp(1j * _GOLDEN_ANGLE * place)  # (n,)
    return trace_geodesic(mesh, centre[np.zeros(count, np.int64)], spokes).points
