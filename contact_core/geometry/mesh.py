"""The triangle mesh: two immutable arrays, and what follows from them, computed when asked for."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, digest, frozen
from contact_core.errors import InvalidInput

_LARGEST = 1e60  # coordinate: products of four lengths neither overflow nor vanish
_AT_A_TIME = 1 << 18  # corners


class TriangleMesh:
    """An immutable triangle mesh.

    points: (n, 3) float64, surface units.  faces: (m, 3) int64, indices into points, counter-clockwise
    seen from outside. Construction checks shapes, finiteness and index ranges, and nothing more:
    manifoldness is asked for only where an operation needs it (see `contact_core.geometry.topology`).
    Raises InvalidInput.
    """

    def __init__(self, points: Any, faces: Any) -> None:
        self.posed_from: TriangleMesh | None = None
        self.points: FloatArray = frozen(points, np.float64, (None, 3), "points")
        self.faces: IntArray = frozen(faces, np.int64, (None, 3), "faces")
        size = float(np.abs(self.points).max(initial=0.0))
        if size and not 1.0 / _LARGEST <= size <= _LARGEST:
            raise InvalidInput(
                f"the largest coordinate of points must lie from {1.0 / _LARGEST:g} to {_LARGEST:g}, but is"
                f" {size:.3g}; use another unit."
            )
        if len(self.faces) and (self.faces.min() < 0 or self.faces.max() >= len(self.points)):
            bad = int(np.argmax(((self.faces < 0) | (self.faces >= len(self.points))).any(axis=1)))
            raise InvalidInput(
                f"faces must index the {len(self.points)} points, but face {bad} is {self.faces[bad].tolist()}."
            )

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.points)} points, {len(self.faces)} faces)"

    @cached_property
    def digest(self) -> str:
        """Content digest of topology and positions; positions as float32, so hosts that store float32 agree."""
        return digest(self.points.astype(np.float32), self.faces)

    @cached_property
    def topology_digest(self) -> str:
        """Content digest of the faces alone: equal for the same asset in another shape."""
        return digest(np.array([len(self.points)]), self.faces)

    @cached_property
    def first_corners(self) -> IntArray:
        """(n,) the first corner 3 f + k of face f that is each vertex; -1 where no face uses it."""
        corners = np.full(len(self.points), -1, np.int64)
        flat = self.faces.ravel()
        for end in range(len(flat), 0, -_AT_A_TIME):  # the first is written last
            begin = max(end - _AT_A_TIME, 0)
            corners[flat[begin:end][::-1]] = np.arange(end - 1, begin - 1, -1)
        return corners

    @cached_property
    def used_points(self) -> IntArray:
        """(k,) the points that faces use, ascending."""
        used = np.zeros(len(self.points), bool)
        used[self.faces] = True
        return np.flatnonzero(used)

    @cached_property
    def bounding_box_diagonal(self) -> float:
        """Length of the diagonal of the box round the points that faces use (surface units)."""
        used = self.points[self.used_points] if len(self.faces) else self.points
        return float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 0.0

    @cached_property
    def face_normals(self) -> FloatArray:
        """(m, 3) unit normals; zero for degenerate faces."""
        a, b, c = (self.points[self.faces[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)  # (m, 3), length = twice the area
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)

    @cached_property
    def face_areas(self) -> FloatArray:
        """(m,) areas, square surface units."""
        a, b, c = (self.points[self.faces[:, k]] for k in range(3))
        return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))

    @cached_property
    def vertex_normals(self) -> FloatArray:
        """(n, 3) unit normals, the faces' normals weighted by their angle at the vertex; zero where unused."""
        normals = np.zeros_like(self.points)
        corners = self.points[self.faces]  # (m, 3, 3)
        for k in range(3):
            u = corners[:, (k + 1) % 3] - corners[:, k]
            v = corners[:, (k + 2) % 3] - corners[:, k]
            angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("mi,mi->m", u, v))  # (m,)
            for axis in range(3):
                normals[:, axis] += np.bincount(
                    self.faces[:, k], weights=angle * self.face_normals[:, axis], minlength=len(self.points)
                )
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)

    def normals_at(self, vertices: IntArray) -> FloatArray:
        """(k, 3) the normals of vertices (k,), those of `vertex_normals`, at the cost of the faces round them.

        The first call lists the faces round each vertex of the mesh.
        """
        if "vertex_normals" in vars(self):
            return np.asarray(self.vertex_normals[vertices])
        wanted = np.unique(vertices)
        starts, corners = self._corners_of_vertices
        count = starts[wanted + 1] - starts[wanted]
        rows = np.repeat(starts[wanted] - np.cumsum(count) + count, count) + np.arange(count.sum())
        around = self.faces[np.unique(corners[rows] // 3)]  # in order, so that sums round alike
        used = np.union1d(wanted, around)
        part = TriangleMesh(self.points[used], np.searchsorted(used, around).reshape(-1, 3))
        return np.asarray(part.vertex_normals[np.searchsorted(used, vertices)])

    @cached_property
    def _corners_of_vertices(self) -> tuple[IntArray, IntArray]:
        """The corners 3 f + k at vertex v are rows starts[v]:starts[v + 1]: starts (n + 1,), corners (3 m,)."""
        from scipy.sparse import csr_matrix

        corners = np.arange(self.faces.size)  # making a matrix by rows is a counting sort
        shape = (len(self.points), self.faces.size)
        table = csr_matrix((np.ones(len(corners), np.int8), (self.faces.ravel(), corners)), shape=shape)
        return table.indptr, table.indices

    @cached_property
    def kept(self) -> dict[object, Any]:
        """What others derive from this mesh and keep as long as it lives, by a key of their own."""
        return {}

    def with_points(self, points: Any) -> TriangleMesh:
        """The same faces with new points (n, 3)."""
        if np.shape(points) != self.points.shape:
            raise InvalidInput(f"points must have shape {self.points.shape}, but have {np.shape(points)}.")
        return TriangleMesh(points, self.faces)

    def posed(self, points: Any) -> TriangleMesh:
        """The same faces with points (n, 3) of a pose: it remembers the shape at rest (`posed_from`), whose tree
        is fitted to it in place of a new one."""
        result = self.with_points(points)
        result.posed_from = self
        return result
