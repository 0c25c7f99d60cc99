"""What a motion is worth: contact, skate, smoothness, depth and keys, in figures per second."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.motion.depth import HELD, deepest_skin
from contact_core.motion.problem import MotionProblem
from contact_core.motion.reduction import Reduction
from contact_core.motion.skate import ObjectGaps
from contact_core.solve.penetration import Solids
from contact_core.solve.state import PoseState


@dataclass(frozen=True)
class PairOverTime:
    """One contact pair while it is on. mean, p95: distance of paired points over all frames (world units). worst:
    the largest mean distance of a frame, and worst_frame. skate_max, skate_rms: speed of its centre over the object
    (world units per second; targets that slide on purpose take it along)."""

    frames: int
    mean: float
    p95: float
    worst: float
    worst_frame: float
    skate_max: float
    skate_rms: float


@dataclass(frozen=True)
class MotionReport:
    """A motion in figures. pairs: by name, those whose points are ever held.

    joint_acceleration: peak of any angle, rad/s^2, root apart. pad_acceleration: peak of any contact's centre on
    the manipulator, world units/s^2; jerk_rms: root mean square of its third derivative, world units/s^3.
    penetration_held, penetration_transit: the deepest skin at frames with and without any contact on, world units.
    largest_step: the farthest that any joint moves in a frame, world units, to step_frame; pop: that step over the
    larger of the steps of the same joint before and after it (about 1 in smooth motion; infinite out of rest).
    keys: how many, and key_error: how far the skin is off with them, by body (surface units).
    """

    pairs: Mapping[str, PairOverTime]
    joint_acceleration: float
    pad_acceleration: float
    jerk_rms: float
    penetration_held: float
    penetration_transit: float
    largest_step: float
    step_frame: float
    pop: float
    keys: Mapping[str, int]
    key_error: Mapping[str, float]


def motion_report(
    motion: MotionProblem,
    thetas: FloatArray,
    *,
    solids: Solids | None = None,
    reductions: Mapping[str, Reduction] | None = None,
) -> MotionReport:
    """The figures of thetas (n, d). solids: as of the penetration term; an empty mapping measures no depth.
    reductions: of the bodies that were reduced. Raises InvalidInput for thetas of another shape."""
    if thetas.shape != motion.pinned.shape:
        raise InvalidInput(f"thetas of this motion have the shape {motion.pinned.shape}, but got {thetas.shape}.")
    states = [problem.state(theta) for problem, theta in zip(motion.posed, thetas, strict=True)]
    pads = _pads(motion, states)
    clock, problem = motion.clock, motion.problems[0]
    steps = motion.chart.steps(thetas).values
    angles = ~problem.is_translation & ~problem.is_root
    depth = _depths(motion, states, solids)
    step, step_frame, pop = _largest_step(motion, states)
    held = np.array([any(c.gain >= HELD for c in p.contacts) for p in motion.problems])
    return MotionReport(
        pairs=_pairs(motion, states),
        joint_acceleration=_peak(clock.accelerations(steps)[:, angles]) if len(steps) > 1 else 0.0,
        pad_acceleration=_peak_length(_derivatives(pads, clock.seconds, 2)),
        jerk_rms=_rms_length(_derivatives(pads, clock.seconds, 3)),
        penetration_held=float(depth[held].max(initial=0.0)),
        penetration_transit=float(depth[~held].max(initial=0.0)),
        largest_step=step,
        step_frame=step_frame,
        pop=pop,
        keys={body: len(done.keys.frames) for body, done in (reductions or {}).items()},
        key_error={body: done.error for body, done in (reductions or {}).items()},
    )


def _pairs(motion: MotionProblem, states: Sequence[PoseState]) -> dict[str, PairOverTime]:
    """Of every contact that is on at any frame."""
    distances: dict[str, list[FloatArray]] = {}
    frames: dict[str, list[int]] = {}
    centres: dict[str, list[FloatArray]] = {}
    for row, (problem, state) in enumerate(zip(motion.posed, states, strict=True)):
        gaps = ObjectGaps(problem).values(state)
        for contact in problem.contacts:
            if contact.gain >= HELD and len(contact.weights) and contact.hold != "direction":
                own = gaps[problem.pairs.rows[contact.name]]
                distances.setdefault(contact.name, []).append(np.linalg.norm(own, axis=1))
                centres.setdefault(contact.name, []).append(own.mean(axis=0))
                frames.setdefault(contact.name, []).append(row)
    seconds = motion.clock.seconds
    result = {}
    for name, parts in distances.items():
        means = np.array([part.mean() for part in parts])
        rows = np.array(frames[name])
        follows = np.diff(rows) == 1
        slips = np.linalg.norm(np.diff(np.array(centres[name]), axis=0), axis=1)[follows]
        speeds = slips / np.diff(seconds[rows])[follows]
        everything = np.concatenate(parts)
        result[name] = PairOverTime(
            frames=len(rows),
            mean=float(everything.mean()),
            p95=float(np.percentile(everything, 95)),
            worst=float(means.max()),
            worst_frame=motion.frames[rows[int(means.argmax())]],
            skate_max=float(speeds.max(initial=0.0)),
            skate_rms=float(np.sqrt((speeds**2).mean())) if len(speeds) else 0.0,
        )
    return result


def _pads(motion: MotionProblem, states: Sequence[PoseState]) -> FloatArray:
    """(n, c, 3) centres of the manipulator's points of the contacts that all frames have, on or not."""
    names = [c.name for c in motion.problems[0].contacts if len(c.weights)]
    for problem in motion.problems:
        names = [name for name in names if name in problem.pairs.rows]
    result = np.zeros((len(states), len(names), 3))
    for row, (problem, state) in enumerate(zip(motion.posed, states, strict=True)):
        points = state.vectors(problem.pairs.manipulator_points)
        for column, name in enumerate(names):
            result[row, column] = points[problem.pairs.rows[name]].mean(axis=0)
    return result


def _depths(motion: MotionProblem, states: Sequence[PoseState], solids: Solids | None) -> FloatArray:
    """(n,) how deep the deepest skin vertex is at each frame, world units."""
    result = np.zeros(len(states))
    for row, (problem, state) in enumerate(zip(motion.posed, states, strict=True)):
        result[row] = deepest_skin(problem, state, solids)
    return result


def _largest_step(motion: MotionProblem, states: Sequence[PoseState]) -> tuple[float, float, float]:
    """Of the joints that free dofs move: the farthest in a frame, to which frame, and over its neighbours."""
    moving = motion.problems[0].moves.any(axis=0)
    places = np.array([state.world[moving, :3, 3] for state in states])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=2)  # (n - 1, j)
    if not lengths.size:
        return 0.0, motion.frames[0], 1.0
    row, joint = np.unravel_index(int(lengths.argmax()), lengths.shape)
    beside = [lengths[r, joint] for r in (row - 1, row + 1) if 0 <= r < len(lengths)]
    largest, next_largest = float(lengths[row, joint]), float(max(beside, default=lengths[row, joint]))
    if largest == 0.0:
        return 0.0, motion.frames[0], 1.0
    return largest, motion.frames[int(row) + 1], largest / next_largest if next_largest > 0.0 else np.inf


def _derivatives(values: FloatArray, seconds: FloatArray, order: int) -> FloatArray:
    """Divided differences over time of values (n, ...), times the factorial: the derivative of an order."""
    result = values
    for k in range(1, order + 1):
        if len(result) < 2:
            return result[:0]
        gaps = (seconds[k:] - seconds[:-k]) / k
        result = np.diff(result, axis=0) / gaps.reshape(-1, *[1] * (values.ndim - 1))
    return result


def _peak(values: FloatArray) -> float:
    return float(np.abs(values).max(initial=0.0))


def _peak_length(vectors: FloatArray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max(initial=0.0))


def _rms_length(vectors: FloatArray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=-1).mean())) if vectors.size else 0.0
