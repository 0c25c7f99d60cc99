"""Solvers, and a term, broken on purpose, each in one way; `breaks` says which clause must see it first."""

from __future__ import annotations

import contextlib
import itertools
from dataclasses import dataclass, replace

import numpy as np
import pytest

from contact_core.errors import Cancelled
from contact_core.progress import NO_PROGRESS, CallbackProgress, Progress
from contact_core.settings import HasSettings, setting
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, SolveStatus
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import DistanceTerm
from contact_core.testing.mutants import Mutant
from contact_core.testing.solver_contract import SolverContract
from contact_core.testing.term_contract import TermContract


class Sound(LevenbergMarquardt):
    """What the mutants start from."""

    name = "mutant"


class Overstepping(Sound):
    """Leaves the limits by a hair."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        solution = super().solve(problem, options, progress)
        theta = solution.theta * (1.0 + 1e-9)
        return replace(solution, theta=theta, value=problem.value(problem.state(theta)))


class Forgetful(Sound):
    """Answers somewhere near the start, which need not be better."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        solution = super().solve(problem, options, progress)
        lower, upper = problem.limits_of_theta
        if options is not None and options.max_iterations == 1:
            theta = np.clip(problem.start + problem.scale, lower, upper)
            return replace(solution, theta=theta, value=problem.value(problem.state(theta)))
        return solution


class Boastful(Sound):
    """Says it settled whatever happened."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        solution = super().solve(problem, options, progress)
        stopped = solution.status is SolveStatus.STOPPED
        return replace(solution, status=SolveStatus.CONVERGED) if stopped else solution


class Moody(Sound):
    """Starts somewhere else every time."""

    calls = itertools.count(1)

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        solution = super().solve(problem, options, progress)
        return replace(solution, trace=(*solution.trace, float(next(self.calls))))


class Deaf(Sound):
    """Does not hear a cancel."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        def tell(fraction: float | None, text: str) -> None:
            with contextlib.suppress(Cancelled):
                progress.tell(fraction, text)

        return super().solve(problem, options, CallbackProgress(tell))


class Receding(Sound):
    """Tells of progress that goes back."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        return super().solve(problem, options, progress.part(1.0, 0.0))


@dataclass(frozen=True)
class Trusting(Sound, HasSettings):
    """Checks no setting that it is made with."""

    patience: int = setting(3, low=1, high=9, help="how long it goes on")

    def __post_init__(self) -> None:
        pass


@dataclass(frozen=True)
class Terse(DistanceTerm):
    """A term with a setting that says nothing about itself."""

    sharpness: float = setting(1.0, low=0.0, help="sharpness")


class Presuming(Sound):
    """Moves what is held."""

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        return super().solve(replace(problem, held=None), options, progress)


class TestOverstepping(Mutant, SolverContract):
    breaks = "S03"
    consequences = ("S15",)  # its answer after a broken term is no better than the start

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Overstepping()


class TestForgetful(Mutant, SolverContract):
    breaks = "S04"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Forgetful()


class TestBoastful(Mutant, SolverContract):
    breaks = "S07"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Boastful()


class TestMoody(Mutant, SolverContract):
    breaks = "S08"
    consequences = ("S09",)

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Moody()


class TestDeaf(Mutant, SolverContract):
    breaks = "S10"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Deaf()


class TestReceding(Mutant, SolverContract):
    breaks = "S11"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Receding()


class TestTrusting(Mutant, SolverContract):
    breaks = "S18"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Trusting()


class TestTerse(Mutant, TermContract):
    breaks = "T09"

    @pytest.fixture
    def term(self) -> PoseTerm:
        return Terse()


class TestPresuming(Mutant, SolverContract):
    breaks = "S12"

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return Presuming()
