"""The minimiser of a convex quadratic within a box, exactly: what a bounded step is.

Most boxes are solved in four rounds of block principal pivoting (Judice and Pires, Computers & Operations
Research 21, 1994): guess which variables are at a limit, solve for the others, and turn every guess that its sign
contradicts. Where that goes in circles, an active set (Stark and Parker, Computational Statistics 10, 1995) takes
over from the last guess: slower, it descends all the way and ends. Cheaper rules that only ever add to what is held
stop short of the minimum, or climb.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray

BOLD_ROUNDS = 12
ROUNDING = 1e-12  # of the largest slope: what counts as none


def box_minimum(matrix: FloatArray, gradient: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """(d,) the s in lower <= s <= upper with the least g.s + s.A s / 2, for A positive definite.

    lower, upper: (d,) with 0 between them, infinite where nothing limits.
    """
    rounding = ROUNDING * float(np.abs(gradient).max(initial=0.0))
    held = np.where((lower >= 0.0) & (gradient > 0.0), -1, np.where((upper <= 0.0) & (gradient < 0.0), 1, 0))
    for _ in range(BOLD_ROUNDS):
        free = held == 0
        step = np.where(free, 0.0, np.where(held < 0, lower, upper))
        step += _newton(matrix, gradient + matrix @ step, free)
        slope = gradient + matrix @ step
        below, above = free & (step < lower), free & (step > upper)
        wrong = below | above | ((held < 0) & (slope < -rounding)) | ((held > 0) & (slope > rounding))
        if not wrong.any():
            return step
        held[wrong] = (above.astype(int) - below.astype(int))[wrong]
    return _by_active_set(matrix, gradient, lower, upper, np.clip(step, lower, upper), rounding)


def _by_active_set(
    matrix: FloatArray,
    gradient: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    step: FloatArray,
    rounding: float,
) -> FloatArray:
    """The same from any step within the box: one limit is met, or left, at a time."""
    free = (step > lower) & (step < upper)
    for _ in range(10 * len(step)):
        move = _newton(matrix, gradient + matrix @ step, free)
        room = np.divide(
            np.where(move < 0.0, lower - step, upper - step),
            move,
            out=np.full(len(move), np.inf),
            where=move != 0.0,
        )
        share = min(1.0, float(room.min(initial=1.0)))
        met = free & (room <= share) & (share < 1.0)
        step = np.where(met, np.where(move < 0.0, lower, upper), step + share * move)
        free &= ~met
        if met.any():
            continue
        slope = gradient + matrix @ step
        inward = np.where(step <= lower, -slope, np.where(step >= upper, slope, 0.0)) * ~free * (lower < upper)
        if inward.max(initial=0.0) <= rounding:
            break
        free[int(inward.argmax())] = True
    return np.clip(step, lower, upper)


def _newton(matrix: FloatArray, slope: FloatArray, free: BoolArray) -> FloatArray:
    """(d,) the step of the free variables that ends their slope; the others stay."""
    index = np.flatnonzero(free)
    move = np.zeros(len(slope))
    move[index] = np.linalg.solve(matrix[np.ix_(index, index)], -slope[index])
    return move
