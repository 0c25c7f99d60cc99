"""Sequences: the object moves and grows, the pose follows from frame to frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.errors import Cancelled, InvalidInput
from contact_core.progress import CallbackProgress
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.sequence import solve_sequence
from contact_core.testing import rigs


def moving(count: int) -> list[tuple[float, PoseProblem]]:
    """A planted tentacle whose mold turns and grows a little each frame."""
    problem, _ = rigs.planted(rigs.tentacle(6, rigs.limited_freedom), 1, contacts=100)
    result = []
    for frame in range(count):
        turn = 0.05 * frame
        placed = np.eye(4)
        placed[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        placed[:3, :3] *= 1.0 + 0.004 * frame
        mold = replace(problem.bodies[1], world_from_rig=placed)
        result.append((float(frame), replace(problem, bodies=(problem.bodies[0], mold))))
    return result


def test_each_frame_is_met_and_follows_the_last() -> None:
    solved = solve_sequence(LevenbergMarquardt(), moving(6))
    assert solved.frames == tuple(map(float, range(6)))
    for solution in solved.solutions:
        assert rigs.mean_gap(solution.problem, solution.theta) < 0.015
    angles = np.array([s.theta[~s.problem.is_translation & ~s.problem.is_root] for s in solved.solutions])
    assert np.abs(np.diff(angles, axis=0)).max() < 0.2  # no joint jumps
    later = [len(s.trace) for s in solved.solutions[1:]]
    assert max(later) < len(solved.solutions[0].trace)  # a warm start is cheaper
    assert solved.keys("tentacle").frames == solved.frames


def test_a_stopped_sequence_keeps_what_is_done() -> None:
    told = list[float | None]()

    def stop(fraction: float | None, text: str) -> None:
        told.append(fraction)
        if text.startswith("frame 2"):
            raise Cancelled("two are enough.")

    solved = solve_sequence(LevenbergMarquardt(), moving(6), progress=CallbackProgress(stop))
    assert len(solved.frames) == 2
    assert told == sorted(told, key=lambda fraction: fraction or 0.0) and 1 / 3 < (told[-1] or 0.0) < 1 / 2
    with pytest.raises(InvalidInput, match="rise"):
        solve_sequence(LevenbergMarquardt(), [*moving(2), *moving(1)])
