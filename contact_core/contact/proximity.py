"""Contacts from a coarse pose: what lies close to the object, facing it (the paper's workflow (e))."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points


def touching_vertices(
    posed: TriangleMesh, other: TriangleMesh, distance: float, *, other_from_posed: Any = None, facing: bool = True
) -> tuple[IntArray, FloatArray]:
    """Vertices (k,) of a posed skin within `distance` of another surface, and how far each is (k,).

    Lengths in the other's units. other_from_posed: (4, 4) from the skin's space to the other's, a similarity.
    facing: only walls that face the vertex count, so that nothing reaches through a cup. Raises InvalidInput.
    """
    if not 0.0 < distance < np.inf:
        raise InvalidInput(f"contacts lie within a positive distance, but got {distance}.")
    matrix = np.eye(4) if other_from_posed is None else np.asarray(other_from_posed, dtype=float).reshape(4, 4)
    points = transform_points(matrix, posed.points)
    normals = posed.vertex_normals @ matrix[:3, :3].T
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    used = posed.used_points
    used = used[length[used, 0] > 0.0]
    normals = normals[used] / length[used]
    near = Locator.of(other).closest(points[used], max_distance=distance, facing=normals if facing else None)
    hit = near.found & (near.distance <= distance)
    return used[hit], near.distance[hit]


def patches_of_vertices(mesh: TriangleMesh, vertices: IntArray, smallest: int = 1) -> list[IntArray]:
    """Connected components of vertices along edges of the mesh, the largest first."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    chosen = np.zeros(len(mesh.points), dtype=bool)
    chosen[vertices] = True
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = edges[chosen[edges].all(axis=1)]
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=2 * (len(mesh.points),))
    _, part = connected_components(graph, directed=False)
    parts = [np.asarray(vertices[part[vertices] == label]) for label in np.unique(part[vertices])]
    kept = [np.sort(found) for found in parts if len(found) >= smallest]
    return sorted(kept, key=lambda found: (-len(found), int(found[0])))
