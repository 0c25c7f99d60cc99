"""Fingers through a loop, as a mug's handle is held: the hand closes round its bar; and thumb and fingers through
two, as scissors are held: the hand is posed for it, then laid in."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contact_builtins.grasps.opposition import frame_of
from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.raycast import Locator
from contact_core.grasping.closing import FOUND, Closed, close_hands
from contact_core.grasping.hand import Hand
from contact_core.grasping.loops import Loop, crossed, loops_near
from contact_core.grasping.slots import Approaches, GraspRequest, Kind

ROLLS = np.arange(16) * np.pi / 8.0  # of the palm round a bar
TILTS = np.radians([0.0, 25.0, -25.0])  # of the fingers away from straight across it
ROLLED = np.radians([0.0, 30.0, -30.0, 60.0, -60.0])  # of fingers that go straight through
FREE = 0.006  # hand lengths between them and the bar
ALONG = (0.16, 0.24, 0.32)  # hand lengths from the palm's middle at which a bar is held
SHIFTS = (-0.12, -0.06, 0.0, 0.06, 0.12)  # hand lengths along the bar
RELAXED = 0.3  # of its room, that a thumb is bent which takes no part
WIDE = 0.2  # hand lengths: a bar is no wider
CURLS = (0.15, 0.25, 0.35, 0.45, 0.55)  # of their room, that fingers are bent
TOGETHER = ((0,), (0, 1), (1,))  # of the fingers beside the thumb, those that go through one loop
SIDEWAYS = 0.08  # hand lengths that digits are worth which do not go straight through
OTHERS = 0.45  # of their room, that the other fingers are bent
TRIED = 80
MOST = 300  # hands with fingers through a loop
EASED, EASY = 5, 0.004  # times that such a hand is moved out of the object, hand lengths that it may be in it
JAMMED = 60.0  # fingers through a loop that it costs to be one hand length deeper
SUNK = 0.03  # hand lengths of skin in the object that spoil it


def through_handle(request: GraspRequest, kinds: tuple[Kind, ...]) -> Approaches | None:
    """Hands that close on the bar between a place that is to be held and the loop there, the palm or the fingers'
    bones against it, for power and hook grasps; None where there is no loop."""
    hand, own = request.hand, [kind for kind in kinds if kind in ("power", "hook")]
    loops = loops_near(request.mesh, hand.length, request.at)
    if request.at is None or not loops or not own:
        return None
    bar = _bar(request, loops[0], request.at)
    made = [*_palms_on(hand, bar, loops[0]), *_bones_on(hand, bar, loops[0])]
    n = len(made)
    placed, ways = np.array([pose for pose, _ in made]), np.array([way for _, way in made])
    limits = np.ones((n, len(hand.bones) - 1))
    laid = Approaches(placed, (own[0],) * n, ways, np.tile(bar, (n, 1)), np.zeros(n), limits)
    found = _threading(request, laid, loops[0])
    return None if found is None else Approaches.joined([_of_kind(hand, found, kind) for kind in own])


def _of_kind(hand: Hand, made: Approaches, kind: Kind) -> Approaches:
    """The same hands as grasps of a kind; the thumb takes no part in a hook."""
    limits = made.limits.copy()
    if kind == "hook" and hand.thumb >= 0:
        limits[:, hand.thumb] = RELAXED
    return replace(made, kinds=(kind,) * len(made.kinds), limits=limits)


def _palms_on(hand: Hand, bar: FloatArray, loop: Loop) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Placements, and ways to approach in: the palm on a bar, from all sides and at several heights."""
    for roll, tilt, side in itertools.product(ROLLS, TILTS, (1.0, -1.0)):
        turn, out = _turned(hand, bar[3:6], loop.way, roll, tilt, side)
        for along, shift in itertools.product(ALONG, SHIFTS):
            held = hand.description.palm.point + along * hand.length * hand.frame[:, 1]
            yield _laid(turn, held, bar[:3] - bar[6] * out + shift * hand.length * bar[3:6]), out


def _bones_on(hand: Hand, bar: FloatArray, loop: Loop) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The same with neighbouring fingers straight through a loop, one of their bones on the bar from within: a loop
    may be too narrow for a bent finger. They stay where they are."""
    outwards = bar[:3] - loop.middle
    level = loop.middle + (outwards - (outwards @ bar[3:6]) * bar[3:6])  # of the bar, as high as the loop's middle
    rolled = np.arctan2(outwards @ np.cross(bar[3:6], loop.way), outwards @ loop.way)
    fingers = [d for d in range(len(hand.bones) - 1) if d != hand.thumb]
    for bone, (first, last) in itertools.product((0, 1), itertools.combinations(range(len(fingers)), 2)):
        chosen = [int(hand.firsts[d]) + bone for d in fingers[first : last + 1]]
        if any(b >= hand.bones[d + 1] for b, d in zip(chosen, fingers[first : last + 1], strict=True)):
            continue
        rest = hand.rig.rest_world[hand.joints[chosen]]
        middles = np.einsum("bij,bj->bi", rest[:, :3, :3], hand.capsules[chosen].mean(axis=1)) + rest[:, :3, 3]
        held = middles.mean(axis=0) + hand.radii[chosen].mean() * hand.frame[:, 0]
        for roll, tilt, side in itertools.product(ROLLED, TILTS, (1.0, -1.0)):
            turn, out = _turned(hand, bar[3:6], loop.way, rolled + roll, tilt, side)
            yield _laid(turn, held, level - (bar[6] + FREE * hand.length) * out), np.zeros(3)


def _turned(
    hand: Hand, axis: FloatArray, way: FloatArray, roll: float, tilt: float, side: float
) -> tuple[FloatArray, FloatArray]:
    """(3, 3) a hand's turn with fingers across an axis, and (3,) where its palm looks: `way` rolled about it."""
    first = way - (way @ axis) * axis
    first = first / np.linalg.norm(first)
    out = np.cos(roll) * first + np.sin(roll) * np.cross(axis, first)
    across = side * (np.cos(tilt) * np.cross(axis, out) + np.sin(tilt) * axis)
    return np.stack([out, across, np.cross(out, across)], axis=1) @ hand.frame.T, out


def _laid(turn: FloatArray, held: FloatArray, at: FloatArray) -> FloatArray:
    """(4, 4) of a hand that is turned so, with its point `held` in rig space at a place."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, at - turn @ held
    return pose


def _threading(request: GraspRequest, made: Approaches, loop: Loop) -> Approaches | None:
    """Those of some approaches with the most fingers through a loop, moved so that none is deep in the object.
    Fingers that then hold nothing take no part."""
    hand = request.hand
    closed = _closed(request, made)
    made = replace(made, placed=closed.placed, ways=np.zeros_like(made.ways))
    made = made[_best(hand, closed, loop)]
    for _ in range(EASED):
        made = _eased(request, made)
    closed = _closed(request, made)
    rows = _best(hand, closed, loop)
    holds = _through(hand, closed, loop) | (closed.clear < FOUND * hand.length)
    holds[:, hand.thumb] |= hand.thumb >= 0
    limits = np.where(holds, made.limits, np.minimum(made.limits, OTHERS))
    return replace(made, limits=limits)[rows] if len(rows) else None


def _best(hand: Hand, closed: Closed, loop: Loop) -> IntArray:
    """Closed hands with two fingers or more through a loop, or one where none has two, the best first: many fingers
    through it, and not deep in the object."""
    fingers = np.arange(len(hand.bones) - 1) != hand.thumb
    clear = np.minimum(np.where(fingers, closed.clear, np.inf).min(axis=1), closed.palm) / hand.length
    count = np.where(np.isfinite(closed.travel) & (clear > -SUNK), _through(hand, closed, loop).sum(axis=1), 0)
    rows = np.flatnonzero((count > 0) & (count >= min(2, count.max(initial=0))))
    worth = count[rows] + JAMMED * np.minimum(clear[rows] + EASY, 0.0)
    return np.asarray(rows[np.argsort(-worth, kind="stable")][:MOST])


def _closed(request: GraspRequest, made: Approaches) -> Closed:
    return close_hands(
        request.hand.quick, request.field, made.placed, made.ways, made.bars, made.curls, made.limits
    )


def _through(hand: Hand, closed: Closed, loop: Loop) -> BoolArray:
    """(N, D) which fingers of closed hands go through a loop."""
    frames = hand.frames(closed.placed, closed.angles, closed.turns)
    return crossed(hand, frames, loop) & (np.arange(len(hand.bones) - 1) != hand.thumb)


def _eased(request: GraspRequest, made: Approaches) -> Approaches:
    """Hands moved as far out of the object as the deepest skin of palm and fingers is in it once they are closed,
    the way that it looks on average."""
    hand, closed = request.hand, _closed(request, made)
    fingers = slice(hand.probe_starts[hand.thumb + 1] if hand.thumb >= 0 else 0, None)
    bones = hand.probe_bones[fingers]
    frames = hand.frames(closed.placed, closed.angles, closed.turns)[:, bones]  # (N, P, 4, 4)
    skin = np.einsum("npij,pj->npi", frames[:, :, :3, :3], hand.probes[fingers]) + frames[:, :, :3, 3]
    palm = np.einsum("nij,pj->npi", made.placed[:, :3, :3], hand.tested) + made.placed[:, None, :3, 3]
    points = np.concatenate([skin, palm], axis=1)
    distance, outwards = request.field.sample(points.reshape(-1, 3))
    depth = np.maximum(-distance.reshape(points.shape[:2]) - EASY * hand.length, 0.0)
    mean = (
        np.einsum("np,npi->ni", depth, outwards.reshape(points.shape))
        / np.maximum(depth.sum(axis=1), 1e-12 * hand.length)[:, None]
    )
    placed = made.placed.copy()
    placed[:, :3, 3] += depth.max(axis=1, initial=0.0)[:, None] * mean
    return replace(made, placed=placed)


def _bar(request: GraspRequest, loop: Loop, at: FloatArray) -> FloatArray:
    """(7,) middle, axis and radius of what is round a loop at the place that is to be held."""
    nearest = int(np.linalg.norm(loop.rim - at, axis=1).argmin())
    axis = loop.rim[(nearest + 1) % len(loop.rim)] - loop.rim[nearest - 1]
    axis = axis / np.linalg.norm(axis)
    out = np.cross(axis, loop.way)
    out = out * np.sign(out @ (loop.rim[nearest] - loop.middle))
    length, locator = request.hand.length, Locator.of(request.mesh)
    start = loop.rim[nearest] + 1e-3 * length * out
    thick = locator.cast(start[None], out[None])
    middle = start + 0.5 * float(thick.distance[0]) * out if thick.found[0] else start
    sides = locator.cast(np.tile(middle, (2, 1)), np.stack([loop.way, -loop.way]))
    wide = float(sides.distance.sum()) if sides.found.all() else 0.0
    radius = 0.5 * max(2.0 * float(np.linalg.norm(middle - start)), min(wide, WIDE * length), 0.02 * length)
    return np.concatenate([middle, axis, [radius]])


def through_two(request: GraspRequest) -> Approaches | None:
    """Precision grasps with the thumb through one loop and one or two fingers through another, near the place that
    is to be held; None where there are none."""
    hand, at = request.hand, request.at
    if at is None or hand.thumb != 0 or hand.first_finger < 0:
        return None
    loops = loops_near(request.mesh, hand.length, at)
    if len(loops) < 2:
        return None
    made = _laid_in(hand, loops[:2])
    closed = close_hands(hand, request.field, made.placed, made.ways, made.bars, made.curls, made.limits)
    inside = _through_both(hand, loops[:2], closed)
    clear = np.minimum(closed.clear.min(axis=1), closed.palm) > -SUNK * hand.length
    kept = np.flatnonzero(inside & clear)
    return made[kept] if len(kept) else None


def _through_both(hand: Hand, loops: tuple[Loop, ...], closed: Closed) -> BoolArray:
    """(N,) which closed hands have the thumb through one of two loops and a finger through the other."""
    frames = hand.frames(closed.placed, closed.angles, closed.turns)
    through = [crossed(hand, frames, loop) for loop in loops]
    one, other = ((a[:, 0] & b[:, 1:].any(axis=1)) for a, b in (through, through[::-1]))
    return np.asarray(one | other)


def _laid_in(hand: Hand, loops: tuple[Loop, ...]) -> Approaches:
    """Hands whose thumb and fingers are as far apart as two loops, side by side, laid into them from both sides."""
    thumbs = [(start, *_last(hand, 0, start, 0.0, 1)) for start in range(int(hand.start_counts[0]))]
    fingers = len(hand.bones) - 2
    apart = float(np.linalg.norm(loops[1].middle - loops[0].middle))
    tried = []
    for chosen, curl, back in itertools.product(TOGETHER, CURLS, (1, 2)):
        if max(chosen) >= fingers:
            continue
        own = [_last(hand, 1 + d, 0, curl, back) for d in chosen]
        at, way = np.mean([each[0] for each in own], axis=0), np.mean([each[1] for each in own], axis=0)
        way = way / np.linalg.norm(way)
        for start, thumb, along in thumbs:
            gap = at - thumb
            line = gap / np.linalg.norm(gap)
            askew = 1.0 - along @ way + (line @ along) ** 2 + (line @ way) ** 2
            off = abs(float(np.linalg.norm(gap)) - apart) / hand.length + SIDEWAYS * float(askew)
            tried.append((off + float(hand.start_prices[0, start]), chosen, curl, thumb, along, at, way))
    tried.sort(key=lambda each: each[0])
    placed, curls, limits = [], [], []
    for _, chosen, curl, thumb, along, at, way in tried[: TRIED // 2]:
        axes = _axes(at - thumb, along + way)
        for first, second in (loops, loops[::-1]):
            for side in (1.0, -1.0):
                turn = _axes(second.middle - first.middle, side * loops[0].way) @ axes.T
                pose = np.eye(4)
                pose[:3, :3] = turn
                pose[:3, 3] = 0.5 * (first.middle + second.middle) - turn @ (0.5 * (at + thumb))
                placed.append(pose)
                curls.append(curl)
                limits.append([1.0, *(1.0 if d in chosen else OTHERS for d in range(fingers))])
    n = len(placed)
    kinds = tuple[Kind, ...](["precision"] * n)
    return Approaches(
        np.array(placed), kinds, np.zeros((n, 3)), np.zeros((n, 7)), np.array(curls), np.array(limits)
    )


def _last(hand: Hand, digit: int, start: int, curl: float, back: int) -> tuple[FloatArray, FloatArray]:
    """The middle (3,) and the way (3,) of a bent digit's last bone, or the one `back` from its end."""
    bone = max(int(hand.bones[digit + 1]) - back, int(hand.bones[digit]))
    frame = frame_of(hand, digit, start, curl, bone)
    ends = hand.capsules[bone] @ frame[:, :3].T + frame[:, 3]
    way = ends[1] - ends[0]
    return ends.mean(axis=0), way / max(float(np.linalg.norm(way)), 1e-30)


def _axes(line: FloatArray, way: FloatArray) -> FloatArray:
    """(3, 3) columns: along a line, towards a way across it, and the third."""
    first = line / np.linalg.norm(line)
    second = way - (way @ first) * first
    second = second / max(float(np.linalg.norm(second)), 1e-30)
    return np.stack([first, second, np.cross(first, second)], axis=1)
