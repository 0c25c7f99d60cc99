"""Coupled hinges (a robot's mimic joints): one dof, exact gradients, the limits of both, poses that keep it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.rig.chart import Chart
from contact_core.rig.poses import set_angles
from contact_core.rig.rig import JointFreedom, Pose, Rig, still_following
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import SolveOptions
from contact_core.testing import meshes, rigs

TURN = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]])
LOWER, UPPER = -0.6, 0.9


def coupled_rig(ratio: float = 0.7, other: float = -1.4) -> Rig:
    """A free root, a leader, one that follows it, a hinge of its own, and one that follows the leader, too."""

    def freedom(index: int) -> JointFreedom:
        if index == 0:
            return JointFreedom("ball", translates=True)
        limits = {"lower": np.array([LOWER]), "upper": np.array([UPPER])}
        if index in (2, 4):
            turns = ratio if index == 2 else other
            return JointFreedom("hinge", frame=TURN, follows="link01", ratio=turns, **limits)
        return JointFreedom("hinge", frame=TURN.T, **limits)

    return rigs.tentacle(6, freedom)


def rule_holds(rig: Rig, pose: Pose, ratio: float, other: float) -> None:
    """Angles are read off the matrices alone, not by the chart that wrote them."""
    angles = []
    for joint in (1, 2, 4):
        frame = rig.freedoms[joint].frame
        turned = frame.T @ (np.linalg.inv(rig.rest_local[joint]) @ pose.local[joint])[:3, :3] @ frame
        assert np.allclose(turned[:, 0], [1.0, 0.0, 0.0], atol=1e-9)
        angles.append(np.arctan2(turned[2, 1], turned[1, 1]))
    assert np.allclose(angles[1:], [ratio * angles[0], other * angles[0]], atol=1e-9)
    assert all(LOWER - 1e-9 <= angle <= UPPER + 1e-9 for angle in angles)


@settings(max_examples=20)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.integers(0, 1000))
def test_gradients_and_gauss_newton_know_the_coupling(ratio: float, other: float, seed: int) -> None:
    rig = coupled_rig(ratio, other)
    ball = meshes.icosphere(2, 4.0)
    random = np.random.default_rng(seed)
    on_ball = rigs.SurfacePoints(random.integers(0, len(ball.faces), 40), random.dirichlet(np.ones(3), 40))
    pair = PairedPoints("hold", rig.name, rigs.scattered_points(rig, 40, seed), "ball", on_ball)
    problem = PoseProblem((Body.skinned(rig), Body.rigid("ball", ball)), (pair,))
    assert not any(name.startswith(("link02", "link04")) for name in {n.split("/")[1] for n in problem.dof_names})
    theta = np.clip(random.normal(0.0, 0.5, len(problem.start)), *problem.limits_of_theta)
    state, step = problem.state(theta), 1e-5
    track = problem.pairs.manipulator_points
    exact, jacobian = problem.gradient(state), state.jacobian(track)
    for q, unit in enumerate(np.eye(len(theta)) * step):
        ahead, behind = problem.state(theta + unit), problem.state(theta - unit)
        numeric = (problem.value(ahead) - problem.value(behind)) / (2.0 * step)
        assert abs(numeric - exact[q]) <= 1e-6 * max(np.abs(exact).max(), 1.0)
        moved = (ahead.vectors(track) - behind.vectors(track)) / (2.0 * step)
        assert np.allclose(jacobian[:, :, q], moved, atol=1e-6 * np.abs(jacobian).max())


@settings(max_examples=8)
@given(st.sampled_from([(0.7, -1.4), (1.0, 1.0), (2.5, 0.0), (-0.5, -3.0)]), st.integers(0, 1000))
def test_a_solved_pose_keeps_the_rule_and_the_limits_of_both(ratios: tuple[float, float], seed: int) -> None:
    rig = coupled_rig(*ratios)
    problem, _ = rigs.planted(rig, seed)
    solution = LevenbergMarquardt().solve(problem, SolveOptions())
    rule_holds(rig, solution.poses[rig.name], *ratios)
    assert rigs.mean_gap(problem, solution.theta) < 0.1 * problem.unit


def test_limits_of_a_leader_keep_its_followers_in_theirs() -> None:
    chart = Chart(coupled_rig(0.5, -1.4))
    leader = chart.dof_names.index("link01.x")
    assert np.allclose([chart.lower[leader], chart.upper[leader]], [max(LOWER, UPPER / -1.4), LOWER / -1.4])
    assert chart.locked[[chart.dof_names.index(name) for name in ("link02.x", "link04.x")]].all()


def test_a_pose_that_breaks_the_rule_comes_back_as_it_was() -> None:
    rig = coupled_rig()
    chart = Chart(rig)
    straight = Pose(rig.joints, chart.local(np.where(np.array(chart.dof_names) == "link01.x", 0.3, 0.0)))
    assert chart.theta_of(straight)[1] is None
    local = straight.local.copy()
    local[2] = rig.rest_local[2]
    theta, leftover = chart.theta_of(Pose(rig.joints, local))
    assert leftover is not None and np.allclose(chart.local(theta, leftover), local, atol=1e-12)


def test_what_follows_is_set_by_what_it_follows() -> None:
    rig = coupled_rig()
    with pytest.raises(InvalidInput, match=r"link02.x .* turns with link01.x"):
        set_angles(rig, Pose.rest(rig), {"link02.x": 0.1})
    rule_holds(rig, set_angles(rig, Pose.rest(rig), {"link01.x": 0.3}), 0.7, -1.4)


def test_a_follower_needs_a_hinge_that_follows_none() -> None:
    with pytest.raises(InvalidInput, match="hinge with a finite ratio"):
        JointFreedom("ball", follows="a")
    rig = coupled_rig()
    lost = [JointFreedom("hinge", follows="gone") if k == 3 else f for k, f in enumerate(rig.freedoms)]
    with pytest.raises(InvalidInput, match="follows 'gone'"):
        Rig(**{**{k: getattr(rig, k) for k in rig.__dataclass_fields__}, "freedoms": tuple(lost)})
    held = still_following(rig.joints, lost)
    assert held[3].kind == "fixed" and held[2].follows == "link01"
