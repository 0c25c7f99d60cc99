"""Signed distance fields: the clay that the samples are made of.

A field maps points (n, 3) to distances (n,), negative inside. Primitives are exact or close to it, blends
are smooth unions (Quilez, "Distance functions" and "Smooth minimum"); lengths in metres.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray

Field = Callable[[FloatArray], FloatArray]


def ball(centre: Any, radius: float) -> Field:
    middle = np.asarray(centre, float)
    return lambda p: np.asarray(np.linalg.norm(p - middle, axis=1) - radius)


def round_cone(start: Any, end: Any, start_radius: float, end_radius: float) -> Field:
    """The hull of two balls."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    along = b - a
    length2 = float(along @ along)
    taper = start_radius - end_radius
    if length2 <= taper * taper:  # one ball holds the other
        return ball(a, start_radius) if taper > 0 else ball(b, end_radius)
    side2 = length2 - taper * taper

    def field(p: FloatArray) -> FloatArray:
        from_a = p - a
        y = from_a @ along  # (n,)
        z = y - length2
        across = from_a * length2 - y[:, None] * along
        x2 = np.einsum("ij,ij->i", across, across)
        y2, z2 = y * y * length2, z * z * length2
        k = np.sign(taper) * taper * taper * x2
        cap_b = np.sqrt(x2 + z2) / length2 - end_radius
        cap_a = np.sqrt(x2 + y2) / length2 - start_radius
        body = (np.sqrt(x2 * side2 / length2) + y * taper) / length2 - start_radius
        return np.where(np.sign(z) * side2 * z2 > k, cap_b, np.where(np.sign(y) * side2 * y2 < k, cap_a, body))

    return field


def chain(points: Any, radii: Any, blend: float = 0.0) -> Field:
    """Round cones along a polyline, blended into one another."""
    pairs = [
        round_cone(a, b, ra, rb)
        for a, b, ra, rb in zip(points[:-1], points[1:], radii[:-1], radii[1:], strict=True)
    ]
    return union(pairs, blend)


def ellipsoid(centre: Any, radii: Any, axes: Any = None) -> Field:
    """An ellipsoid with half axes `radii` along the columns of `axes` (3, 3); close to exact near the surface."""
    middle, size = np.asarray(centre, float), np.asarray(radii, float)
    turn = np.eye(3) if axes is None else np.asarray(axes, float)

    def field(p: FloatArray) -> FloatArray:
        local = (p - middle) @ turn / size
        near = np.linalg.norm(local, axis=1)
        steep = np.linalg.norm(local / size, axis=1)
        return np.where(steep > 0, near * (near - 1.0) / np.maximum(steep, 1e-12), -size.min())

    return field


def box(centre: Any, half: Any, rounding: float = 0.0, axes: Any = None) -> Field:
    """A box of half extents `half`, its edges rounded within them."""
    middle, size = np.asarray(centre, float), np.asarray(half, float) - rounding
    turn = np.eye(3) if axes is None else np.asarray(axes, float)

    def field(p: FloatArray) -> FloatArray:
        q = np.abs((p - middle) @ turn) - size
        return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0) - rounding

    return field


def cylinder(centre: Any, radius: float, half: float, rounding: float = 0.0) -> Field:
    """An upright cylinder (axis y) of half height `half`, its rims rounded within it."""
    middle = np.asarray(centre, float)

    def field(p: FloatArray) -> FloatArray:
        local = p - middle
        out = np.stack([np.hypot(local[:, 0], local[:, 2]) - radius, np.abs(local[:, 1]) - half], axis=1) + rounding
        return np.linalg.norm(np.maximum(out, 0.0), axis=1) + np.minimum(out.max(axis=1), 0.0) - rounding

    return field


def slab(a: Any, b: Any, c: Any, radius: float) -> Field:
    """A triangle as thick as a ball of `radius`: the hull of three balls."""
    corners = [np.asarray(v, float) for v in (a, b, c)]
    edges = [corners[(k + 1) % 3] - corners[k] for k in range(3)]
    normal = np.cross(edges[0], edges[1])
    walls = [np.cross(edge, normal) for edge in edges]

    def field(p: FloatArray) -> FloatArray:
        offsets = [p - corner for corner in corners]
        within = np.all([offset @ wall <= 0 for offset, wall in zip(offsets, walls, strict=True)], axis=0)
        to_edges = []
        for offset, edge in zip(offsets, edges, strict=True):
            along = np.clip(offset @ edge / (edge @ edge), 0.0, 1.0)
            to_edges.append(np.linalg.norm(offset - along[:, None] * edge, axis=1))
        flat = np.abs(offsets[0] @ normal) / np.linalg.norm(normal)
        return np.where(within, flat, np.min(to_edges, axis=0)) - radius

    return field


def half_space(point: Any, outward: Any) -> Field:
    """All that lies behind a plane."""
    origin, normal = np.asarray(point, float), np.asarray(outward, float)
    normal = normal / np.linalg.norm(normal)
    return lambda p: np.asarray((p - origin) @ normal)


def union(fields: list[Field], blend: float = 0.0) -> Field:
    """All fields together; `blend` is the width over which they flow into one another."""
    return lambda p: reduce(lambda x, y: smooth_min(x, y, blend), (f(p) for f in fields))


def common(first: Field, second: Field, blend: float = 0.0) -> Field:
    """What lies in both, the edge between them rounded by `blend`."""
    return lambda p: -smooth_min(-first(p), -second(p), blend)


def without(first: Field, second: Field, blend: float = 0.0) -> Field:
    """The first field with the second carved out."""
    return lambda p: -smooth_min(-first(p), second(p), blend)


def smooth_min(x: FloatArray, y: FloatArray, blend: float) -> FloatArray:
    """The smaller of two distances, rounded where they differ by less than `blend` (quadratic, C1)."""
    lower = np.minimum(x, y)
    if blend <= 0.0:
        return lower
    near = np.maximum(blend - np.abs(x - y), 0.0) / blend
    return np.asarray(lower - near * near * blend * 0.25)


def gradient(field: Field, points: FloatArray, step: float) -> FloatArray:
    """(n, 3) gradient of a field by four evaluations at the corners of a tetrahedron."""
    corners = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], float)
    return np.asarray(sum(field(points + step * c)[:, None] * c for c in corners) / (4.0 * step))
