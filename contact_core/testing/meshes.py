"""Mesh families for laws: small, deterministic, each hard in its own way. numpy only.

Every function returns a TriangleMesh with outward (or +z) normals. `family(name)` and `FAMILIES` give
representatives by name for parametrised tests; sizes are chosen so that an exact engine answers in
milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh


def grid_faces(rows: int, columns: int, *, wrap_rows: bool = False, wrap_columns: bool = False) -> IntArray:
    """(m, 3) faces over a rows x columns lattice of vertices, alternating diagonals; normal = column x row axis."""
    r = np.arange(rows if wrap_rows else rows - 1)[:, None]
    c = np.arange(columns if wrap_columns else columns - 1)[None, :]
    a = r * columns + c
    b = r * columns + (c + 1) % columns
    d = ((r + 1) % rows) * columns + c
    e = ((r + 1) % rows) * columns + (c + 1) % columns
    even = np.broadcast_to((r + c) % 2 == 0, a.shape)[..., None]
    first = np.where(even, np.stack([a, b, e], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([a, e, d], -1), np.stack([b, e, d], -1))
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def plane(resolution: int = 12, size: float = 1.0) -> TriangleMesh:
    """A flat square of `resolution`^2 cells in z = 0, normals +z."""
    x, y = np.meshgrid(*2 * [np.linspace(0.0, size, resolution + 1)])
    points = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    return TriangleMesh(points, grid_faces(resolution + 1, resolution + 1))


def height_field(height: Callable[[FloatArray, FloatArray], FloatArray], resolution: int = 14) -> TriangleMesh:
    """The graph z = height(x, y) over [-1, 1]^2, normals +z."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, resolution + 1)])
    points = np.stack([x, y, height(x, y)], -1).reshape(-1, 3)
    return TriangleMesh(points, grid_faces(resolution + 1, resolution + 1))


def saddle(resolution: int = 14) -> TriangleMesh:
    """z = (x^2 - y^2) / 2: negative curvature, so many saddle vertices."""
    return height_field(lambda x, y: 0.5 * (x * x - y * y), resolution)


def creased(resolution: int = 12) -> TriangleMesh:
    """A folded sheet with a ridge and a valley: all curvature sits on two lines."""
    return height_field(lambda x, y: np.abs(x - 0.3) - 0.8 * np.abs(x + 0.4) + 0.0 * y, resolution)


def icosphere(subdivisions: int = 2, radius: float = 1.0) -> TriangleMesh:
    """A sphere by midpoint subdivision of the icosahedron, vertices on the sphere."""
    t = (1.0 + 5.0**0.5) / 2.0
    points = np.array(
        [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t], [0, -1, -t], [0, 1, -t],
         [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]]
    )  # fmt: skip
    faces = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
         [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
         [8, 6, 7], [9, 8, 1]]
    )  # fmt: skip
    mesh = TriangleMesh(points / np.linalg.norm(points, axis=1, keepdims=True), faces)
    for _ in range(subdivisions):
        mesh = subdivided(mesh)
        mesh = mesh.with_points(mesh.points / np.linalg.norm(mesh.points, axis=1, keepdims=True))
    return mesh.with_points(radius * mesh.points)


def cylinder(around: int = 24, along: int = 12, radius: float = 0.5, height: float = 2.0) -> TriangleMesh:
    """An open tube about z: developable, so every answer is known on its unrolled polygon."""
    angle = 2.0 * np.pi * np.arange(around) / around
    z = np.linspace(0.0, height, along + 1)
    zz, aa = np.meshgrid(z, angle, indexing="ij")
    points = np.stack([radius * np.cos(aa), radius * np.sin(aa), zz], -1).reshape(-1, 3)
    return TriangleMesh(points, grid_faces(along + 1, around, wrap_columns=True))


def torus(around: int = 28, section: int = 16, major: float = 1.0, minor: float = 0.4) -> TriangleMesh:
    """A closed torus about z: genus 1, both signs of curvature."""
    u = 2.0 * np.pi * np.arange(around) / around
    v = 2.0 * np.pi * np.arange(section) / section
    uu, vv = np.meshgrid(u, v)
    ring = major + minor * np.cos(vv)
    points = np.stack([ring * np.cos(uu), ring * np.sin(uu), minor * np.sin(vv)], -1).reshape(-1, 3)
    return TriangleMesh(points, grid_faces(section, around, wrap_rows=True, wrap_columns=True))


def noisy(subdivisions: int = 2, amplitude: float = 0.06, seed: int = 7) -> TriangleMesh:
    """A sphere with radial noise: many convex vertices and many saddles."""
    mesh = icosphere(subdivisions)
    factor = 1.0 + amplitude * np.random.default_rng(seed).standard_normal(len(mesh.points))
    return mesh.with_points(mesh.points * factor[:, None])


def with_holes(resolution: int = 16) -> TriangleMesh:
    """A wavy sheet with two holes: shortest paths bend round the rims."""
    mesh = height_field(lambda x, y: 0.2 * np.sin(3.0 * x) * np.cos(2.0 * y), resolution)
    centres = mesh.points[mesh.faces].mean(axis=1)[:, :2]  # (m, 2)
    first, second = np.array([0.35, 0.3]), np.array([-0.4, -0.35])
    inside = (np.linalg.norm(centres - first, axis=1) < 0.28) | (np.linalg.norm(centres - second, axis=1) < 0.22)
    return without_unused(mesh.points, mesh.faces[~inside])


def sliver(ratio: float = 1000.0, resolution: int = 10) -> TriangleMesh:
    """A gently bent sheet cut into triangles `ratio` times longer than high, every other row wide."""
    steps = np.where(np.arange(resolution) % 2 == 0, 1.0, 1.0 / ratio)
    y = np.concatenate([[0.0], np.cumsum(steps)])
    x = np.linspace(0.0, 5.0, 6)
    xx, yy = np.meshgrid(x, y)
    points = np.stack([xx, yy, 0.1 * xx * xx / 5.0], -1).reshape(-1, 3)
    return TriangleMesh(points, grid_faces(len(y), len(x)))


def lattice(size: int = 9, levels: int = 3, seed: int = 1) -> TriangleMesh:
    """A sheet of whole heights 0 to levels - 1 over size^2 lattice points: straight ways pass vertices exactly,
    and many ways are equally long."""
    x, y = np.meshgrid(*2 * [np.arange(float(size))])
    z = np.random.default_rng(seed).integers(0, levels, (size, size)).astype(float)
    return TriangleMesh(np.stack([x, y, z], -1).reshape(-1, 3), grid_faces(size, size))


def blocks(solid: BoolArray | None = None) -> TriangleMesh:
    """The closed surface of unit cubes where solid (a, b, c) is true: right angles, flat vertices, exact ties.

    Two cubes that touch in an edge or a vertex alone make it non-manifold. Without an argument, a ring with a step.
    """
    if solid is None:
        solid = np.ones((4, 3, 2), bool)
        solid[1:3, 1, :] = False
        solid[3, :, 1] = False
    filled = np.pad(solid, 1)
    corners: list[IntArray] = []
    for axis in range(3):
        u, v, normal = np.eye(3, dtype=np.int64)[[(axis + 1) % 3, (axis + 2) % 3, axis]]
        for side in (0, 1):
            cubes = np.argwhere(filled & ~np.roll(filled, 1 - 2 * side, axis=axis)) + side * normal
            square = cubes[:, None] + (np.array([0 * u, u, u + v, v]) if side else np.array([0 * u, v, u + v, u]))
            odd = cubes.sum(axis=1) % 2 == 1
            square[odd] = np.roll(square[odd], 1, axis=1)  # the diagonals alternate
            corners += [square[:, [0, 1, 2]], square[:, [0, 2, 3]]]
    points, faces = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(points.astype(float), faces.reshape(-1, 3))


def subdivided(mesh: TriangleMesh) -> TriangleMesh:
    """Midpoint subdivision, 1 to 4: the same polyhedral surface. Child 3 of face f is its middle triangle."""
    ends = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)  # (3m, 2), halfedge 3f + k
    edges, edge_of = np.unique(ends, axis=0, return_inverse=True)
    middle = (edge_of.reshape(-1, 3) + len(mesh.points)).astype(np.int64)  # (m, 3)
    a, b, c = mesh.faces.T
    ab, bc, ca = middle.T
    children = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])  # (4, 3, m)
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    return TriangleMesh(points, children.transpose(2, 0, 1).reshape(-1, 3))


def copies(mesh: TriangleMesh, count: int, spacing: float = 2.0) -> TriangleMesh:
    """`count` disjoint copies in a row in one mesh; the last one's faces come last."""
    step = np.array([spacing * mesh.bounding_box_diagonal, 0.0, 0.0])
    points = np.concatenate([mesh.points + k * step for k in range(count)])
    faces = np.concatenate([mesh.faces + k * len(mesh.points) for k in range(count)])
    return TriangleMesh(points, faces)


def without_unused(points: FloatArray, faces: IntArray) -> TriangleMesh:
    """The mesh of the points that faces use."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return TriangleMesh(points[used], renumbered.reshape(-1, 3))


FAMILIES: dict[str, Callable[[], TriangleMesh]] = {
    "plane": plane,
    "sphere": icosphere,
    "cylinder": cylinder,
    "torus": torus,
    "saddle": saddle,
    "noisy": noisy,
    "holes": with_holes,
    "creased": creased,
    "sliver": sliver,
    "lattice": lattice,
    "blocks": blocks,
}


def family(name: str) -> TriangleMesh:
    """The representative of a family by name."""
    if name not in FAMILIES:
        raise InvalidInput(f"a mesh family is one of {', '.join(FAMILIES)}, but got {name!r}.")
    return FAMILIES[name]()
