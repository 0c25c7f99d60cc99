"""Points on a surface: a face and barycentric coordinates (the field's SurfacePoint, in batches)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.kernel_arrays import Points
from contact_core.geometry.mesh import TriangleMesh


class SurfacePoints:
    """An immutable batch of k points on a triangle mesh.

    faces: (k,) int64.  barycentric: (k, 3) float64, non-negative, rows sum to 1 (they are normalised;
    a row off by more than 1e-6 is refused). A zero barycentric coordinate puts a point on an edge, two on
    a vertex; the same edge or vertex point may be written in any of its faces.
    """

    __slots__ = ("barycentric", "faces")

    faces: IntArray
    barycentric: FloatArray

    def __init__(self, faces: Any, barycentric: Any) -> None:
        self.faces = frozen(np.atleast_1d(np.asarray(faces)), np.int64, (None,), "faces of surface points")
        raw = frozen(np.atleast_2d(np.asarray(barycentric, dtype=float)) if len(self.faces) else np.zeros((0, 3)),
                     np.float64, (len(self.faces), 3), "barycentric")  # fmt: skip
        total = raw.sum(axis=1)
        bad = (np.abs(total - 1.0) > 1e-6) | (raw < -1e-6).any(axis=1)
        if bad.any():
            k = int(np.argmax(bad))
            raise InvalidInput(
                f"barycentric coordinates must be non-negative and sum to 1, but point {k} has {raw[k].tolist()}."
            )
        if (raw < 0).any() or (np.abs(total - 1.0) > 1e-15).any():
            clipped = np.clip(raw, 0.0, None)
            raw = clipped / clipped.sum(axis=1, keepdims=True)
            raw.setflags(write=False)
        self.barycentric = raw

    def __len__(self) -> int:
        return len(self.faces)

    def __getitem__(self, index: Any) -> SurfacePoints:
        """A sub-batch; an integer gives a batch of one."""
        faces, barycentric = self.faces[index], self.barycentric[index]
        return SurfacePoints.trusted(np.atleast_1d(faces), np.atleast_2d(barycentric))

    @property
    def arrays(self) -> Points:
        """Both arrays in one group, as kernels take them."""
        return Points(self.faces, self.barycentric)

    def __repr__(self) -> str:
        return f"SurfacePoints({len(self)} points)"

    def same_as(self, other: SurfacePoints) -> bool:
        """Bitwise equality (`==` on arrays is no truth value)."""
        return np.array_equal(self.faces, other.faces) and np.array_equal(self.barycentric, other.barycentric)

    def positions(self, mesh: TriangleMesh) -> FloatArray:
        """(k, 3) positions in surface units."""
        corners = mesh.points[mesh.faces[self.faces]]  # (k, 3, 3)
        return np.einsum("kc,kci->ki", self.barycentric, corners)

    def normals(self, mesh: TriangleMesh) -> FloatArray:
        """(k, 3) unit normals, interpolated from the vertex normals."""
        blended = np.einsum("kc,kci->ki", self.barycentric, mesh.vertex_normals[mesh.faces[self.faces]])
        length = np.linalg.norm(blended, axis=1, keepdims=True)
        return np.where(length > 1e-12, blended / np.maximum(length, 1e-300), mesh.face_normals[self.faces])

    @classmethod
    def trusted(cls, faces: IntArray, barycentric: FloatArray) -> SurfacePoints:
        """Adopt the result of a kernel, (k,) and (k, 3), without checks or copies; the arrays become read-only."""
        points = cls.__new__(cls)
        faces.setflags(write=False)
        barycentric.setflags(write=False)
        points.faces, points.barycentric = faces, barycentric
        return points

    @classmethod
    def concatenate(cls, batches: Iterable[SurfacePoints]) -> SurfacePoints:
        """One batch out of several, in order."""
        batches = list(batches)
        if not batches:
            return cls(np.zeros(0, np.int64), np.zeros((0, 3)))
        return cls.trusted(
            np.concatenate([b.faces for b in batches]), np.concatenate([b.barycentric for b in batches])
        )

    @classmethod
    def at_vertices(cls, mesh: TriangleMesh, vertices: Any) -> SurfacePoints:
        """The given vertices (k,) as surface points, each in its first face. Raises InvalidInput if unused."""
        wanted = np.atleast_1d(np.asarray(vertices, dtype=np.int64))
        outside = (wanted < 0) | (wanted >= len(mesh.points))
        if outside.any():
            bad = int(wanted[np.argmax(outside)])
            raise InvalidInput(f"vertices must be in 0..{len(mesh.points) - 1}, but got {bad} among them.")
        corners = mesh.first_corners[wanted]
        if (corners < 0).any():
            raise InvalidInput(f"vertex {int(wanted[np.argmax(corners < 0)])} belongs to no face.")
        return cls(corners // 3, np.eye(3)[corners % 3])
