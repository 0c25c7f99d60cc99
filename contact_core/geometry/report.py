"""What a mesh is made of: the facts that `contact inspect` prints and that errors quote."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import IntArray
from contact_core.geometry.mesh import TriangleMesh


@dataclass(frozen=True)
class MeshReport:
    """Facts about a triangle mesh. A face is degenerate when it repeats a vertex or has no area; components
    join faces that share an edge; genus is the total over components of an oriented manifold, None where the
    mesh is not one."""

    vertices: int
    faces: int
    unused_vertices: int
    components: int
    boundary_edges: int
    boundary_loops: int
    non_manifold_edges: tuple[tuple[int, int], ...]
    non_manifold_vertices: tuple[int, ...]
    misoriented_edges: int
    degenerate_faces: tuple[int, ...]
    duplicate_faces: tuple[int, ...]
    euler_characteristic: int
    genus: int | None
    area: float
    volume: float | None
    extent: tuple[float, float, float]

    @property
    def is_manifold(self) -> bool:
        """Every edge has one or two faces, every vertex one fan, all faces turn the same way."""
        return not (self.non_manifold_edges or self.non_manifold_vertices or self.misoriented_edges)

    @property
    def is_watertight(self) -> bool:
        """Manifold, and without boundary."""
        return self.is_manifold and self.boundary_edges == 0 and self.faces > 0


def report(mesh: TriangleMesh) -> MeshReport:
    """Count everything, in arrays only: a million faces take a few seconds."""
    points, faces = mesh.points, mesh.faces
    n, m = len(points), len(faces)
    halfedges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)  # (3m, 2), halfedge 3f + k
    ends = np.sort(halfedges, axis=1)
    edges, edge_of, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    edge_of = edge_of.reshape(-1)
    forward = np.bincount(edge_of[halfedges[:, 0] == ends[:, 0]], minlength=len(edges))  # (edges,)
    crowded = uses > 2
    repeated = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    flat = mesh.face_areas <= 1e-16 * max(mesh.bounding_box_diagonal, 1e-300) ** 2
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    boundary = edges[uses == 1]
    used = np.unique(faces)
    components = _joined(m, edge_of)
    loops, closed_boundary = _boundary_loops(boundary)
    crowded_edges = tuple((int(a), int(b)) for a, b in edges[crowded])
    misoriented = int(((uses == 2) & (forward != 1)).sum())
    crowded_vertices = _vertices_with_several_fans(faces, edge_of, uses, halfedges, n)
    euler = len(used) - len(edges) + m
    oriented = not crowded_edges and not len(crowded_vertices) and not misoriented and closed_boundary and m > 0
    genus = (2 * components - loops - euler) // 2 if oriented else None
    corners = points[faces]
    volume = float(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0)
    extent = np.ptp(points[used], axis=0) if len(used) else np.zeros(3)
    return MeshReport(
        vertices=n,
        faces=m,
        unused_vertices=n - len(used),
        components=components,
        boundary_edges=len(boundary),
        boundary_loops=loops,
        non_manifold_edges=crowded_edges,
        non_manifold_vertices=tuple(int(v) for v in crowded_vertices),
        misoriented_edges=misoriented,
        degenerate_faces=tuple(int(f) for f in np.flatnonzero(repeated | flat)),
        duplicate_faces=tuple(int(f) for f in np.setdiff1d(np.arange(m), first)),
        euler_characteristic=euler,
        genus=genus,
        area=float(mesh.face_areas.sum()),
        volume=volume if oriented and not len(boundary) else None,
        extent=(float(extent[0]), float(extent[1]), float(extent[2])),
    )


def _joined(count: int, edge_of: IntArray) -> int:
    """Number of groups of `count` faces that share edges; edge_of: (3 count,) edge of each halfedge."""
    if not count:
        return 0
    face = np.repeat(np.arange(count), 3)
    size = count + int(edge_of.max()) + 1
    graph = coo_array((np.ones(len(face), np.int8), (face, count + edge_of)), shape=(size, size))
    return int(connected_components(graph, directed=False, return_labels=False))


def _boundary_loops(boundary: IntArray) -> tuple[int, bool]:
    """Number of connected pieces of the boundary edges (b, 2), and whether each vertex on it has just two."""
    if not len(boundary):
        return 0, True
    vertices, renumbered, degree = np.unique(boundary, return_inverse=True, return_counts=True)
    pairs = renumbered.reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=2 * (len(vertices),))
    return int(connected_components(graph, directed=False, return_labels=False)), bool((degree == 2).all())


def _vertices_with_several_fans(
    faces: IntArray, edge_of: IntArray, uses: IntArray, halfedges: IntArray, n: int
) -> IntArray:
    """Vertices whose corners are not joined to one fan by shared edges (bow ties)."""
    m = len(faces)
    if not m:
        return np.zeros(0, np.int64)
    corner = np.arange(3 * m)  # corner 3f + k sits at the start of halfedge 3f + k
    # A halfedge joins, at its start, its own corner; at its end, the next corner of the face. Corners that
    # meet at one end of one edge belong to one fan: link each to a node (edge, end).
    following = 3 * (corner // 3) + (corner % 3 + 1) % 3
    at_low_end = halfedges[:, 0] < halfedges[:, 1]  # (3m,)
    start_node = 3 * m + 2 * edge_of + np.where(at_low_end, 0, 1)
    end_node = 3 * m + 2 * edge_of + np.where(at_low_end, 1, 0)
    rows, columns = np.concatenate([corner, following]), np.concatenate([start_node, end_node])
    size = 3 * m + 2 * len(uses)
    graph = coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    pairs = np.unique(np.stack([faces.ravel(), label[: 3 * m]], -1), axis=0)  # vertex, fan
    return np.flatnonzero(np.bincount(pairs[:, 0], minlength=n) > 1)
