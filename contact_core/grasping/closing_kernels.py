"""Kernels that bring a hand to an object and curl its digits until they touch (GraspIt!'s rule, Miller and Allen
2004), one digit's links at a few dozen points, with steps that the clearance allows (sphere tracing, Hart 1996).

A frame is (3, 4), the upper rows of a rigid matrix. Nothing is allocated. Digits are numbered d, bones b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.field_kernels import distance_and_gradient
from contact_core.geometry.jit import constant, inlined, inner, kernel
from contact_core.geometry.kernel_arrays import Grid

LEAST_STEP, LARGEST_STEP = np.radians(1.0), np.radians(15.0)
LAST_RATIO = 0.7  # the last joint of a digit curls more slowly, as tendons make it
OUT_OF_BAR = 0.02  # hand lengths: a digit that is deeper in the object than this does not fit beside a bar
TURNED = 0.04  # hand lengths that a pad is worth that looks away from the object
BEST = 1e-12  # hand lengths by which a start has to be better than the best before it
ROUNDS = constant(120)
ZERO, ONE = constant(0), constant(1)


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


class Starts(NamedTuple):
    """From where each digit is closed, and where to look about the best of a thumb's: fields of `hand.Hand`.

    turns: (D, S, 3, 3), counts: (D,), angles, prices: (D, S). ways: (4,) starts each way, and rounds of looking.
    frame: (3, 3), low, high: (3,).
    """

    turns: FloatArray
    counts: IntArray
    angles: FloatArray
    prices: FloatArray
    ways: IntArray
    frame: FloatArray
    low: FloatArray
    high: FloatArray


class Rules(NamedTuple):
    """length: of the hand, surface units; touch: nearer than so many of them is touching. In hand lengths: on, how
    near a pad presses; oppose, along: what it is worth that a thumb opposes, and lies across a rod."""

    length: float
    touch: float
    on: float
    oppose: float
    along: float


class Placed(NamedTuple):
    """Where N hands begin, and what is asked of each.

    frames: (N, 3, 4) object_from_rig, moved by the approach. ways: (N, 3). bars: (N, 7). curls: (N,). limits:
    (N, D). See `closing.close_hands`.
    """

    frames: FloatArray
    ways: FloatArray
    bars: FloatArray
    curls: FloatArray
    limits: FloatArray


class Found(NamedTuple):
    """How N hands closed: arrays of `closing.Closed`."""

    angles: FloatArray
    turns: FloatArray
    fits: FloatArray
    clear: FloatArray
    rest: FloatArray
    palm: FloatArray
    travel: FloatArray


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


class Best(NamedTuple):
    """The best start so far of a digit. angles: (B,). turn: (3, 3). at: (3,) twist, spread and flexion of a thumb;
    trial: (3,) those that are tried next."""

    angles: FloatArray
    turn: FloatArray
    at: FloatArray
    trial: FloatArray


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


@inlined
def turned_root(out: FloatArray, frame: FloatArray, x: float, y: float) -> None:
    """out (3, 3) = frame @ turn about x @ turn about y @ frame.T, frame (3, 3)."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    for i in range(3):
        f0, f1, f2 = frame[i, 0], frame[i, 1], frame[i, 2]
        a = f0 * cy + (f1 * sx - f2 * cx) * sy
        b = f1 * cx + f2 * sx
        c = f0 * sy - (f1 * sx - f2 * cx) * cy
        for j in range(3):
            out[i, j] = a * frame[j, 0] + b * frame[j, 1] + c * frame[j, 2]


@inlined
def between(prices: FloatArray, counts: IntArray, low: FloatArray, high: FloatArray, at: FloatArray) -> float:
    """Trilinear in prices of a grid with so many nodes each way (flat, the last way fastest) from low to high."""
    total = 0.0
    for corner in range(8):
        place, share = ZERO, 1.0
        for axis in range(3):
            side = (corner >> axis) & 1
            g = (at[axis] - low[axis]) / (high[axis] - low[axis]) * (counts[axis] - 1)
            g = min(max(g, 0.0), counts[axis] - 1.0)
            cell = min(np.int64(g), counts[axis] - 2)
            share *= g - cell if side else 1.0 - (g - cell)
            place = place * counts[axis] + cell + side
        total += share * prices[place]
    return total


@inner
def misfit_of(
    d: int,
    least: float,
    price: float,
    bar: FloatArray,
    chains: Chains,
    skin: Skin,
    grid: Grid,
    rules: Rules,
    state: State,
) -> float:
    """What is amiss with a closed digit, in hand lengths: skin in the object, pads off it, and of a thumb that it
    does not press against the fingers or lies along what they go round.

    A thumb is across a rod where its tip points the way in which the normals under the fingers vary; for a ball or
    a plate no way is better than another.
    """
    misfit = price - 3.0 * min(least, 0.0) / rules.length
    count, against, fit = 0.0, 0.0, state.fit
    for b in range(chains.bones[d], chains.bones[d + 1]):
        if skin.has_pad[b]:
            pad_fit(b, bar, skin, grid, state, fit)
            count += 1.0
            misfit += abs(fit[0]) / rules.length + TURNED * (1.0 + fit[1])
            against += fit[2] * state.mean[0] + fit[3] * state.mean[1] + fit[4] * state.mean[2]
    if d == chains.thumb and count > 0.0:
        misfit += rules.oppose * max(against / count + 0.6, 0.0)
        misfit += rules.along * max(1.0 - across(d, chains, skin, state), 0.0)
    return misfit


@inlined
def across(d: int, chains: Chains, skin: Skin, state: State) -> float:
    """Three times the share of the normals' variance that lies along the last bone of digit d: 1 where no way is
    better than another."""
    last, tip = chains.bones[d + 1] - 1, state.fit
    x, y, z = moved(state.frames[last], skin.capsules[last, 1])
    u, v, w = moved(state.frames[last], skin.capsules[last, 0])
    tip[0], tip[1], tip[2] = x - u, y - v, z - w
    size, along = 1e-30, 0.0
    for i in range(3):
        size += tip[i] * tip[i]
    for i in range(3):
        for j in range(3):
            along += tip[i] * state.normals[i, j] * tip[j]
    return 3.0 * along / size


@inner
def take_start(d: int, tried: int, starts: Starts, chains: Chains, state: State) -> float:
    """Put the first bone of digit d where one of its starts puts it; returns the price of that."""
    first = chains.firsts[d]
    copy_turn(starts.turns[d, tried], state.turns[first])
    if d == chains.thumb:
        state.angles[first] = starts.angles[d, tried]
    return starts.prices[d, tried]


@inlined
def place_of_start(chosen: int, starts: Starts, at: FloatArray) -> None:
    """Write twist, spread and flexion of a thumb's start to `at` (3,)."""
    for k in range(2, -1, -1):
        at[k] = chosen % starts.ways[k] * (starts.high[k] - starts.low[k]) / (starts.ways[k] - 1.0)
        at[k] += starts.low[k]
        chosen = chosen // starts.ways[k]


@inner
def look_about(near: int, step: float, starts: Starts, chains: Chains, state: State, best: Best) -> float:
    """Put the thumb beside the best so far, a step (of the spacing of the starts) one way of each of three; returns
    the price of that."""
    for k in range(3):
        best.trial[k] = best.at[k]
    k = near % 6 // 2
    stride = step * (starts.high[k] - starts.low[k]) / (starts.ways[k] - 1.0)
    best.trial[k] += stride if near % 2 else -stride
    best.trial[k] = min(max(best.trial[k], starts.low[k]), starts.high[k])
    first = chains.firsts[chains.thumb]
    turned_root(state.turns[first], starts.frame, best.trial[0], best.trial[1])
    state.angles[first] = best.trial[2]
    return between(starts.prices[chains.thumb], starts.ways, starts.low, starts.high, best.trial)


@inner
def close_best(
    d: int,
    base: FloatArray,
    bar: FloatArray,
    curl: float,
    chains: Chains,
    skin: Skin,
    starts: Starts,
    grid: Grid,
    rules: Rules,
    state: State,
    best: Best,
) -> None:
    """Close digit d from each of its starts, then of a thumb from what is near the best of them, in steps that
    halve; it ends as it fits best."""
    first, end = chains.bones[d], chains.bones[d + 1]
    least_misfit, chosen, step, better = np.inf, ZERO, 0.5, True
    more = 6 * starts.ways[3] if d == chains.thumb and starts.counts[d] > 1 else ZERO
    for tried in range(starts.counts[d] + more):
        near = tried - starts.counts[d]
        open_digit(d, curl, chains, state)
        if near < 0:
            price = take_start(d, tried, starts, chains, state)
        else:
            if near == 0:
                place_of_start(chosen, starts, best.at)
            if near % 6 == 0:
                step = step if better else 0.5 * step
                better = False
            price = look_about(near, step, starts, chains, state, best)
        clear = close_digit(d, base, bar, chains, skin, grid, rules.touch, state)
        misfit = misfit_of(d, clear, price, bar, chains, skin, grid, rules, state)
        if misfit < least_misfit - BEST:
            least_misfit, better = misfit, True
            if near < 0:
                chosen = tried
            else:
                for k in range(3):
                    best.at[k] = best.trial[k]
            for b in range(first, end):
                best.angles[b] = state.angles[b]
            copy_turn(state.turns[chains.firsts[d]], best.turn)
    copy_turn(best.turn, state.turns[chains.firsts[d]])
    for b in range(first, end):
        state.angles[b] = best.angles[b]
    pose_digit(d, base, chains, state)


@inner
def open_digit(d: int, curl: float, chains: Chains, state: State) -> None:
    """Bend digit d by a share of its limits, a thumb not at all, and let all that bends move; of a thumb all but
    the first, whose angle is a part of its start."""
    for b in range(chains.bones[d], chains.bones[d + 1]):
        state.moves[b] = chains.flexes[b]
        state.angles[b] = 0.0
        if chains.flexes[b] and d != chains.thumb:
            state.angles[b] = min(max(curl * chains.high[b], chains.low[b]), chains.high[b])
    if d == chains.thumb:
        state.moves[chains.firsts[d]] = False


@inner
def close_on_whole(
    d: int, base: FloatArray, chains: Chains, skin: Skin, grid: Grid, touch: float, state: State
) -> None:
    """Close digit d again, on all of the object: there is no room beside the bar."""
    for b in range(chains.bones[d], chains.bones[d + 1]):
        state.moves[b] = chains.flexes[b] and not (d == chains.thumb and b == chains.firsts[d])
        if state.moves[b]:
            state.angles[b] = 0.0
    close_digit(d, base, state.whole, chains, skin, grid, touch, state)
    pose_digit(d, base, chains, state)


@inner
def open_hand(n: int, placed: Placed, chains: Chains, state: State) -> None:
    """Hand n before its approach: digits bent by a share of their limits, the thumb not; none is closed."""
    state.normals[:] = 0.0
    state.mean[:] = 0.0
    state.turns[:] = 0.0
    state.done[:] = False
    for d in range(len(chains.bones) - 1):
        for b in range(chains.bones[d], chains.bones[d + 1]):
            state.ceiling[b] = placed.limits[n, d] * chains.high[b]
            wanted = placed.curls[n] * chains.high[b] if chains.flexes[b] else 0.0
            state.angles[b] = 0.0 if d == chains.thumb else min(max(wanted, chains.low[b]), chains.high[b])
            for i in range(3):
                state.turns[b, i, i] = 1.0


@inner
def press(d: int, chains: Chains, skin: Skin, grid: Grid, rules: Rules, state: State, fits: FloatArray) -> float:
    """Write how the pads of digit d fit to fits (B, 8), and add the normals under those of a finger that press to
    the sums in state; returns how many press."""
    pressing = 0.0
    for b in range(chains.bones[d], chains.bones[d + 1]):
        if not skin.has_pad[b]:
            continue
        pad_fit(b, state.whole, skin, grid, state, fits[b])
        if d != chains.thumb and abs(fits[b, 0]) < rules.on * rules.length:
            pressing += 1.0
            for i in range(3):
                state.mean[i] += fits[b, 2 + i]
                for j in range(3):
                    state.normals[i, j] += fits[b, 2 + i] * fits[b, 2 + j]
    return pressing


@inner
def average(pressing: float, state: State) -> None:
    """Make a mean of the sums of the normals under fingers that press."""
    size = np.sqrt(state.mean[0] ** 2 + state.mean[1] ** 2 + state.mean[2] ** 2)
    if size > 0.0:
        for i in range(3):
            state.mean[i] = state.mean[i] / size
            for j in range(3):
                state.normals[i, j] = state.normals[i, j] / pressing


@inner
def close_hand(
    n: int,
    placed: Placed,
    chains: Chains,
    skin: Skin,
    starts: Starts,
    grid: Grid,
    rules: Rules,
    state: State,
    best: Best,
    found: Found,
) -> None:
    """Close the digits of hand n where the approach left it, in their order, the thumb last: where it presses
    depends on the fingers."""
    digits, pressing, base, bar = len(chains.bones) - 1, 0.0, placed.frames[n], placed.bars[n]
    for turn in range(digits):
        d = turn if chains.thumb < 0 else (turn + 1 if turn + 1 < digits else ZERO)
        close_best(d, base, bar, placed.curls[n], chains, skin, starts, grid, rules, state, best)
        copy_turn(best.turn, found.turns[n, d])
        clear = clearance_of_digit(d, skin, grid, state)
        if bar[6] > 0.0 and clear < -OUT_OF_BAR * rules.length:
            close_on_whole(d, base, chains, skin, grid, rules.touch, state)
            clear = clearance_of_digit(d, skin, grid, state)
        found.clear[n, d] = clear
        for b in range(chains.bones[d], chains.bones[d + 1]):
            found.angles[n, b] = state.angles[b]
        place_capsules(d, chains, skin, state)
        state.done[d] = True
        pressing += press(d, chains, skin, grid, rules, state, found.fits[n])
        if turn == digits - 2:
            average(pressing, state)


@kernel
def close_all(
    placed: Placed,
    chains: Chains,
    skin: Skin,
    starts: Starts,
    grid: Grid,
    rules: Rules,
    state: State,
    best: Best,
    found: Found,
) -> None:
    """Approach and close a hand at every placement."""
    for n in range(len(placed.frames)):
        frame, way = placed.frames[n], placed.ways[n]
        open_hand(n, placed, chains, state)
        found.travel[n] = 0.0
        if way[0] != 0.0 or way[1] != 0.0 or way[2] != 0.0:
            found.travel[n] = approach(frame, way, placed.bars[n], chains, skin, grid, rules.touch, state)
        if np.isfinite(found.travel[n]):
            close_hand(n, placed, chains, skin, starts, grid, rules, state, best, found)
            found.rest[n] = clearance_of(skin.rest, frame, grid)
            found.palm[n] = clearance_of(skin.tested, frame, grid)
