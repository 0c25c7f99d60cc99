"""Clips moved as a whole to where their contacts are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.motion.band import BlockBand
from contact_core.motion.grounding import _add_smoothness, grounded
from contact_core.motion.problem import MotionProblem, MotionWeights
from contact_core.motion.steps import Clock
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.testing.motions import molded


def clip(wander: float) -> tuple[MotionProblem, np.ndarray, np.ndarray, np.ndarray]:
    """A motion whose contacts hold throughout, the thetas that meet them, and the same wandering over the floor."""
    motion = molded(1.0, joints=3)
    motion = replace(motion, problems=(motion.problems[0],) * len(motion.frames))
    problem = motion.problems[0]
    roots = np.flatnonzero(problem.is_root & problem.is_translation)
    held = np.tile(LevenbergMarquardt().solve(problem).theta, (len(motion.frames), 1))
    held = grounded(motion.problems, held, motion.clock, 1e-9)  # its best place
    away = held.copy()
    phase = np.linspace(0.0, 4.0, len(held))[:, None] + np.arange(len(roots))
    away[:, roots] += wander * problem.scale[roots] * np.sin(phase)
    return motion, held, away, roots


@pytest.mark.parametrize("wander", [0.01, 0.1])
def test_what_wanders_comes_back_to_its_contacts(wander: float) -> None:
    motion, held, away, roots = clip(wander)
    back = grounded(motion.problems, away, motion.clock, MotionWeights().acceleration)
    off, was = (np.abs(thetas - held)[:, roots].max() for thetas in (back, away))
    assert off < 0.05 * was
    others = np.setdiff1d(np.arange(held.shape[1]), roots)
    assert np.array_equal(back[:, others], away[:, others])


def test_where_nothing_holds_it_goes_smoothly_from_one_contact_to_the_next() -> None:
    motion, held, away, roots = clip(0.0)
    n = len(held)
    off = tuple(replace(c, gain=0.0) for c in motion.problems[0].contacts)
    first, last = n // 4, 3 * n // 4
    problems = tuple(
        replace(p, contacts=off) if first <= row < last else p for row, p in enumerate(motion.problems)
    )
    scale = problems[0].scale[roots]
    away[n // 2 :, roots] += 0.1 * scale  # only the second contact is off
    back = grounded(problems, away, motion.clock, 3e-4)
    moved = (back - away)[:, roots] / scale
    assert np.abs(moved[0]).max() < 0.02 and np.abs(moved[-1] + 0.1).max() < 0.02
    steps = np.abs(np.diff(moved, axis=0)).max(axis=1)
    assert steps.max() < 4.0 * 0.1 / (last - first)  # no leap between them


def test_without_contacts_nothing_moves() -> None:
    motion, held, away, _ = clip(0.05)
    off = tuple(replace(c, gain=0.0) for c in motion.problems[0].contacts)
    problems = tuple(replace(p, contacts=off) for p in motion.problems)
    assert np.array_equal(grounded(problems, away, motion.clock, 3e-4), away)
    assert held.shape == away.shape


@settings(max_examples=20)
@given(n=st.integers(1, 8), seed=st.integers(0, 1000))
def test_smoothness_is_the_integral_of_squared_accelerations(n: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    clock = Clock(np.cumsum(random.uniform(0.02, 0.1, n)))
    matrix, values = BlockBand.zeros(n, 2), random.normal(size=(n, 2))
    _add_smoothness(matrix, clock, 0.7)
    wanted = 0.0
    if n > 2:
        accelerations = clock.accelerations(np.diff(values, axis=0))
        wanted = 0.7 * float(clock.spans[1:-1] @ (accelerations**2).sum(axis=1))
    assert 0.5 * float((values * matrix.times(values)).sum()) == pytest.approx(wanted, rel=1e-9, abs=1e-9)
