"""Kernels of the exponential map: straight walks over the faces (Polthier and Schmies 2006).

A walk lives in the frame of one halfedge at a time. The frame's apex lies left or right of the ray: one cross
product chooses the edge that the ray leaves through. A ray that meets a vertex leaves it with equal angles on both
sides.
"""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined, kernel, prefetch
from contact_core.geometry.kernel_arrays import Halfedges, Points
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_FACE,
    ON_NOTHING,
    ON_VERTEX,
    PI,
    SNAP,
    angle_round_vertex,
    corner_at_angle,
    direction_of_next,
    heading_at,
    place,
    place_of,
    turned,
    turned_back,
    vertex_scale,
)
from contact_core.geometry.topology_kernels import (
    BLOCKED,
    BLOCKED_VERTEX,
    BOUNDARY,
    BOUNDARY_VERTEX,
    following,
    preceding,
    twin_of,
    wide,
)

DONE = constant(0)
MET_BLOCKED_EDGE = constant(1)
MET_BLOCKED_VERTEX = constant(2)
TOO_LONG = constant(3)  # more than MOST_CROSSINGS: a length that no one meant
NO_ROOM = constant(4)  # the polyline buffer is full
MET_BEND = constant(5)  # a walk that was to stop there met a vertex that bends paths
MOST_CROSSINGS = constant(5_000_000)
CURVE_CELLS = 63.99  # cells along an axis of the curve of `keys_along_curve`, the last of which holds the rim
MEETING = 4.0 * SNAP  # the wider sense in which a walk meets vertices that it is to stop at
GRAZE = 1e-10  # radians by which a direction may point out of a boundary and still run along it
# Legs of a chain join at vertices. A leg that ends this near to one, as a part of an edge, ends there: vertices on
# its path that are not quite flat (EXCESS) may have turned it a little.
JOINT = 1e-9


@inlined
def start_on_edge(h: int, x: float, dx: float, dy: float, mesh: Halfedges) -> tuple[int, float, float, float]:
    """Where a walk from an edge point begins: (halfedge of the face it enters or a negative twin, x, dx, dy)."""
    if dy >= 0.0:
        return h, x, dx, dy
    other = twin_of(h, mesh)
    if other == BOUNDARY and dy > -GRAZE:
        return h, x, dx, 0.0
    return other, mesh.shape[h, 0] - x, -dx, -dy


@inlined
def start_in_face(
    f: int, x: float, y: float, dx: float, dy: float, mesh: Halfedges
) -> tuple[int, float, float, float, float]:
    """A walk from inside face f, moved to the frame of a halfedge that it does not leave through."""
    h = 3 * f
    length = mesh.shape[h, 0]
    tail_side = dx * (0.0 - y) - dy * (0.0 - x)  # positive: the corner lies left of the ray
    head_side = dx * (0.0 - y) - dy * (length - x)
    if not (tail_side < 0.0 <= head_side):
        return h, x, y, dx, dy
    ux, uy = direction_of_next(h, mesh)
    x, y = turned_back(x - length, y, ux, uy)
    dx, dy = turned_back(dx, dy, ux, uy)
    return h + 1, x, y, dx, dy


@inlined
def onward_angle(v: int, back: float, mesh: Halfedges) -> float:
    """The angle at which a straight walk leaves vertex v that it reached from angle `back`; negative: nowhere.

    On a boundary straight on means half a turn of the rescaled frame: only a walk along the rim goes on.
    """
    total = mesh.angle_sum[v]
    if mesh.kind[v] == BOUNDARY_VERTEX:
        if back < GRAZE:
            return total
        return 0.0 if back > total - GRAZE else -1.0
    angle = back + 0.5 * total
    return angle - total if angle >= total else angle


@inlined
def record(h: int, fraction_head: float, fraction_apex: float, points: Points, i: int) -> None:
    """Write a point of the face of h, given by its weights at the head and the apex of h, as row i."""
    k = h % 3
    points.faces[i] = h // 3
    points.barycentric[i, k] = max(1.0 - fraction_head - fraction_apex, 0.0)
    points.barycentric[i, (k + 1) % 3] = fraction_head
    points.barycentric[i, (k + 2) % 3] = fraction_apex


@inlined
def append(points: Points, i: int, line: Points, end: int) -> int:
    """Append row i of points to a buffer that may be full; returns the new end, beyond the buffer if it was."""
    if end < len(line.faces):
        line.faces[end] = points.faces[i]
        for k in range(3):
            line.barycentric[end, k] = points.barycentric[i, k]
    return end + 1


@inlined
def prefetch_beyond(edge: int, mesh: Halfedges) -> None:
    """Have the record read that a walk needs if it goes on across an edge.

    It knows which edge only once it has this face's own record: without this it waits for memory twice a face.
    """
    other = wide(mesh.twin[edge])
    if other >= 0:
        prefetch(mesh.shape, 4 * other)
        prefetch(mesh.twin, other)


@inlined
def walk(
    on: int,
    element: int,
    x: float,
    y: float,
    dx: float,
    dy: float,
    remaining: float,
    to_joint: bool,
    to_bend: bool,
    line_end: int,
    mesh: Halfedges,
    line: Points,
) -> tuple[int, int, float, float, float, float, float, int]:
    """Walk straight from a place along the unit vector (dx, dy) for the length `remaining`, not 0.

    Crossings are appended to the line buffers from row line_end on, if these have rows. Returns (status; the
    halfedge in whose frame the walk ends, or the blocked element, or -1 if it could not leave its start; x, y;
    direction x, y; remaining length; line_end).
    to_joint: another leg follows, so the walk ends at a vertex that it meets with hardly anything (JOINT) to go.
    to_bend: stop at the first vertex that bends paths, met in a wider sense, so that no walk the other way meets
    one more. Returns MET_BEND, the corner there, how far to the left the vertex lay, 0, and the direction back in
    the frame of the corner.
    """
    h, vertex, angle, miss = -1, -1, 0.0, 0.0
    if on == ON_FACE:
        h, x, y, dx, dy = start_in_face(element, x, y, dx, dy, mesh)
    elif on == ON_EDGE:
        h, x, dx, dy = start_on_edge(element, x, dx, dy, mesh)
        if h == BLOCKED:
            return MET_BLOCKED_EDGE, element, x, y, dx, dy, remaining, line_end
        if h == BOUNDARY:
            return DONE, -1, x, y, dx, dy, remaining, line_end
    else:
        vertex = element
        angle = math.atan2(dy, dx)
        if angle < -GRAZE or (angle < 0.0 and mesh.kind[vertex] != BOUNDARY_VERTEX):
            angle += 2.0 * PI
        if mesh.kind[vertex] == BOUNDARY_VERTEX and angle > PI + GRAZE:
            return DONE, -1, x, y, dx, dy, remaining, line_end
        angle /= vertex_scale(vertex, mesh)

    for _ in range(MOST_CROSSINGS):
        from_vertex = vertex >= 0
        if from_vertex:
            if mesh.kind[vertex] == BLOCKED_VERTEX:
                return MET_BLOCKED_VERTEX, vertex, x, y, dx, dy, remaining, line_end
            h, angle = corner_at_angle(vertex, angle, mesh)
            x, y, dx, dy = 0.0, 0.0, math.cos(angle), math.sin(angle)
            vertex = -1
        prefetch_beyond(preceding(h), mesh)
        prefetch_beyond(following(h), mesh)
        length, ax, ay = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
        side = dx * (ay - y) - dy * (ax - x)
        right = from_vertex or side > 0.0 or (side == 0.0 and ay == 0.0 and dx > 0.0)  # along a flat face: ahead
        if right:  # through the edge from the head to the apex
            edge, ox = following(h), length
            size = mesh.shape[edge, 0]
            ux, uy = direction_of_next(h, mesh)
        else:  # through the edge from the mesh.tail to the apex
            edge, ox = preceding(h), 0.0
            size = mesh.shape[edge, 0]
            ux, uy = ax / size, ay / size
        near = MEETING * size if to_bend else SNAP * size
        across = dx * uy - dy * ux
        if abs(across) < 1e-300:  # along a face without area
            step, along = max((length - x) if dx > 0.0 else x, 0.0), 0.0
        else:
            inverse = 1.0 / across
            step = max(((ox - x) * uy + y * ux) * inverse, 0.0)
            along = ((ox - x) * dy + y * dx) * inverse  # from the tail or head to the apex; rounding: to a vertex
        at_vertex, arrival = along <= near or size - along <= near, near
        if at_vertex:  # the step to the vertex, not to where the ray leaves beside it
            along = 0.0 if along <= near else size
            vx, vy = ox + along * ux - x, along * uy - y
            step, miss = max(vx * dx + vy * dy, 0.0), vy * dx - vx * dy
            if to_joint:
                arrival = JOINT * size
        if remaining <= step + arrival:
            step = min(step, remaining)
            return DONE, h, x + step * dx, y + step * dy, dx, dy, 0.0, line_end
        remaining -= step
        if len(line.faces) > 0:
            if line_end >= len(line.faces):
                return NO_ROOM, h, x, y, dx, dy, remaining, line_end
            t = along / size
            record(h, 1.0 - t if right else 0.0, t, line, line_end)
            line_end += 1
        x, y = ox + along * ux, along * uy
        if at_vertex:
            if along == size:
                corner = preceding(h)
                bx, by = turned_back(dx, dy, ax / mesh.shape[corner, 0], ay / mesh.shape[corner, 0])
            elif right:
                corner = edge
                bx, by = turned_back(-dx, -dy, ux, uy)
            else:
                corner = h
                bx, by = -dx, -dy
            vertex = mesh.tail[corner]
            if to_bend and mesh.bends[vertex]:
                return MET_BEND, corner, miss, 0.0, bx, by, remaining, line_end
            if mesh.kind[vertex] == BLOCKED_VERTEX:
                return MET_BLOCKED_VERTEX, vertex, x, y, dx, dy, remaining, line_end
            angle = onward_angle(vertex, angle_round_vertex(corner, bx, by, mesh), mesh)
            if angle < 0.0:
                return DONE, h, x, y, dx, dy, remaining, line_end
            continue
        other = wide(mesh.twin[edge])
        if other < BLOCKED:
            other = twin_of(edge, mesh)
        if other < 0:
            status = DONE if other == BOUNDARY else MET_BLOCKED_EDGE
            if to_joint and remaining <= JOINT * size:
                remaining = 0.0
            return status, h if other == BOUNDARY else edge, x, y, dx, dy, remaining, line_end
        if right:  # the other side runs from the apex to the head
            x, ux, uy = size - along, -ux, -uy
        else:
            x = along
        dx, dy = turned_back(dx, dy, ux, uy)
        h, y = other, 0.0
    return TOO_LONG, h, x, y, dx, dy, remaining, line_end


@inlined
def corner_near(h: int, x: float, y: float, part: float, mesh: Halfedges) -> int:
    """The corner, by its halfedge, that (x, y) in the frame of h lies within a part of an edge of; -1 if none."""
    length, near = mesh.shape[h, 0], part * max(mesh.shape[h, 0], mesh.shape[following(h), 0])
    if y <= near:
        if abs(x) <= near:
            return h
        if abs(x - length) <= near:
            return following(h)
    return preceding(h) if abs(x - mesh.shape[h, 1]) <= near and abs(y - mesh.shape[h, 2]) <= near else -1


@inlined
def moved_into_face(h: int, x: float, y: float, mesh: Halfedges) -> tuple[float, float]:
    """(x, y) in the frame of h, or the nearest point of the edge that rounding put it beyond. (To clip barycentric
    coordinates instead would move it a million times as far, near the corner of a sliver.)"""
    length, ax, ay = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
    if ax * y > ay * x:
        left_length = mesh.shape[preceding(h), 0]
        ux, uy = ax / left_length, ay / left_length
        t = min(max(x * ux + y * uy, 0.0), left_length)
        x, y = t * ux, t * uy
    rx, ry = (
        -mesh.shape[following(h), 1],
        mesh.shape[following(h), 2],
    )  # along the edge on the right, times the length
    if rx * y < ry * (x - length):
        ux, uy = rx / length, ry / length
        t = min(max((x - length) * ux + y * uy, 0.0), mesh.shape[following(h), 0])
        x, y = length + t * ux, t * uy
    return x, max(y, 0.0)


@inlined
def settle(
    h: int, x: float, y: float, is_joint: bool, points: Points, i: int, mesh: Halfedges
) -> tuple[int, int, float, float]:
    """Write (x, y) in the frame of h as surface point i and return its place; what lies on an edge or a vertex is
    written with exact zeros, so that whoever reads the point finds the same place."""
    length, ax, ay = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
    f, corner = h // 3, corner_near(h, x, y, JOINT if is_joint else SNAP, mesh)
    if corner >= 0:
        on, element, px, py = ON_VERTEX, mesh.tail[corner], 0.0, 0.0
        points.faces[i] = f
    else:
        x, y = moved_into_face(h, x, y, mesh)
        apex = min(max(y / ay, 0.0), 1.0) if ay > 0.0 else 0.0
        head = min(max((x - apex * ax) / length, 0.0), 1.0 - apex)
        record(h, head, apex, points, i)
        on, element, px, py = place(
            f, points.barycentric[i, 0], points.barycentric[i, 1], points.barycentric[i, 2], mesh
        )
    if on == ON_VERTEX:
        for k in range(3):
            points.barycentric[i, k] = 1.0 if mesh.tail[3 * f + k] == element else 0.0
    elif on == ON_EDGE:
        edge = element if element // 3 == f else twin_of(element, mesh)
        k = edge % 3
        t = px / mesh.shape[edge, 0]
        if edge != element:
            t = 1.0 - t
        points.barycentric[i, k], points.barycentric[i, (k + 1) % 3], points.barycentric[i, (k + 2) % 3] = (
            1.0 - t,
            t,
            0.0,
        )
    return on, element, px, py


@inlined
def spread(cell: int) -> int:
    """The six bits of a number, two zeros between each and the next."""
    cell = (cell | cell << 8) & 0x300F
    cell = (cell | cell << 4) & 0x30C3
    return (cell | cell << 2) & 0x9249


@kernel
def keys_along_curve(points: FloatArray, faces: IntArray, chosen: IntArray, keys: IntArray) -> None:
    """Write the place of each chosen face (k,) along a Z-order curve through their bounding cube as keys (k,).

    A face is where its first corner is. Morton 1966: neighbours along the curve are neighbours in space.
    """
    first = points[faces[chosen[0], 0]]
    low_x, low_y, low_z, size = first[0], first[1], first[2], 0.0
    for f in chosen:
        v = faces[f, 0]
        low_x, low_y, low_z = min(low_x, points[v, 0]), min(low_y, points[v, 1]), min(low_z, points[v, 2])
    for f in chosen:
        v = faces[f, 0]
        size = max(size, points[v, 0] - low_x, points[v, 1] - low_y, points[v, 2] - low_z)
    scale = CURVE_CELLS / size if size > 0.0 else 0.0
    for i in range(len(chosen)):
        v = faces[chosen[i], 0]
        x = spread(int((points[v, 0] - low_x) * scale))
        y = spread(int((points[v, 1] - low_y) * scale))
        z = spread(int((points[v, 2] - low_z) * scale))
        keys[i] = x | y << 1 | z << 2


@kernel
def trace(
    starts: Points,
    first_legs: FloatArray,
    offsets: IntArray,
    turning_angles: FloatArray,
    lengths: FloatArray,
    ends: Points,
    headings: FloatArray,
    remaining: FloatArray,
    line_ends: IntArray,
    order: IntArray,
    mesh: Halfedges,
    line: Points,
) -> tuple[int, int, int]:
    """Trace k chains of straight legs; returns (status, chain, blocked element).

    first_legs (k, 2) tangent vectors at the starts; then, per row of offsets (k + 1,), legs that turn from straight
    on by turning_angles and run for lengths. Writes ends (k), headings (k, 2) and
    remaining (k,); if the line buffers have rows the crossings, start and end included, with line_ends (k, 2):
    first row, row after the last. order (k,): who walks when.
    """
    starts = Points(*starts)
    ends = Points(*ends)
    mesh = Halfedges(*mesh)
    line = Points(*line)
    lines = len(line.faces) > 0
    cursor = 0
    for i in order:
        on, element, x, y = place_of(starts, i, mesh)
        if on == ON_NOTHING:
            return MET_BLOCKED_EDGE, i, element
        append(starts, i, ends, i)
        zx, zy = first_legs[i, 0], first_legs[i, 1]
        rest = math.hypot(zx, zy)
        hx, hy = (1.0, 0.0) if rest < 1e-290 else (zx / rest, zy / rest)
        if lines:
            line_ends[i, 0] = cursor
            cursor = append(ends, i, line, cursor)
        leg = offsets[i]
        while True:
            if rest >= 1e-290:
                status, h, x, y, dx, dy, rest, cursor = walk(
                    on, element, x, y, hx, hy, rest, leg < offsets[i + 1], False, cursor, mesh, line
                )
                if status != DONE:
                    return status, i, h
                if h >= 0:
                    on, element, x, y = settle(h, x, y, leg < offsets[i + 1], ends, i, mesh)
                    hx, hy = heading_at(on, element, h, dx, dy, mesh)
            if rest > 0.0 or leg == offsets[i + 1]:
                break
            hx, hy = turned(hx, hy, math.cos(turning_angles[leg]), math.sin(turning_angles[leg]))
            rest = lengths[leg]
            leg += 1
            if lines:  # where it bends
                cursor = append(ends, i, line, cursor)
        headings[i, 0], headings[i, 1] = hx, hy
        for j in range(leg, offsets[i + 1]):
            rest += lengths[j]
        remaining[i] = rest
        if lines:
            cursor = append(ends, i, line, cursor)
            line_ends[i, 1] = cursor
            if cursor > len(line.faces):
                return NO_ROOM, i, 0
    return DONE, cursor, 0
