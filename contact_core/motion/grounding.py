"""A clip moved as a whole to where its contacts are, before it is followed.

What wanders in captured motion is mostly where the body stands. Corrected by the joints alone, a wandering body
bends to keep its feet in place. So the root is put right first (Kovar, Schreiner, Gleicher: Footskate cleanup for
motion capture editing, 2002), by the translations that bring together what holds, smooth over time:

    min  sum_f T_f sum_i a_i |g_fi + J_fi d_f|^2 / l^2  +  w_a sum_f T_f |d_f''|^2  +  w_0 sum_f T_f |d_f|^2

over translations d_f of the roots, with the gaps g of the clip. Where nothing holds they go smoothly from one
contact to the next.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.motion.band import BlockBand, bounded_minimum
from contact_core.motion.steps import Clock
from contact_core.solve.problem import PoseProblem

STILL = 1e-6  # w_0: what holds nowhere stays where it is


def grounded(
    problems: tuple[PoseProblem, ...], thetas: FloatArray, clock: Clock, acceleration: float
) -> FloatArray:
    """Thetas (n, d) with their roots moved. acceleration: w_a, as of `MotionWeights`."""
    problem = problems[0]
    roots = np.flatnonzero(problem.is_root & problem.is_translation)
    if not len(roots):
        return thetas
    gradient, matrix = _pull(problems, thetas, clock, roots)
    _add_smoothness(matrix, clock, acceleration)
    free = np.full(gradient.shape, np.inf)
    moved = bounded_minimum(matrix, 0.0, gradient, -free, free)
    if moved is None:  # nothing holds it well enough
        return thetas
    result = thetas.copy()
    result[:, roots] += moved * problem.scale[roots]
    return result


def _pull(
    problems: tuple[PoseProblem, ...], thetas: FloatArray, clock: Clock, roots: IntArray
) -> tuple[FloatArray, BlockBand]:
    """Gradient (n, m) and matrix of the contacts' part, in natural units of the roots' dofs (m,)."""
    gradient, matrix = np.zeros((len(thetas), len(roots))), BlockBand.zeros(len(thetas), len(roots))
    scale = problems[0].scale[roots]
    for row, (problem, theta, time) in enumerate(zip(problems, thetas, clock.spans, strict=True)):
        pairs, state = problem.pairs, problem.state(theta)
        matrix.own[row] += 2.0 * time * STILL * np.eye(len(roots))
        if pairs.weights.any():
            moved = state.jacobian(pairs.gap)[:, :, roots] * scale / problem.unit  # (k, 3, m)
            gap = state.vectors(pairs.gap) / problem.unit
            gradient[row] = 2.0 * time * np.einsum("k,kim,ki->m", pairs.weights, moved, gap)
            matrix.own[row] += 2.0 * time * np.einsum("k,kim,kin->mn", pairs.weights, moved, moved)
    return gradient, matrix


def _add_smoothness(matrix: BlockBand, clock: Clock, weight: float) -> None:
    """Add the second derivatives of w sum_f T_f |d_f''|^2, where d_f'' are divided differences."""
    gaps, spans = clock.gaps, clock.spans
    one = np.eye(matrix.own.shape[1])
    for f in range(1, len(spans) - 1):
        before, after = 1.0 / (gaps[f - 1] * spans[f]), 1.0 / (gaps[f] * spans[f])
        row = np.array([before, -before - after, after])
        block = 2.0 * weight * spans[f] * np.outer(row, row)
        for k in range(3):
            matrix.own[f - 1 + k] += block[k, k] * one
        matrix.next[f - 1] += block[1, 0] * one
        matrix.next[f] += block[2, 1] * one
        matrix.after[f - 1] += block[2, 0] * one
