"""The query of the log map: sources light their faces, windows spread, targets listen.

Targets inside faces and on edges wait in a list of one face: every window that enters it tests them, and at the end
the three corners of the face are candidates too. Targets on vertices read the vertex.
"""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined, kernel
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
    place,
)
from contact_core.geometry.topology_kernels import (
    BLOCKED,
    BLOCKED_VERTEX,
    following,
    preceding,
)
from contact_core.geometry.window_kernels import (
    B0,
    B1,
    BLUR,
    COS,
    HALFEDGE,
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
    emit_shadow,
    emit_source,
    lost_its_claim,
    propagate,
)

DONE, MET_BLOCKED_EDGE, MET_BLOCKED_VERTEX, NO_ROOM = constant(0), constant(1), constant(2), constant(3)
# Columns of target_floats (t, 12); X + 2k, Y + 2k: position in the frame of halfedge 3f + k
X, Y, RANK, DISTANCE, ZX, ZY, DX, DY = (
    constant(0), constant(1), constant(6), constant(7), constant(8), constant(9), constant(10), constant(11),
)  # fmt: skip
# Columns of target_integers (t, 7)
ON, ELEMENT, NEXT, TARGET_ROOT, TARGET_WEDGE, ARRIVAL, TOUCHES = (
    constant(0), constant(1), constant(2), constant(3), constant(4), constant(5), constant(6),
)  # fmt: skip

# A way that only grazes its window is preferred to another one if it is shorter by more than this: it may in truth
# be the way round the vertex that it grazes.
GRAZING_RANK = 1.0 + 1e-11
CHECK_EVERY = constant(64)  # pops, at least, between two looks at the targets


@kernel
def list_targets(
    faces: IntArray, barycentric: FloatArray, epoch: float, tail: IntArray, twin: IntArray, shape: FloatArray,
    listed: FloatArray, target_floats: FloatArray, target_integers: IntArray,
) -> int:  # fmt: skip
    """Find the places of targets and hang those inside faces and on edges into the list of a face.

    Returns -1, or a halfedge of a face without three corners that a target lies in.
    """
    for t in range(len(faces)):
        b0, b1, b2 = barycentric[t, 0], barycentric[t, 1], barycentric[t, 2]
        on, element, x, y = place(faces[t], b0, b1, b2, tail, twin, shape)
        target_integers[t, ON], target_integers[t, ELEMENT] = on, element
        target_floats[t, RANK] = math.inf
        if on == ON_NOTHING:
            return element
        if on == ON_VERTEX:
            continue
        h = 3 * element if on == ON_FACE else element
        for _ in range(3):
            k = h % 3
            target_floats[t, X + 2 * k], target_floats[t, Y + 2 * k] = x, y
            h_next = following(h)
            ux, uy = direction_of_next(h, shape)
            x -= shape[h, 0]
            x, y = x * ux + y * uy, y * ux - x * uy
            h = h_next
        f = h // 3
        target_integers[t, NEXT] = int(listed[f, 1]) if listed[f, 0] == epoch else -1
        listed[f, 0], listed[f, 1] = epoch, t
    return -1


@inlined
def offer(
    t: int, rank: float, distance: float, root: int, wedge: int, zx: float, zy: float, h: int, dx: float, dy: float,
    touches: bool, target_floats: FloatArray, target_integers: IntArray,
) -> None:  # fmt: skip
    """Give target t a way if it is shorter than the one it has; direction (dx, dy) in the frame of h.

    touches: whether it touches the rim of its window.
    """
    row = target_floats[t]
    if rank > row[RANK] * SURELY:
        return
    row[RANK], row[DISTANCE], row[ZX], row[ZY], row[DX], row[DY] = rank, distance, zx, zy, dx, dy
    target_integers[t, TARGET_ROOT], target_integers[t, TARGET_WEDGE] = root, wedge
    target_integers[t, ARRIVAL], target_integers[t, TOUCHES] = h, 1 if touches else 0


@inlined
def light_targets(
    w: int, epoch: float, shape: FloatArray, listed: FloatArray, floats: FloatArray, integers: IntArray,
    target_floats: FloatArray, target_integers: IntArray,
) -> None:  # fmt: skip
    """Offer the targets of the face that window w enters their straight ways to its root."""
    h = integers[w, HALFEDGE]
    f, k = h // 3, h % 3
    if listed[f, 0] != epoch:
        return
    record = floats[w]
    sx, sy = record[SX], record[SY]
    left_x, right_x = record[B0] - sx, record[B1] - sx
    left_ray, right_ray = abs(left_x) - sy, abs(right_x) - sy
    blur = BLUR * (shape[3 * f, 0] + shape[3 * f + 1, 0] + shape[3 * f + 2, 0])
    slack = min(max(record[SLACK], blur / min(left_ray, right_ray)), MOST_SLACK)
    t = int(listed[f, 1])
    while t >= 0:
        rx, ry = target_floats[t, X + 2 * k] - sx, target_floats[t, Y + 2 * k] - sy
        miss_left, miss_right = left_x * ry + sy * rx, -(right_x * ry + sy * rx)
        lean = slack * (abs(rx) + abs(ry))
        left_lean, right_lean = lean * left_ray, lean * right_ray
        if miss_left <= left_lean and miss_right <= right_lean:
            rank = 1.0 if miss_left <= 0.0 and miss_right <= 0.0 else GRAZING_RANK
            touches = miss_left >= -TOUCHING * left_lean or miss_right >= -TOUCHING * right_lean
            distance = record[SIGMA] + norm(rx, ry)
            zx, zy = rx * record[COS] - ry * record[SIN], rx * record[SIN] + ry * record[COS]
            offer(
                t, rank * distance, distance, integers[w, ROOT], integers[w, WEDGE], zx, zy, h, rx, ry,
                touches, target_floats, target_integers,
            )  # fmt: skip
        t = target_integers[t, NEXT]


@kernel
def farthest_target(
    limit: float, epoch: float, tail: IntArray, reach: FloatArray,
    target_floats: FloatArray, target_integers: IntArray,
) -> float:  # fmt: skip
    """The largest distance that some target still needs searching: no more than `limit`."""
    bound = 0.0
    for t in range(len(target_floats)):
        if target_integers[t, ON] == ON_VERTEX:
            best = distance_at(target_integers[t, ELEMENT], epoch, reach)
        else:
            best = target_floats[t, DISTANCE] if target_floats[t, RANK] < math.inf else math.inf
            h = 3 * host_face(t, target_integers)
            for k in range(3):
                d = distance_at(tail[h + k], epoch, reach)
                best = min(best, d + norm(target_floats[t, X + 2 * k], target_floats[t, Y + 2 * k]))
        bound = max(bound, best)
        if bound >= limit:
            return limit
    return bound


@kernel
def host_face(t: int, target_integers: IntArray) -> int:
    """The face in whose list target t waits."""
    element = target_integers[t, ELEMENT]
    return element if target_integers[t, ON] == ON_FACE else element // 3


@kernel
def light_own_face(
    base: int, x: float, y: float, root: int, epoch: float, listed: FloatArray,
    target_floats: FloatArray, target_integers: IntArray,
) -> None:  # fmt: skip
    """Offer the targets of the face of `base` the straight way from the source at (x, y) in its frame."""
    f, k = base // 3, base % 3
    t = int(listed[f, 1]) if listed[f, 0] == epoch else -1
    while t >= 0:
        rx, ry = target_floats[t, X + 2 * k] - x, target_floats[t, Y + 2 * k] - y
        distance = norm(rx, ry)
        offer(t, distance, distance, root, base, rx, ry, base, rx, ry, False, target_floats, target_integers)
        t = target_integers[t, NEXT]


@kernel
def light_source(
    s: int, f: int, b0: float, b1: float, b2: float, bound: float, epoch: float,
    tail: IntArray, twin: IntArray, shape: FloatArray, first: IntArray, angle_sum: FloatArray, kind: IntArray,
    reach: FloatArray, leg: FloatArray, origin: IntArray, listed: FloatArray,
    floats: FloatArray, integers: IntArray, keys: FloatArray, items: IntArray, state: IntArray,
    target_floats: FloatArray, target_integers: IntArray,
) -> tuple[int, int]:  # fmt: skip
    """Light all faces at source s; returns (status, blocked element)."""
    on, element, x, y = place(f, b0, b1, b2, tail, twin, shape)
    if on == ON_NOTHING:
        return MET_BLOCKED_EDGE, element
    if on == ON_VERTEX and kind[element] >= BLOCKED_VERTEX:
        return MET_BLOCKED_VERTEX, element
    if on == ON_EDGE and twin[element] == BLOCKED:
        return MET_BLOCKED_EDGE, element
    base = element
    if on == ON_FACE:
        base = 3 * element
    elif on == ON_VERTEX:
        base = first[element]
    start = base
    while True:
        emit_source(
            base, x, y, on, -1 - s, bound, epoch, tail, twin, shape, angle_sum, kind, reach, leg, origin,
            floats, integers, keys, items, state,
        )  # fmt: skip
        light_own_face(base, x, y, -1 - s, epoch, listed, target_floats, target_integers)
        if on == ON_FACE:
            break
        if on == ON_EDGE:
            x = shape[base, 0] - x
            base = twin[base]
        else:
            base = twin[preceding(base)]
        if base < 0 or base == start:
            break
    if on == ON_VERTEX:
        origin[element, 2] = 1  # nothing is nearer
    return DONE, 0


@kernel
def search(
    source_faces: IntArray, source_barycentric: FloatArray, target_faces: IntArray, target_barycentric: FloatArray,
    limit: float, epoch: float,
    tail: IntArray, twin: IntArray, shape: FloatArray, first: IntArray, angle_sum: FloatArray, kind: IntArray,
    reach: FloatArray, leg: FloatArray, origin: IntArray, claim: FloatArray, listed: FloatArray,
    floats: FloatArray, integers: IntArray, keys: FloatArray, items: IntArray, state: IntArray,
    target_floats: FloatArray, target_integers: IntArray,
) -> tuple[int, int]:  # fmt: skip
    """Spread from the sources until every target within `limit` is final; returns (status, blocked element)."""
    state[:] = 0
    state[FREE] = -1
    keys[len(keys) - 1] = -1.0
    element = list_targets(
        target_faces, target_barycentric, epoch, tail, twin, shape, listed, target_floats, target_integers
    )
    if element >= 0:
        return MET_BLOCKED_EDGE, element
    for s in range(len(source_faces)):
        b0, b1, b2 = source_barycentric[s, 0], source_barycentric[s, 1], source_barycentric[s, 2]
        status, element = light_source(
            s, source_faces[s], b0, b1, b2, limit, epoch, tail, twin, shape, first, angle_sum, kind,
            reach, leg, origin, listed, floats, integers, keys, items, state, target_floats, target_integers,
        )  # fmt: skip
        if status != DONE:
            return status, element
    patience = max(CHECK_EVERY, len(target_floats))
    bound = farthest_target(limit, epoch, tail, reach, target_floats, target_integers)
    next_check = patience
    while state[STACK_SIZE] > 0 or (state[HEAP_SIZE] > 0 and keys[0] <= bound):
        if state[OVERFLOW] > 0:
            return NO_ROOM, 0
        key, from_heap = keys[0], state[STACK_SIZE] == 0
        item = heap_pop(keys, items, state) if from_heap else stack_pop(items, state)
        state[POPS] += 1
        if item < 0:
            v = -1 - item
            if origin[v, 2] == 1 or reach[v, 1] < key:
                continue
            if kind[v] == BLOCKED_VERTEX:
                return MET_BLOCKED_VERTEX, v
            emit_shadow(
                v, bound, epoch, tail, twin, shape, first, angle_sum, kind, reach, leg, origin,
                floats, integers, keys, items, state,
            )  # fmt: skip
        else:
            if integers[item, HALFEDGE] < 0:
                return MET_BLOCKED_EDGE, -1 - integers[item, HALFEDGE]
            if from_heap:
                base = 3 * (integers[item, HALFEDGE] // 3)
                keys[len(keys) - 1] = key + min(shape[base, 0], shape[base + 1, 0], shape[base + 2, 0])
            if not lost_its_claim(item, epoch, twin, claim, floats, integers):
                light_targets(item, epoch, shape, listed, floats, integers, target_floats, target_integers)
                propagate(
                    item, bound, epoch, tail, twin, shape, angle_sum, kind, reach, leg, origin, claim,
                    floats, integers, keys, items, state,
                )  # fmt: skip
            integers[item, HALFEDGE] = state[FREE]
            state[FREE] = item
        if state[POPS] >= next_check:
            next_check += patience
            bound = farthest_target(bound, epoch, tail, reach, target_floats, target_integers)
    return (NO_ROOM if state[OVERFLOW] > 0 else DONE), 0
