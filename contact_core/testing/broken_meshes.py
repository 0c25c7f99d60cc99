"""Meshes that are broken as artists' assets are: not manifold, torn, crossing themselves, in parts. numpy only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.testing.meshes import grid_faces, icosphere, torus, without_unused


def fin() -> TriangleMesh:
    """A sphere with a fin on one of its edges: three faces share it."""
    ball = icosphere(3)
    a, b = ball.faces[7, :2]
    tip = 1.3 * (ball.points[a] + ball.points[b]) / 2.0
    return joined(ball.with_points(ball.points), TriangleMesh([*ball.points[[a, b]], tip], [[0, 1, 2]]), weld=True)


def bow_tie() -> TriangleMesh:
    """Two spheres that meet in one vertex."""
    ball = icosphere(3)
    top = int(np.argmax(ball.points[:, 1]))
    mirrored = ball.points * np.array([1.0, -1.0, 1.0])
    other = ball.with_points(mirrored + np.array([0.0, 2.0 * ball.points[top, 1], 0.0]))
    return joined(ball, TriangleMesh(other.points, other.faces[:, ::-1]), weld=True)


def mixed_winding(share: float = 0.1, seed: int = 3) -> TriangleMesh:
    """A torus with some of its faces wound inwards."""
    ring = torus()
    turned = np.random.default_rng(seed).random(len(ring.faces)) < share
    return TriangleMesh(ring.points, np.where(turned[:, None], ring.faces[:, ::-1], ring.faces))


def shells(count: int = 12) -> TriangleMesh:
    """A row of overlapping spheres, each a part of its own: a bar like a robot's finger."""
    ball = icosphere(2, radius=0.3)
    return joined(*(ball.with_points(ball.points + np.array([0.25 * k, 0.0, 0.0])) for k in range(count)))


def cards(count: int = 9, seed: int = 5) -> TriangleMesh:
    """Sheets that cross one another in the y axis, as cards of hair do; three and more share each edge there."""
    rng = np.random.default_rng(seed)
    heights = np.linspace(0.0, 2.0, 9)
    axis = np.column_stack([np.zeros(9), heights, np.zeros(9)])
    parts = []
    for angle in rng.uniform(0.0, 2.0 * np.pi, count):
        rim = axis + np.array([0.6 * np.cos(angle), 0.0, 0.6 * np.sin(angle)])
        parts.append(TriangleMesh(np.stack([axis, rim], 1).reshape(-1, 3), grid_faces(9, 2)))
    return joined(*parts, weld=True)


def shirt(around: int = 40, along: int = 30) -> TriangleMesh:
    """One layer of cloth: a trunk with two sleeves that cross its wall, all of them open tubes."""
    trunk = _tube([0.0, -1.0, 0.0], [0.0, 1.0, 0.0], 0.6, around, along)
    sleeves = [_tube([0.45 * side, 0.6, 0.0], [1.5 * side, 0.2, 0.0], 0.25, around, along // 2) for side in (-1, 1)]
    return joined(trunk, *sleeves)


def torn_knot(around: int = 240, section: int = 16, seed: int = 11) -> TriangleMesh:
    """A trefoil tube so thick that it nearly crosses itself, with a fifteenth of its faces torn out."""
    t = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    line = np.stack([np.sin(t) + 2.0 * np.sin(2.0 * t), np.cos(t) - 2.0 * np.cos(2.0 * t), -np.sin(3.0 * t)], 1)
    ahead = np.roll(line, -1, 0) - np.roll(line, 1, 0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = np.linspace(0.0, 2.0 * np.pi, section, endpoint=False)[None, :, None]
    ring = np.cos(turn) * side[:, None] + np.sin(turn) * np.cross(ahead, side)[:, None]
    points = (line[:, None] + 0.45 * ring).reshape(-1, 3)
    faces = grid_faces(around, section, wrap_rows=True, wrap_columns=True)
    kept = np.random.default_rng(seed).random(len(faces)) > 1.0 / 15.0
    return without_unused(points, outwards(points, faces)[kept])


def doubled() -> TriangleMesh:
    """A sphere with each of its faces twice, once in either winding."""
    ball = icosphere(3)
    return TriangleMesh(ball.points, np.concatenate([ball.faces, ball.faces[:, ::-1]]))


BROKEN: dict[str, Callable[[], TriangleMesh]] = {
    maker.__name__: maker for maker in (fin, bow_tie, mixed_winding, shells, cards, shirt, torn_knot, doubled)
}


def joined(*meshes: TriangleMesh, weld: bool = False) -> TriangleMesh:
    """Meshes as one. weld: equal points are one point."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    points = np.concatenate([mesh.points for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)])
    if weld:
        _, first, number = np.unique(np.round(points, 12), axis=0, return_index=True, return_inverse=True)
        points, faces = points[first], number.reshape(-1)[faces]
    return TriangleMesh(points, faces)


def outwards(points: FloatArray, faces: IntArray) -> IntArray:
    """Faces of a closed surface (m, 3), turned outwards."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return faces if np.einsum("mi,mi->", a, np.cross(b, c)) > 0.0 else faces[:, ::-1]


def _tube(start: list[float], end: list[float], radius: float, around: int, along: int) -> TriangleMesh:
    """An open tube round a segment."""
    a, b = np.array(start), np.array(end)
    axis = (b - a) / np.linalg.norm(b - a)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)[None, :, None]
    ring = radius * (np.cos(turn) * side + np.sin(turn) * np.cross(axis, side))
    points = a + np.linspace(0.0, 1.0, along)[:, None, None] * (b - a) + ring
    faces = grid_faces(along, around, wrap_columns=True)
    outer = TriangleMesh(points.reshape(-1, 3), faces)
    radial = np.einsum("mi,mi->m", outer.face_normals, outer.points[faces].mean(axis=1) - (a + b) / 2.0)
    return outer if radial.sum() > 0.0 else TriangleMesh(outer.points, faces[:, ::-1])
