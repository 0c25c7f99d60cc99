"""The joint pass: all frames at once, by Levenberg-Marquardt on a banded system.

E = sum_f T_f E_f(theta_f)                          the frames' own terms, T_f the time a frame stands for
  + w_a sum_f T_f |a_f - a_f of the reference|^2    accelerations
  + w_k sum_f T |slip_f / T|^2                      skate, seen from the objects (`skate`)
  + w_r sum_f T_f |theta_f - reference|^2           only with a reference
  + sum_f T_f B |what exceeds a bound|^2            B rises where a bound is exceeded (`MotionBounds`)
  + walls at frames in transit                      dearer while skin is deeper than its bound

All sums are integrals over seconds, so the rate of the frames does not matter. Steps, limits and damping are those
of the solver of single poses (`solve.levenberg_marquardt`); a step costs n d^3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.motion.band import BlockBand, bounded_minimum
from contact_core.motion.depth import HELD, SAMPLES, deepest_skin
from contact_core.motion.problem import MotionProblem
from contact_core.motion.skate import SkateEnergy
from contact_core.motion.steps import Clock, Steps
from contact_core.rig.rig import Rig
from contact_core.solve.penetration import Allowance, NoDeeperTerm, thinned
from contact_core.solve.state import PoseState

FIRST_WALL = 8.0  # weight of depth beyond its bound
INSIDE = 0.9  # of the bound: where walls stand, for they see the solid on a grid
FIRST_DAMPING = 1e-3
LARGEST_DAMPING = 1e8
FIRST_BOUND_WEIGHT = 0.1  # times the weight of accelerations, or of 1 where those are free


class JointObjective:
    """E of a motion. evaluations: how many single frames were evaluated, models: of how many a model was made."""

    def __init__(self, motion: MotionProblem) -> None:
        self.motion, self.problems = motion, list(motion.posed)
        self.clock, self.chart = motion.clock, motion.chart
        self.walls = np.zeros(len(motion.frames))  # per frame, what skin that is too deep costs
        self.skate = SkateEnergy(motion.posed, self.clock.gaps, motion.weights.skate)
        self.reference = motion.reference_thetas
        self.reference_acceleration: FloatArray | float = 0.0
        if self.reference is not None and len(motion.frames) > 2:
            self.reference_acceleration = self.clock.accelerations(self.chart.steps(self.reference).values)
        share = np.where(self.problems[0].is_root, motion.weights.follow_root, 1.0)
        self.follow_weights = motion.weights.follow * share  # (d,)
        self.bounds = motion.bounds.of(self.problems[0])
        n, d = motion.pinned.shape
        self.bound_weights = np.zeros((n - 1, d)), np.zeros((max(n - 2, 0), d))
        self.evaluations = self.models = 0

    def states(self, thetas: FloatArray) -> list[PoseState]:
        """Of thetas (n, d)."""
        self.evaluations += len(thetas)
        return [problem.state(theta) for problem, theta in zip(self.problems, thetas, strict=True)]

    def parts(self, states: list[PoseState]) -> dict[str, float]:
        """The energies by name; their sum is the objective."""
        steps = self.chart.steps(np.array([state.theta for state in states]))
        values = [problem.value(state) for problem, state in zip(self.problems, states, strict=True)]
        result = {"frames": float(self.clock.spans @ values), "skate": self.skate.value(states)}
        result |= {name: form.value() for name, form in self._forms(steps).items()}
        if self.reference is not None and self.motion.weights.follow > 0.0:
            away = self._away(states)[0].values[0::2]
            result["follow"] = float(self.clock.spans @ (away * away) @ self.follow_weights)
        return result

    def value(self, states: list[PoseState]) -> float:
        """The objective; infinite where it is not a number."""
        total = sum(self.parts(states).values())
        return total if np.isfinite(total) else np.inf

    def model(self, states: list[PoseState]) -> tuple[FloatArray, BlockBand]:
        """Gradient (n, d) and Gauss-Newton matrix."""
        self.models += len(states)
        thetas = np.array([state.theta for state in states])
        gradient, matrix = np.zeros_like(thetas), BlockBand.zeros(*thetas.shape)
        for f, (problem, state, time) in enumerate(zip(self.problems, states, self.clock.spans, strict=True)):
            gradient[f] = time * problem.gradient(state)
            matrix.own[f] = time * problem.normal_matrix(state)
        self.skate.add_model(states, gradient, matrix)
        steps = self.chart.steps(thetas)
        for form in self._forms(steps).values():
            by_steps, own, next_ = form.derivatives()
            steps.add_gradient(by_steps, gradient)
            steps.add_curvature(own, next_, matrix)
        if self.reference is not None and self.motion.weights.follow > 0.0:
            self._add_follow(states, gradient, matrix)
        return gradient, matrix

    def _forms(self, steps: Steps) -> dict[str, _Speeds | _Accelerations]:
        """What costs by steps alone."""
        if len(steps.values) < 1:
            return {}
        clock, result = self.clock, dict[str, _Speeds | _Accelerations]()
        speeds = clock.speeds(steps.values)
        if np.isfinite(self.bounds[0]).any():
            beyond = speeds - np.clip(speeds, -self.bounds[0], self.bounds[0])
            result["bounds of speed"] = _Speeds(clock, beyond, self.bound_weights[0] * (beyond != 0.0))
        if len(steps.values) < 2:
            return result
        accelerations = clock.accelerations(steps.values)
        weights = np.full_like(accelerations, self.motion.weights.acceleration)
        result["acceleration"] = _Accelerations(clock, accelerations - self.reference_acceleration, weights)
        if np.isfinite(self.bounds[1]).any():
            beyond = accelerations - np.clip(accelerations, -self.bounds[1], self.bounds[1])
            result["bounds of acceleration"] = _Accelerations(
                clock, beyond, self.bound_weights[1] * (beyond != 0.0)
            )
        return result

    def raise_bounds(self, states: list[PoseState], tolerance: float) -> bool:
        """Make bounds dearer where they are exceeded by more than a share `tolerance`; whether any is."""
        steps = self.chart.steps(np.array([state.theta for state in states])).values
        first = FIRST_BOUND_WEIGHT * (self.motion.weights.acceleration or 1.0)
        raised = False
        speeds = self.clock.speeds(steps) if len(steps) else steps
        accelerations = self.clock.accelerations(steps) if len(steps) > 1 else steps[:0]
        for values, bound, weights, unit in (
            (speeds, self.bounds[0], self.bound_weights[0], 100.0 * first),
            (accelerations, self.bounds[1], self.bound_weights[1], first),
        ):
            beyond = (np.abs(values) > bound * (1.0 + tolerance)) & self._can_move(len(values))
            weights[beyond] = np.maximum(8.0 * weights[beyond], unit)
            raised |= bool(beyond.any())
        return raised

    def raise_walls(self, states: list[PoseState], tolerance: float) -> bool:
        """Make depth dearer at frames in transit at which skin is deeper than its bound by more than a share
        `tolerance`; whether any is."""
        bound, raised = self.motion.bounds.depth, False
        if not np.isfinite(bound):
            return False
        for row, (posed, state) in enumerate(zip(self.motion.posed, states, strict=True)):
            held = any(contact.gain >= HELD for contact in posed.contacts) or self.motion.pinned[row].all()
            if held or deepest_skin(posed, state) <= bound * (1.0 + tolerance):
                continue
            self.walls[row], raised = max(8.0 * self.walls[row], FIRST_WALL), True
            allowed = {
                body.name: _even_allowance(body.rig, INSIDE * bound / posed.unit)
                for body in posed.bodies
                if len(body.rig.joints) > 1 and body.black_box is None
            }
            wall = NoDeeperTerm(allowed, weight=self.walls[row])
            self.problems[row] = replace(posed, terms=(*posed.terms, wall))
        return raised

    def _can_move(self, rows: int) -> BoolArray:
        """(rows, d) whether any frame that a speed or acceleration spans may move."""
        free = ~self.motion.pinned
        reach = len(free) - rows
        return np.asarray(np.any([free[k : k + rows] for k in range(reach + 1)], axis=0))

    def _away(self, states: list[PoseState]) -> tuple[Steps, FloatArray]:
        """Steps from the reference to each frame at even rows, and the thetas, interleaved."""
        assert self.reference is not None
        thetas = np.array([state.theta for state in states])
        both = np.empty((2 * len(thetas), thetas.shape[1]))
        both[0::2], both[1::2] = self.reference, thetas
        return self.chart.steps(both), thetas

    def _add_follow(self, states: list[PoseState], gradient: FloatArray, matrix: BlockBand) -> None:
        steps, thetas = self._away(states)
        weights = np.zeros_like(steps.values)
        weights[0::2] = 2.0 * self.follow_weights * self.clock.spans[:, None]
        slopes = np.zeros((2 * len(thetas), thetas.shape[1]))
        steps.add_gradient(weights * steps.values, slopes)
        model = BlockBand.zeros(*slopes.shape)
        steps.add_curvature(weights, weights[:0], model)
        gradient += slopes[1::2]
        matrix.own += model.own[1::2]


def _even_allowance(rig: Rig, depth: float) -> Allowance:
    """Every vertex that stands for the skin may be so deep, in l."""
    vertices, _ = thinned(rig.surface, SAMPLES)
    return Allowance(vertices, np.full(len(vertices), depth))


@dataclass(frozen=True, eq=False)
class _Speeds:
    """sum T_f weights |values|^2 over speeds (n - 1, d)."""

    clock: Clock
    values: FloatArray
    weights: FloatArray

    def value(self) -> float:
        return float(self.clock.gaps @ (self.weights * self.values**2).sum(axis=1))

    def derivatives(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """By steps: gradient (n - 1, d), second derivatives of each with itself, and with the next (n - 2, d)."""
        gaps = self.clock.gaps[:, None]
        own = 2.0 * self.weights / gaps
        return 2.0 * self.weights * self.values, own, np.zeros((0, own.shape[1]))


@dataclass(frozen=True, eq=False)
class _Accelerations:
    """sum T_f weights |values|^2 over accelerations (n - 2, d)."""

    clock: Clock
    values: FloatArray
    weights: FloatArray

    def value(self) -> float:
        return float(self.clock.spans[1:-1] @ (self.weights * self.values**2).sum(axis=1))

    def derivatives(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As those of speeds: an acceleration is (step' / gap' - step / gap) / T."""
        gaps, spans = self.clock.gaps[:, None], self.clock.spans[1:-1, None]
        force = 2.0 * self.weights * self.values  # by the acceleration, times T
        gradient = np.zeros((len(gaps), force.shape[1]))
        gradient[1:] += force / gaps[1:]
        gradient[:-1] -= force / gaps[:-1]
        stiffness = 2.0 * self.weights / spans
        own = np.zeros_like(gradient)
        own[1:] += stiffness / gaps[1:] ** 2
        own[:-1] += stiffness / gaps[:-1] ** 2
        return gradient, own, -stiffness / (gaps[1:] * gaps[:-1])


@dataclass
class JointDescent:
    """One descent of the objective from thetas (n, d), the best so far in `states` at any time.

    observe: called after each iteration with the descent; what it raises ends the descent where it is.
    """

    objective: JointObjective
    thetas: FloatArray
    tolerance: float
    observe: Callable[[JointDescent], None]
    damping: float = FIRST_DAMPING
    growth: float = 2.0
    settled: bool = False
    iterations: int = 0
    trace: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.lower, self.upper = (
            np.array(side) for side in zip(*(p.limits_of_theta for p in self.objective.problems), strict=True)
        )
        self.pinned = self.objective.motion.pinned
        inside = np.clip(self.thetas, self.lower, self.upper)
        self.states = self.objective.states(np.where(self.pinned, self.thetas, inside))
        self.value = self.objective.value(self.states)

    @property
    def best(self) -> FloatArray:
        """(n, d)"""
        return np.array([state.theta for state in self.states])

    def restart(self) -> None:
        """Go on after the objective has changed."""
        self.states = self.objective.states(self.best)
        self.value = self.objective.value(self.states)
        self.damping, self.growth, self.settled = FIRST_DAMPING, 2.0, False

    def run(self, iterations: int) -> bool:
        """Up to so many iterations; whether it settled."""
        model: tuple[FloatArray, BlockBand] | None = None
        for _ in range(iterations):
            if self.settled:
                break
            model = model or self.objective.model(self.states)
            if self._step(*model):
                model = None
            self.iterations += 1
            self.trace.append(self.value)
            self.observe(self)
        return self.settled

    def _step(self, gradient: FloatArray, matrix: BlockBand) -> bool:
        """One trial step; whether it was taken."""
        thetas = self.best
        low = np.where(self.pinned, 0.0, np.minimum(self.lower - thetas, 0.0))
        high = np.where(self.pinned, 0.0, np.maximum(self.upper - thetas, 0.0))
        step = bounded_minimum(matrix, self.damping, gradient, low, high)
        if step is None:
            self._damp_more()
            return False
        predicted = -float((gradient * step).sum() + 0.5 * (step * matrix.times(step)).sum())
        if predicted <= self.tolerance * 1e-2 * abs(self.value):
            self.settled = True
            return False
        moved = np.where(self.pinned, thetas, np.clip(thetas + step, self.lower, self.upper))
        states = self.objective.states(self.objective.chart.unwound(moved))
        value = self.objective.value(states)
        gain = (self.value - value) / predicted
        if not gain > 0.0:
            self._damp_more()
            return False
        self.settled = self.value - value <= self.tolerance * self.value and self.damping < 1.0
        self.states, self.value = states, value
        self.damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
        self.growth = 2.0
        return True

    def _damp_more(self) -> None:
        self.damping *= self.growth
        self.growth *= 2.0
        self.settled = self.damping > LARGEST_DAMPING
