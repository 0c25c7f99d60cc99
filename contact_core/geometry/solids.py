"""Plain solids as triangles, centred at the origin, wound outwards: what URDF and USD name without a mesh.

Round solids are inscribed: their points lie on the true surface, their volume is up to 1 % below it.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray

SEGMENTS = 48  # around the axis: chords bulge by 0.2 % of the radius
ARC = SEGMENTS // 4  # rings from a pole to the equator
Solid = tuple[FloatArray, IntArray]  # points (n, 3), faces (m, 3)


def box(x: float, y: float, z: float) -> Solid:
    """A box with the given edge lengths along the axes."""
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return corners * [x, y, z], faces


def sphere(radius: float) -> Solid:
    """A ball around the origin."""
    return revolved(_arc(radius, 0.0, -1.0, 0.0) + _arc(radius, 0.0, 0.0, 1.0)[1:])


def capsule(radius: float, length: float, top_radius: float | None = None) -> Solid:
    """A cylinder along z of the given length with half a ball on either end, which the length does not count."""
    top = radius if top_radius is None else top_radius
    below, above = _arc(radius, -length / 2, -1.0, 0.0), _arc(top, length / 2, 0.0, 1.0)
    return revolved(below + (above if length > 0 or top != radius else above[1:]))


def cone(radius: float, height: float, top_radius: float = 0.0) -> Solid:
    """A frustum along z; a cylinder where both radii are the same, a cone with its tip at +z by default."""
    profile = [(0.0, -height / 2), (radius, -height / 2), (top_radius, height / 2), (0.0, height / 2)]
    return revolved([p for k, p in enumerate(profile) if k == 0 or p != profile[k - 1]])


def rounded_cylinder(radius: float, height: float, rounding: float, step: float) -> Solid:
    """A cylinder along z with rounded rims, its rings about `step` apart: points that contacts can be laid on."""
    flat = np.linspace(0.0, radius - rounding, max(int((radius - rounding) / step), 1) + 1)
    angles = np.linspace(0.0, np.pi / 2, 5)[1:]
    high = height / 2 - rounding
    side = np.linspace(-high, high, max(int(2 * high / step), 1) + 1)[1:-1]
    rim = [(float(radius - rounding + rounding * np.sin(a)), float(-high - rounding * np.cos(a))) for a in angles]
    below = [(float(r), -height / 2) for r in flat] + rim
    above = [(r, -z) for r, z in reversed(below)]
    return revolved(below + [(radius, float(z)) for z in side] + above)


def rounded_box(x: float, y: float, z: float, rounding: float, step: float) -> Solid:
    """A box with rounded edges, its triangles about `step` wide."""
    half = 0.5 * np.array([x, y, z])
    counts = np.maximum(np.round(2 * half / step).astype(int), 3)
    lines = [np.linspace(-h, h, n + 1) for h, n in zip(half, counts, strict=True)]
    for line, h in zip(lines, half, strict=True):  # a line where the rounding begins, or the edge would bulge
        line[1], line[-2] = -h + rounding, h - rounding
    index = np.full([len(line) for line in lines], -1)
    border = np.zeros(index.shape, bool)
    for axis in range(3):
        border[tuple(slice(None) if k != axis else [0, -1] for k in range(3))] = True
    at = np.argwhere(border)
    index[border] = np.arange(len(at))
    points = np.stack([lines[k][at[:, k]] for k in range(3)], axis=1)
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, -1):
            sheet = index.take(side, axis=axis)
            sheet = sheet if u < v else sheet.T  # rows along u, columns along v
            quads = np.stack([sheet[:-1, :-1], sheet[1:, :-1], sheet[1:, 1:], sheet[:-1, 1:]], axis=-1).reshape(
                -1, 4
            )
            quads = quads[:, ::-1] if side == 0 else quads
            faces += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    inner = np.clip(points, rounding - half, half - rounding)
    out = points - inner
    out *= rounding / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return inner + out, np.concatenate(faces)


def rectangle(x: float, y: float) -> Solid:
    """Two triangles in the plane z = 0 that face +z."""
    corners = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
    return corners * [x, y, 1.0], np.array([[0, 1, 2], [0, 2, 3]])


def _arc(radius: float, z: float, start: float, end: float) -> list[tuple[float, float]]:
    """(distance from the axis, height) along a quarter of a circle, in quarter turns from the equator."""
    angles = np.linspace(start, end, ARC + 1) * (np.pi / 2)
    return [
        (0.0 if abs(abs(a) - np.pi / 2) < 1e-9 else float(radius * np.cos(a)), float(z + radius * np.sin(a)))
        for a in angles
    ]


def revolved(profile: list[tuple[float, float]]) -> Solid:
    """The solid that a profile (distance from the axis, height), bottom to top, sweeps about z."""
    turns = np.arange(SEGMENTS) * (2 * np.pi / SEGMENTS)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)  # (s, 2)
    points, faces = list[FloatArray](), list[IntArray]()
    before: IntArray | None = None
    start = 0
    for radius, z in profile:
        count = SEGMENTS if radius > 0 else 1
        points.append(np.column_stack([radius * circle[:count], np.full(count, z)]))
        here = np.broadcast_to(np.arange(start, start + count), SEGMENTS)
        if before is not None:
            below, above = np.roll(before, -1), np.roll(here, -1)
            band = np.concatenate([np.stack([before, below, above], 1), np.stack([before, above, here], 1)])
            faces.append(band[(band[:, 0] != band[:, 1]) & (band[:, 1] != band[:, 2])])
        before, start = here, start + count
    return np.concatenate(points), np.concatenate(faces)
