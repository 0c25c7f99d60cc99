"""Kernels that close whole hands: each digit from the best of its starts, the thumb last.

See `closing.close_hands` for what is computed. How one digit closes is in `closing_kernels`. Nothing is allocated.
Digits are numbered d, bones b, hands n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import constant, inlined, inner, kernel
from contact_core.geometry.kernel_arrays import Grid
from contact_core.grasping.closing_kernels import (
    Chains,
    Skin,
    State,
    approach,
    clearance_of,
    clearance_of_digit,
    close_digit,
    copy_turn,
    moved,
    pad_fit,
    place_capsules,
    pose_digit,
)

OUT_OF_BAR = 0.02  # hand lengths: a digit that is deeper in the object than this does not fit beside a bar
TURNED = 0.04  # hand lengths that a pad is worth that looks away from the object
BEST = 1e-12  # hand lengths by which a start has to be better than the best before it
ZERO = constant(0)


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


class Best(NamedTuple):
    """The best start so far of a digit. angles: (B,). turn: (3, 3). at: (3,) twist, spread and flexion of a thumb;
    trial: (3,) those that are tried next."""

    angles: FloatArray
    turn: FloatArray
    at: FloatArray
    trial: FloatArray


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
        if clear < -rules.touch and curl > 0.0 and d != chains.thumb:  # it was in the object before it closed
            open_digit(d, 0.0, chains, state)
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
