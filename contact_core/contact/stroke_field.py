"""The preview of a brush stroke: how far each vertex lies from what the pointer has passed over so far.

A stroke only grows, so its distances only shrink: new points lower them round themselves, and nothing else is
computed again. What a brush leaves is made once, at release; until then a front end colours by these distances.

They are exact where that is cheap. On a dense mesh, whose windows would be as many as the cube of the faces across
the brush, they spread as fronts (`geometry.fronts`), off by a twentieth of a percent of the radius on average (ADR
0117).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput, NotManifold
from contact_core.geometry.exact_geodesics import lowered_distances
from contact_core.geometry.fronts import spread_distances
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology

DENSE, LONG = 12.0, 4.0  # mean edges, and longest ones, within the reach of a stroke on a dense mesh


@dataclass(frozen=True, eq=False)
class StrokeField:
    """Distances over a surface from a stroke.

    radius: of the brush, surface units. reach: how far distances are known; beyond the radius by 1.5 mean edges, so
    that the rim may be interpolated inside a face. distances: (n,) per vertex, inf beyond the reach. changed: (k,)
    the vertices that the last extension lowered, which is all that a front end uploads.
    """

    mesh: TriangleMesh
    radius: float
    reach: float
    distances: FloatArray
    changed: IntArray

    @classmethod
    def begun(cls, mesh: TriangleMesh, radius: float) -> StrokeField:
        """The field of a stroke that has touched nothing. Raises InvalidInput for a radius that is not positive."""
        if not 0.0 < radius < np.inf:
            raise InvalidInput(f"the radius of a stroke must be a positive number, but got {radius}.")
        empty = np.full(len(mesh.points), np.inf)
        empty.setflags(write=False)
        return cls(mesh, radius, radius + 1.5 * _edges(mesh)[0], empty, np.zeros(0, np.int64))

    def extended(self, points: SurfacePoints) -> StrokeField:
        """The field after the pointer passed over further points, at the cost of those alone.

        In whatever batches and order points come, the distances are those of all of them together; on a dense mesh
        nearly.
        """
        if not len(points):
            return replace(self, changed=np.zeros(0, np.int64))
        if self._is_dense:
            distances, lowered = spread_distances(self.mesh, points, self.reach, self.distances)
        else:
            distances, lowered = self._searched(points)
        distances.setflags(write=False)
        return replace(self, distances=distances, changed=frozen(lowered, np.int64, (None,), "changed"))

    @property
    def _is_dense(self) -> bool:
        mean, longest = _edges(self.mesh)
        fine = mean < self.reach / DENSE and longest < self.reach / LONG
        return fine and Topology.of(self.mesh).is_manifold

    def _searched(self, points: SurfacePoints) -> tuple[FloatArray, IntArray]:
        """The distances (n,) lowered by an exact search, and the vertices (k,) that were."""
        near, straight = self._around(points.positions(self.mesh))
        distances = self.distances.copy()
        if not len(near):
            return distances, near
        distance = self._distances(points, near, straight)
        lower = (distance < self.distances[near]) & (distance <= self.reach)
        distances[near[lower]] = distance[lower]
        return distances, near[lower]

    def _around(self, positions: FloatArray) -> tuple[IntArray, FloatArray]:
        """The vertices (k,) within reach of positions (p, 3) in space, and how far they are from the nearest."""
        used, tree = _vertices(self.mesh)
        around = tree.query_ball_point(positions, self.reach * (1.0 + 1e-9), return_sorted=False)
        parts = [np.asarray(some, np.int64) for some in around]
        near = used[np.sort(parts[0]) if len(parts) == 1 else np.unique(np.concatenate(parts))]
        at, squares = self.mesh.points[near], np.full(len(near), np.inf)
        for position in positions:
            away = at - position
            np.minimum(squares, np.einsum("ij,ij->i", away, away), out=squares)
        return near, np.sqrt(squares)

    def _distances(self, points: SurfacePoints, near: IntArray, straight: FloatArray) -> FloatArray:
        """(k,) from points, or from what the stroke passed before, to vertices over the surface; straight ones
        where it is broken. No path is shorter than the straight line, so most of what is behind is not sought."""
        known = self.distances[near]
        try:
            return lowered_distances(self.mesh, points, near, known, self.reach, known > straight * (1.0 - 1e-9))
        except NotManifold:
            return straight

    def covered(self) -> IntArray:
        """The vertices (k,) within the radius of the stroke."""
        return np.flatnonzero(self.distances <= self.radius)


def _edges(mesh: TriangleMesh) -> tuple[float, float]:
    """The mean and the largest length of the first edges of faces, surface units; kept with the mesh."""
    if "edges" not in mesh.kept:
        ends = mesh.points[mesh.faces[:, :2]]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        mesh.kept["edges"] = (float(lengths.mean()), float(lengths.max())) if len(lengths) else (0.0, 0.0)
    mean, longest = mesh.kept["edges"]
    return mean, longest


def _vertices(mesh: TriangleMesh) -> tuple[IntArray, Any]:
    """The vertices that faces use and a tree of them; kept with the mesh."""
    if "vertex tree" not in mesh.kept:
        from scipy.spatial import cKDTree

        used = mesh.used_points
        mesh.kept["vertex tree"] = used, cKDTree(mesh.points[used])
    used, tree = mesh.kept["vertex tree"]
    return used, tree
