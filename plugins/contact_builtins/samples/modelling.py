"""From a field to a surface: level set (manifold3d), then even triangles that lie exactly on the field."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from contact_builtins.samples.fields import Field, gradient
from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import MissingExtra
from contact_core.geometry.mesh import TriangleMesh

Sizing = Callable[[FloatArray], FloatArray]  # wanted edge length at points (n, 3)


def surface_of(
    field: Field, low: Any, high: Any, grid: float, edge: float | Sizing | None = None, rounds: int = 11
) -> TriangleMesh:
    """The closed manifold surface of a field within the box low..high.

    grid: lattice spacing of the level set, finer than the thinnest wall. edge: wanted edge length, one number or
    a function of points (n, 3). The level set comes as a manifold with uneven triangles; each of `rounds` collapses
    short edges, flips edges towards Delaunay, smooths within the surface, and steps back onto the field (after
    Botsch and Kobbelt 2004).
    """
    mesh = level_set(field, low, high, grid)
    points, faces = np.array(mesh.points), np.array(mesh.faces)
    for _ in range(rounds):
        if edge is not None:
            for _ in range(4):  # an independent set at a time
                points, faces = collapse_short_edges(points, faces, edge)
        faces = flip_towards_delaunay(points, faces)
        points = onto_field(field, points + 0.6 * _slide(points, faces), grid, steps=1)
    points = onto_field(field, points, grid, steps=2)
    return TriangleMesh(points, flip_towards_delaunay(points, faces))


def level_set(field: Field, low: Any, high: Any, grid: float) -> TriangleMesh:
    """The zero level set as manifold3d meshes it, its largest piece."""
    return closed_surfaces(field, low, high, grid, ("Building a sample", "samples"))[0]


def closed_surfaces(
    field: Field,
    low: Any,
    high: Any,
    grid: float,
    extra: tuple[str, str],
    *,
    steep: float = 1.2,
    simpler: float = 0.0,
) -> list[TriangleMesh]:
    """The pieces of the zero level set within a box as manifold3d meshes it, largest volume first.

    extra: what needs the library, and the extra that brings it, for the error. steep: how much faster than one
    moves the field may change, at most. simpler: grid lengths that the surface may move for larger triangles.
    Raises MissingExtra.
    """
    try:
        import manifold3d
    except ImportError as error:
        raise MissingExtra(*extra) from error
    bounds = [float(v) for v in (*low, *high)]
    lattice: list[tuple[float, float, float]] = []

    def ask(x: float, y: float, z: float) -> float:
        lattice.append((x, y, z))
        return -1.0

    # Which points the library asks for does not depend on the answers: a first pass collects them, one
    # vectorised call answers them all, a second pass reads the answers.
    manifold3d.Manifold.level_set(ask, bounds, grid)
    inside = -_near_the_surface(field, np.array(lattice), grid, steep)  # manifold3d calls the inside positive
    answers = dict(zip(lattice, inside.tolist(), strict=True))
    solid = manifold3d.Manifold.level_set(lambda x, y, z: answers[x, y, z], bounds, grid)
    if simpler:
        solid = solid.simplify(simpler * grid)
    pieces = sorted(solid.decompose(), key=lambda piece: -piece.volume())
    return [from_manifold(piece) for piece in pieces]


def _near_the_surface(field: Field, lattice: FloatArray, grid: float, steep: float) -> FloatArray:
    """Field values (n,), exact near the surface; farther off, blocks of points share one value of the right sign.

    A distance field changes no faster than one moves, so a block whose centre is far from the surface holds none.
    """
    size = 3.0 * grid
    cell = np.floor(lattice / size).astype(np.int64)
    first = cell.min(axis=0)
    sides = cell.max(axis=0) - first + 1
    numbers, cell_of = np.unique(np.ravel_multi_index((cell - first).T, sides), return_inverse=True)
    cells = np.stack(np.unravel_index(numbers, sides), axis=1) + first
    centre = field(np.asarray((cells + 0.5) * size, np.float64))[cell_of.reshape(-1)]  # (n,)
    # half a block's diagonal, a cell of the lattice, and a fifth more: blends and ellipsoids are not quite exact
    near = np.abs(centre) < steep * (0.5 * np.sqrt(3.0) * size + 2.0 * grid)
    values = centre.copy()
    values[near] = field(np.asarray(lattice[near]))
    return values


def from_manifold(solid: Any) -> TriangleMesh:
    mesh = solid.to_mesh64()
    return TriangleMesh(np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, np.int64))


def onto_field(field: Field, points: FloatArray, edge: float, steps: int) -> FloatArray:
    """Points moved onto the zero level along the gradient (Newton; never farther than an edge a step)."""
    for _ in range(steps):
        slope = gradient(field, points, 0.02 * edge)
        steep2 = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.04)
        reach = np.clip(field(points) / steep2, -edge, edge)
        points = points - reach[:, None] * slope
    return points


def collapse_short_edges(points: FloatArray, faces: IntArray, edge: float | Sizing) -> tuple[FloatArray, IntArray]:
    """Collapse an independent set of edges shorter than 0.8 of the wanted length to their midpoints.

    An edge goes only when exactly two vertices neighbour both its ends (the link condition keeps the manifold
    and its genus) and no face around it turns over.
    """
    from scipy.sparse import coo_array

    count = len(points)
    halfedges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs = np.stack(np.divmod(np.unique(halfedges[:, 0] * count + halfedges[:, 1]), count), axis=1)  # (e, 2)
    middle = points[pairs].mean(axis=1)
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    wanted = edge(middle) if callable(edge) else np.full(len(pairs), edge)
    ratio = length / wanted
    ones = np.ones(len(pairs), np.int32)
    half = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    neighbours = half + half.T
    valence = np.diff(neighbours.indptr)
    short = np.flatnonzero(ratio < 0.8)
    a, b = pairs[short].T
    shared = np.asarray(neighbours[a].multiply(neighbours[b]).sum(axis=1)).ravel()
    short = short[(shared == 2) & (valence[a] + valence[b] > 8) & (valence[a] + valence[b] < 14)]
    short = short[np.argsort(ratio[short], kind="stable")]
    chosen = _far_apart(pairs[short], pairs, count)
    return _collapse(points, faces, pairs[short][chosen], middle[short][chosen])


def _far_apart(wanted: IntArray, edges: IntArray, count: int) -> BoolArray:
    """(w,) which of the edges `wanted`, best first, have no better one within two steps."""
    rank = np.arange(len(wanted))
    reach = np.full(count, len(wanted))
    np.minimum.at(reach, wanted.ravel(), np.repeat(rank, 2))
    for _ in range(2):
        spread = reach.copy()
        np.minimum.at(spread, edges[:, 0], reach[edges[:, 1]])
        np.minimum.at(spread, edges[:, 1], reach[edges[:, 0]])
        reach = spread
    return np.asarray((reach[wanted] == rank[:, None]).all(axis=1))


def _collapse(
    points: FloatArray, faces: IntArray, edges: IntArray, middle: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Collapse edges that share no neighbour, unless a face near them would turn over."""
    while True:
        target = np.arange(len(points))
        target[edges[:, 1]] = edges[:, 0]
        moved = points.copy()
        moved[edges[:, 0]] = middle
        merged = target[faces]
        stays = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
        before = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
        after = np.cross(moved[merged[:, 1]] - moved[merged[:, 0]], moved[merged[:, 2]] - moved[merged[:, 0]])
        lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        turned = stays & (np.einsum("ij,ij->i", before, after) < 0.5 * lengths)
        bad = np.zeros(len(points), bool)
        bad[merged[turned]] = True
        keep = ~bad[edges[:, 0]]
        if keep.all():
            break
        edges, middle = edges[keep], middle[keep]
    used, faces = np.unique(merged[stays], return_inverse=True)
    return moved[used], faces.reshape(-1, 3)


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
