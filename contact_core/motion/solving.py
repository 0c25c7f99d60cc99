"""Solve a motion: frame after frame first, then all frames at once from there.

The first, causal pass is what the joint pass starts from: from elsewhere (a line between the end poses) it takes
many times the iterations and can end in a worse place. Alone it pops where contacts come and go, drifts where
nothing holds, and lets held contacts skate.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.errors import Cancelled
from contact_core.motion.joint import JointDescent, JointObjective
from contact_core.motion.problem import MotionProblem
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rig import Pose
from contact_core.solve.candidates import fitted
from contact_core.solve.levenberg_marquardt import Descent, LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolver, Run, SolveOptions, SolveStatus
from contact_core.solve.threads import one_blas_thread

CAUSAL_SHARE = 0.6  # of the time of a solve, as measured
CAUSAL_TOLERANCE = 1e-3  # what the joint pass starts from need not be settled
FIT_ITERATIONS = 8  # of each start where contacts come on
BOUND_ROUNDS = 12  # of making exceeded bounds dearer


@dataclass(frozen=True)
class MotionOptions:
    """max_iterations, tolerance: of the joint pass. frame_iterations: per frame of the causal pass.

    bound_tolerance: by what share a bound may be exceeded before it is made dearer.
    """

    max_iterations: int = 60
    tolerance: float = 1e-4
    frame_iterations: int = 60
    bound_tolerance: float = 0.01


@dataclass(frozen=True, eq=False)
class MotionSolution:
    """What a solve returns. thetas: (n, d), the best motion seen; causal: (n, d), that of the first pass.

    value, causal_value: the joint objective of both. parts: its energies by name. iterations: of the joint pass;
    trace: the objective after each. evaluations, models: of how many single frames, of both passes and of the
    joint pass. speed_excess, acceleration_excess: the largest share by which a bound is still exceeded.
    """

    motion: MotionProblem
    thetas: FloatArray
    causal: FloatArray
    status: SolveStatus
    value: float
    causal_value: float
    parts: dict[str, float]
    iterations: int
    trace: tuple[float, ...]
    evaluations: int
    models: int
    speed_excess: float
    acceleration_excess: float
    seconds: float

    @property
    def message(self) -> str:
        """The status in words."""
        return self.status.value

    @cached_property
    def by_frame(self) -> tuple[dict[str, Pose], ...]:
        """Per frame, the pose of every body; what is pinned is the pinned pose itself."""
        return tuple(
            {**problem.poses(theta), **self.motion.pins.get(frame, {})}
            for frame, problem, theta in zip(self.motion.frames, self.motion.posed, self.thetas, strict=True)
        )

    def poses(self, body: str) -> tuple[Pose, ...]:
        """The pose of one body at every frame."""
        self.motion.problems[0].body_index(body)
        return tuple(poses[body] for poses in self.by_frame)


def solve_motion(
    motion: MotionProblem,
    *,
    solver: PoseSolver | None = None,
    options: MotionOptions | None = None,
    start: FloatArray | None = None,
    progress: Progress = NO_PROGRESS,
) -> MotionSolution:
    """The motion of least joint energy (`motion.joint`) found from the causal pass.

    solver: poses the first frame (the default solver with its starts). start: (n, d) thetas to start the joint pass
    from in place of a causal pass, such as the last solution when one key was dragged. Cancelled during the causal
    pass, the frames not yet posed hold the last pose; the best seen is returned whatever happens.
    """
    options = options or MotionOptions()
    began = time.perf_counter()
    with one_blas_thread():
        return _Solve(motion, options, progress, began).run(solver or LevenbergMarquardt(), start)


class _Solve:
    """One solve as it happens."""

    def __init__(self, motion: MotionProblem, options: MotionOptions, progress: Progress, began: float) -> None:
        self.motion, self.options, self.began = motion, options, began
        self.causal_progress = progress.part(0.0, CAUSAL_SHARE)
        self.joint_progress = progress.part(CAUSAL_SHARE, 1.0, "all frames")
        self.objective = JointObjective(motion)
        self.status = SolveStatus.STOPPED
        self.causal_evaluations = 0

    def run(self, solver: PoseSolver, start: FloatArray | None) -> MotionSolution:
        """Both passes."""
        if start is None:
            causal = self._causal(solver)
        else:
            causal = np.where(self.motion.pinned, self._pinned_thetas(), start)
        causal = self.objective.chart.unwound(causal)
        descent = JointDescent(self.objective, causal, self.options.tolerance, self._observe)
        first = descent.best
        if not causal.shape[1] or self.motion.pinned.all():
            self.status = SolveStatus.NOTHING_FREE
        elif not np.isfinite(descent.value):
            self.status = SolveStatus.FAILED
        elif self.status is not SolveStatus.CANCELLED:
            try:
                self.status = self._joint(descent)
            except Cancelled:
                self.status = SolveStatus.CANCELLED
        return self._solution(descent, first)

    def _joint(self, descent: JointDescent) -> SolveStatus:
        settled = descent.run(self.options.max_iterations)
        for _ in range(BOUND_ROUNDS):
            tolerance = self.options.bound_tolerance
            faster = self.objective.raise_bounds(descent.states, tolerance)
            if not self.objective.raise_walls(descent.states, tolerance) and not faster:
                break
            descent.restart()
            settled = descent.run(self.options.max_iterations)
        return SolveStatus.CONVERGED if settled else SolveStatus.STOPPED

    def _observe(self, descent: JointDescent) -> None:
        done = descent.iterations / (descent.iterations + 4.0)  # most end after four to eight
        self.joint_progress.tell(done, f"iteration {descent.iterations}")

    def _solution(self, descent: JointDescent, causal: FloatArray) -> MotionSolution:
        objective, thetas, value = self.objective, descent.best, descent.value
        causal_value = objective.value(objective.states(causal))
        if causal_value < value:  # bounds that became dearer can put the first pass ahead
            thetas, value = causal, causal_value
        thetas.setflags(write=False)
        steps = objective.chart.steps(thetas).values
        speeds = objective.clock.speeds(steps) if len(steps) else steps
        accelerations = objective.clock.accelerations(steps) if len(steps) > 1 else steps[:0]
        return MotionSolution(
            motion=self.motion,
            thetas=thetas,
            causal=causal,
            status=self.status,
            value=value,
            causal_value=causal_value,
            parts=objective.parts(objective.states(thetas)),
            iterations=descent.iterations,
            trace=tuple(descent.trace),
            evaluations=self.causal_evaluations + objective.evaluations,
            models=objective.models,
            speed_excess=_excess(speeds, objective.bounds[0]),
            acceleration_excess=_excess(accelerations, objective.bounds[1]),
            seconds=time.perf_counter() - self.began,
        )

    # --- the causal pass ----------------------------------------------------------------------------------

    def _pinned_thetas(self) -> FloatArray:
        """(n, d) theta of the pins; of what is not pinned, where each frame's problem starts."""
        return np.array(
            [
                problem.theta_of(self.motion.pins.get(frame, {}))
                for frame, problem in zip(self.motion.frames, self.objective.problems, strict=True)
            ]
        )

    def _causal(self, solver: PoseSolver) -> FloatArray:
        """(n, d) each frame solved from the last one's pose; frames left out by cancelling hold the last."""
        given, pinned = self._pinned_thetas(), self.motion.pinned
        thetas = given.copy()
        n, held = len(thetas), False
        for row, problem in enumerate(self.objective.problems):
            try:
                self.causal_progress.tell(row / n, f"frame {self.motion.frames[row]:g}")
            except Cancelled:
                self.status = SolveStatus.CANCELLED
                thetas[row:] = np.where(pinned[row:], given[row:], thetas[max(row - 1, 0)])
                break
            holds = any(contact.gain > 0.0 and contact.weights.any() for contact in problem.contacts)
            if row:
                thetas[row] = np.where(pinned[row], given[row], thetas[row - 1])
            if not pinned[row].all():
                first = row == 0 and not pinned[row].any()
                thetas[row] = (
                    self._first(solver, problem)
                    if first
                    else self._next(problem, thetas[row], pinned[row], came_on=holds and not held)
                )
            held = holds
        return thetas

    def _first(self, solver: PoseSolver, problem: PoseProblem) -> FloatArray:
        solution = solver.solve(problem, SolveOptions())
        self.causal_evaluations += solution.evaluations
        return np.array(solution.theta)

    def _next(self, problem: PoseProblem, theta: FloatArray, pinned: BoolArray, *, came_on: bool) -> FloatArray:
        """The pose at one frame, from theta (d,) and, where contacts came on after none, from rigid fits too."""
        run = Run("causal", problem, SolveOptions())
        lower, upper = (np.where(pinned, theta, side) for side in problem.limits_of_theta)
        descents = [Descent(run, theta, CAUSAL_TOLERANCE, limits=(lower, upper))]
        if came_on and not pinned.any():
            for with_normals in (False, True):
                fit = fitted(problem, theta, with_normals=with_normals)
                if fit is not None:
                    descents.append(Descent(run, fit, CAUSAL_TOLERANCE))
            for descent in descents:
                descent.advance(FIT_ITERATIONS)
        best = min(descents, key=lambda descent: descent.value)
        best.advance(self.options.frame_iterations)
        self.causal_evaluations += run.evaluations
        return np.array(best.state.theta)


def _excess(values: FloatArray, bound: FloatArray) -> float:
    """The largest share by which values (m, d) exceed bounds (d,), 0 where none does."""
    return max(float((np.abs(values) / bound).max(initial=0.0)) - 1.0, 0.0)
