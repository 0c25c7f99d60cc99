"""The figures of a motion frame by frame: what curves over time show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.motion.depth import HELD, deepest_skin
from contact_core.motion.problem import MotionProblem
from contact_core.motion.skate import ObjectGaps
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.solve.penetration import Solids


@dataclass(frozen=True, eq=False)
class MotionSeries:
    """By frame (n,); NaN where there is nothing to measure.

    errors: by pair, the mean distance of its points while it is on, world units. skates: by pair, how fast its
    centre slips over the object to a frame, world units/s. acceleration: the largest of any angle, root apart,
    rad/s^2. depth: of the deepest skin, world units; NaN throughout where it was not measured.
    """

    frames: tuple[float, ...]
    errors: Mapping[str, FloatArray]
    skates: Mapping[str, FloatArray]
    acceleration: FloatArray
    depth: FloatArray

    @property
    def skate(self) -> FloatArray:
        """(n,) of the pair that slips fastest."""
        return _largest(self.skates, len(self.frames))

    @property
    def error(self) -> FloatArray:
        """(n,) of the pair that is farthest off."""
        return _largest(self.errors, len(self.frames))


def motion_series(
    motion: MotionProblem,
    thetas: FloatArray,
    *,
    solids: Solids | None = None,
    progress: Progress = NO_PROGRESS,
) -> MotionSeries:
    """The figures of thetas (n, d). solids: as of the penetration term; an empty mapping measures no depth.

    Raises InvalidInput for thetas of another shape, Cancelled from progress.
    """
    if thetas.shape != motion.pinned.shape:
        raise InvalidInput(f"thetas of this motion have the shape {motion.pinned.shape}, but got {thetas.shape}.")
    n = len(motion.frames)
    names = list(dict.fromkeys(contact.name for problem in motion.problems for contact in problem.contacts))
    errors, skates = ({name: np.full(n, np.nan) for name in names} for _ in range(2))
    depth, before = np.full(n, np.nan), dict[str, FloatArray]()
    for row, (problem, theta) in enumerate(zip(motion.posed, thetas, strict=True)):
        progress.tell(row / n, f"frame {motion.frames[row]:g}")
        state, now = problem.state(theta), dict[str, FloatArray]()
        gaps = ObjectGaps(problem).values(state)
        for contact in problem.contacts:
            if contact.gain < HELD or not len(contact.weights) or contact.hold == "direction":
                continue
            own = gaps[problem.pairs.rows[contact.name]]
            errors[contact.name][row] = np.linalg.norm(own, axis=1).mean()
            now[contact.name] = own.mean(axis=0)
            if contact.name in before:
                gap = motion.clock.gaps[row - 1]
                skates[contact.name][row] = np.linalg.norm(now[contact.name] - before[contact.name]) / gap
        before = now
        if solids is None or len(solids):
            depth[row] = deepest_skin(problem, state, solids)
    return MotionSeries(motion.frames, errors, skates, _accelerations(motion, thetas), depth)


def _accelerations(motion: MotionProblem, thetas: FloatArray) -> FloatArray:
    """(n,)"""
    problem, result = motion.problems[0], np.full(len(thetas), np.nan)
    angles = ~problem.is_translation & ~problem.is_root
    if len(thetas) > 2 and angles.any():
        found = motion.clock.accelerations(motion.chart.steps(thetas).values)
        result[1:-1] = np.abs(found[:, angles]).max(axis=1)
    return result


def _largest(by_pair: Mapping[str, FloatArray], n: int) -> FloatArray:
    """(n,) over pairs, NaN where none is a number."""
    values = np.array([np.where(np.isnan(each), -np.inf, each) for each in by_pair.values()]).reshape(-1, n)
    found = values.max(axis=0, initial=-np.inf)
    return np.where(np.isfinite(found), found, np.nan)
