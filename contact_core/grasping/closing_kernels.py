"""Kernels that bring a hand to an object and curl a digit until it touches (GraspIt!'s rule, Miller and Allen
2004), its links at a few dozen points, with steps that the clearance allows (sphere tracing, Hart 1996).

A frame is (3, 4), the upper rows of a rigid matrix. Nothing is allocated. Digits are numbered d, bones b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.field_kernels import distance_and_gradient
from contact_core.geometry.jit import constant, inlined, inner
from contact_core.geometry.kernel_arrays import Grid

LEAST_STEP, LARGEST_STEP = np.radians(1.0), np.radians(15.0)
LAST_RATIO = 0.7  # the last joint of a digit curls more slowly, as tendons make it
ROUNDS = constant(120)
ONE = constant(1)


class Chains(NamedTuple):
    """The digits of a hand as chains of bones, thumb first where there is one: fields of `hand.Hand`.

    thumb: which digit it is, -1 for none.
    """

    bones: IntArray
    firsts: IntArray
    links: FloatArray
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    flexes: BoolArray
    leads: IntArray
    ratios: FloatArray
    thumb: int


class Skin(NamedTuple):
    """Points, pads and capsules of a hand's skin: fields of `hand.Hand`."""

    probes: FloatArray
    probe_bones: IntArray
    probe_starts: IntArray
    levers: FloatArray
    tested: FloatArray
    tested_bones: IntArray
    rest: FloatArray
    pads: FloatArray
    pad_normals: FloatArray
    has_pad: BoolArray
    capsules: FloatArray
    radii: FloatArray
    room: FloatArray


class State(NamedTuple):
    """One hand as it closes.

    turns: (B, 3, 3) of each bone before it bends. angles: (B,). frames: (B, 3, 4) and capsules' ends (B, 2, 3) in
    the object's space. ceiling: (B,) how far each bends at most. moves, going: (B,) which bend, and still do.
    done: (D,) which digits are closed. mean: (3,) the object's normal under the fingers, normals: (3, 3) the mean
    of n n^T. fit: (8,) of a pad. whole: (7,) a bar of radius 0, for all of the object.
    """

    turns: FloatArray
    angles: FloatArray
    frames: FloatArray
    ends: FloatArray
    ceiling: FloatArray
    moves: BoolArray
    going: BoolArray
    done: BoolArray
    mean: FloatArray
    normals: FloatArray
    fit: FloatArray
    whole: FloatArray


@inlined
def distance_at(grid: Grid, x: float, y: float, z: float) -> float:
    """Signed distance of a point to the object."""
    return distance_and_gradient(grid, x, y, z)[0]


@inlined
def distance_beside(grid: Grid, bar: FloatArray, x: float, y: float, z: float) -> float:
    """Signed distance to the object; where bar[6] > 0 to a round bar alone: middle (3), axis (3), radius."""
    if bar[6] <= 0.0:
        return distance_at(grid, x, y, z)
    px, py, pz = x - bar[0], y - bar[1], z - bar[2]
    along = px * bar[3] + py * bar[4] + pz * bar[5]
    px, py, pz = px - along * bar[3], py - along * bar[4], pz - along * bar[5]
    return np.sqrt(px * px + py * py + pz * pz) - bar[6]


@inlined
def bent(
    out: FloatArray,
    base: FloatArray,
    link: FloatArray,
    pre: FloatArray,
    axis: FloatArray,
    angle: float,
) -> None:
    """out = base @ link @ pre @ turn(axis, angle); base, link, out (3, 4), pre (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    t = 1.0 - c
    r00, r01, r02 = c + t * x * x, t * x * y - s * z, t * x * z + s * y
    r10, r11, r12 = t * x * y + s * z, c + t * y * y, t * y * z - s * x
    r20, r21, r22 = t * x * z - s * y, t * y * z + s * x, c + t * z * z
    for i in range(3):
        b0, b1, b2 = base[i, 0], base[i, 1], base[i, 2]
        l0 = b0 * link[0, 0] + b1 * link[1, 0] + b2 * link[2, 0]
        l1 = b0 * link[0, 1] + b1 * link[1, 1] + b2 * link[2, 1]
        l2 = b0 * link[0, 2] + b1 * link[1, 2] + b2 * link[2, 2]
        out[i, 3] = b0 * link[0, 3] + b1 * link[1, 3] + b2 * link[2, 3] + base[i, 3]
        p0 = l0 * pre[0, 0] + l1 * pre[1, 0] + l2 * pre[2, 0]
        p1 = l0 * pre[0, 1] + l1 * pre[1, 1] + l2 * pre[2, 1]
        p2 = l0 * pre[0, 2] + l1 * pre[1, 2] + l2 * pre[2, 2]
        out[i, 0] = p0 * r00 + p1 * r10 + p2 * r20
        out[i, 1] = p0 * r01 + p1 * r11 + p2 * r21
        out[i, 2] = p0 * r02 + p1 * r12 + p2 * r22


@inlined
def copy_turn(source: FloatArray, target: FloatArray) -> None:
    """target (3, 3) = source (3, 3)."""
    for i in range(3):
        for j in range(3):
            target[i, j] = source[i, j]


@inlined
def moved(frame: FloatArray, p: FloatArray) -> tuple[float, float, float]:
    """A point (3,) in a frame."""
    return (
        frame[0, 0] * p[0] + frame[0, 1] * p[1] + frame[0, 2] * p[2] + frame[0, 3],
        frame[1, 0] * p[0] + frame[1, 1] * p[1] + frame[1, 2] * p[2] + frame[1, 3],
        frame[2, 0] * p[0] + frame[2, 1] * p[1] + frame[2, 2] * p[2] + frame[2, 3],
    )


@inner
def pose_digit(d: int, base: FloatArray, chains: Chains, state: State) -> None:
    """Frames of the bones of digit d at their angles."""
    first = chains.bones[d]
    for b in range(first, chains.bones[d + 1]):
        before = base if b == first else state.frames[b - 1]
        bent(state.frames[b], before, chains.links[b], state.turns[b], chains.axes[b], state.angles[b])


@inner
def segments_apart(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> float:
    """Distance of segments pq and rs, each end (3,). Ericson, "Real-Time Collision Detection", 5.1.9."""
    a = e = f = b = c = 0.0
    for i in range(3):
        d1, d2, w = q[i] - p[i], s[i] - r[i], p[i] - r[i]
        a, e, f, b, c = a + d1 * d1, e + d2 * d2, f + d2 * w, b + d1 * d2, c + d1 * w
    u = 0.0
    parallel = a * e - b * b
    if parallel > 1e-12 * a * e:
        u = min(max((b * f - c * e) / parallel, 0.0), 1.0)
    t = (b * u + f) / e if e > 1e-30 else 0.0
    inside = min(max(t, 0.0), 1.0)
    if inside != t:
        u = min(max((b * inside - c) / a, 0.0), 1.0) if a > 1e-30 else 0.0
    total = 0.0
    for i in range(3):
        gap = p[i] + u * (q[i] - p[i]) - r[i] - inside * (s[i] - r[i])
        total += gap * gap
    return np.sqrt(total)


@inner
def place_capsules(d: int, chains: Chains, skin: Skin, state: State) -> None:
    """Ends of the capsules of digit d in the object's space."""
    for b in range(chains.bones[d], chains.bones[d + 1]):
        for e in range(2):
            x, y, z = moved(state.frames[b], skin.capsules[b, e])
            state.ends[b, e, 0], state.ends[b, e, 1], state.ends[b, e, 2] = x, y, z


@inner
def touched_digit(d: int, chains: Chains, skin: Skin, state: State) -> int:
    """The last bone of digit d whose capsule is in that of another digit which is closed, -1 for none."""
    last = -ONE
    for b in range(chains.bones[d], chains.bones[d + 1]):
        if skin.radii[b] <= 0.0:
            continue
        for other in range(len(state.done)):
            if not state.done[other] or other == d:
                continue
            for c in range(chains.bones[other], chains.bones[other + 1]):
                if skin.radii[c] > 0.0 and skin.room[b, c] > 0.0:
                    gap = segments_apart(state.ends[b, 0], state.ends[b, 1], state.ends[c, 0], state.ends[c, 1])
                    if gap < skin.room[b, c]:
                        last = b
    return last


@inner
def close_digit(
    d: int, base: FloatArray, bar: FloatArray, chains: Chains, skin: Skin, grid: Grid, touch: float, state: State
) -> float:
    """Curl digit d from its angles until each joint's link, or one beyond it, touches; returns the least clearance.

    bar: (7,) what it closes on (`distance_beside`).
    """
    first, end = chains.bones[d], chains.bones[d + 1]
    last_moving = -ONE
    for b in range(first, end):
        state.going[b] = state.moves[b] and chains.leads[b] < 0
        if state.going[b]:
            last_moving = b
    least = np.inf
    for _ in range(ROUNDS):
        for b in range(first, end):
            if chains.leads[b] >= 0:
                state.angles[b] = chains.ratios[b] * state.angles[chains.leads[b]]
        pose_digit(d, base, chains, state)
        least = np.inf
        stop = -ONE
        step = LARGEST_STEP
        for p in range(skin.probe_starts[d], skin.probe_starts[d + 1]):
            b = skin.probe_bones[p]
            x, y, z = moved(state.frames[b], skin.probes[p])
            clear = distance_beside(grid, bar, x, y, z)
            least = min(least, clear)
            if clear < touch:
                stop = max(stop, b)
            else:
                step = min(step, (clear - 0.5 * touch) / skin.levers[p])
        place_capsules(d, chains, skin, state)
        stop = max(stop, touched_digit(d, chains, skin, state))
        if not curl(d, stop, max(step, LEAST_STEP), last_moving, chains, state):
            break
    return least


@inlined
def curl(d: int, stop: int, step: float, last_moving: int, chains: Chains, state: State) -> bool:
    """Bend the bones of digit d beyond `stop` by a step (radians), as far as they go; whether any did."""
    first, bends = chains.bones[d], False
    for b in range(first, chains.bones[d + 1]):
        if b <= stop:
            state.going[b] = False
        if state.going[b]:
            rate = LAST_RATIO if b == last_moving and last_moving > first else 1.0
            angle = min(state.angles[b] + step * rate, max(state.ceiling[b], state.angles[b]))
            state.going[b] = angle > state.angles[b]
            state.angles[b] = angle
            bends = bends or state.going[b]
    return bends


@inner
def pad_fit(b: int, bar: FloatArray, skin: Skin, grid: Grid, state: State, out: FloatArray) -> None:
    """Of the pad below bone b: out = distance, n . gradient, gradient (3), position (3)."""
    h, frame, pad, normal = 0.5 * grid.spacing, state.frames[b], skin.pads[b], skin.pad_normals[b]
    x, y, z = moved(frame, pad)
    out[0] = distance_beside(grid, bar, x, y, z)
    gx = distance_beside(grid, bar, x + h, y, z) - distance_beside(grid, bar, x - h, y, z)
    gy = distance_beside(grid, bar, x, y + h, z) - distance_beside(grid, bar, x, y - h, z)
    gz = distance_beside(grid, bar, x, y, z + h) - distance_beside(grid, bar, x, y, z - h)
    size = max(np.sqrt(gx * gx + gy * gy + gz * gz), 1e-30)
    out[2], out[3], out[4] = gx / size, gy / size, gz / size
    out[5], out[6], out[7] = x, y, z
    out[1] = 0.0
    for i in range(3):
        n = frame[i, 0] * normal[0] + frame[i, 1] * normal[1]
        n += frame[i, 2] * normal[2]
        out[1] += n * out[2 + i]


@inner
def approach(
    frame: FloatArray,
    way: FloatArray,
    bar: FloatArray,
    chains: Chains,
    skin: Skin,
    grid: Grid,
    touch: float,
    state: State,
) -> float:
    """Move `frame` back along `way` (3,) until the tested skin is clear, then on until it touches.

    Returns how far it went; inf where it passes by. Bones of tested skin are -1 for the palm.
    """
    for d in range(len(chains.bones) - 1):
        pose_digit(d, frame, chains, state)
    values = grid.values
    reach = grid.spacing * (values.shape[0] + values.shape[1] + values.shape[2])
    travelled, forward = 0.0, False
    for _ in range(ROUNDS):
        least = np.inf
        for p in range(len(skin.tested)):
            b = skin.tested_bones[p]
            x, y, z = moved(frame if b < 0 else state.frames[b], skin.tested[p])
            x, y, z = x + travelled * way[0], y + travelled * way[1], z + travelled * way[2]
            least = min(least, distance_beside(grid, bar, x, y, z))
        if least >= 0.0:
            forward = True
            if least < touch:
                break
            travelled += max(0.9 * (least - 0.5 * touch), 0.25 * touch)
        elif forward:
            break
        else:
            travelled -= max(-least, touch)
        if abs(travelled) > reach:
            return np.inf
    for i in range(3):
        frame[i, 3] += travelled * way[i]
    return travelled


@inner
def clearance_of_digit(d: int, skin: Skin, grid: Grid, state: State) -> float:
    """The least signed distance of digit d's skin to the object."""
    least = np.inf
    for p in range(skin.probe_starts[d], skin.probe_starts[d + 1]):
        x, y, z = moved(state.frames[skin.probe_bones[p]], skin.probes[p])
        least = min(least, distance_at(grid, x, y, z))
    return least


@inner
def clearance_of(points: FloatArray, frame: FloatArray, grid: Grid) -> float:
    """The least signed distance of points (k, 3) in a frame to the object."""
    least = np.inf
    for p in range(len(points)):
        x, y, z = moved(frame, points[p])
        least = min(least, distance_at(grid, x, y, z))
    return least
