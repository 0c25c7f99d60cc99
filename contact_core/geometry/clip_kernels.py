"""Kernels that clip the ears of a polygon in its plane. Its corners are a list by `before` and `after`, (k,) each.

Angles are compared in steps: those of a regular polygon are alike but for rounding, which differs with processors.
"""

from __future__ import annotations

import math

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import inner, kernel

_STEP = 1e-9  # rad


@kernel
def clip(
    flat: FloatArray,
    before: IntArray,
    after: IntArray,
    alive: IntArray,
    turn: FloatArray,
    worth: FloatArray,
    flat_turn: float,
    cut: IntArray,
) -> int:
    """Write the triangles (k - 2, 3) of a polygon as numbers of its corners; 1 where every cut was a true ear.

    flat: (k, 2) counter-clockwise. alive: (k,) 1. turn, worth: (k,) room. flat_turn: what counts as no turn at all.
    """
    complete = 1
    for v in range(len(flat)):
        turn[v] = _turn(v, before, after, flat)
    for v in range(len(flat)):
        worth[v] = _worth(v, before, after, flat, turn, alive)
    for step in range(len(flat) - 2):
        ear = 0
        for v in range(1, len(flat)):
            if worth[v] > worth[ear]:
                ear = v
        if worth[ear] < 0.0:  # no ear is left: cut where it turns most, and say so
            ear = -1
            for v in range(len(flat)):
                if alive[v] == 1 and (ear < 0 or turn[v] > turn[ear]):
                    ear = v
            if not abs(turn[ear]) <= flat_turn:
                complete = 0
        left, right = before[ear], after[ear]
        cut[step, 0], cut[step, 1], cut[step, 2] = left, ear, right
        after[left] = right
        before[right] = left
        alive[ear] = 0
        worth[ear] = -math.inf
        turn[left] = _turn(left, before, after, flat)
        turn[right] = _turn(right, before, after, flat)
        worth[left] = _worth(left, before, after, flat, turn, alive)
        worth[right] = _worth(right, before, after, flat, turn, alive)
    return complete


@inner
def _turn(v: int, before: IntArray, after: IntArray, flat: FloatArray) -> float:
    """More than 0 where the polygon is convex at a corner."""
    a, c = before[v], after[v]
    return (flat[v, 0] - flat[a, 0]) * (flat[c, 1] - flat[v, 1]) - (flat[v, 1] - flat[a, 1]) * (
        flat[c, 0] - flat[v, 0]
    )


@inner
def _worth(v: int, before: IntArray, after: IntArray, flat: FloatArray, turn: FloatArray, alive: IntArray) -> float:
    """Smallest angle (rad) of the triangle that clipping corner v would cut; -1 when v is no ear."""
    if turn[v] <= 0.0:
        return -1.0
    i, k = before[v], after[v]
    ax, ay, bx, by, cx, cy = flat[i, 0], flat[i, 1], flat[v, 0], flat[v, 1], flat[k, 0], flat[k, 1]
    for q in range(len(flat)):  # only corners that do not turn left can lie in an ear
        if alive[q] == 0 or turn[q] > 0.0 or q in (i, v, k):
            continue
        x, y = flat[q, 0], flat[q, 1]
        if (bx - ax) * (y - ay) - (by - ay) * (x - ax) < 0.0 or (cx - bx) * (y - by) - (cy - by) * (x - bx) < 0.0:
            continue
        if (ax - cx) * (y - cy) - (ay - cy) * (x - cx) < 0.0:
            continue
        if not ((x == ax and y == ay) or (x == bx and y == by) or (x == cx and y == cy)):  # the lips of a slit
            return -1.0
    least = min(
        _angle(bx - ax, by - ay, cx - bx, cy - by),
        _angle(cx - bx, cy - by, ax - cx, ay - cy),
        _angle(ax - cx, ay - cy, bx - ax, by - ay),
    )
    return math.floor(least / _STEP + 0.5) * _STEP


@inner
def _angle(ux: float, uy: float, vx: float, vy: float) -> float:
    """Between an edge and the one after it, inside the triangle."""
    return math.atan2(ux * vy - uy * vx, -(ux * vx + uy * vy))
