"""Kernels for points and directions: what a surface point lies on, and its tangent frame.

A point lies on a vertex, an edge or inside a face: its *place* (kind, element, x, y). Directions at it are complex
numbers in its tangent frame: of a face, the frame of halfedge 3f; of an edge, that of its lower-index halfedge; of
a vertex, angles counter-clockwise from its first halfedge, rescaled to 2 pi in all (pi on a boundary).
"""

from __future__ import annotations

import math

from contact_core.geometry.jit import constant, inlined, inner
from contact_core.geometry.kernel_arrays import Halfedges, Points
from contact_core.geometry.topology_kernels import (
    BOUNDARY_VERTEX,
    first_of,
    following,
    has_three_corners,
    preceding,
    twin_of,
    visit,
)

ON_FACE = constant(0)  # element: face; x, y in the frame of halfedge 3f
ON_EDGE = constant(1)  # element: the lower-index halfedge; x along it, y = 0
ON_VERTEX = constant(2)  # element: vertex; x = y = 0
ON_NOTHING = constant(3)  # in a face without three corners; element: its halfedge 3f

# A point this near to an edge or a vertex, as a fraction of the longest edge of its face, lies on it. A distance,
# not a barycentric coordinate: in a face a million times longer than high, that would be a million times off.
SNAP = 1e-11
PI = math.pi


@inlined
def place(f: int, b0: float, b1: float, b2: float, mesh: Halfedges) -> tuple[int, int, float, float]:
    """The place of a point given by face and barycentric coordinates."""
    h = 3 * f
    visit(f, mesh)
    l0, l1, l2 = mesh.shape[h, 0], mesh.shape[h + 1, 0], mesh.shape[h + 2, 0]
    near = SNAP * max(l0, l1, l2)
    if b1 * l0 + b2 * l2 <= near:
        return ON_VERTEX, mesh.tail[h], 0.0, 0.0
    if b2 * l1 + b0 * l0 <= near:
        return ON_VERTEX, mesh.tail[h + 1], 0.0, 0.0
    if b0 * l2 + b1 * l1 <= near:
        return ON_VERTEX, mesh.tail[h + 2], 0.0, 0.0
    if not has_three_corners(mesh.tail, f):
        return ON_NOTHING, h, 0.0, 0.0
    for k in range(3):
        if b2 * mesh.shape[h + k, 2] <= near:  # b0, b1, b2 are the weights at mesh.tail, head and apex of this side
            x = b1 * mesh.shape[h + k, 0] + b2 * mesh.shape[h + k, 1]
            if -near <= x <= near:
                return ON_VERTEX, mesh.tail[h + k], 0.0, 0.0
            if abs(x - mesh.shape[h + k, 0]) <= near:
                return ON_VERTEX, mesh.tail[following(h + k)], 0.0, 0.0
            if 0.0 < x < mesh.shape[h + k, 0]:
                return on_edge(h + k, x, mesh)
        b0, b1, b2 = b1, b2, b0
    return ON_FACE, f, b1 * l0 + b2 * mesh.shape[h, 1], b2 * mesh.shape[h, 2]


@inlined
def place_of(points: Points, i: int, mesh: Halfedges) -> tuple[int, int, float, float]:
    """The place of row i of points."""
    b = points.barycentric
    return place(points.faces[i], b[i, 0], b[i, 1], b[i, 2], mesh)


@inlined
def on_edge(h: int, x: float, mesh: Halfedges) -> tuple[int, int, float, float]:
    """The place at x along halfedge h."""
    other = twin_of(h, mesh)
    if 0 <= other < h:
        return ON_EDGE, other, mesh.shape[h, 0] - x, 0.0
    return ON_EDGE, h, x, 0.0


@inlined
def direction_of_next(h: int, mesh: Halfedges) -> tuple[float, float]:
    """The unit direction of the next halfedge in the frame of h.

    Read from the next one's own record, where h runs from the apex: (apex - head) / length would lose all digits
    where a short edge follows a long one.
    """
    h_next = following(h)
    return -mesh.shape[h_next, 1] / mesh.shape[h, 0], mesh.shape[h_next, 2] / mesh.shape[h, 0]


@inlined
def direction_in_face(h: int, mesh: Halfedges) -> tuple[float, float]:
    """The unit direction of halfedge h in the frame of its face."""
    k = h % 3
    if k == 0:
        return 1.0, 0.0
    if k == 1:
        return direction_of_next(h - 1, mesh)
    return -mesh.shape[h - 2, 1] / mesh.shape[h, 0], -mesh.shape[h - 2, 2] / mesh.shape[h, 0]


@inlined
def norm(x: float, y: float) -> float:
    """Length of (x, y); math.hypot guards against overflow at several times the cost."""
    return math.sqrt(x * x + y * y)


@inlined
def turned(x: float, y: float, cos: float, sin: float) -> tuple[float, float]:
    """(x + iy)(cos + i sin)."""
    return x * cos - y * sin, x * sin + y * cos


@inlined
def turned_back(x: float, y: float, cos: float, sin: float) -> tuple[float, float]:
    """(x + iy)(cos - i sin)."""
    return x * cos + y * sin, y * cos - x * sin


@inlined
def corner_angle(h: int, mesh: Halfedges) -> float:
    """The angle of the face at the tail of halfedge h (radians)."""
    return math.atan2(mesh.shape[h, 2], mesh.shape[h, 1])


@inner
def angle_round_vertex(h: int, x: float, y: float, mesh: Halfedges) -> float:
    """The angle at the tail of h, from its first halfedge, of direction (x, y) in the frame of h; not rescaled.

    Unwrapped round the middle of the corner: a direction that rounding put just outside stays just outside.
    """
    half = 0.5 * corner_angle(h, mesh)
    u, v = turned_back(x, y, math.cos(half), math.sin(half))
    return mesh.shape[h, 3] + half + math.atan2(v, u)


@inlined
def vertex_scale(v: int, mesh: Halfedges) -> float:
    """Factor from angles round a vertex to angles of its tangent frame."""
    return (PI if mesh.kind[v] == BOUNDARY_VERTEX else 2.0 * PI) / mesh.angle_sum[v]


@inlined
def corner_of(f: int, v: int, mesh: Halfedges) -> int:
    """The halfedge of face f that leaves vertex v."""
    if mesh.tail[3 * f] == v:
        return 3 * f
    return 3 * f + 1 if mesh.tail[3 * f + 1] == v else 3 * f + 2


@inner
def corner_at_angle(v: int, angle: float, mesh: Halfedges) -> tuple[int, float]:
    """The corner (by its halfedge) of v that holds an angle round it, and the angle within that corner."""
    h = first_of(v, mesh)
    while True:
        onward = twin_of(preceding(h), mesh)
        if onward < 0 or onward == mesh.first[v] or angle < mesh.shape[onward, 3]:
            return h, min(max(angle - mesh.shape[h, 3], 0.0), corner_angle(h, mesh))
        h = onward


@inlined
def heading_at(on: int, element: int, h: int, x: float, y: float, mesh: Halfedges) -> tuple[float, float]:
    """Unit forward direction of a path that arrives in the face of h along (x, y) in the frame of h.

    In the tangent frame of the place where it ends. At a vertex the direction backwards is what lies in the face,
    and forwards is opposite to it in the rescaled frame.
    """
    length = norm(x, y)
    x, y = x / length, y / length
    cos, sin = direction_in_face(h, mesh)
    fx, fy = turned(x, y, cos, sin)  # in the frame of the face
    if on == ON_FACE:
        return fx, fy
    if on == ON_EDGE:
        if element // 3 == h // 3:
            cos, sin = direction_in_face(element, mesh)
            return turned_back(fx, fy, cos, sin)
        cos, sin = direction_in_face(twin_of(element, mesh), mesh)
        return turned_back(-fx, -fy, cos, sin)
    corner = corner_of(h // 3, element, mesh)
    cos, sin = direction_in_face(corner, mesh)
    bx, by = turned_back(-fx, -fy, cos, sin)
    angle = angle_round_vertex(corner, bx, by, mesh) * vertex_scale(element, mesh)
    return -math.cos(angle), -math.sin(angle)
