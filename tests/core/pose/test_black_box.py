"""Black boxes: a rig that only evaluates is posed like the analytic one, and its gradients are as exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.chart import Chart
from contact_core.rig.rig import Rig, skin
from contact_core.solve.black_box import BlackBoxDof, DeformedSkin
from contact_core.solve.body import Body
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.testing import rigs
from contact_core.testing.term_contract import differences


class Counted(DeformedSkin):
    """A rig behind a curtain: its own skin, evaluated whole, and counted."""

    def __init__(self, rig: Rig, length: float) -> None:
        chart = Chart(rig)
        dofs = [
            BlackBoxDof(name, low, high, is_translation=bool(moves), is_root=bool(root))
            for name, low, high, moves, root in zip(
                chart.dof_names, chart.lower, chart.upper, chart.is_translation, chart.is_root, strict=True
            )
        ]
        self.evaluations = 0

        def deform(theta: FloatArray) -> FloatArray:
            self.evaluations += 1
            return skin(rig, chart.motion(theta).world)

        super().__init__(rig.surface, dofs, deform, length)


def both() -> tuple[PoseProblem, PoseProblem, Counted]:
    analytic, _ = rigs.planted(rigs.tentacle(5, rigs.limited_freedom), 2, contacts=60)
    box = Counted(analytic.bodies[0].rig, analytic.manipulator_length)
    hidden = replace(analytic, bodies=(Body.evaluated("tentacle", box), analytic.bodies[1]))
    return analytic, hidden, box


def test_points_and_gradients_are_those_of_the_analytic_rig() -> None:
    analytic, hidden, _ = both()
    theta = np.clip(np.random.default_rng(0).normal(0.0, 0.3, len(analytic.start)), *analytic.limits_of_theta)
    one, two = (problem.state(theta) for problem in (analytic, hidden))
    assert np.abs(one.vectors(analytic.pairs.gap) - two.vectors(hidden.pairs.gap)).max() < 1e-9
    assert np.abs(one.jacobian(analytic.pairs.gap) - two.jacobian(hidden.pairs.gap)).max() < 1e-5
    exact = hidden.gradient(two)
    numeric = differences(hidden, theta)
    assert np.abs(exact - numeric).max() <= 1e-6 * np.abs(numeric).max()
    assert hidden.manipulator_length == analytic.manipulator_length


def test_it_is_posed_and_its_pose_comes_back() -> None:
    analytic, hidden, box = both()
    # Rigid fits need a root that is known to be rigid; a black box starts where the host stands.
    near = hidden.at(analytic.start + 0.0)
    solution = LevenbergMarquardt().solve(near)
    assert solution.value < 0.05 * solution.start_value
    assert box.evaluations < 60 * 2 * len(hidden.start)
    values = dict(zip(hidden.charts[0].dof_names, solution.theta, strict=True))
    pose = solution.poses["tentacle"]
    assert dict(zip(pose.joints, pose.local[:, 0, 3], strict=True)) == values
    assert np.array_equal(hidden.theta_of(solution.poses), solution.theta)
    assert solution.patches["all"].mean < 0.2 * hidden.manipulator_length


def test_names_must_be_unique() -> None:
    analytic, _, _ = both()
    box = DeformedSkin(
        analytic.bodies[0].rig.surface, [BlackBoxDof("a"), BlackBoxDof("a")], lambda theta: theta, 1.0
    )
    with pytest.raises(InvalidInput, match="unique"):
        _ = replace(analytic, bodies=(Body.evaluated("tentacle", box), analytic.bodies[1])).charts
