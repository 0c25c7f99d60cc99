"""Thumb and fingers through two loops, as scissors are held: the hand is posed for it, then laid in."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from contact_builtins.grasps.opposition import frame_of
from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.raycast import Locator
from contact_core.grasping.closing import Closed, close_hands
from contact_core.grasping.facts import through_loops
from contact_core.grasping.filled import filled
from contact_core.grasping.hand import Hand
from contact_core.grasping.slots import Approaches, GraspRequest, Kind

FILLED = 0.2  # hand lengths: what a ball of this radius does not reach is a hollow
LEAST = 20  # cells of a hollow that a digit may go through
WIDEST, THROUGH = 0.4, 0.3  # hand lengths: how far the rim of a loop may be, and how far it is free both ways
NEAR = 0.3  # hand lengths from the place that is to be held to the middle of the nearest loop
SPOKES = 16
CURLS = (0.15, 0.25, 0.35, 0.45, 0.55)  # of their room, that fingers are bent
TOGETHER = ((0,), (0, 1), (1,))  # of the fingers beside the thumb, those that go through one loop
SIDEWAYS = 0.08  # hand lengths that digits are worth which do not go straight through
OTHERS = 0.45  # of their room, that the other fingers are bent
TRIED = 80
SUNK = 0.03  # hand lengths of skin in the object that spoil it


@dataclass(frozen=True, eq=False)
class Loop:
    """middle: (3,). way: (3,) unit, through it. Object's space."""

    middle: FloatArray
    way: FloatArray


def loops_of(request: GraspRequest, solid: DistanceField) -> list[Loop]:
    """Hollows that a rim surrounds and through which the way is free. solid: the object with hollows filled."""
    field, length = request.field, request.hand.length
    marked, count = ndimage.label((field.values > 0.0) & (solid.values < 0.0))
    locator, found = Locator.of(request.mesh), []
    for number in range(1, count + 1):
        cells = np.argwhere(marked == number)
        if len(cells) < LEAST:
            continue
        points = field.origin + cells * field.spacing
        middle = points.mean(axis=0)
        ways = np.linalg.eigh(np.cov(points.T))[1]  # a loop is flat: least far along its way
        turn = (np.arange(SPOKES) * 2.0 * np.pi / SPOKES)[:, None]
        spokes = np.cos(turn) * ways[:, 1] + np.sin(turn) * ways[:, 2]
        rim = locator.cast(np.tile(middle, (SPOKES, 1)), spokes, max_distance=WIDEST * length).found
        both = locator.cast(np.tile(middle, (2, 1)), np.stack([ways[:, 0], -ways[:, 0]]), THROUGH * length).found
        if rim.all() and not both.any():
            found.append(Loop(middle, ways[:, 0]))
    return found


def through_two(request: GraspRequest) -> Approaches | None:
    """Precision grasps with the thumb through one loop and one or two fingers through another, near the place that
    is to be held; None where there are none."""
    hand, at = request.hand, request.at
    if at is None or hand.thumb != 0 or hand.first_finger < 0:
        return None
    solid = filled(request.field, FILLED * hand.length)
    loops = loops_of(request, solid)
    loops.sort(key=lambda loop: float(np.linalg.norm(loop.middle - at)))
    if len(loops) < 2 or np.linalg.norm(loops[0].middle - at) > NEAR * hand.length:
        return None
    made = _laid_in(hand, loops[:2])
    closed = close_hands(hand, request.field, made.placed, made.ways, made.bars, made.curls, made.limits)
    inside = _through_both(request, solid, loops[:2], closed)
    clear = np.minimum(closed.clear.min(axis=1), closed.palm) > -SUNK * hand.length
    kept = np.flatnonzero(inside & clear)
    return made[kept] if len(kept) else None


def _through_both(request: GraspRequest, solid: DistanceField, loops: list[Loop], closed: Closed) -> BoolArray:
    """(N,) which closed hands have the thumb through one of two loops and a finger through the other."""
    frames = request.hand.frames(closed.placed, closed.angles, closed.turns)
    apart = float(np.linalg.norm(loops[0].middle - loops[1].middle))
    through = [
        through_loops(request.hand, frames, request.field, solid, loop.middle, 0.5 * apart) for loop in loops
    ]
    one, other = ((a[:, 0] & b[:, 1:].any(axis=1)) for a, b in (through, through[::-1]))
    return np.asarray(one | other)


def _laid_in(hand: Hand, loops: list[Loop]) -> Approaches:
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
