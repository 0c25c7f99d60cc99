"""Connectivity and intrinsic geometry of a triangle mesh, built once per mesh by kernels.

Halfedge h = 3 f + k runs from corner k of face f to corner (k + 1) % 3. The frame of a halfedge has its origin at
the tail and its x axis along it; the face lies on the side of positive y. Only the region that a query walks over
needs to be manifold: what is not is marked BLOCKED, and a query that reaches it says where.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen, sparse_zeros
from contact_core.errors import InvalidInput, NotManifold
from contact_core.geometry.elements import (
    BLOCKED,
    BLOCKED_VERTEX,
    BOUNDARY,
    BOUNDARY_VERTEX,
    EXCESS,
    UNUSED_VERTEX,
)
from contact_core.geometry.flat_faces import mollify
from contact_core.geometry.kernel_arrays import Halfedges, plain
from contact_core.geometry.mesh import TriangleMesh

VISITED_AT_ONCE = 350_000  # faces: of a larger mesh records are written where queries come


@dataclass(frozen=True, eq=False)
class Topology:
    """Halfedges of n points and m faces; read-only arrays.

    tail: (3m,) vertex that a halfedge leaves. Corners joined by an edge of no length count as one vertex, the
        one of lowest index.
    twin: (3m,) the opposite halfedge, BOUNDARY or BLOCKED.
    shape: (3m, 4) length; apex x, y in the halfedge's frame (surface units); angle of the halfedge at its tail,
        counter-clockwise from the tail's first halfedge (radians, not rescaled).
    first: (n,) first halfedge of each vertex; on a boundary the clockwise-most. -1 where unused.
    angle_sum: (n,) sum of the corner angles round each vertex (radians).
    kind: (n,) INTERIOR_VERTEX, BOUNDARY_VERTEX, BLOCKED_VERTEX or UNUSED_VERTEX.

    halfedges: the arrays as kernels take them. Of a mesh of more than VISITED_AT_ONCE faces that has none without
    area, records are written where queries come, for they take nearly three times the memory of the mesh; whoever
    asks for twin, shape or angle_sum has them all written (ADR 0118).
    """

    halfedges: Halfedges

    @classmethod
    def of(cls, mesh: TriangleMesh) -> Topology:
        """The topology of a mesh: built at the first call (about a second per million faces), then kept on it.

        Raises InvalidInput for what is no mesh.
        """
        if not isinstance(mesh, TriangleMesh):
            raise InvalidInput(f"the mesh must be a TriangleMesh(points, faces), but got {type(mesh).__name__}.")
        kept = mesh.__dict__.get("_topology")
        if kept is None:
            kept = mesh.__dict__["_topology"] = cls._build(mesh)
        return kept

    @classmethod
    def _build(cls, mesh: TriangleMesh) -> Topology:
        from contact_core.geometry import topology_kernels as kernels

        n, count = len(mesh.points), 3 * len(mesh.faces)
        at_once = len(mesh.faces) <= VISITED_AT_ONCE
        shape = np.zeros((count, 4)) if at_once else sparse_zeros((count, 4))
        tail = mesh.faces.ravel()
        lengthless, flat = kernels.measure(mesh.points, mesh.faces, shape, at_once)
        if (lengthless or flat) and not at_once:
            at_once = True
            kernels.measure(mesh.points, mesh.faces, shape, at_once)
        if lengthless:
            tail = np.empty(count, np.int64)
            kernels.merge_lengthless_edges(mesh.faces, shape, np.arange(n), tail)
            tail.setflags(write=False)
        degree: Any = np.zeros(n, np.int32)
        twin: Any = np.full(count, BOUNDARY, np.int32)
        kernels.pair_halfedges(tail, degree, np.full(n, -1, np.int32), np.empty(count, np.int32), twin)
        first = np.full(n, -1, np.int64)
        angle_sum = np.zeros(n)
        kind: Any = np.full(n, UNUSED_VERTEX, np.int8)
        bends = np.zeros(n, bool)
        fans = (degree, first, angle_sum, kind, bends, at_once)
        kernels.order_fans(tail, twin, shape, mesh.points, *fans)
        if flat:
            straight = np.where(kind == BOUNDARY_VERTEX, np.pi, 2.0 * np.pi)
            if mollify(twin, shape, (angle_sum > straight + EXCESS)[tail]):
                kernels.order_fans(tail, twin, shape, mesh.points, *fans)
        if not at_once:
            kernels.leave_unvisited(twin, angle_sum)
        return cls(Halfedges(tail, twin, shape, first, angle_sum, kind, bends, mesh.points))

    @property
    def tail(self) -> IntArray:
        return self.halfedges.tail

    @property
    def first(self) -> IntArray:
        return _read_only(self.halfedges.first)

    @property
    def kind(self) -> IntArray:
        return _read_only(self.halfedges.kind)

    @property
    def twin(self) -> IntArray:
        return _read_only(self._written.twin)

    @property
    def shape(self) -> FloatArray:
        return _read_only(self._written.shape)

    @property
    def angle_sum(self) -> FloatArray:
        return _read_only(self._written.angle_sum)

    @cached_property
    def _written(self) -> Halfedges:
        """The arrays, with no record left out."""
        from contact_core.geometry.topology_kernels import write_all

        write_all(plain(self.halfedges))
        return self.halfedges

    @cached_property
    def is_manifold(self) -> bool:
        """Whether no edge and no vertex is blocked."""
        return not ((self.halfedges.twin == BLOCKED).any() or (self.kind == BLOCKED_VERTEX).any())

    @cached_property
    def boundary_halfedges(self) -> IntArray:
        """(b,) halfedges with no face on the other side."""
        return frozen(np.flatnonzero(self.halfedges.twin == BOUNDARY), np.int64, (None,), "boundary_halfedges")

    def scale(self, vertex: int) -> float:
        """Factor from corner angles to angles of the vertex's tangent frame: 2 pi (boundary: pi) / angle sum."""
        whole = np.pi if self.kind[vertex] == BOUNDARY_VERTEX else 2.0 * np.pi
        return float(whole / abs(self.halfedges.angle_sum[vertex]))

    def refuse_halfedge(self, halfedge: int, doing: str) -> NotManifold:
        """The error for a query that met a blocked halfedge."""
        face, k = divmod(int(halfedge), 3)
        a, b = int(self.tail[halfedge]), int(self.tail[3 * face + (k + 1) % 3])
        corners = self.tail[3 * face : 3 * face + 3].tolist()
        if len(set(corners)) < 3:
            return NotManifold(
                f"{doing} needs a face with three distinct corners, but face {face} has only the corners "
                f"{sorted(set(corners))}. Delete that face, or stay on a neighbouring one."
            )
        return NotManifold(
            f"{doing} needs a manifold surface, but the edge {a}-{b} of face {face} is shared by more than two "
            f"faces, or by faces oriented against each other. Repair the mesh there, or stay away from that edge."
        )

    def refuse_vertex(self, vertex: int, doing: str) -> InvalidInput:
        """The error for a query that met a vertex with no single fan of faces."""
        if self.kind[vertex] == UNUSED_VERTEX:
            return InvalidInput(f"{doing} needs a point on the surface, but no face uses vertex {int(vertex)}.")
        return NotManifold(
            f"{doing} needs a manifold surface, but the faces round vertex {int(vertex)} do not form a single fan. "
            f"Split that vertex, or stay away from it."
        )


def _read_only(array: Any) -> Any:
    view = array.view()
    view.setflags(write=False)
    return view


def closed_manifold(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """The mesh itself, if it is a closed manifold, as a proxy has to be. Raises InvalidInput. name: of what for."""
    topology = Topology.of(mesh)
    if not len(mesh.faces) or not topology.is_manifold or len(topology.boundary_halfedges):
        raise InvalidInput(
            f"a proxy is a closed manifold, but that for {name!r} has {len(mesh.faces)} faces,"
            f" {len(topology.boundary_halfedges)} open edges and is {'a' if topology.is_manifold else 'no'}"
            " manifold."
        )
    return mesh
