"""What a pose solver is: the protocol, its options, its answer, and the run that every solver reports to."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.rig import Pose
from contact_core.settings import HasSettings, setting
from contact_core.solve.problem import PoseProblem
from contact_core.solve.state import PoseState


class SolveStatus(Enum):
    """How a solve ended. The value is its message."""

    CONVERGED = "The pose settled: no step within the limits lowers the objective noticeably."
    STOPPED = "The iterations ran out before the pose settled; this is the best pose seen. Solve again to go on."
    CANCELLED = "You stopped the solve; this is the best pose seen."
    NOTHING_FREE = "Nothing is free to move: every degree of freedom is locked, held or fixed."
    FAILED = "The objective could not be evaluated (not a number) at the start; the pose is unchanged."


@dataclass(frozen=True, eq=False)
class Iteration:
    """One iteration as `SolveOptions.watch` sees it. theta: (d,) the best pose so far; poses() gives it by body."""

    number: int
    value: float
    evaluations: int
    seconds: float
    problem: PoseProblem
    theta: FloatArray

    def poses(self) -> dict[str, Pose]:
        """The best pose so far, by body."""
        return self.problem.poses(self.theta)


CANDIDATES = ("current", "positions", "normals")


@dataclass(frozen=True)
class SolveOptions(HasSettings):
    """What every solver understands; its own settings are fields of the solver (`contact_core.settings`).

    max_iterations: over all starts of one stage. tolerance: relative decrease of the objective below which a
    pose counts as settled. candidates: where to start from, of "current", "positions" (rigid fit of the paired
    points), "normals" (the fit with normals); fits are left out where the root is held. watch: is shown every
    iteration with its pose, for a ghost that moves along; it may raise Cancelled, as progress may.
    """

    max_iterations: int = setting(200, low=1, help="how many iterations at most, over all starts of one stage")
    tolerance: float = setting(
        1e-5, low=0.0, help="relative decrease of the objective below which a pose counts as settled"
    )
    candidates: tuple[str, ...] = setting(
        CANDIDATES, choices=CANDIDATES, help="where to start from: the current pose, and rigid fits of the contacts"
    )
    seed: int = setting(0, low=0, high=2**32 - 1, help="of solvers that start at random")
    watch: Callable[[Iteration], object] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.candidates:
            raise InvalidInput(f"candidates are some of {', '.join(CANDIDATES)}, at least one, but got none.")


@runtime_checkable
class PoseSolver(Protocol):
    """Something that poses (hook `contact_pose_solvers`).

    Settings of its own are fields, see `contact_core.settings`.
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        """The best pose found, with a truthful status. InvalidInput for a wrong problem, never for a hard one.

        Tells progress every iteration; Cancelled raised there ends the solve within the iteration, with the best
        pose so far and the status CANCELLED.
        """
        ...


@dataclass(frozen=True)
class PatchResidual:
    """How well one contact pair is met. Distances in surface units.

    mean, p95: distance of paired points. opposed, opposed_45: fraction of points whose normals face each other
    at all, and within 45 degrees. Normals are those of the deformed meshes.
    """

    mean: float
    p95: float
    opposed: float
    opposed_45: float


@dataclass(frozen=True, eq=False)
class PoseSolution:
    """The answer of a solve. theta: (d,) best pose ever seen, in the chart of `problem`.

    value, start_value: the objective there and at the start. trace: objective after each iteration.
    """

    solver: str
    status: SolveStatus
    problem: PoseProblem
    theta: FloatArray
    value: float
    start_value: float
    trace: tuple[float, ...]
    evaluations: int
    seconds: float
    notes: tuple[str, ...] = ()

    @property
    def message(self) -> str:
        """The status in words."""
        return self.status.value

    @cached_property
    def poses(self) -> dict[str, Pose]:
        """The solved pose of every body, by name."""
        return self.problem.poses(self.theta)

    @cached_property
    def terms(self) -> dict[str, float]:
        """Weighted value of every term at the solution; their sum is `value`."""
        return self.problem.term_values(self.problem.state(self.theta))

    @cached_property
    def patches(self) -> dict[str, PatchResidual]:
        """Residuals per contact pair, by name."""
        return patch_residuals(self.problem, self.theta)


def patch_residuals(problem: PoseProblem, theta: FloatArray) -> dict[str, PatchResidual]:
    """Per contact pair: how far its points are apart and how well its surfaces face each other, at theta."""
    state = problem.state(theta)
    meshes = {body.name: posed_mesh(problem, state, body.name) for body in problem.bodies if body.black_box is None}
    seen = state.vectors(problem.pairs.manipulator_normals), state.vectors(problem.pairs.object_normals)

    def normals(body: str, points: SurfacePoints, end: int, rows: slice) -> FloatArray:
        return points.normals(meshes[body]) if body in meshes else seen[end][rows]

    gaps = np.linalg.norm(state.vectors(problem.pairs.gap), axis=1)
    result = {}
    for contact in problem.contacts:
        rows = problem.pairs.rows[contact.name]
        gap = gaps[rows]
        mine = normals(contact.manipulator, contact.manipulator_points, 0, rows)
        other = normals(contact.object, contact.object_points, 1, rows)
        cosine = np.einsum("ki,ki->k", mine, other)
        if len(gap) == 0:
            continue
        result[contact.name] = PatchResidual(
            mean=float(gap.mean()),
            p95=float(np.percentile(gap, 95)),
            opposed=float((cosine < 0.0).mean()),
            opposed_45=float((cosine < -np.sqrt(0.5)).mean()),
        )
    return result


def posed_mesh(problem: PoseProblem, state: PoseState, body: str) -> TriangleMesh:
    """The deformed surface of a body in the problem's world."""
    from contact_core.rig.rig import skin

    index = problem.body_index(body)
    rig = problem.bodies[index].rig
    return TriangleMesh(skin(rig, state.motions[index].world), rig.faces)


class Run:
    """One solve as it happens: counts, remembers the best pose ever seen, traces, tells progress.

    A solver asks `evaluate` for every state it looks at and calls `iteration` once per iteration; whatever
    happens afterwards, `solution` returns the best pose that was ever evaluated within the limits. budget: how many
    iterations make the whole, those of the options by default.
    """

    def __init__(
        self,
        solver: str,
        problem: PoseProblem,
        options: SolveOptions,
        progress: Progress = NO_PROGRESS,
        *,
        budget: int | None = None,
    ) -> None:
        self.solver, self.problem, self.progress, self.watch = solver, problem, progress, options.watch
        self.budget = options.max_iterations if budget is None else budget
        self.began = time.perf_counter()
        self.evaluations = 0
        self.trace: list[float] = []
        self.notes: list[str] = []
        self.best_theta = problem.start
        self.start_value = self.best_value = problem.value(problem.start_state)

    def evaluate(self, theta: FloatArray) -> tuple[PoseState, float]:
        """The state and the objective at theta (d,); infinite where it is not a number."""
        start = self.problem.start_state  # what was found there at binding and for the first value is kept
        state = start if np.array_equal(theta, start.theta) else self.problem.state(theta)
        value = self.problem.value(state)
        value = value if np.isfinite(value) else np.inf
        self.evaluations += 1
        if value < self.best_value or not np.isfinite(self.best_value):
            self.best_value, self.best_theta = value, state.theta
        return state, value

    def iteration(self, theta: FloatArray | None = None, value: float | None = None) -> None:
        """Show and tell the best pose, or the pose of a stage. Raises Cancelled when the work is to stop."""
        self.trace.append(self.best_value if value is None else value)
        number = len(self.trace)
        if self.watch is not None:
            seen = Iteration(
                number=number,
                value=self.trace[-1],
                evaluations=self.evaluations,
                seconds=time.perf_counter() - self.began,
                problem=self.problem,
                theta=(self.best_theta if theta is None else theta).copy(),
            )
            self.watch(seen)
        self.progress.tell(min(number / self.budget, 1.0), f"iteration {number}")

    def solution(self, status: SolveStatus) -> PoseSolution:
        """The answer with the best pose seen."""
        theta = self.best_theta.copy()
        theta.setflags(write=False)
        return PoseSolution(
            solver=self.solver,
            status=status,
            problem=self.problem,
            theta=theta,
            value=self.best_value,
            start_value=self.start_value,
            trace=tuple(self.trace),
            evaluations=self.evaluations,
            seconds=time.perf_counter() - self.began,
            notes=tuple(self.notes),
        )


def unsolvable(run: Run) -> PoseSolution | None:
    """The answer for a problem that no solver can start on, else None."""
    if not len(run.problem.start):
        return run.solution(SolveStatus.NOTHING_FREE)
    if not np.isfinite(run.start_value):
        return run.solution(SolveStatus.FAILED)
    return None
