"""Reading ways off a finished search: distances, headings, and chains of straight legs.

A straight leg may pass a vertex exactly, as many do on a lattice. Round a saddle a walk would part the angles there
and end elsewhere, so the leg is cut in two at that vertex, and both can be walked. Legs that touch the rim of their
window are walked backwards to see whether they pass one.
"""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import kernel
from contact_core.geometry.log_map_kernels import (
    ARRIVAL,
    DISTANCE,
    DX,
    DY,
    ELEMENT,
    ON,
    RANK,
    TARGET_ROOT,
    TARGET_WEDGE,
    TOUCHES,
    ZX,
    ZY,
    X,
    Y,
    host_face,
    offer,
)
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_VERTEX,
    PI,
    angle_round_vertex,
    heading_at,
    norm,
    place,
    vertex_scale,
)
from contact_core.geometry.tracing_kernels import MET_BEND, walk
from contact_core.geometry.window_kernels import distance_at

AS_LONG = 1.0 + 1e-9  # relative: a leg that is bent where it meets a vertex gets longer by the square of the miss


@kernel
def bend_met(
    on: int, element: int, x: float, y: float, bx: float, by: float, length: float, distance: float, epoch: float,
    tail: IntArray, twin: IntArray, shape: FloatArray, first: IntArray, angle_sum: FloatArray, kind: IntArray,
    reach: FloatArray, no_faces: IntArray, no_barycentric: FloatArray,
) -> tuple[int, int, float, float]:  # fmt: skip
    """The last vertex that bends paths on the last leg of a way, walked back from its end along the unit vector
    (bx, by): (vertex or -1, corner, leg from the vertex to the end in the corner's frame)."""
    status, corner, miss, _, cos, sin, before, _ = walk(
        on, element, x, y, length * bx, length * by, False, True, tail, twin, shape, first, angle_sum, kind,
        no_faces, no_barycentric, 0,
    )  # fmt: skip
    if status != MET_BEND:
        return -1, 0, 0.0, 0.0
    v, after = tail[corner], length - before
    to_v = distance_at(v, epoch, reach)
    if to_v >= distance or to_v + after > distance * AS_LONG:
        return -1, 0, 0.0, 0.0
    return v, corner, after * cos - miss * sin, after * sin + miss * cos


@kernel
def bend_way_to_vertex(
    v: int, epoch: float,
    tail: IntArray, twin: IntArray, shape: FloatArray, first: IntArray, angle_sum: FloatArray, kind: IntArray,
    reach: FloatArray, leg: FloatArray, origin: IntArray, no_faces: IntArray, no_barycentric: FloatArray,
) -> None:  # fmt: skip
    """Bend the last leg of the way to v at the vertex that it passes, if it may pass one."""
    if origin[v, 3] == 0:
        return
    origin[v, 3] = 0
    angle = leg[v, 2] * vertex_scale(v, angle_sum, kind)
    u, corner, x, y = bend_met(
        ON_VERTEX, v, 0.0, 0.0, math.cos(angle), math.sin(angle), norm(leg[v, 0], leg[v, 1]), reach[v, 1], epoch,
        tail, twin, shape, first, angle_sum, kind, reach, no_faces, no_barycentric,
    )  # fmt: skip
    if u >= 0:
        origin[v, 0], origin[v, 1], leg[v, 0], leg[v, 1] = u, corner, x, y


@kernel
def read_targets(
    limit: float, epoch: float, tail: IntArray, twin: IntArray, shape: FloatArray,
    first: IntArray, angle_sum: FloatArray, kind: IntArray, reach: FloatArray, leg: FloatArray, origin: IntArray,
    target_floats: FloatArray, target_integers: IntArray, no_faces: IntArray, no_barycentric: FloatArray,
    anchor: IntArray, distance: FloatArray, headings: FloatArray, offsets: IntArray,
) -> int:  # fmt: skip
    """Settle the way of every target; write anchor, distance, headings (t, 2) and offsets of the chains (t + 1,).

    Afterwards target_integers hold root and wedge, and target_floats ZX, ZY the last leg, for vertices too.
    """
    total = 0
    for t in range(len(anchor)):
        on, element = target_integers[t, ON], target_integers[t, ELEMENT]
        row = target_floats[t]
        headings[t, 0], headings[t, 1] = 1.0, 0.0
        if on == ON_VERTEX:
            distance[t] = distance_at(element, epoch, reach)
            if distance[t] <= limit and distance[t] < math.inf:
                bend_way_to_vertex(
                    element, epoch, tail, twin, shape, first, angle_sum, kind, reach, leg, origin,
                    no_faces, no_barycentric,
                )  # fmt: skip
                row[ZX], row[ZY] = leg[element, 0], leg[element, 1]
                target_integers[t, TARGET_ROOT] = origin[element, 0]
                target_integers[t, TARGET_WEDGE] = origin[element, 1]
                if distance[t] > 0.0:
                    angle = leg[element, 2] * vertex_scale(element, angle_sum, kind)
                    headings[t, 0], headings[t, 1] = -math.cos(angle), -math.sin(angle)
        else:
            base = 3 * host_face(t, target_integers)
            for k in range(3):
                x, y = row[X + 2 * k], row[Y + 2 * k]
                way = distance_at(tail[base + k], epoch, reach)
                if 0.0 < way < math.inf:
                    way += norm(x, y)
                    offer(
                        t, way, way, tail[base + k], base + k, x, y, base + k, x, y, False,
                        target_floats, target_integers,
                    )  # fmt: skip
            distance[t] = row[DISTANCE] if row[RANK] < math.inf else math.inf
            if 0.0 < distance[t] <= limit and distance[t] < math.inf:
                headings[t, 0], headings[t, 1] = heading_at(
                    on, element, target_integers[t, ARRIVAL], row[DX], row[DY], tail, twin, shape, angle_sum, kind
                )
                if target_integers[t, TOUCHES] == 1:
                    k = element % 3 if on == ON_EDGE else 0
                    v, corner, x, y = bend_met(
                        on, element, row[X + 2 * k], row[Y + 2 * k], -headings[t, 0], -headings[t, 1],
                        norm(row[ZX], row[ZY]), distance[t], epoch,
                        tail, twin, shape, first, angle_sum, kind, reach, no_faces, no_barycentric,
                    )  # fmt: skip
                    if v >= 0:
                        target_integers[t, TARGET_ROOT], target_integers[t, TARGET_WEDGE] = v, corner
                        row[ZX], row[ZY] = x, y
        if distance[t] > limit or distance[t] == math.inf:
            anchor[t], distance[t] = -1, math.inf
        else:
            root = target_integers[t, TARGET_ROOT]
            while root >= 0:
                bend_way_to_vertex(
                    root, epoch, tail, twin, shape, first, angle_sum, kind, reach, leg, origin,
                    no_faces, no_barycentric,
                )  # fmt: skip
                total += 1
                root = origin[root, 0]
            anchor[t] = -1 - root
        offsets[t + 1] = total
    return total


@kernel
def read_chains(
    source_faces: IntArray, source_barycentric: FloatArray,
    tail: IntArray, twin: IntArray, shape: FloatArray, angle_sum: FloatArray, kind: IntArray,
    leg: FloatArray, origin: IntArray, target_floats: FloatArray, target_integers: IntArray,
    anchor: IntArray, offsets: IntArray,
    first_legs: FloatArray, turning_angles: FloatArray, lengths: FloatArray,
) -> None:  # fmt: skip
    """Write first_legs (t, 2) in the sources' tangent frames, and the legs that follow, last leg last."""
    for t in range(len(anchor)):
        first_legs[t, 0], first_legs[t, 1] = 0.0, 0.0
        if anchor[t] < 0:
            continue
        root, wedge = target_integers[t, TARGET_ROOT], target_integers[t, TARGET_WEDGE]
        zx, zy = target_floats[t, ZX], target_floats[t, ZY]
        i = offsets[t + 1]
        while root >= 0:
            i -= 1
            away = angle_round_vertex(wedge, zx, zy, shape)
            turn = (away - leg[root, 2]) * vertex_scale(root, angle_sum, kind) - PI
            turning_angles[i] = turn + 2.0 * PI if turn <= -PI else turn
            lengths[i] = norm(zx, zy)
            zx, zy, wedge, root = leg[root, 0], leg[root, 1], origin[root, 1], origin[root, 0]
        s = -1 - root
        b0, b1, b2 = source_barycentric[s, 0], source_barycentric[s, 1], source_barycentric[s, 2]
        on, element, _, _ = place(source_faces[s], b0, b1, b2, tail, twin, shape)
        if on == ON_EDGE and wedge != element:
            zx, zy = -zx, -zy
        elif on == ON_VERTEX:
            length = norm(zx, zy)
            angle = angle_round_vertex(wedge, zx, zy, shape) * vertex_scale(element, angle_sum, kind)
            zx, zy = length * math.cos(angle), length * math.sin(angle)
        first_legs[t, 0], first_legs[t, 1] = zx, zy
