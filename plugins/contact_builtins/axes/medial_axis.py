"""The paper's second default axis: a smoothed medial axis of the patch.

As the paper has it: the heat method (Crane et al. 2017) gives a smoothed distance u from the patch's boundary;
points where the gradient of u turns by more than pi/2 lie on the medial axis; Dijkstra's algorithm joins them.

The patch is laid flat and triangulated by its own points first, so that it has faces and a boundary even where it
lies inside one face of a coarse mesh, or covers many of a dense one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay, QhullError

from contact_builtins.axes.straight import flatten, principal_heading, through_centre
from contact_core.arrays import FloatArray, IntArray
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints, TriangleMesh
from contact_core.geometry.heat import heat_distance

_LONG = 3.0  # an edge of the triangulation longer than this many typical ones bridges a gap of the patch
_AWAY = 6.0  # how much dearer a step is off the medial points: the curve leaves them only to get over a gap


class MedialAxis:
    """Where the patch is too round or too small to have a medial axis of two points, the axis goes along its
    longest direction instead; the paper does not say what to do there."""

    name = "medial_axis"
    summary = "a smoothed medial axis of the patch, by the heat method (the paper's second)"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        order = np.lexsort((*request.points.barycentric.T, request.points.faces))  # a patch is a set: sort it
        plane = flat.plane[order]
        faces = _triangulated(np.stack([plane.real, plane.imag], -1))
        chain = np.zeros(0, np.int64)
        if len(faces):
            patch = TriangleMesh(request.points.positions(request.mesh)[order], faces)
            chain = _joined(patch, _medial_points(patch))
        if len(chain) < 2:
            return through_centre(flat, principal_heading(flat))
        along = (plane * np.conj(principal_heading(flat))).real[chain]
        return request.points[order[chain if along[-1] >= along[0] else chain[::-1]]]


def _triangulated(plane: FloatArray) -> IntArray:
    """Delaunay triangles (m, 3) over points of the plane (n, 2), counter-clockwise, without long edges."""
    try:
        triangles = Delaunay(plane).simplices.astype(np.int64)
    except (QhullError, ValueError):  # fewer than three points, or all on a line
        return np.zeros((0, 3), np.int64)
    corners = plane[triangles]  # (m, 3, 2)
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)  # (m, 3)
    triangles = triangles[sides.max(axis=1) < _LONG * np.median(sides)]
    u, v = (plane[triangles[:, k]] - plane[triangles[:, 0]] for k in (1, 2))
    turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return np.where((turn < 0)[:, None], triangles[:, ::-1], triangles)


def _medial_points(patch: TriangleMesh) -> IntArray:
    """Vertices of the patch beside edges over which the gradient of the distance turns by more than pi/2."""
    ends = np.sort(patch.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)  # (3m, 2)
    edges, edge_of, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    border = np.unique(edges[uses == 1])
    field = heat_distance(patch, np.arange(len(patch.faces)), border)
    gradient = np.zeros((len(patch.faces), 3))
    gradient[field.faces] = field.gradient
    distance = np.zeros(len(patch.points))
    distance[field.vertices] = field.distance
    halfedges = np.argsort(edge_of.reshape(-1), kind="stable")  # the two faces of an edge side by side
    first = np.cumsum(uses) - uses
    inner = np.flatnonzero(uses == 2)
    left, right = halfedges[first[inner]] // 3, halfedges[first[inner] + 1] // 3
    turns = (gradient[left] * gradient[right]).sum(axis=1) < 0.0
    pairs = edges[inner[turns]]  # (k, 2)
    deeper = np.where(distance[pairs[:, 0]] >= distance[pairs[:, 1]], pairs[:, 0], pairs[:, 1])
    return np.setdiff1d(deeper, border)


def _joined(patch: TriangleMesh, medial: IntArray) -> IntArray:
    """The cheapest way, by Dijkstra over the patch, between the two medial points that are farthest apart."""
    if len(medial) < 2:
        return medial
    n = len(patch.points)
    ends = np.unique(np.sort(patch.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)  # (edges, 2)
    on_axis = np.zeros(n, bool)
    on_axis[medial] = True
    cost = np.linalg.norm(patch.points[ends[:, 0]] - patch.points[ends[:, 1]], axis=1)
    cost = np.where(on_axis[ends].all(axis=1), cost, _AWAY * cost)
    graph = csr_array((cost, ends.T), shape=(n, n))
    start = _farthest(dijkstra(graph, directed=False, indices=int(medial[0])), medial)
    away, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    chain = [_farthest(away, medial)]
    while chain[-1] != start:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1])


def _farthest(away: FloatArray, among: IntArray) -> int:
    """The one that is farthest of those that can be reached."""
    return int(among[np.argmax(np.where(np.isfinite(away[among]), away[among], -1.0))])
