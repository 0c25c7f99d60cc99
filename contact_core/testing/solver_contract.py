"""The contract of pose solvers. Subclass it and give the fixture `solver` (and `options`, if it needs its own)."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import NO_PROGRESS, CallbackProgress
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import Iteration, PoseSolver, SolveOptions, SolveStatus
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm
from contact_core.solve.terms import DistanceTerm, paper_terms
from contact_core.testing import rigs
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings


@dataclass(frozen=True)
class Poison:
    """A term that is not a number beyond (or up to) its n-th evaluation: what a broken plugin looks like."""

    after: int
    weight: float = 1.0
    name: str = "poison"
    summary: str = "breaks on purpose"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Poisoned(self.after, problem)


class _Poisoned:
    def __init__(self, after: int, problem: BareProblem) -> None:
        self.left, self.clean = after, DistanceTerm(0.0).bind(problem)

    def value(self, state: PoseState) -> float:
        self.left -= 1
        return float("nan") if self.left < 0 else 0.0

    def gradient(self, state: PoseState) -> FloatArray:
        return self.clean.gradient(state)

    def normal_matrix(self, state: PoseState) -> FloatArray:
        return self.clean.normal_matrix(state)


def small(seed: int = 0) -> PoseProblem:
    """A planted pose of a limited tentacle of 6 joints: 21 dofs, 120 contacts."""
    return rigs.planted(rigs.tentacle(6, rigs.limited_freedom), seed, contacts=120)[0]


def confined(seed: int = 0) -> PoseProblem:
    """A pose of the same tentacle that its joints are too narrow for: at the optimum half of them are at limits."""
    problem, _ = rigs.planted(rigs.tentacle(6), seed, contacts=60, spread=1.0, reach=2.0)
    narrow = Body.skinned(rigs.tentacle(6, rigs.narrow_freedom))
    return replace(problem, bodies=(narrow, *problem.bodies[1:]))


def polished(problem: PoseProblem, theta: FloatArray) -> float:
    """The objective where an optimiser that is none of ours arrives from theta."""
    from scipy.optimize import minimize

    lower, upper = (limit / problem.scale for limit in problem.limits_of_theta)

    def objective(x: FloatArray) -> tuple[float, FloatArray]:
        state = problem.state(np.clip(x, lower, upper) * problem.scale)
        return problem.value(state), problem.gradient(state) * problem.scale

    bounds = list(zip(lower, upper, strict=True))
    return float(minimize(objective, theta / problem.scale, jac=True, method="L-BFGS-B", bounds=bounds).fun)


class SolverContract(Contract):
    """Fixtures: `solver`, a PoseSolver; `options`, its SolveOptions for these problems (the defaults)."""

    about, letter = "pose solver", "S"

    @pytest.fixture
    def options(self) -> SolveOptions:
        return SolveOptions()

    def test_s01_is_named(self, solver: PoseSolver) -> None:
        """Has a name and says in a sentence what it does."""
        assert solver.name == solver.name.strip() != ""
        assert len(solver.summary.split()) >= 3, solver.summary

    @needs("precision")
    @pytest.mark.parametrize("seed", range(4))
    def test_s02_recovers_a_planted_pose(self, solver: PoseSolver, options: SolveOptions, seed: int) -> None:
        """A reachable pose is met from its own contacts to 1% of the length, from a length away and any turn."""
        problem = small(seed)
        solution = solver.solve(problem, options)
        assert rigs.mean_gap(problem, solution.theta) < 0.01, solution.message

    @pytest.mark.parametrize("seed", range(4))
    def test_s03_keeps_the_limits_exactly(self, solver: PoseSolver, options: SolveOptions, seed: int) -> None:
        """No dof of the answer is beyond its limit by even one bit, also where the contacts pull beyond."""
        rig = rigs.tentacle(6, rigs.limited_freedom)
        loose, _ = rigs.planted(rigs.tentacle(6), seed, contacts=120, spread=1.2)
        problem = replace(loose, bodies=(Body.skinned(rig), loose.bodies[1]))
        theta = solver.solve(problem, options).theta
        lower, upper = problem.limits_of_theta
        assert ((theta >= lower) & (theta <= upper)).all()
        best = LevenbergMarquardt().solve(problem).theta
        assert ((best == lower) | (best == upper)).any(), "the problem was meant to press against its limits"

    @pytest.mark.parametrize("seed", range(4))
    def test_s04_is_never_worse_than_its_start(self, solver: PoseSolver, options: SolveOptions, seed: int) -> None:
        """The objective of the answer is at most that of the start, and is the one that the answer states."""
        problem = small(seed)
        for budget in (1, 3, options.max_iterations):
            solution = solver.solve(problem, replace(options, max_iterations=budget))
            assert solution.value <= solution.start_value
            assert solution.value == solution.problem.value(solution.problem.state(solution.theta))

    def test_s05_stays_at_an_optimum(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Started where it ended, it does not get worse, and moves nowhere far."""
        solution = solver.solve(small(), options)
        again = solver.solve(solution.problem.at(solution.theta), options)
        assert again.value <= solution.value * (1.0 + 1e-12)

    @needs("precision")
    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("make", [small, confined])
    def test_s06_says_converged_only_when_it_is(
        self, solver: PoseSolver, options: SolveOptions, make: Callable[[int], PoseProblem], seed: int
    ) -> None:
        """Where the status is CONVERGED, going on gains less than half a percent: for it, and for L-BFGS-B."""
        solution = solver.solve(make(seed), options)
        if solution.status is SolveStatus.CONVERGED:
            again = solver.solve(solution.problem.at(solution.theta), replace(options, candidates=("current",)))
            assert again.value >= 0.995 * solution.value, (solution.value, again.value)
            assert polished(solution.problem, solution.theta) >= 0.995 * solution.value

    @needs("budget")
    def test_s07_says_when_it_ran_out(self, solver: PoseSolver, options: SolveOptions) -> None:
        """With two iterations it says STOPPED, and its message says what to do."""
        solution = solver.solve(small(), replace(options, max_iterations=2))
        assert solution.status is SolveStatus.STOPPED
        assert solution.message == SolveStatus.STOPPED.value

    def test_s08_is_deterministic(self, solver: PoseSolver, options: SolveOptions) -> None:
        """The same problem gives the same answer, to the bit."""
        first, second = solver.solve(small(1), options), solver.solve(small(1), options)
        assert np.array_equal(first.theta, second.theta)
        assert first.trace == second.trace

    def test_s09_shows_every_iteration(self, solver: PoseSolver, options: SolveOptions) -> None:
        """`watch` sees iterations 1, 2, 3 ... each with a pose within the limits and a finite objective."""
        problem, seen = small(), list[Iteration]()
        solution = solver.solve(problem, replace(options, watch=seen.append))
        assert [iteration.number for iteration in seen] == list(range(1, len(seen) + 1))
        assert len(seen) == len(solution.trace) > 0
        lower, upper = problem.limits_of_theta
        for iteration in seen:
            assert ((iteration.theta >= lower) & (iteration.theta <= upper)).all()
            assert np.isfinite(iteration.value)
        assert seen[-1].poses().keys() == {body.name for body in problem.bodies}

    @pytest.mark.parametrize("stop_at", [1, 4])
    def test_s10_stops_within_one_iteration(self, solver: PoseSolver, options: SolveOptions, stop_at: int) -> None:
        """What raises Cancelled is not called again, and the status is CANCELLED with the best pose."""
        for told in (False, True):
            calls = list[int]()

            def cancel(*_: object, calls: list[int] = calls) -> None:
                calls.append(len(calls) + 1)
                if len(calls) >= stop_at:
                    raise Cancelled("the test has seen enough.")

            watched = options if told else replace(options, watch=cancel)
            solution = solver.solve(small(), watched, CallbackProgress(cancel) if told else NO_PROGRESS)
            assert len(calls) == stop_at
            assert solution.status is SolveStatus.CANCELLED
            assert solution.value <= solution.start_value

    def test_s11_watching_changes_nothing(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Neither `watch` nor progress changes the result; what is told rises from 0 to at most 1."""
        told = list[float | None]()
        progress = CallbackProgress(lambda fraction, _: told.append(fraction))
        watched = solver.solve(small(2), replace(options, watch=lambda _: True), progress)
        known = [fraction for fraction in told if fraction is not None]
        assert len(told) > 0
        assert all(0.0 <= one <= other <= 1.0 for one, other in itertools.pairwise([*known, 1.0]))
        assert np.array_equal(watched.theta, solver.solve(small(2), options).theta)

    def test_s12_moves_only_what_is_free(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Held joints keep their transforms to rounding; with nothing free it says so and changes nothing."""
        problem = small()
        held = replace(problem, held={"tentacle": ["link00", "link03"]})
        pose = solver.solve(held, options).poses["tentacle"]
        before = problem.bodies[0].pose
        assert np.abs(pose.local[[0, 3]] - before.local[[0, 3]]).max() < 1e-12
        still = solver.solve(replace(problem, free={}), options)
        assert still.status is SolveStatus.NOTHING_FREE
        assert np.abs(still.poses["tentacle"].local - before.local).max() < 1e-12

    @needs("precision")
    def test_s13_moves_the_other_body(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Where only the object is free, the object comes to the manipulator."""
        problem, _ = rigs.planted(rigs.tentacle(6), 3, contacts=120, movable=True)
        solution = solver.solve(problem, options)
        assert rigs.mean_gap(problem, solution.theta) < 0.01, solution.message

    @needs("precision")
    def test_s14_closes_a_gap_within_one_body(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Contacts between two parts of one rig bring them together."""
        rig = rigs.hand_like()
        one, two = (
            np.flatnonzero(rig.skin_joints[rig.faces[:, 0], 0] == rig.joint_index(f"finger{k}_2")) for k in (1, 2)
        )
        ends = [SurfacePoints(faces[:20], np.full((20, 3), 1.0 / 3.0)) for faces in (one, two)]
        problem = PoseProblem(
            (Body.skinned(rig),),
            (PairedPoints("touch", rig.name, ends[0], rig.name, ends[1]),),
            terms=paper_terms(prior=0.1),
        )
        solution = solver.solve(problem, options)
        start, end = (rigs.mean_gap(problem, theta) for theta in (problem.start, solution.theta))
        assert end < 0.5 * start, (start, end)

    def test_s15_survives_a_broken_term(self, solver: PoseSolver, options: SolveOptions) -> None:
        """Not a number at the start: FAILED and an unchanged pose. Later: the best pose seen before."""
        problem = small()
        failed = solver.solve(replace(problem, terms=(*paper_terms(), Poison(0))), options)
        assert failed.status is SolveStatus.FAILED
        assert np.array_equal(failed.theta, problem.start)
        later = solver.solve(replace(problem, terms=(*paper_terms(), Poison(6))), options)
        assert np.isfinite(later.value)
        assert later.value <= later.start_value

    def test_s16_keeps_to_the_prior_without_contacts(self, solver: PoseSolver, options: SolveOptions) -> None:
        """A problem without contacts is a problem: the pose stays at its prior."""
        problem = small()
        started = replace(problem, contacts=(), prior="current")
        assert np.allclose(solver.solve(started, options).theta, started.start, atol=1e-6)

    def test_s17_leaves_its_input_alone(self, solver: PoseSolver, options: SolveOptions) -> None:
        """The arrays of the problem are the same bits afterwards."""
        problem = small()
        body = problem.bodies[0]
        arrays = [body.pose.local, body.rig.rest_local, body.rig.bind_points, problem.start, problem.prior_theta,
                  *problem.limits_of_theta, problem.contacts[0].weights]  # fmt: skip
        before = [array.tobytes() for array in arrays]
        solver.solve(problem, options)
        assert before == [array.tobytes() for array in arrays]

    def test_s18_declares_its_settings(self, solver: PoseSolver) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(solver)
