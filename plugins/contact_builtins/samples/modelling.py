"""From a field to a surface: level set (manifold3d), then even triangles that lie exactly on the field."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_builtins.samples.fields import Field, gradient
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import MissingExtra
from contact_core.geometry.mesh import TriangleMesh


def surface_of(field: Field, low: Any, high: Any, edge: float, rounds: int = 12) -> TriangleMesh:
    """The closed manifold surface of a field within the box low..high, its edges about `edge` long.

    The level set comes as a manifold but with uneven triangles: `rounds` of edge flips towards Delaunay and of
    smoothing within the surface make them even, each followed by a Newton step back onto the field.
    """
    mesh = level_set(field, low, high, edge)
    points, faces = np.array(mesh.points), np.array(mesh.faces)
    for _ in range(rounds):
        faces = flip_towards_delaunay(points, faces)
        points = points + 0.6 * _slide(points, faces)
        points = onto_field(field, points, edge)
    faces = flip_towards_delaunay(points, faces)
    return TriangleMesh(points, faces)


def level_set(field: Field, low: Any, high: Any, edge: float) -> TriangleMesh:
    """The zero level set as manifold3d meshes it, its largest piece."""
    try:
        import manifold3d
    except ImportError as error:
        raise MissingExtra("Building a sample", "samples") from error
    bounds = [float(v) for v in (*low, *high)]
    lattice: list[tuple[float, float, float]] = []

    def ask(x: float, y: float, z: float) -> float:
        lattice.append((x, y, z))
        return -1.0

    # Which points the library asks for does not depend on the answers: a first pass collects them, one
    # vectorised call answers them all, a second pass reads the answers.
    manifold3d.Manifold.level_set(ask, bounds, edge)
    inside = -field(np.array(lattice))  # manifold3d calls the inside positive
    answers = dict(zip(lattice, inside.tolist(), strict=True))
    solid = manifold3d.Manifold.level_set(lambda x, y, z: answers[x, y, z], bounds, edge)
    pieces = sorted(solid.decompose(), key=lambda piece: -piece.volume())
    return from_manifold(pieces[0])


def from_manifold(solid: Any) -> TriangleMesh:
    mesh = solid.to_mesh64()
    return TriangleMesh(np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, np.int64))


def onto_field(field: Field, points: FloatArray, edge: float, steps: int = 2) -> FloatArray:
    """Points moved onto the zero level along the gradient (Newton; never farther than an edge a step)."""
    for _ in range(steps):
        slope = gradient(field, points, 0.02 * edge)
        steep2 = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.04)
        reach = np.clip(field(points) / steep2, -edge, edge)
        points = points - reach[:, None] * slope
    return points


def _slide(points: FloatArray, faces: IntArray) -> FloatArray:
    """(n, 3) the way of each vertex to the area-weighted centroid of its faces, within the tangent plane."""
    mesh = TriangleMesh(points, faces)
    centroids = points[faces].mean(axis=1)  # (m, 3)
    pull, mass = np.zeros_like(points), np.zeros(len(points))
    for k in range(3):
        np.add.at(pull, faces[:, k], centroids * mesh.face_areas[:, None])
        np.add.at(mass, faces[:, k], mesh.face_areas)
    way = pull / np.maximum(mass, 1e-30)[:, None] - points
    normals = mesh.vertex_normals
    return way - np.einsum("ij,ij->i", way, normals)[:, None] * normals


def flip_towards_delaunay(points: FloatArray, faces: IntArray, passes: int = 6) -> IntArray:
    """Faces after flipping edges whose opposite angles exceed 180 degrees, where the surface stays a manifold."""
    faces = np.array(faces)
    for _ in range(passes):
        flips = _choose_flips(points, faces)
        if not len(flips):
            break
        # edge a-b between faces f = (a, b, c) and g = (b, a, d) becomes c-d
        a, b, c, d, f, g = flips.T
        faces[f] = np.stack([a, d, c], axis=1)
        faces[g] = np.stack([d, b, c], axis=1)
    return faces


def _choose_flips(points: FloatArray, faces: IntArray) -> IntArray:
    """(k, 6) rows a, b, c, d, f, g of edges worth flipping, no two of which touch a common quad of faces."""
    count = len(points)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    apex = np.roll(faces, -2, axis=1).ravel()
    order = np.lexsort((start > end, np.maximum(start, end), np.minimum(start, end)))
    one, two = order[0::2], order[1::2]  # the two halfedges of each edge of a closed manifold
    a, b, c, d = start[one], end[one], apex[one], apex[two]
    f, g = one // 3, two // 3
    angle_c = _angle(points[a] - points[c], points[b] - points[c])
    angle_d = _angle(points[a] - points[d], points[b] - points[d])
    gain = angle_c + angle_d - np.pi
    # the flipped pair must face as the old pair does, and the new edge must not exist yet
    old = np.cross(points[b] - points[a], points[c] - points[a]) + np.cross(
        points[a] - points[b], points[d] - points[b]
    )
    first = np.cross(points[d] - points[a], points[c] - points[a])
    second = np.cross(points[b] - points[d], points[c] - points[d])
    upright = (np.einsum("ij,ij->i", first, old) > 0) & (np.einsum("ij,ij->i", second, old) > 0)
    keys = np.minimum(start, end)[one] * count + np.maximum(start, end)[one]
    exists = np.isin(np.minimum(c, d) * count + np.maximum(c, d), keys)
    worth = np.flatnonzero((gain > 1e-6) & upright & ~exists)
    worth = worth[np.argsort(-gain[worth], kind="stable")]
    # greedy and independent: an edge goes only if it is the best of all that touch its four corners
    best = np.full(count, len(worth))
    corners = np.stack([a, b, c, d], axis=1)[worth]
    np.minimum.at(best, corners.ravel(), np.repeat(np.arange(len(worth)), 4))
    chosen = worth[(best[corners] == np.arange(len(worth))[:, None]).all(axis=1)]
    return np.stack([a, b, c, d, f, g], axis=1)[chosen]


def _angle(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v))
