"""The map between a mesh and a proxy of it: a closed manifold surface that lies close round it.

Contacts walk on the proxy, where a path always goes on, and are given on the mesh, which people see.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints

_ALIKE = 0.3  # cosine between the normals of a point and of the side of the proxy that it goes to
_FARTHER = 3.0  # a side that faces the same direction may lie this many times as far as the closest one


@dataclass(frozen=True, eq=False)
class SurfaceMap:
    """Points of `source` on `proxy`, and back, by closest points.

    From the proxy the closest point of the source is the foot of its offset normal. From the source, a side of the
    proxy that faces as the face does goes before one that is as close: both sides of a sheet have their own. A face
    that is wound the wrong direction finds no such side near, and takes the closest. A point deep in a gap that the
    proxy closes goes to the closest point over the gap.
    """

    source: TriangleMesh
    proxy: TriangleMesh

    @classmethod
    def of(cls, source: TriangleMesh, proxy: TriangleMesh) -> SurfaceMap:
        """The map, kept with the proxy: two meshes of one digest share it."""
        kept = proxy.kept.get(("map", source.digest))
        if not isinstance(kept, cls):
            kept = proxy.kept["map", source.digest] = cls(source, proxy)
        return kept

    def to_proxy(self, points: SurfacePoints) -> SurfacePoints:
        """(k) points of the source on the proxy."""
        at, normals = points.positions(self.source), self.source.face_normals[points.faces]
        locator = Locator.of(self.proxy)
        closest = locator.closest(at)
        facing = locator.closest(at, facing=-normals, facing_limit=-_ALIKE)
        taken = facing.found & (facing.distance <= _FARTHER * closest.distance + self._rounding)
        return SurfacePoints(
            np.where(taken, facing.points.faces, closest.points.faces),
            np.where(taken[:, None], facing.points.barycentric, closest.points.barycentric),
        )

    def to_source(self, points: SurfacePoints) -> SurfacePoints:
        """(k) points of the proxy on the source."""
        return Locator.of(self.source).closest(points.positions(self.proxy)).points

    def followed(self, posed: TriangleMesh) -> TriangleMesh:
        """The proxy of the source in another shape (the same faces): each of its points stays where it is seen from
        the face at its foot. So it follows any skin, a host's own too."""
        key = ("followed", self.proxy.digest)
        if key not in posed.kept:  # a posed mesh is kept over a stroke, and with it what follows it
            posed.kept[key] = self._followed(posed)
        kept: TriangleMesh = posed.kept[key]
        return kept

    def _followed(self, posed: TriangleMesh) -> TriangleMesh:
        feet = Locator.of(self.source).closest(self.proxy.points).points
        lifts = self.proxy.points - feet.positions(self.source)  # (n, 3)
        then, now = (_frames(mesh, feet.faces) for mesh in (self.source, posed))
        turned = np.einsum("nij,nkj,nk->ni", now, then, lifts)
        flat = np.asarray(~(then.any(axis=(1, 2)) & now.any(axis=(1, 2))))  # faces without an area turn nothing
        return self.proxy.with_points(feet.positions(posed) + np.where(flat[:, None], lifts, turned))

    def distances(self, points: SurfacePoints) -> FloatArray:
        """(k,) how far points of the proxy lie from the source (surface units)."""
        return Locator.of(self.source).closest(points.positions(self.proxy)).distance

    @property
    def _rounding(self) -> float:
        return 1e-9 * self.proxy.bounding_box_diagonal


def _frames(mesh: TriangleMesh, faces: IntArray) -> FloatArray:
    """(k, 3, 3) orthonormal frames of faces (k,) in columns: along the first edge, across, normal. Faces without an
    area have none: zero."""
    along = mesh.points[mesh.faces[faces, 1]] - mesh.points[mesh.faces[faces, 0]]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    normal = mesh.face_normals[faces]
    along = np.where(normal.any(axis=1, keepdims=True), along, 0.0)
    return np.stack([along, np.cross(normal, along), normal], axis=2)
