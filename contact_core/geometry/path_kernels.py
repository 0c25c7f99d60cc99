"""Reading paths off a finished search: distances, headings, and chains of straight legs.

A straight leg may pass a vertex exactly, as many do on a lattice. Round a saddle a walk would part the angles there
and end elsewhere, so the leg is cut in two at that vertex, and both can be walked. Legs that touch the rim of their
window are walked backwards to see whether they pass one.
"""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import inner, kernel
from contact_core.geometry.kernel_arrays import Halfedges, Labels, Path, Points, Targets
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
    update_target,
)
from contact_core.geometry.tangent_kernels import (
    ON_EDGE,
    ON_VERTEX,
    PI,
    angle_round_vertex,
    heading_at,
    norm,
    place_of,
    vertex_scale,
)
from contact_core.geometry.tracing_kernels import MET_BEND, walk
from contact_core.geometry.window_kernels import INSIDE, distance_at

AS_LONG = 1.0 + 1e-9  # relative: a leg that is bent where it meets a vertex gets longer by the square of the miss


@inner
def bend_met(
    on: int,
    element: int,
    x: float,
    y: float,
    bx: float,
    by: float,
    length: float,
    distance: float,
    mesh: Halfedges,
    labels: Labels,
    line: Points,
) -> tuple[int, int, float, float]:
    """The last vertex that bends paths on the last leg of a path, walked back from its end along the unit vector
    (bx, by): (vertex or -1, corner, leg from the vertex to the end in the corner's frame)."""
    status, corner, miss, _, cos, sin, before, _ = walk(
        on, element, x, y, bx, by, length, False, True, 0, mesh, line
    )
    if status != MET_BEND:
        return -1, 0, 0.0, 0.0
    v, after = mesh.tail[corner], length - before
    to_v = distance_at(v, labels)
    if to_v >= distance or to_v + after > distance * AS_LONG:
        return -1, 0, 0.0, 0.0
    return v, corner, after * cos - miss * sin, after * sin + miss * cos


@inner
def bend_path_to_vertex(v: int, mesh: Halfedges, labels: Labels, line: Points) -> None:
    """Bend the last leg of the path to v at the vertex that it passes, if it may pass one."""
    if labels.origin[v, 3] == 0:
        return
    labels.origin[v, 3] = 0
    angle = labels.leg[v, 2] * vertex_scale(v, mesh)
    u, corner, x, y = bend_met(
        ON_VERTEX,
        v,
        0.0,
        0.0,
        math.cos(angle),
        math.sin(angle),
        norm(labels.leg[v, 0], labels.leg[v, 1]),
        labels.reach[v, 1],
        mesh,
        labels,
        line,
    )
    if u >= 0:
        labels.origin[v, 0], labels.origin[v, 1], labels.leg[v, 0], labels.leg[v, 1] = u, corner, x, y


@kernel
def read_targets(
    limit: float,
    anchor: IntArray,
    distance: FloatArray,
    headings: FloatArray,
    offsets: IntArray,
    mesh: Halfedges,
    labels: Labels,
    targets: Targets,
    line: Points,
) -> int:
    """Settle the path of every target; write anchor, distance, headings (t, 2) and offsets of the chains (t + 1,).

    Afterwards target_integers hold root and wedge, and target_floats ZX, ZY the last leg, for vertices too.
    """
    mesh = Halfedges(*mesh)
    labels = Labels(*labels)
    targets = Targets(*targets)
    line = Points(*line)
    total = 0
    for t in range(len(anchor)):
        on, element = targets.integers[t, ON], targets.integers[t, ELEMENT]
        row = targets.floats[t]
        headings[t, 0], headings[t, 1] = 1.0, 0.0
        if on == ON_VERTEX:
            distance[t] = distance_at(element, labels)
            if distance[t] <= limit and distance[t] < math.inf:
                bend_path_to_vertex(element, mesh, labels, line)
                row[ZX], row[ZY] = labels.leg[element, 0], labels.leg[element, 1]
                targets.integers[t, TARGET_ROOT] = labels.origin[element, 0]
                targets.integers[t, TARGET_WEDGE] = labels.origin[element, 1]
                if distance[t] > 0.0:
                    angle = labels.leg[element, 2] * vertex_scale(element, mesh)
                    headings[t, 0], headings[t, 1] = -math.cos(angle), -math.sin(angle)
        else:
            base = 3 * host_face(t, targets)
            for k in range(3):
                x, y = row[X + 2 * k], row[Y + 2 * k]
                length = distance_at(mesh.tail[base + k], labels)
                if 0.0 < length < math.inf:
                    length += norm(x, y)
                    path = Path(length, mesh.tail[base + k], base + k, x, y, base + k, x, y, INSIDE)
                    update_target(t, length, path, targets)
            distance[t] = row[DISTANCE] if row[RANK] < math.inf else math.inf
            if 0.0 < distance[t] <= limit and distance[t] < math.inf:
                headings[t, 0], headings[t, 1] = heading_at(
                    on, element, targets.integers[t, ARRIVAL], row[DX], row[DY], mesh
                )
                if targets.integers[t, TOUCHES] == 1:
                    k = element % 3 if on == ON_EDGE else 0
                    v, corner, x, y = bend_met(
                        on,
                        element,
                        row[X + 2 * k],
                        row[Y + 2 * k],
                        -headings[t, 0],
                        -headings[t, 1],
                        norm(row[ZX], row[ZY]),
                        distance[t],
                        mesh,
                        labels,
                        line,
                    )
                    if v >= 0:
                        targets.integers[t, TARGET_ROOT], targets.integers[t, TARGET_WEDGE] = v, corner
                        row[ZX], row[ZY] = x, y
        if distance[t] > limit or distance[t] == math.inf:
            anchor[t], distance[t] = -1, math.inf
        else:
            root = targets.integers[t, TARGET_ROOT]
            while root >= 0:
                bend_path_to_vertex(root, mesh, labels, line)
                total += 1
                root = labels.origin[root, 0]
            anchor[t] = -1 - root
        offsets[t + 1] = total
    return total


@kernel
def read_chains(
    sources: Points,
    anchor: IntArray,
    offsets: IntArray,
    first_legs: FloatArray,
    turning_angles: FloatArray,
    lengths: FloatArray,
    mesh: Halfedges,
    labels: Labels,
    targets: Targets,
) -> None:
    """Write first_legs (t, 2) in the sources' tangent frames, and the legs that follow, last leg last."""
    sources = Points(*sources)
    mesh = Halfedges(*mesh)
    labels = Labels(*labels)
    targets = Targets(*targets)
    for t in range(len(anchor)):
        first_legs[t, 0], first_legs[t, 1] = 0.0, 0.0
        if anchor[t] < 0:
            continue
        root, wedge = targets.integers[t, TARGET_ROOT], targets.integers[t, TARGET_WEDGE]
        zx, zy = targets.floats[t, ZX], targets.floats[t, ZY]
        i = offsets[t + 1]
        while root >= 0:
            i -= 1
            away = angle_round_vertex(wedge, zx, zy, mesh)
            turn = (away - labels.leg[root, 2]) * vertex_scale(root, mesh) - PI
            turning_angles[i] = turn + 2.0 * PI if turn <= -PI else turn
            lengths[i] = norm(zx, zy)
            zx, zy, wedge, root = (
                labels.leg[root, 0],
                labels.leg[root, 1],
                labels.origin[root, 1],
                labels.origin[root, 0],
            )
        s = -1 - root
        on, element, _, _ = place_of(sources, s, mesh)
        if on == ON_EDGE and wedge != element:
            zx, zy = -zx, -zy
        elif on == ON_VERTEX:
            length = norm(zx, zy)
            angle = angle_round_vertex(wedge, zx, zy, mesh) * vertex_scale(element, mesh)
            zx, zy = length * math.cos(angle), length * math.sin(angle)
        first_legs[t, 0], first_legs[t, 1] = zx, zy
