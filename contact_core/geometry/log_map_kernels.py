"""The query of the log map: windows start at the sources and propagate; targets are updated.

Targets inside faces and on edges wait in a list of one face: every window that enters it tests them, and at the end
the three corners of the face are candidates too. Targets on vertices read the vertex.
"""

from __future__ import annotations

import math

from contact_core.geometry.jit import constant, inlined, inner, kernel
from contact_core.geometry.kernel_arrays import Goal, Halfedges, Labels, Path, Points, Queue, Targets, Windows
from contact_core.geometry.queue_kernels import (
    FREE,
    HEAP_SIZE,
    OVERFLOW,
    POPS,
    STACK_SIZE,
    heap_pop,
    stack_pop,
)
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_FACE,
    ON_NOTHING,
    ON_VERTEX,
    direction_of_next,
    norm,
    place_of,
)
from contact_core.geometry.topology_kernels import (
    BLOCKED,
    BLOCKED_VERTEX,
    first_of,
    following,
    preceding,
    twin_of,
)
from contact_core.geometry.window_kernels import (
    B0,
    B1,
    BLUR,
    COS,
    HALFEDGE,
    INSIDE,
    MOST_SLACK,
    ROOT,
    SIGMA,
    SIN,
    SLACK,
    SURELY,
    SX,
    SY,
    TOUCHING,
    WEDGE,
    distance_at,
    is_displaced,
    propagate,
    vertex_key,
    windows_of_pseudo_source,
    windows_of_source,
)

DONE, MET_BLOCKED_EDGE, MET_BLOCKED_VERTEX, NO_ROOM = constant(0), constant(1), constant(2), constant(3)
# Columns of target_floats (t, 12); X + 2k, Y + 2k: position in the frame of halfedge 3f + k
X, Y, RANK, DISTANCE, ZX, ZY, DX, DY = (constant(i) for i in (0, 1, 6, 7, 8, 9, 10, 11))
# Columns of target_integers (t, 7)
ON, ELEMENT, NEXT, TARGET_ROOT, TARGET_WEDGE, ARRIVAL, TOUCHES = (constant(i) for i in range(7))

# A path that only grazes its window is preferred to another one if it is shorter by more than this: it may in truth
# be the path round the vertex that it grazes.
GRAZING_RANK = 1.0 + 1e-11
CHECK_EVERY = constant(64)  # pops, at least, between two looks at the targets


@inner
def list_targets(ends: Points, mesh: Halfedges, labels: Labels, targets: Targets) -> int:
    """Find the places of targets and enter those inside faces and on edges in the list of a face.

    Returns -1, or a halfedge of a face without three corners that a target lies in.
    """
    for t in range(len(ends.faces)):
        on, element, x, y = place_of(ends, t, mesh)
        targets.integers[t, ON], targets.integers[t, ELEMENT] = on, element
        targets.floats[t, RANK] = math.inf
        if on == ON_NOTHING:
            return element
        if on == ON_VERTEX:
            continue
        h = 3 * element if on == ON_FACE else element
        for _ in range(3):
            k = h % 3
            targets.floats[t, X + 2 * k], targets.floats[t, Y + 2 * k] = x, y
            h_next = following(h)
            ux, uy = direction_of_next(h, mesh)
            x -= mesh.shape[h, 0]
            x, y = x * ux + y * uy, y * ux - x * uy
            h = h_next
        f = h // 3
        targets.integers[t, NEXT] = int(targets.waiting[f, 1]) if targets.waiting[f, 0] == labels.epoch else -1
        targets.waiting[f, 0], targets.waiting[f, 1] = labels.epoch, t
    return -1


@inlined
def update_target(t: int, rank: float, path: Path, targets: Targets) -> None:
    """Give target t a path if it ranks before the one that it has (rank: its distance, or a little more)."""
    row = targets.floats[t]
    if rank > row[RANK] * SURELY:
        return
    row[RANK], row[DISTANCE], row[ZX], row[ZY] = rank, path.distance, path.zx, path.zy
    row[DX], row[DY] = path.x, path.y
    targets.integers[t, TARGET_ROOT], targets.integers[t, TARGET_WEDGE] = path.root, path.wedge
    targets.integers[t, ARRIVAL], targets.integers[t, TOUCHES] = path.halfedge, path.touches


@inlined
def update_targets(w: int, mesh: Halfedges, labels: Labels, windows: Windows, targets: Targets) -> None:
    """Update the targets of the face that window w enters with the straight legs from its root."""
    h = windows.integers[w, HALFEDGE]
    f, k = h // 3, h % 3
    if targets.waiting[f, 0] != labels.epoch:
        return
    record = windows.floats[w]
    sx, sy = record[SX], record[SY]
    left_x, right_x = record[B0] - sx, record[B1] - sx
    left_ray, right_ray = abs(left_x) - sy, abs(right_x) - sy
    blur = BLUR * (mesh.shape[3 * f, 0] + mesh.shape[3 * f + 1, 0] + mesh.shape[3 * f + 2, 0])
    slack = min(max(record[SLACK], blur / min(left_ray, right_ray)), MOST_SLACK)
    t = int(targets.waiting[f, 1])
    while t >= 0:
        rx, ry = targets.floats[t, X + 2 * k] - sx, targets.floats[t, Y + 2 * k] - sy
        miss_left, miss_right = left_x * ry + sy * rx, -(right_x * ry + sy * rx)
        lean = slack * (abs(rx) + abs(ry))
        left_lean, right_lean = lean * left_ray, lean * right_ray
        if miss_left <= left_lean and miss_right <= right_lean:
            rank = 1.0 if miss_left <= 0.0 and miss_right <= 0.0 else GRAZING_RANK
            touches = 1 if miss_left >= -TOUCHING * left_lean or miss_right >= -TOUCHING * right_lean else 0
            distance = record[SIGMA] + norm(rx, ry)
            zx, zy = rx * record[COS] - ry * record[SIN], rx * record[SIN] + ry * record[COS]
            path = Path(distance, windows.integers[w, ROOT], windows.integers[w, WEDGE], zx, zy, h, rx, ry, touches)
            update_target(t, rank * distance, path, targets)
        t = targets.integers[t, NEXT]


@inner
def farthest_target(limit: float, mesh: Halfedges, labels: Labels, targets: Targets) -> float:
    """The largest distance that some target still needs searching: no more than `limit`."""
    bound = 0.0
    for t in range(len(targets.floats)):
        if targets.integers[t, ON] == ON_VERTEX:
            best = distance_at(targets.integers[t, ELEMENT], labels)
        else:
            best = targets.floats[t, DISTANCE] if targets.floats[t, RANK] < math.inf else math.inf
            h = 3 * host_face(t, targets)
            for k in range(3):
                d = distance_at(mesh.tail[h + k], labels)
                best = min(best, d + norm(targets.floats[t, X + 2 * k], targets.floats[t, Y + 2 * k]))
        bound = max(bound, best)
        if bound >= limit:
            return limit
    return bound


@inner
def host_face(t: int, targets: Targets) -> int:
    """The face in whose list target t waits."""
    element = targets.integers[t, ELEMENT]
    return element if targets.integers[t, ON] == ON_FACE else element // 3


@inner
def update_targets_beside(base: int, x: float, y: float, root: int, labels: Labels, targets: Targets) -> None:
    """Update the targets of the face of `base` with the straight legs from the source at (x, y) in its frame."""
    f, k = base // 3, base % 3
    t = int(targets.waiting[f, 1]) if targets.waiting[f, 0] == labels.epoch else -1
    while t >= 0:
        rx, ry = targets.floats[t, X + 2 * k] - x, targets.floats[t, Y + 2 * k] - y
        distance = norm(rx, ry)
        path = Path(distance, root, base, rx, ry, base, rx, ry, INSIDE)
        update_target(t, distance, path, targets)
        t = targets.integers[t, NEXT]


@inner
def seed(
    s: int,
    sources: Points,
    bound: float,
    mesh: Halfedges,
    labels: Labels,
    windows: Windows,
    queue: Queue,
    targets: Targets,
    goal: Goal,
) -> tuple[int, int]:
    """Start windows into all faces at source s; returns (status, blocked element)."""
    on, element, x, y = place_of(sources, s, mesh)
    if on == ON_NOTHING:
        return MET_BLOCKED_EDGE, element
    if on == ON_VERTEX and mesh.kind[element] >= BLOCKED_VERTEX:
        return MET_BLOCKED_VERTEX, element
    if on == ON_EDGE and twin_of(element, mesh) == BLOCKED:
        return MET_BLOCKED_EDGE, element
    base = element
    if on == ON_FACE:
        base = 3 * element
    elif on == ON_VERTEX:
        base = first_of(element, mesh)
    start = base
    while True:
        windows_of_source(base, x, y, on, -1 - s, bound, mesh, labels, windows, queue, goal)
        update_targets_beside(base, x, y, -1 - s, labels, targets)
        if on == ON_FACE:
            break
        if on == ON_EDGE:
            x = mesh.shape[base, 0] - x
            base = twin_of(base, mesh)
        else:
            base = twin_of(preceding(base), mesh)
        if base < 0 or base == start:
            break
    if on == ON_VERTEX:
        labels.origin[element, 2] = 1  # nothing is nearer
    return DONE, 0


@kernel
def search(
    sources: Points,
    ends: Points,
    limit: float,
    mesh: Halfedges,
    labels: Labels,
    windows: Windows,
    queue: Queue,
    targets: Targets,
    goal: Goal,
) -> tuple[int, int]:
    """Spread from the sources until every target within `limit` is final; returns (status, blocked element)."""
    sources = Points(*sources)
    ends = Points(*ends)
    mesh = Halfedges(*mesh)
    labels = Labels(*labels)
    windows = Windows(*windows)
    queue = Queue(*queue)
    targets = Targets(*targets)
    goal = Goal(*goal)
    queue.state[:] = 0
    queue.state[FREE] = -1
    queue.keys[len(queue.keys) - 1] = -1.0
    element = list_targets(ends, mesh, labels, targets)
    if element >= 0:
        return MET_BLOCKED_EDGE, element
    for s in range(len(sources.faces)):
        status, element = seed(s, sources, limit, mesh, labels, windows, queue, targets, goal)
        if status != DONE:
            return status, element
    patience = max(CHECK_EVERY, len(targets.floats))
    bound = farthest_target(limit, mesh, labels, targets)
    next_check = patience
    while queue.state[STACK_SIZE] > 0 or (queue.state[HEAP_SIZE] > 0 and queue.keys[0] <= bound):
        if queue.state[OVERFLOW] > 0:
            return NO_ROOM, 0
        key, from_heap = queue.keys[0], queue.state[STACK_SIZE] == 0
        item = heap_pop(queue) if from_heap else stack_pop(queue)
        queue.state[POPS] += 1
        if item < 0:
            v = -1 - item
            if labels.origin[v, 2] == 1 or vertex_key(v, labels.reach[v, 1], goal) < key:
                continue
            if mesh.kind[v] == BLOCKED_VERTEX:
                return MET_BLOCKED_VERTEX, v
            windows_of_pseudo_source(v, bound, mesh, labels, windows, queue, goal)
        else:
            if windows.integers[item, HALFEDGE] < 0:
                edge = -1 - windows.integers[item, HALFEDGE]
                windows.integers[item, HALFEDGE] = twin_of(edge, mesh)
                if windows.integers[item, HALFEDGE] == BLOCKED:
                    return MET_BLOCKED_EDGE, edge
            if from_heap and goal.sought == 0:
                base = 3 * (windows.integers[item, HALFEDGE] // 3)
                queue.keys[len(queue.keys) - 1] = key + min(
                    mesh.shape[base, 0], mesh.shape[base + 1, 0], mesh.shape[base + 2, 0]
                )
            if not is_displaced(item, mesh, labels, windows):
                update_targets(item, mesh, labels, windows, targets)
                propagate(item, bound, mesh, labels, windows, queue, goal)
            windows.integers[item, HALFEDGE] = queue.state[FREE]
            queue.state[FREE] = item
        if queue.state[POPS] >= next_check:
            next_check += patience
            bound = farthest_target(bound, mesh, labels, targets)
    return (NO_ROOM if queue.state[OVERFLOW] > 0 else DONE), 0
