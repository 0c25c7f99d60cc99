"""Kernels between directions in space and headings on the surface."""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import inner, kernel
from contact_core.geometry.kernel_arrays import Halfedges, Points
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_FACE,
    ON_NOTHING,
    PI,
    corner_angle,
    corner_at_angle,
    norm,
    place_of,
    turned,
    vertex_scale,
)
from contact_core.geometry.topology_kernels import BOUNDARY_VERTEX, first_of, preceding, twin_of


@inner
def in_frame(
    h: int, dx: float, dy: float, dz: float, points: FloatArray, faces: IntArray
) -> tuple[float, float, float]:
    """A direction in space in the frame of halfedge h, and along the normal of its face (not normalised)."""
    f, k = h // 3, h % 3
    a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
    ex, ey, ez = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    along = ex * wx + ey * wy + ez * wz
    wx, wy, wz = wx - along * ex, wy - along * ey, wz - along * ez
    height = math.sqrt(wx * wx + wy * wy + wz * wz)
    x = dx * ex + dy * ey + dz * ez
    if height == 0.0:
        return x, 0.0, 0.0
    wx, wy, wz = wx / height, wy / height, wz / height
    normal = dx * (ey * wz - ez * wy) + dy * (ez * wx - ex * wz) + dz * (ex * wy - ey * wx)
    return x, dx * wx + dy * wy + dz * wz, normal


@inner
def in_space(h: int, x: float, y: float, points: FloatArray, faces: IntArray, direction: FloatArray) -> None:
    """Write the unit direction in space (3,) of direction (x, y) in the frame of halfedge h."""
    f, k = h // 3, h % 3
    a, b, c = faces[f, k], faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
    ee = ew = ww = 0.0
    for i in range(3):
        e, w = points[b, i] - points[a, i], points[c, i] - points[a, i]
        ee, ew, ww = ee + e * e, ew + e * w, ww + w * w
    length = math.sqrt(ee)
    height = math.sqrt(max(ww - ew * ew / ee, 0.0))
    norm = 0.0
    for i in range(3):
        e, w = points[b, i] - points[a, i], points[c, i] - points[a, i]
        up = (w - ew / ee * e) / height if height > 0.0 else 0.0
        direction[i] = x * e / length + y * up
        norm += direction[i] * direction[i]
    norm = math.sqrt(norm)
    for i in range(3):
        direction[i] /= norm


@kernel
def headings_of_directions(
    points: FloatArray,
    faces: IntArray,
    at: Points,
    directions: FloatArray,
    headings: FloatArray,
    mesh: Halfedges,
) -> int:
    """Write headings (k, 2) of directions (k, 3) at points: see `tangent.direction_to_heading`. Returns -1, or
    a halfedge of a face without three corners that a point lies in."""
    for i in range(len(at.faces)):
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        on, element, _, _ = place_of(at, i, mesh)
        if on == ON_NOTHING:
            return element
        if on == ON_FACE:
            x, y, _ = in_frame(3 * element, dx, dy, dz, points, faces)
        elif on == ON_EDGE:
            x, y, _ = in_frame(element, dx, dy, dz, points, faces)
            other = twin_of(element, mesh)
            if other >= 0:
                _, beyond, _ = in_frame(other, dx, dy, dz, points, faces)
                y = y if y >= beyond else -beyond
            else:
                y = max(y, 0.0)
        else:
            least, angle = math.inf, 0.0
            h = first_of(element, mesh)
            while True:
                x, y, z = in_frame(h, dx, dy, dz, points, faces)
                corner = corner_angle(h, mesh)
                half = 0.5 * corner
                u, v = turned(x, y, math.cos(half), -math.sin(half))
                alpha = half + min(max(math.atan2(v, u), -half), half)
                # measured by what is missed: a cosine would not tell directions 1e-9 apart
                along, across = turned(x, y, math.cos(alpha), -math.sin(alpha))
                miss = norm(across, z) if along > 0.0 else norm(norm(across, z), along) - along
                if miss < least:
                    least, angle = miss, mesh.shape[h, 3] + alpha
                h = twin_of(preceding(h), mesh)
                if h < 0 or h == mesh.first[element]:
                    break
            angle *= vertex_scale(element, mesh)
            x, y = math.cos(angle), math.sin(angle)
        length = math.hypot(x, y)
        headings[i, 0], headings[i, 1] = (x / length, y / length) if length > 0.0 else (1.0, 0.0)
    return -1


@kernel
def directions_of_headings(
    points: FloatArray,
    faces: IntArray,
    at: Points,
    headings: FloatArray,
    directions: FloatArray,
    mesh: Halfedges,
) -> int:
    """Write directions (k, 3) of headings (k, 2) at points: see `tangent.heading_to_direction`. Returns -1, or
    a halfedge of a face without three corners that a point lies in."""
    for i in range(len(at.faces)):
        x, y = headings[i, 0], headings[i, 1]
        on, element, _, _ = place_of(at, i, mesh)
        if on == ON_NOTHING:
            return element
        if on == ON_FACE:
            h = 3 * element
        elif on == ON_EDGE:
            h = element
            other = twin_of(h, mesh)
            if y < 0.0 and other >= 0:
                h, x, y = other, -x, -y
        else:
            angle = math.atan2(y, x)
            if angle < 0.0 and mesh.kind[element] != BOUNDARY_VERTEX:
                angle += 2.0 * PI
            h, angle = corner_at_angle(element, angle / vertex_scale(element, mesh), mesh)
            x, y = math.cos(angle), math.sin(angle)
        in_space(h, x, y, points, faces, directions[i])
    return -1
