"""How theta goes from frame to frame: steps, speeds and accelerations, and the energies that they cost.

A step is the difference of two frames' numbers, in natural units (1 radian, or the manipulator's length). A ball
joint without limits, as the root of a rig is, may turn on and on, and its rotation vector wraps: its step is the
rotation vector of the turn from one frame to the next, R' R^T, which knows no wrap. Derivatives by the rotation
vectors go through the Jacobians of SO(3) (Sola, Deray, Atchuthan: A micro Lie theory, 2018, eq. 143-146).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray, IntArray
from contact_core.motion.band import BlockBand
from contact_core.rig.chart import Chart
from contact_core.rig.rotations import exponential
from contact_core.solve.problem import PoseProblem


@dataclass(frozen=True, eq=False)
class StepChart:
    """balls: (b, 3) the dofs of each ball joint that turns without limits. plain: the other dofs. scale: (d,)."""

    balls: IntArray
    plain: IntArray
    scale: FloatArray

    @classmethod
    def of(cls, problem: PoseProblem) -> StepChart:
        """The chart of all problems that free the same dofs."""
        lower, upper = problem.limits_of_theta
        unlimited = np.isinf(lower) & np.isinf(upper)
        balls = []
        for index, chart in enumerate(problem.charts):
            if not isinstance(chart, Chart):
                continue
            place = np.full(chart.size, -1)
            place[problem.free_of_body[index]] = np.arange(
                problem.dof_slices[index].start, problem.dof_slices[index].stop
            )
            for freedom, dofs in zip(chart.rig.freedoms, chart.rotation_slices, strict=True):
                at = place[dofs]
                if freedom.kind == "ball" and (at >= 0).all() and unlimited[at].all():
                    balls.append(at)
        ball_dofs = np.array(balls, np.int64).reshape(-1, 3)
        plain = np.setdiff1d(np.arange(len(lower)), ball_dofs)
        return cls(ball_dofs, plain, problem.scale)

    def unwound(self, thetas: FloatArray) -> FloatArray:
        """The same poses (n, d) with the rotation vectors of the balls at most pi long."""
        result = thetas.copy()
        for ball in self.balls:
            vectors = result[:, ball]
            angle = np.linalg.norm(vectors, axis=1)
            long = angle > np.pi
            if long.any():
                shorter = np.remainder(angle[long] + np.pi, 2.0 * np.pi) - np.pi
                result[np.ix_(np.flatnonzero(long), ball)] = vectors[long] * (shorter / angle[long])[:, None]
        return result

    def steps(self, thetas: FloatArray) -> Steps:
        """The steps between frames of thetas (n, d), with their derivatives."""
        difference = np.diff(thetas, axis=0) / self.scale
        n, b = len(thetas), len(self.balls)
        if not b:
            nothing = np.zeros((max(n - 1, 0), 0, 3, 3))
            return Steps(self, difference, nothing, nothing)
        turns, left = exponential(thetas[:, self.balls].reshape(-1, 3))
        turns, left = turns.reshape(n, b, 3, 3), left.reshape(n, b, 3, 3)
        between = turns[1:] @ turns[:-1].swapaxes(-1, -2)
        vectors = Rotation.from_matrix(between.reshape(-1, 3, 3)).as_rotvec().reshape(n - 1, b, 3)
        difference[:, self.balls] = vectors
        inverse = np.linalg.inv(exponential(vectors.reshape(-1, 3))[1]).reshape(n - 1, b, 3, 3)
        return Steps(self, difference, inverse @ left[1:], -inverse.swapaxes(-1, -2) @ left[:-1])


@dataclass(frozen=True, eq=False)
class Steps:
    """values: (n - 1, d) in natural units. later, earlier: (n - 1, b, 3, 3) derivatives of the balls' steps by the
    rotation vectors at the later and at the earlier frame; the other dofs' are 1 and -1 over their scale."""

    chart: StepChart
    values: FloatArray
    later: FloatArray
    earlier: FloatArray

    def add_gradient(self, by_steps: FloatArray, gradient: FloatArray) -> None:
        """Add to the gradient (n, d) by theta what an energy with this gradient (n - 1, d) by steps has."""
        plain, balls = self.chart.plain, self.chart.balls
        share = by_steps[:, plain] / self.chart.scale[plain]
        gradient[1:, plain] += share
        gradient[:-1, plain] -= share
        if len(balls):
            forces = by_steps[:, balls]  # (n - 1, b, 3)
            gradient[1:, balls] += np.einsum("fbji,fbj->fbi", self.later, forces)
            gradient[:-1, balls] += np.einsum("fbji,fbj->fbi", self.earlier, forces)

    def add_curvature(self, own: FloatArray, next_: FloatArray, matrix: BlockBand) -> None:
        """Add the model of an energy whose second derivatives by steps are own (n - 1, d), each step with itself,
        and next_ (n - 2, d), each step with the one after it."""
        late, early = (1.0, self.later), (-1.0, self.earlier)
        self._add(matrix.own[1:], late, own, late)
        self._add(matrix.own[:-1], early, own, early)
        self._add(matrix.next, late, own, early)
        if not len(next_):
            return
        first_late, first_early = (1.0, self.later[:-1]), (-1.0, self.earlier[:-1])
        second_late, second_early = (1.0, self.later[1:]), (-1.0, self.earlier[1:])
        self._add(matrix.own[1:-1], second_early, next_, first_late)
        self._add(matrix.own[1:-1], first_late, next_, second_early)
        self._add(matrix.next[:-1], second_early, next_, first_early)
        self._add(matrix.next[1:], second_late, next_, first_late)
        self._add(matrix.after, second_late, next_, first_early)

    def _add(
        self,
        blocks: FloatArray,
        rows: tuple[float, FloatArray],
        weights: FloatArray,
        columns: tuple[float, FloatArray],
    ) -> None:
        """blocks (m, d, d) += rows^T diag(weights) columns, for derivatives given as sign and matrices of balls."""
        plain = self.chart.plain
        blocks[:, plain, plain] += rows[0] * columns[0] * weights[:, plain] / self.chart.scale[plain] ** 2
        for b, ball in enumerate(self.chart.balls):
            product = rows[1][:, b].swapaxes(-1, -2) @ (weights[:, ball, None] * columns[1][:, b])
            blocks[:, ball[:, None], ball] += product


@dataclass(frozen=True, eq=False)
class Clock:
    """When frames are. seconds: (n,) rising. gaps: (n - 1,). spans: (n,) the time that each frame stands for."""

    seconds: FloatArray

    @property
    def gaps(self) -> FloatArray:
        return np.diff(self.seconds)

    @property
    def spans(self) -> FloatArray:
        gaps = self.gaps
        if not len(gaps):
            return np.ones(len(self.seconds))
        return 0.5 * (np.concatenate([gaps[:1], gaps]) + np.concatenate([gaps, gaps[-1:]]))

    def speeds(self, steps: FloatArray) -> FloatArray:
        """(n - 1, d) per second, of steps (n - 1, d)."""
        return steps / self.gaps[:, None]

    def accelerations(self, steps: FloatArray) -> FloatArray:
        """(n - 2, d) per second squared at the inner frames, of steps (n - 1, d)."""
        return np.diff(self.speeds(steps), axis=0) / self.spans[1:-1, None]
