"""The joint pass: its parts against dense linear algebra and differences, and the laws of what it finds."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled, InvalidInput
from contact_core.motion.band import BlockBand, bounded_minimum
from contact_core.motion.joint import JointObjective
from contact_core.motion.problem import MotionBounds, MotionProblem, MotionWeights
from contact_core.motion.skate import held_rows
from contact_core.motion.solving import MotionOptions, MotionSolution, solve_motion
from contact_core.progress import CallbackProgress
from contact_core.rig.rig import Pose
from contact_core.rig.rotations import exponential
from contact_core.solve.box import box_minimum
from contact_core.solve.solver import SolveStatus
from contact_core.solve.terms import DistanceTerm, NormalTerm, paper_terms
from contact_core.testing.motions import eased, molded

# --- linear algebra -----------------------------------------------------------------------------------------


def random_band(n: int, d: int, seed: int) -> tuple[BlockBand, FloatArray]:
    """A positive definite band and the same as a dense matrix."""
    random = np.random.default_rng(seed)
    band, dense = BlockBand.zeros(n, d), np.zeros((n * d, n * d))
    for f in range(n):
        reach = min(3, n - f)
        rows = random.normal(size=(2 * d, reach * d))
        square = rows.T @ rows + 0.1 * np.eye(reach * d)
        dense[f * d : (f + reach) * d, f * d : (f + reach) * d] += square
    for f in range(n):
        band.own[f] = dense[f * d : (f + 1) * d, f * d : (f + 1) * d]
        if f + 1 < n:
            band.next[f] = dense[(f + 1) * d : (f + 2) * d, f * d : (f + 1) * d]
        if f + 2 < n:
            band.after[f] = dense[(f + 2) * d : (f + 3) * d, f * d : (f + 1) * d]
    return band, dense


@given(st.integers(1, 5), st.integers(1, 4), st.integers(0, 10_000))
def test_a_banded_step_is_the_dense_one_within_the_box(n: int, d: int, seed: int) -> None:
    band, dense = random_band(n, d, seed)
    random = np.random.default_rng(seed + 1)
    gradient = random.normal(size=(n, d))
    lower, upper = -random.exponential(0.3, (n, d)), random.exponential(0.3, (n, d))
    lower[random.random((n, d)) < 0.3], upper[random.random((n, d)) < 0.3] = -np.inf, np.inf
    still = random.random((n, d)) < 0.1
    lower[still] = upper[still] = 0.0
    assert np.allclose(band.times(gradient).ravel(), dense @ gradient.ravel())
    step = bounded_minimum(band, 0.1, gradient, lower, upper)
    assert step is not None
    damped = dense + np.diag(0.1 * np.diagonal(dense) + 1e-9 * np.diagonal(dense).max())
    expected = box_minimum(damped, gradient.ravel(), lower.ravel(), upper.ravel())
    assert np.allclose(step.ravel(), expected, atol=1e-8)


# --- derivatives --------------------------------------------------------------------------------------------


def full_objective(**more: float) -> tuple[JointObjective, FloatArray]:
    """All energies at once, at random thetas with a root that turns round more than once."""
    motion = molded(0.25, joints=3)
    reference = tuple(problem.bodies[0].pose for problem in motion.problems)
    motion = replace(
        motion,
        weights=MotionWeights(acceleration=1e-3, skate=0.1, follow=0.2, follow_root=0.3),
        bounds=MotionBounds(turning_speed=2.0, turning_acceleration=20.0, travel_speed=5.0),
        reference={motion.problems[0].bodies[0].name: reference},
    )
    objective = JointObjective(motion)
    for weights in objective.bound_weights:
        weights[:] = 1e-3
    random = np.random.default_rng(2)
    n, d = motion.pinned.shape
    thetas = np.cumsum(random.normal(0.0, 0.15, (n, d)), axis=0)
    ball = objective.chart.balls[0]
    turns = np.cumsum(random.normal(0.6, 0.3, (n, 3)), axis=0)
    thetas[:, ball] = turns
    return objective, objective.chart.unwound(thetas)


def test_gradient_is_the_derivative_and_the_model_is_symmetric_and_positive() -> None:
    objective, thetas = full_objective()
    assert len(objective.chart.balls) == 1
    assert set(objective.parts(objective.states(thetas))) >= {
        "frames", "skate", "acceleration", "follow", "bounds of speed", "bounds of acceleration",
    }  # fmt: skip
    gradient, _ = objective.model(objective.states(thetas))
    random = np.random.default_rng(3)
    for _ in range(6):
        way, h = random.normal(size=thetas.shape), 1e-6
        values = [objective.value(objective.states(thetas + s * h * way)) for s in (1.0, -1.0)]
        assert (values[0] - values[1]) / (2.0 * h) == pytest.approx(float((gradient * way).sum()), rel=2e-5)


def test_gauss_newton_model_predicts_what_is_quadratic() -> None:
    """Of steps and skate the model is that of squares of residuals: exact where residuals vanish."""
    motion = molded(0.3, joints=3, weights=MotionWeights(3e-4, 0.05))
    objective = JointObjective(motion)
    still = np.tile(motion.problems[0].start, (len(motion.frames), 1))
    way = np.random.default_rng(0).normal(size=still.shape)
    way -= way.mean(axis=0)
    forms = objective._forms(objective.chart.steps(still))
    model = BlockBand.zeros(*still.shape)
    by_steps, own, next_ = forms["acceleration"].derivatives()
    objective.chart.steps(still).add_curvature(own, next_, model)
    h = 1e-4
    energy = objective._forms(objective.chart.steps(still + h * way))["acceleration"].value()
    assert energy == pytest.approx(0.5 * h * h * float((way * model.times(way)).sum()), rel=1e-2)
    assert np.abs(by_steps).max() < 1e-9


def test_unwinding_changes_no_pose() -> None:
    motion = molded(0.2, joints=3)
    chart, problem = motion.chart, motion.problems[0]
    theta = np.tile(problem.start, (4, 1))
    theta[:, chart.balls[0]] = np.array([[3.0, 0.5, 0.0], [5.0, 0.0, 1.0], [0.0, -7.0, 0.0], [20.0, 1.0, 2.0]])
    unwound = chart.unwound(theta)
    assert np.linalg.norm(unwound[:, chart.balls[0]], axis=1).max() <= np.pi + 1e-12
    before, after = (exponential(t[:, chart.balls[0]])[0] for t in (theta, unwound))
    assert np.allclose(before, after, atol=1e-12)


# --- laws ---------------------------------------------------------------------------------------------------


def steps_of(solution: MotionSolution, thetas: FloatArray | None = None) -> FloatArray:
    chart = solution.motion.chart
    return np.asarray(chart.steps(solution.thetas if thetas is None else thetas).values)


def mean_gap(solution: MotionSolution, row: int) -> float:
    problem = solution.motion.problems[row]
    gap = problem.state(solution.thetas[row]).vectors(problem.pairs.gap)
    return float(np.linalg.norm(gap, axis=1).mean() / problem.manipulator_length)


@pytest.mark.parametrize("degrees", [60.0, 300.0, 720.0])
def test_the_joint_motion_is_never_worse_and_turns_as_far_as_it_must(degrees: float) -> None:
    seconds = max(degrees / 300.0, 1.0)
    solution = solve_motion(molded(seconds, degrees=degrees))
    assert solution.status is SolveStatus.CONVERGED
    assert solution.value <= solution.causal_value
    assert list(solution.trace) == sorted(solution.trace, reverse=True)
    assert sum(solution.parts.values()) == pytest.approx(solution.value)
    assert max(mean_gap(solution, row) for row in range(0, len(solution.thetas), 6)) < 0.02
    peak = 1.875 * np.radians(degrees) / len(solution.thetas)  # of the minimum-jerk profile
    assert np.abs(steps_of(solution)[:, solution.motion.chart.balls[0]]).max() < 1.1 * peak  # no jump at the wrap


def fading(share: float) -> float:
    """Nothing, then a contact that eases in within a sixth of the time, holds, and lets go."""
    return eased((share - 0.3) * 6.0) * (1.0 - eased((share - 0.533) * 6.0))


def test_a_contact_that_eases_in_does_not_pop() -> None:
    """Alone, frame after frame, it pops on the first frame that has any weight."""
    away = {0.0: {"tentacle": moved_pose(12.0)}, 48.0: {"tentacle": moved_pose(12.0)}}
    motion = molded(2.0, travel=1.0, gain=fading, pins=away)
    solution = solve_motion(motion)
    root = motion.problems[0].is_root & motion.problems[0].is_translation
    pops = [
        np.linalg.norm(steps_of(solution, thetas)[:, root], axis=1).max()
        for thetas in (solution.causal, solution.thetas)
    ]
    length = motion.problems[0].manipulator_length
    far = max(np.linalg.norm(t[root]) for t in solution.thetas - solution.thetas[24]) / length
    assert pops[0] > 0.5 * far  # one step goes half of the way
    smooth = 1.875 * far / (0.4 * 48)  # a minimum-jerk reach in the time up to the grip
    assert pops[1] < 1.6 * smooth
    assert mean_gap(solution, 24) < 0.02
    held = [row for row in range(49) if motion.problems[row].contacts[0].gain > 0.99]
    assert max(mean_gap(solution, row) for row in held) < 0.03
    assert all(row in range(49) and motion.problems[row].contacts[0].gain == 0.0 for row in (1, 10, 38, 47))


def moved_pose(shift: float) -> Pose:
    problem = molded(0.1).problems[0]
    body = problem.bodies[0]
    local = body.pose.local.copy()
    local[0, 1, 3] += shift
    return Pose(body.rig.joints, local)


def test_pins_are_kept_to_the_bit_and_their_speed_goes_on() -> None:
    pose = moved_pose(3.0)
    motion = molded(1.0, pins={0.0: {"tentacle": pose}, 10.0: {"tentacle": pose}})
    solution = solve_motion(motion)
    assert solution.by_frame[10]["tentacle"] is pose
    chart_theta = motion.problems[10].theta_of({"tentacle": pose})
    assert np.array_equal(solution.thetas[10], chart_theta)
    # a window between two pinned frames on either side starts and ends with their speed
    whole = solve_motion(molded(1.0))
    outside = {f: whole.by_frame[int(f)] for f in (4.0, 5.0, 18.0, 19.0)}
    rows = slice(4, 20)
    window = replace(
        whole.motion, frames=whole.motion.frames[rows], problems=whole.motion.problems[rows],
        pins={f: {"tentacle": poses["tentacle"]} for f, poses in outside.items()},
    )  # fmt: skip
    again = solve_motion(window)
    assert np.abs(again.thetas - whole.thetas[rows]).max() < 2e-3


def test_24_and_60_frames_per_second_agree() -> None:
    slow, fast = (solve_motion(molded(1.0, rate, gain=fading)) for rate in (24.0, 60.0))
    for share in (0.25, 0.5, 0.75):
        one, other = (
            s.motion.problems[0].state(s.thetas[round(share * s.motion.rate)]).world[:, :3, 3] for s in (slow, fast)
        )
        length = slow.motion.problems[0].manipulator_length
        assert np.linalg.norm(one - other, axis=1).max() < 0.01 * length
    assert slow.value == pytest.approx(fast.value, rel=0.05)


def test_held_contacts_skate_less_with_the_skate_energy() -> None:
    def skate(weight: float) -> float:
        motion = molded(1.0, degrees=120.0, joints=3, weights=MotionWeights(3e-6, weight))
        problems = tuple(
            replace(p, bodies=(p.bodies[0], replace(p.bodies[1], world_from_rig=shaken(p, row))))
            for row, p in enumerate(motion.problems)
        )
        solution = solve_motion(replace(motion, problems=problems))
        return solution.parts["skate"] / max(weight, 1e-12)

    def shaken(problem: object, row: int) -> FloatArray:
        placed = problem.bodies[1].world_from_rig.copy()  # type: ignore[attr-defined]
        placed[:3, :3] *= 1.0 + 0.1 * (row % 2)  # breathes: cannot be followed exactly
        return np.asarray(placed)

    assert skate(10.0) < 0.5 * skate(1e-6)


def test_an_approach_is_no_slip() -> None:
    """A contact that fades in pulls from afar; what it still has to travel must not hold back what holds."""
    ramp = molded(0.5, gain=lambda share: min(4.0 * share, 1.0))
    on = [all(contact.gain == 1.0 for contact in problem.contacts) for problem in ramp.problems]
    for first, second, held in zip(ramp.problems, ramp.problems[1:], held_between(on), strict=False):
        assert bool(len(held_rows(first, second).weights)) is held
    motion = replace(ramp, weights=MotionWeights(skate=1.0))
    thetas = np.array([problem.start_state.theta for problem in motion.problems])
    thetas[: on.index(True)] += 0.3  # somewhere else on its way
    objective = JointObjective(motion)
    moved = objective.parts(objective.states(thetas))["skate"]
    thetas[: on.index(True)] -= 0.3
    assert moved == pytest.approx(objective.parts(objective.states(thetas))["skate"])
    assert moved > 0.0


def held_between(on: list[bool]) -> list[bool]:
    """Whether the contacts are on at both of two frames that follow one another."""
    return [a and b for a, b in itertools.pairwise(on)]


def test_bounds_are_honoured_and_reported() -> None:
    free = solve_motion(molded(0.5, degrees=120.0))
    speeds = np.abs(steps_of(free)[:, free.motion.chart.balls[0]] * 24.0).max()
    bound = 0.6 * float(speeds)
    bounded = solve_motion(replace(free.motion, bounds=MotionBounds(turning_speed=bound)))
    assert np.abs(steps_of(bounded)[:, free.motion.chart.balls[0]] * 24.0).max() <= 1.02 * bound
    assert bounded.speed_excess <= 0.02
    impossible = solve_motion(
        replace(
            free.motion, bounds=MotionBounds(travel_speed=0.1),
            pins={0.0: {"tentacle": moved_pose(0.0)}, 6.0: {"tentacle": moved_pose(9.0)}},
        )
    )  # fmt: skip
    assert impossible.speed_excess > 1.0  # said, not hidden


def test_a_motion_without_any_contact_joins_its_pins_smoothly() -> None:
    motion = molded(
        1.0, gain=lambda _: 0.0, pins={0.0: {"tentacle": moved_pose(0.0)}, 24.0: {"tentacle": moved_pose(8.0)}}
    )
    motion = replace(motion, problems=tuple(replace(p, contacts=()) for p in motion.problems))
    solution = solve_motion(motion)
    root = np.flatnonzero(motion.problems[0].is_root & motion.problems[0].is_translation)
    away = np.linalg.norm(solution.thetas[:, root] - solution.thetas[0, root], axis=1)
    assert (np.diff(away) > 0.0).all()
    assert np.allclose(np.diff(away), away[-1] / 24.0, rtol=1e-3)  # nothing but the least acceleration: a line


def test_cost_is_linear_in_the_frames() -> None:
    """Counted, not timed: frames evaluated and modelled per frame, and the size of the banded system."""
    short, long = (solve_motion(molded(seconds, degrees=60.0 * seconds)) for seconds in (1.0, 4.0))
    per_frame = [(s.evaluations / len(s.thetas), s.models / len(s.thetas)) for s in (short, long)]
    assert per_frame[1][0] <= 1.5 * per_frame[0][0]
    assert per_frame[1][1] <= per_frame[0][1] + 3.0
    band = [BlockBand.zeros(n, 5).lower_band().size / n for n in (10, 1000)]
    assert band[0] == band[1]


def test_cancelled_anywhere_a_whole_motion_comes_back() -> None:
    motion = molded(0.5)
    shares = list[float | None]()
    solve_motion(motion, progress=CallbackProgress(lambda share, _: shares.append(share)))
    known = [share for share in shares if share is not None]
    assert known == sorted(known)
    assert 0.0 <= known[0] <= known[-1] <= 1.0
    assert len(known) > len(motion.frames)
    for stop in (0, 5, len(motion.frames)):
        told = itertools.count()

        def cancel(*_: object, told: itertools.count[int] = told, stop: int = stop) -> None:
            if next(told) >= stop:
                raise Cancelled

        solution = solve_motion(motion, progress=CallbackProgress(cancel))
        assert solution.status is SolveStatus.CANCELLED
        assert solution.thetas.shape == motion.pinned.shape
        assert np.isfinite(solution.thetas).all()
        assert solution.value <= solution.causal_value


def test_a_start_takes_the_place_of_the_causal_pass() -> None:
    solved = solve_motion(molded(1.0))
    again = solve_motion(solved.motion, start=solved.thetas)
    assert again.iterations <= 2
    assert again.evaluations < 0.5 * solved.evaluations
    assert again.value <= solved.value * (1.0 + 1e-9)


def test_follow_keeps_a_reference() -> None:
    motion = molded(0.5)
    poses = tuple(moved_pose(0.1 * k) for k in range(len(motion.frames)))
    following = replace(motion, weights=MotionWeights(3e-4, 0.0, 1e6, 1.0), reference={"tentacle": poses})
    solution = solve_motion(following)
    expected = [p.theta_of({"tentacle": pose}) for p, pose in zip(motion.problems, poses, strict=True)]
    assert np.abs(solution.thetas - expected).max() < 0.02


def test_what_does_not_fit_is_refused_in_words() -> None:
    motion = molded(0.2)
    frozen_dof = replace(motion.problems[1], held={"tentacle": ["link01"]})
    cases = [
        (lambda: replace(motion, frames=motion.frames[:-1]), "one pose problem per frame"),
        (lambda: replace(motion, frames=(0.0, *motion.frames[:-1])), "must rise"),
        (lambda: replace(motion, rate=0.0), "rate"),
        (lambda: replace(motion, problems=(motion.problems[0], frozen_dof, *motion.problems[2:])), "frame 1"),
        (lambda: replace(motion, pins={99.0: {}}), "frame 99"),
        (lambda: replace(motion, weights=MotionWeights(follow=1.0)), "reference"),
        (lambda: MotionWeights(skate=-1.0), "skate"),
        (lambda: MotionBounds(travel_speed=0.0), "travel_speed"),
    ]
    for make, words in cases:
        with pytest.raises(InvalidInput, match=words):
            make()


def test_iterations_that_run_out_are_said() -> None:
    motion: MotionProblem = molded(1.0, gain=fading, pins={0.0: {"tentacle": moved_pose(12.0)}})
    assert solve_motion(motion, options=MotionOptions(max_iterations=1)).status is SolveStatus.STOPPED


def test_what_a_contact_holds_is_what_it_counts() -> None:
    """The point: its normals are free. The direction: it may be anywhere, and slips nowhere. Both: all of it."""
    base = molded(0.2, weights=MotionWeights(skate=1.0))

    def parts(hold: str) -> tuple[float, float, float]:
        problems = tuple(
            replace(p, contacts=tuple(replace(c, hold=hold) for c in p.contacts), terms=paper_terms())
            for p in base.problems
        )
        state = problems[-1].start_state
        distance, normal = (term.bind(problems[-1]).value(state) for term in (DistanceTerm(), NormalTerm()))
        objective = JointObjective(replace(base, problems=problems))
        return distance, normal, objective.parts([p.start_state for p in problems])["skate"]

    both, point, direction = (parts(hold) for hold in ("both", "point", "direction"))
    assert min(both) > 0.0
    assert point == (both[0], 0.0, both[2]) and direction == (0.0, both[1], 0.0)
    with pytest.raises(InvalidInput, match="holds"):
        parts("nothing")
