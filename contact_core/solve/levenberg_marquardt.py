"""The default solver: bounded Levenberg-Marquardt from several starts.

Each start gets a few iterations; the best two go on to the end, which is measured (docs/pose-grips.md) against the
paper's weakness with large wrist motion. A step minimises g.s + s.(A + mu D) s / 2, D = diag A, exactly within the
limits (`box`), with Nielsen's rule for mu (Madsen, Nielsen, Tingleff: Methods for Non-Linear Least Squares
Problems, 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.solve.box import box_minimum
from contact_core.solve.candidates import starting_thetas
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, Run, SolveOptions, SolveStatus, unsolvable
from contact_core.solve.state import PoseState
from contact_core.solve.threads import one_blas_thread

TRIAL_ITERATIONS = 8
CONTINUED = 2  # how many of the starts go on
WORTH_CONTINUING = 3.0  # times the best value after the trial; above, a start is left
FIRST_DAMPING = 1e-3
LARGEST_DAMPING = 1e12


class LevenbergMarquardt:
    """Bounded Levenberg-Marquardt over the starting candidates; deterministic."""

    name = "levenberg-marquardt"
    default_for = "solve"
    summary = "Bounded Levenberg-Marquardt from the current pose and two rigid fits; the default."

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        options = options or SolveOptions()
        with one_blas_thread():
            return self._solve(problem, options, progress)

    def _solve(self, problem: PoseProblem, options: SolveOptions, progress: Progress) -> PoseSolution:
        run = Run(self.name, problem, options, progress)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped
        starts = starting_thetas(problem, options.candidates)
        try:
            descents = [Descent(run, theta, options.tolerance) for theta in starts.values()]
            return run.solution(_race(descents, options.max_iterations))
        except Cancelled:
            return run.solution(SolveStatus.CANCELLED)


def few_steps(problem: PoseProblem, iterations: int, damping: float = FIRST_DAMPING) -> tuple[PoseSolution, float]:
    """A few iterations from the problem's start, for a solve that goes on frame after frame.

    Also returns the damping to go on with: begun anew, steps that are too bold would be tried again and again.
    """
    options = SolveOptions(max_iterations=iterations, candidates=("current",))
    with one_blas_thread():
        run = Run(LevenbergMarquardt.name, problem, options)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped, damping
        descent = Descent(run, problem.start, options.tolerance, damping)
        descent.advance(iterations)
        return run.solution(SolveStatus.CONVERGED if descent.settled else SolveStatus.STOPPED), descent.damping


def _race(descents: list[Descent], budget: int) -> SolveStatus:
    """Trial iterations for all, then the best to the end; the status is that of the best."""
    if len(descents) > 1:
        for descent in descents:
            budget -= descent.advance(min(TRIAL_ITERATIONS, budget))
        descents.sort(key=lambda descent: descent.value)
        ceiling = WORTH_CONTINUING * descents[0].value
        descents = descents[:1] + [other for other in descents[1:CONTINUED] if other.value <= ceiling]
    for descent in descents:
        budget -= descent.advance(budget)
    best = min(descents, key=lambda descent: descent.value)
    return SolveStatus.CONVERGED if best.settled else SolveStatus.STOPPED


@dataclass
class Descent:
    """One descent that can be advanced in portions. limits: lower and upper (d,), by default the problem's."""

    run: Run
    theta: FloatArray
    tolerance: float
    damping: float = FIRST_DAMPING
    growth: float = 2.0
    settled: bool = False
    limits: tuple[FloatArray, FloatArray] | None = None

    def __post_init__(self) -> None:
        self.lower, self.upper = self.limits or self.run.problem.limits_of_theta
        self.state, self.value = self.run.evaluate(np.clip(self.theta, self.lower, self.upper))
        self._model: tuple[PoseState, FloatArray, FloatArray] | None = None

    def advance(self, iterations: int) -> int:
        """Up to so many iterations; returns how many were made."""
        for number in range(iterations):
            if self.settled:
                return number
            self._step()
            self.run.iteration()
        return max(iterations, 0)

    def _step(self) -> None:
        """One trial step: taken if it lowers the objective, else the damping grows."""
        gradient, matrix = self._derivatives()
        theta = self.state.theta
        step = bounded_step(matrix, gradient, self.damping, self.lower - theta, self.upper - theta)
        predicted = -float(gradient @ step + 0.5 * step @ matrix @ step)
        if predicted <= self.tolerance * 1e-3 * self.value:
            self.settled = True
            return
        state, value = self.run.evaluate(np.clip(theta + step, self.lower, self.upper))
        gain = (self.value - value) / predicted
        if gain <= 0.0:
            self.damping *= self.growth
            self.growth *= 2.0
            self.settled = self.damping > LARGEST_DAMPING
            return
        self.settled = self.value - value <= self.tolerance * self.value and self.damping < 1.0
        self.state, self.value = state, value
        self.damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
        self.growth = 2.0

    def _derivatives(self) -> tuple[FloatArray, FloatArray]:
        """Gradient and Gauss-Newton matrix at the current state, once per accepted step."""
        if self._model is None or self._model[0] is not self.state:
            problem = self.run.problem
            self._model = self.state, problem.gradient(self.state), problem.normal_matrix(self.state)
        return self._model[1], self._model[2]


def bounded_step(
    matrix: FloatArray, gradient: FloatArray, damping: float, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """(d,) the minimiser of g.s + s.(A + damping D).s / 2 over lower <= s <= upper, with D = diag A."""
    diagonal = np.diagonal(matrix)
    floor = 1e-9 * max(float(diagonal.max(initial=0.0)), 1e-30)  # dofs that nothing holds stay put
    return box_minimum(matrix + np.diag(damping * diagonal + floor), gradient, lower, upper)
