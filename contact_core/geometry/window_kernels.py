"""Kernels of the exact log map: continuous Dijkstra with windows (Mitchell, Mount and Papadimitriou 1987).

A window is a bundle of straight paths from one root that enter a face through an interval [b0, b1] of halfedge h.
The root is a source, or a pseudo-source: a saddle or boundary vertex that paths bend round. The window keeps the
root's position S in the frame of h (S below the edge) and a rotation from that frame to the root's, so that the
straight path to any point p of the face has length |p - S| and leaves the root along (p - S) * rotation.

Windows leave a queue in order of distance (Chen and Han 1990, improved by Xin and Wang 2009). A window whose cone
holds the apex of the face splits in two, but of all windows that enter through h only the one with the shortest
path to the apex, which occupies it, keeps both children (`Windows.occupied`). A window is dropped where a path
through a vertex beside it is shorter. Two windows with the same image (along mirrored paths round a fold) go on as
one: else windows would double at every fold.

Where one place alone is sought the order is that of A* (Hart, Nilsson and Raphael 1968): the least length of a path
through the window that goes on straight through space. No path on the surface is shorter, and the least length
never falls on the way, so a vertex is final when it leaves the queue, as in order of distance; but what leads
elsewhere is never looked at.

Work arrays belong to a mesh and are never cleared: what carries an older epoch counts as empty, so a query touches
no more memory than its region has.
"""

from __future__ import annotations

import math

from contact_core.geometry.jit import constant, inlined, inner, prefetch
from contact_core.geometry.kernel_arrays import Goal, Halfedges, Labels, Path, Queue, Window, Windows
from contact_core.geometry.queue_kernels import FREE, OVERFLOW, USED, WINDOWS, heap_push, stack_push
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_FACE,
    ON_VERTEX,
    PI,
    angle_round_vertex,
    corner_angle,
    direction_in_face,
    direction_of_next,
    norm,
)
from contact_core.geometry.topology_kernels import (
    BLOCKED,
    BOUNDARY,
    BOUNDARY_VERTEX,
    first_of,
    following,
    preceding,
    twin_of,
    wide,
)

# Columns of the float record of a window
B0, B1, SX, SY, SIGMA, COS, SIN, SPLIT_DISTANCE, SPLIT_CROSSING, SLACK = (constant(i) for i in range(10))
# Columns of its integer record. root: source s as -1 - s, or a vertex. wedge: the halfedge in whose frame
# directions at the root are given. side: which child of its parent it is. A free record links to the next one in
# HALFEDGE, and one that has not entered its face yet may have -1 - the halfedge that it leaves through.
HALFEDGE, ROOT, WEDGE, SIDE = constant(0), constant(1), constant(2), constant(3)
ONLY_CHILD, LEFT_CHILD, RIGHT_CHILD = constant(0), constant(1), constant(2)

# A ray meets a vertex or a target that it misses by no more than its window's slack, in radians: GRAZING, or what
# rounding by BLUR of the size of a face did where the interval was nearest to the root. (Rays part at vertices, and
# every mesh with straight lines has other vertices behind them: without slack these would stay dark.)
GRAZING = 1e-11
BLUR = 4e-15
MOST_SLACK = 1e-6
# A path so near to the rim of its window (in slacks) may meet a vertex when it is walked, for a walk meets what it
# misses by SNAP, a thousand times more than the blur of a face. `path_kernels.bend_met` looks whether it does.
TOUCHING = 1e3
INSIDE = constant(0)  # of a path that does not touch the rim of its window
SURELY = 1.0 - 1e-14  # relative margin for "shorter": rounding must not decide
AT_LEAST = 1.0 - 1e-11  # relative margin of a lower bound: of paths of equal length none may be cut off by rounding


@inlined
def distance_at(v: int, labels: Labels) -> float:
    """The distance found so far at vertex v."""
    return labels.reach[v, 1] if labels.reach[v, 0] == labels.epoch else math.inf


@inlined
def vertex_key(v: int, distance: float, goal: Goal) -> float:
    """What vertex v leaves the queue by: its distance, or the least length of a path through it to the goal."""
    if goal.sought == 0:
        return distance
    x, y, z = goal.points[v, 0] - goal.x, goal.points[v, 1] - goal.y, goal.points[v, 2] - goal.z
    return AT_LEAST * (distance + math.sqrt(x * x + y * y + z * z))


@inlined
def window_key(
    b0: float, b1: float, sx: float, sy: float, tail: int, head: int, length: float, goal: Goal
) -> float:
    """The least length of a path from the root at (sx, sy) through the interval [b0, b1] of an edge, straight on
    through space to the goal.

    Points of the edge are as far from the goal as from its image in the plane of the root, beyond the edge: so the
    two legs are shortest where the line between the images crosses the edge.
    """
    points = goal.points
    ax, ay, az = points[tail, 0], points[tail, 1], points[tail, 2]
    ux, uy, uz = (points[head, 0] - ax) / length, (points[head, 1] - ay) / length, (points[head, 2] - az) / length
    gx, gy, gz = goal.x - ax, goal.y - ay, goal.z - az
    cx, cy, cz = uy * gz - uz * gy, uz * gx - ux * gz, ux * gy - uy * gx
    tx, ty = ux * gx + uy * gy + uz * gz, math.sqrt(cx * cx + cy * cy + cz * cz)
    p = sx if ty - sy <= 0.0 else sx - (tx - sx) * sy / (ty - sy)
    p = min(max(p, b0), b1)
    return norm(p - sx, sy) + norm(p - tx, ty)


@inner
def update_vertex(
    v: int, path: Path, bound: float, mesh: Halfedges, labels: Labels, queue: Queue, goal: Goal
) -> None:
    """Label v with a shorter path, and queue it as a pseudo-source if paths can bend there."""
    reach, leg, origin = labels.reach, labels.leg, labels.origin
    if reach[v, 0] == labels.epoch and origin[v, 2] == 1:  # its windows have left: it keeps its path
        return
    reach[v, 0], reach[v, 1] = labels.epoch, path.distance
    leg[v, 0], leg[v, 1] = path.zx, path.zy
    leg[v, 2] = angle_round_vertex(path.halfedge, path.x, path.y, mesh)
    origin[v, 0], origin[v, 1], origin[v, 2], origin[v, 3] = path.root, path.wedge, 0, path.touches
    key = vertex_key(v, path.distance, goal)
    if key <= bound and mesh.bends[v]:
        heap_push(key, -1 - v, queue)


@inlined
def push_window(
    edge: int,
    window: Window,
    bound: float,
    mesh: Halfedges,
    labels: Labels,
    windows: Windows,
    queue: Queue,
    goal: Goal,
) -> None:
    """Queue a window that leaves a face through `edge`, unless it is empty, off the surface, too far, or dominated
    by a path through a vertex next to it (Xin and Wang 2009)."""
    sx, sigma, side = window.sx, window.sigma, window.side
    h = wide(mesh.twin[edge])
    length = mesh.shape[edge, 0]
    b0, b1, sy = max(window.b0, 0.0), min(window.b1, length), min(window.sy, 0.0)
    if not b1 > b0 or h == BOUNDARY:
        return
    to_b0, to_b1 = norm(b0 - sx, sy), norm(b1 - sx, sy)
    left, right = mesh.tail[following(edge)], mesh.tail[edge]  # the other side runs the other way
    if goal.sought == 0:
        key = sigma + (to_b0 if sx <= b0 else (to_b1 if sx >= b1 else -sy))
    else:
        key = AT_LEAST * (sigma + window_key(b0, b1, sx, sy, left, right, length, goal))
    if key > bound:
        return
    d0, d1 = (sigma + to_b0) * SURELY, (sigma + to_b1) * SURELY
    if distance_at(left, labels) + b1 < d1 or distance_at(right, labels) + (length - b0) < d0:
        return
    if side != ONLY_CHILD:
        from_apex = distance_at(mesh.tail[preceding(edge)], labels)
        x, y = length - mesh.shape[edge, 1], mesh.shape[edge, 2]
        if side == LEFT_CHILD:  # the third vertex of the face lies right of the window
            if from_apex + norm(b0 - x, y) < d0:
                return
        elif from_apex + norm(b1 - x, y) < d1:
            return
    w = queue.state[FREE]
    if w >= 0:
        queue.state[FREE] = windows.integers[w, HALFEDGE]
    else:
        w = queue.state[USED]
        if w >= len(windows.integers):
            queue.state[OVERFLOW] = 1
            return
        queue.state[USED] = w + 1
    record = windows.floats[w]
    record[B0], record[B1], record[SX], record[SY], record[SIGMA] = b0, b1, sx, sy, sigma
    record[COS], record[SIN], record[SLACK] = window.cos, window.sin, window.slack
    record[SPLIT_DISTANCE], record[SPLIT_CROSSING] = window.split_distance, window.split_crossing
    # a blocked edge waits in the heap like any other: it is refused only when the search really gets there; and a
    # face that no query has come to yet is written only then
    windows.integers[w, HALFEDGE] = h if h >= 0 else -1 - edge
    windows.integers[w, ROOT], windows.integers[w, WEDGE], windows.integers[w, SIDE] = (
        window.root,
        window.wedge,
        side,
    )
    if h >= 0:  # what the window will find in its face is on its way from memory before the window's turn comes
        base = 3 * (h // 3)
        prefetch(mesh.shape, 4 * base)
        prefetch(mesh.shape, 4 * base + 8)
        prefetch(windows.occupied, 6 * h)
    queue.state[WINDOWS] += 1
    if h == BLOCKED or key > queue.keys[len(queue.keys) - 1]:
        heap_push(key, w, queue)
    else:
        stack_push(w, queue)


@inlined
def propagate(
    w: int, bound: float, mesh: Halfedges, labels: Labels, windows: Windows, queue: Queue, goal: Goal
) -> None:
    """Carry window w across its face: to the apex if its cone holds it, and through the other two edges."""
    record = windows.floats[w]
    b0, b1, sx, sy, sigma = record[B0], record[B1], record[SX], record[SY], record[SIGMA]
    cos, sin = record[COS], record[SIN]
    h, root, wedge = windows.integers[w, HALFEDGE], windows.integers[w, ROOT], windows.integers[w, WEDGE]
    to_left, to_right = preceding(h), following(h)
    length, ax, ay = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
    left_length, right_length = mesh.shape[to_left, 0], mesh.shape[to_right, 0]
    rx, ry = ax - sx, ay - sy  # from the root to the apex
    beyond_left = (b0 - sx) * ry + sy * rx  # positive: the apex lies left of the leftmost ray
    beyond_right = -((b1 - sx) * ry + sy * rx)
    span, blur = abs(rx) + ry, BLUR * (length + left_length + right_length)
    left_ray, right_ray = abs(b0 - sx) - sy, abs(b1 - sx) - sy
    slack, nearest_ray = record[SLACK], min(left_ray, right_ray)
    if blur > slack * nearest_ray:
        slack = min(blur / nearest_ray, MOST_SLACK)
    left, right = beyond_left <= 0.0, beyond_right <= 0.0
    split_distance, split_crossing = -1.0, 0.0
    left_lean, right_lean = span * slack * left_ray, span * slack * right_ray
    if beyond_left <= left_lean and beyond_right <= right_lean:
        apex = mesh.tail[to_left]
        distance = sigma + norm(rx, ry)
        sharp = left and right
        if distance < distance_at(apex, labels) * SURELY:
            cx, cy = -ax / left_length, -ay / left_length
            path = Path(
                distance,
                root,
                wedge,
                rx * cos - ry * sin,
                rx * sin + ry * cos,
                to_left,
                -rx * cx - ry * cy,
                -ry * cx + rx * cy,
                1 if beyond_left >= -TOUCHING * left_lean or beyond_right >= -TOUCHING * right_lean else 0,
            )
            update_vertex(apex, path, bound, mesh, labels, queue, goal)
        if sharp:  # one angle, one split
            crossing = sx - rx * sy / ry if ry > 0.0 else sx
            split_distance, split_crossing = distance, crossing
            seat = windows.occupied[h]
            occupier, crossed = seat[1], seat[2]
            if seat[0] != labels.epoch:
                seat[0], seat[1], seat[2], seat[3], seat[4] = labels.epoch, distance, crossing, b0, b1
                seat[5] = sigma
            elif (
                max(distance, occupier) * SURELY <= min(distance, occupier)
                and abs(crossing - crossed) <= GRAZING * length
                and abs(sigma - seat[5]) <= GRAZING * length
            ):
                # the same image again, along a path of the same length: on each side the wider window goes on
                # (of two on one ray, one seen past the other, each goes on: their rays part behind the apex)
                left, right = b0 < seat[3] - GRAZING * length, b1 > seat[4] + GRAZING * length
                seat[3], seat[4] = min(b0, seat[3]), max(b1, seat[4])
            elif distance < occupier:
                seat[1], seat[2], seat[3], seat[4], seat[5] = distance, crossing, b0, b1, sigma
            elif distance * SURELY > occupier:
                left = crossing < crossed + GRAZING * length
                right = crossing > crossed - GRAZING * length
    if left:
        ux, uy = ax / left_length, ay / left_length
        t0 = 0.0 if b0 == 0.0 else left_length * sy * b0 / (ax * sy + ay * (b0 - sx))
        t1 = left_length if beyond_right <= 0.0 else left_length * sy * b1 / (ax * sy + ay * (b1 - sx))
        window = Window(
            t0,
            t1,
            sx * ux + sy * uy,
            sy * ux - sx * uy,
            sigma,
            cos * ux - sin * uy,
            cos * uy + sin * ux,
            slack,
            split_distance,
            split_crossing,
            root,
            wedge,
            LEFT_CHILD,
        )
        push_window(to_left, window, bound, mesh, labels, windows, queue, goal)
    if right:  # the same, seen in a mirror that puts the head at the origin
        ux, uy = direction_of_next(h, mesh)
        ux, uy = -ux, -uy
        fx, fs = right_length * ux, length - sx
        c0, c1 = length - b0, length - b1
        t0 = 0.0 if beyond_left <= 0.0 else right_length - right_length * sy * c0 / (fx * sy + ay * (c0 - fs))
        t1 = right_length if c1 == 0.0 else right_length - right_length * sy * c1 / (fx * sy + ay * (c1 - fs))
        window = Window(
            t0,
            t1,
            -rx * ux - ry * uy,
            -ry * ux + rx * uy,
            sigma,
            cos * ux - sin * uy,
            cos * uy + sin * ux,
            slack,
            split_distance,
            split_crossing,
            root,
            wedge,
            RIGHT_CHILD,
        )
        push_window(to_right, window, bound, mesh, labels, windows, queue, goal)


@inlined
def is_displaced(w: int, mesh: Halfedges, labels: Labels, windows: Windows) -> bool:
    """Whether, since w was cast, a window nearer to the apex took the side of the face that w came through."""
    split_distance = windows.floats[w, SPLIT_DISTANCE]
    if split_distance < 0.0:
        return False
    edge = wide(mesh.twin[windows.integers[w, HALFEDGE]])
    side = windows.integers[w, SIDE]
    entry = following(edge) if side == LEFT_CHILD else preceding(edge)
    if windows.occupied[entry, 1] >= split_distance * SURELY:
        return False
    gap = windows.floats[w, SPLIT_CROSSING] - windows.occupied[entry, 2]
    return gap > GRAZING if side == LEFT_CHILD else gap < -GRAZING


@inner
def windows_of_pseudo_source(
    v: int, bound: float, mesh: Halfedges, labels: Labels, windows: Windows, queue: Queue, goal: Goal
) -> None:
    """Queue the windows of pseudo-source v: all directions at half a turn or more, on both sides, from direction
    leg[v, 2] back along its path; and label its neighbours."""
    labels.origin[v, 2] = 1
    sigma, back, total = labels.reach[v, 1], labels.leg[v, 2], mesh.angle_sum[v]
    rim = mesh.kind[v] == BOUNDARY_VERTEX
    low, high = 0.0 if rim else back + PI - total, back - PI
    low_too, high_too = back + PI, total if rim else back + total - PI
    h = first_of(v, mesh)
    while True:
        opposite, backward = following(h), preceding(h)
        corner = corner_angle(h, mesh)
        for reversed_edge in (False, True):
            x, y = (mesh.shape[h, 1], mesh.shape[h, 2]) if reversed_edge else (mesh.shape[h, 0], 0.0)
            arrival = backward if reversed_edge else opposite
            neighbour = mesh.tail[arrival]
            distance = sigma + (mesh.shape[backward, 0] if reversed_edge else mesh.shape[h, 0])
            if distance < distance_at(neighbour, labels) * SURELY:
                if reversed_edge:
                    bx, by = 1.0, 0.0
                else:
                    ux, uy = direction_in_face(opposite, mesh)
                    vx, vy = direction_in_face(h, mesh)
                    bx, by = -vx * ux - vy * uy, -vy * ux + vx * uy
                path = Path(distance, v, h, x, y, arrival, bx, by, INSIDE)
                update_vertex(neighbour, path, bound, mesh, labels, queue, goal)
        start = mesh.shape[h, 3]
        for part in range(2):
            a0 = max((low if part == 0 else low_too) - start, 0.0)
            a1 = min((high if part == 0 else high_too) - start, corner)
            if a1 > a0:
                window_from_corner(h, a0, a1, corner, sigma, v, bound, mesh, labels, windows, queue, goal)
        h = twin_of(backward, mesh)
        if h < 0 or h == mesh.first[v]:
            break


@inner
def window_from_corner(
    h: int,
    a0: float,
    a1: float,
    corner: float,
    sigma: float,
    root: int,
    bound: float,
    mesh: Halfedges,
    labels: Labels,
    windows: Windows,
    queue: Queue,
    goal: Goal,
) -> None:
    """Cast a window from the tail of h, between angles a0 < a1 from h, through the opposite edge."""
    opposite = following(h)
    length, ax, ay = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
    size = mesh.shape[opposite, 0]
    ux, uy = direction_of_next(h, mesh)
    ux, uy = -ux, -uy
    b0, b1 = 0.0, size  # from the apex to the head
    if a0 > 0.0:
        sin, cos = math.sin(a0), math.cos(a0)
        b1 = size * (1.0 - length * sin / (cos * ay + sin * size * ux))
    if a1 < corner:
        sin, cos = math.sin(a1), math.cos(a1)
        b0 = size * (1.0 - length * sin / (cos * ay + sin * size * ux))
    window = Window(
        b0, b1, -ax * ux - ay * uy, -ay * ux + ax * uy, sigma, ux, uy, GRAZING, -1.0, 0.0, root, h, ONLY_CHILD
    )
    push_window(opposite, window, bound, mesh, labels, windows, queue, goal)


@inner
def windows_of_source(
    base: int,
    x: float,
    y: float,
    on: int,
    root: int,
    bound: float,
    mesh: Halfedges,
    labels: Labels,
    windows: Windows,
    queue: Queue,
    goal: Goal,
) -> None:
    """Start windows from the source at (x, y) in the frame of halfedge `base` out of its face; label its corners.

    on: what the source lies on; the face, `base`, or the tail of `base`. No window leaves through its own edges.
    """
    h = base
    from_x, from_y = x, y
    corner_x, corner_y = 0.0, 0.0  # the tail of h in the frame of base
    cos, sin = 1.0, 0.0  # from the frame of h to that of base
    for side in range(3):
        if side == 2 and on == ON_VERTEX:  # known better than by way of the far corner
            x, y = mesh.shape[h, 0], 0.0
        distance = norm(x, y)
        v = mesh.tail[h]
        if distance < distance_at(v, labels):
            path = Path(distance, root, base, corner_x - from_x, corner_y - from_y, h, x, y, INSIDE)
            update_vertex(v, path, bound, mesh, labels, queue, goal)
        length = mesh.shape[h, 0]
        if side == 1 or on == ON_FACE or (side == 2 and on == ON_EDGE):
            window = Window(
                0.0, length, length - x, -y, 0.0, -cos, -sin, GRAZING, -1.0, 0.0, root, base, ONLY_CHILD
            )
            push_window(h, window, bound, mesh, labels, windows, queue, goal)
        h_next = following(h)
        ux, uy = direction_of_next(h, mesh)
        x -= length
        x, y = x * ux + y * uy, y * ux - x * uy
        cos, sin = cos * ux - sin * uy, cos * uy + sin * ux
        corner_x, corner_y = (mesh.shape[base, 0], 0.0) if side == 0 else (mesh.shape[base, 1], mesh.shape[base, 2])
        h = h_next
