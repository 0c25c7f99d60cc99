"""Solvers that call the default solver several times: staged, progressive, and from many starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import Cancelled
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.settings import HasSettings, setting
from contact_core.solve.candidates import fitted
from contact_core.solve.levenberg_marquardt import Descent, LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, Run, SolveOptions, SolveStatus, unsolvable
from contact_core.solve.stages import Stage, solve_stages
from contact_core.solve.threads import one_blas_thread


@dataclass(frozen=True)
class StagedSolver:
    """The paper's chair: root first, then legs and feet, then arms.

    stages: `Stage`s or tables with free, contacts, prior, name. Without them: the roots alone on all contacts, then
    everything.
    """

    name: ClassVar[str] = "staged"
    summary: ClassVar[str] = "Levenberg-Marquardt in stages, each with its own free joints, contacts and prior."
    stages: Sequence[Stage | Mapping[str, Any]] = ()

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        options = options or SolveOptions()
        given = [Stage.parse(stage) for stage in self.stages]
        stages = given or [roots_first(problem), Stage(name="all")]
        return solve_stages(self.name, LevenbergMarquardt(), problem, stages, options, progress)


@dataclass(frozen=True)
class ProgressiveSolver(HasSettings):
    """For wraps: contacts join one by one along the chain that carries them, so a tail follows its head."""

    name: ClassVar[str] = "progressive"
    summary: ClassVar[str] = (
        "Levenberg-Marquardt with contacts added along the chain; for tentacles and long wraps."
    )
    steps: int | None = setting(
        None, low=1, high=10_000, help="how many times contacts are added; one joint at a time by default"
    )

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        options = options or SolveOptions()
        depths = {contact.name: carrier_depths(problem, contact.name) for contact in problem.contacts}
        levels = np.unique(np.concatenate(list(depths.values()))) if depths else np.zeros(1, np.int64)
        steps = len(levels) if self.steps is None else self.steps
        ends = (
            levels[np.unique(np.linspace(0, len(levels) - 1, steps + 1).astype(int)[1:])]
            if steps > 1
            else levels[-1:]
        )
        stages = [
            Stage(
                weights={c.name: np.where(depths[c.name] <= end, c.weights, 0.0) for c in problem.contacts},  # (k,)
                name=f"up to joint level {end}",
            )
            for end in ends
        ]
        return solve_stages(self.name, LevenbergMarquardt(), problem, stages, options, progress)


@dataclass(frozen=True)
class MultiStartSolver(HasSettings):
    """Many seeded starts: the pose as it is, then random placements and poses anywhere within the limits.

    Two of three are then brought to their contacts by a rigid fit, with normals and without; the third stays where
    it fell.
    """

    name: ClassVar[str] = "multi-start"
    summary: ClassVar[str] = (
        "Levenberg-Marquardt from many random starts; the best known objective, for benchmarks."
    )
    starts: int = setting(
        32, low=1, high=100_000, help="how many starts, each with the iterations of max_iterations"
    )

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        options = options or SolveOptions()
        with one_blas_thread():
            return self._solve(problem, options, progress)

    def _solve(self, problem: PoseProblem, options: SolveOptions, progress: Progress) -> PoseSolution:
        run = Run(self.name, problem, options, progress, budget=self.starts * options.max_iterations)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped
        random = np.random.default_rng(options.seed)
        status, best = SolveStatus.STOPPED, np.inf
        try:
            for number in range(self.starts):
                theta = problem.start if number == 0 else random_start(problem, random)
                placed = fitted(problem, theta, with_normals=number % 3 == 1) if number % 3 else None
                descent = Descent(run, theta if placed is None else placed, options.tolerance)
                descent.advance(options.max_iterations)
                if descent.value < best:
                    best = descent.value
                    status = SolveStatus.CONVERGED if descent.settled else SolveStatus.STOPPED
        except Cancelled:
            status = SolveStatus.CANCELLED
        return run.solution(status)


def roots_first(problem: PoseProblem) -> Stage:
    """The stage that only places whole bodies."""
    free = {
        body.name: [chart.dof_names[q] for q in chosen if chart.is_root[q]]
        for body, chart, chosen in zip(problem.bodies, problem.charts, problem.free_of_body, strict=True)
    }
    return Stage(free=free, name="roots")


def carrier_depths(problem: PoseProblem, contact: str) -> IntArray:
    """(k,) how deep in the manipulator's joint tree the joint sits that holds each contact point strongest."""
    pair = next(c for c in problem.contacts if c.name == contact)
    rig = problem.bodies[problem.body_index(pair.manipulator)].rig
    depth = np.zeros(len(rig.joints), np.int64)
    for joint, parent in enumerate(rig.parents):
        depth[joint] = 0 if parent < 0 else depth[parent] + 1
    points = pair.manipulator_points
    held = np.zeros((len(points), len(rig.joints)))
    for corner in range(3):
        vertices = rig.faces[points.faces, corner]
        for influence in range(rig.skin_joints.shape[1]):
            share = points.barycentric[:, corner] * rig.skin_weights[vertices, influence]
            np.add.at(held, (np.arange(len(points)), rig.skin_joints[vertices, influence]), share)
    return depth[held.argmax(axis=1)]


def random_start(problem: PoseProblem, random: np.random.Generator) -> FloatArray:
    """A theta (d,): angles a random share of the way from the start to anywhere within the limits; placed about a
    manipulator's length away, turned anyhow."""
    lower, upper = problem.limits_of_theta
    turn = random.uniform(np.maximum(lower, -np.pi), np.minimum(upper, np.pi))
    theta = np.where(problem.is_root, turn, problem.start + random.uniform() * (turn - problem.start))
    reach = problem.manipulator_length * random.normal(0.0, 1.0, len(theta))
    return np.clip(np.where(problem.is_translation, problem.start + reach, theta), lower, upper)
