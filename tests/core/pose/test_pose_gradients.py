"""Gradients equal central differences: every term, every kind of joint, both ends of a pair, near limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.rig.rig import Pose, Rig
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.problem import PoseProblem
from contact_core.solve.stretch import SkinStretchTerm
from contact_core.testing import meshes, rigs

STEP = 1e-5


def derivative(problem: PoseProblem, theta: np.ndarray) -> np.ndarray:
    """(d,) fourth-order central differences of the objective."""
    result = np.empty(len(theta))
    for q, unit in enumerate(np.eye(len(theta)) * STEP):
        one, two = ([problem.value(problem.state(theta + k * s * unit)) for s in (1, -1)] for k in (1, 2))
        result[q] = (8.0 * (one[0] - one[1]) - (two[0] - two[1])) / (12.0 * STEP)
    return result


def assert_gradient(problem: PoseProblem, theta: np.ndarray) -> None:
    exact = problem.gradient(problem.state(theta))
    numeric = derivative(problem, theta)
    assert np.abs(exact - numeric).max() <= 1e-6 * np.abs(numeric).max()


def scaled_rig(rig: Rig) -> Rig:
    """The rig with a sheared, a mirrored and a scaled joint, bound elsewhere than at rest."""
    local = rig.rest_local.copy()
    local[1, :3, :3] = [[1.0, 0.3, 0.0], [0.0, 1.2, 0.1], [0.0, 0.0, 0.8]]
    local[4, :3, :3] = np.diag([1.0, 1.0, -1.0])
    local[6, :3, :3] *= 1.5
    return replace(rig, rest_local=local)


RIGS = {
    "balls": lambda: rigs.hand_like(),
    "every kind": lambda: rigs.hand_like(rigs.any_freedom),
    "tentacle": lambda: rigs.tentacle(12, rigs.any_freedom),
    "scaled": lambda: scaled_rig(rigs.hand_like(rigs.any_freedom)),
}


def two_bodies(rig: Rig, form: str, *, movable: bool = True, seed: int = 0) -> PoseProblem:
    ball = meshes.icosphere(2, 4.0)
    placed = np.eye(4)
    placed[:3, 3] = [8.0, 6.0, 1.0]
    random = np.random.default_rng(seed)
    on_ball = rigs.SurfacePoints(random.integers(0, len(ball.faces), 60), random.dirichlet(np.ones(3), 60))
    on_self = rigs.scattered_points(rig, 20, seed + 2)
    contacts = (
        PairedPoints(
            "hold", rig.name, rigs.scattered_points(rig, 60, seed), "ball", on_ball, np.linspace(0, 2, 60)
        ),
        PairedPoints("self", rig.name, rigs.scattered_points(rig, 20, seed + 1), rig.name, on_self),
    )
    bodies = (Body.skinned(rig), Body.rigid("ball", ball, world_from_surface=placed, movable=movable))
    return PoseProblem(bodies, contacts, form=form)  # type: ignore[arg-type]


@pytest.mark.parametrize("form", ["squares", "paper"])
@pytest.mark.parametrize("name", RIGS)
def test_gradient_of_the_objective(name: str, form: str) -> None:
    problem = two_bodies(RIGS[name](), form)
    random = np.random.default_rng(1)
    lower, upper = problem.limits_of_theta
    theta = np.clip(random.normal(0.0, 0.5, len(problem.start)), lower, upper)  # some dofs sit on their limits
    assert (theta == lower).any() or name == "balls"
    assert_gradient(problem, theta)


def test_gradient_reaches_both_ends_of_a_pair() -> None:
    problem = two_bodies(rigs.hand_like(), "squares")
    gradient = problem.gradient(problem.start_state)
    assert np.abs(gradient[problem.dof_slices[1]]).max() > 1e-3  # the ball is pulled too
    # Action and reaction: a common translation of both bodies changes nothing.
    translations = problem.is_translation
    assert np.abs(gradient[translations].reshape(2, 3).sum(axis=0)).max() < 1e-12 * np.abs(gradient).max()


def test_gradient_of_a_pose_outside_the_chart() -> None:
    """A joint posed in a way that its freedom cannot express keeps that, and gradients stay exact."""
    rig = rigs.hand_like(rigs.any_freedom)
    random = np.random.default_rng(3)
    local = rig.rest_local.copy()
    local[:, :3, :3] = local[:, :3, :3] @ random.normal(np.eye(3), 0.05, (len(local), 3, 3))
    local[:, :3, 3] += random.normal(0.0, 0.1, (len(local), 3))
    problem = two_bodies(rig, "squares")
    posed = Body.skinned(rig, pose=Pose(rig.joints, local))
    problem = replace(problem, bodies=(posed, problem.bodies[1]), limits="none")
    assert np.allclose(problem.poses(problem.start)[rig.name].local, local, atol=1e-12)
    assert_gradient(problem, problem.start)


def test_gauss_newton_matrix_is_that_of_the_residuals() -> None:
    """For single-bone contacts the constant-gram matrices equal J^T J of distance and normal residuals."""
    rig = rigs.hand_like()
    stiff = replace(rig, skin_joints=rig.skin_joints[:, :1], skin_weights=np.ones((len(rig.bind_points), 1)))
    problem = two_bodies(stiff, "squares", movable=False)
    state = problem.state(np.random.default_rng(5).normal(0.0, 0.3, len(problem.start)))
    pairs = problem.pairs
    distance = state.jacobian(pairs.gap) * np.sqrt(2.0 * pairs.weights)[:, None, None] / problem.unit
    # Interpolated normals of one bone are shorter than 1 by a constant, which the residual divides out.
    length = np.linalg.norm(problem.start_state.vectors(pairs.manipulator_normals), axis=1)
    normal = state.jacobian(pairs.manipulator_normals) * (np.sqrt(pairs.weights) / length)[:, None, None]
    other = np.linalg.norm(problem.start_state.vectors(pairs.object_normals), axis=1)
    normal = normal + state.jacobian(pairs.object_normals) * (np.sqrt(pairs.weights) / other)[:, None, None]
    expected = sum(np.einsum("kiq,kir->qr", j, j) for j in (distance, normal))
    expected = expected + problem.bound_terms["prior"].normal_matrix(state)
    got = problem.normal_matrix(state)
    assert np.abs(got - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("name", RIGS)
def test_gradient_of_the_stretch_of_the_skin(name: str) -> None:
    """Alone, at poses that stretch; at rest nothing costs anything."""
    problem = replace(two_bodies(RIGS[name](), "squares"), terms=(SkinStretchTerm(allowed=1.05, samples=400),))
    random = np.random.default_rng(2)
    lower, upper = problem.limits_of_theta
    theta = np.clip(random.normal(0.0, 0.6, len(problem.start)), lower, upper)
    assert problem.value(problem.state(theta)) > 0.0
    assert_gradient(problem, theta)
    matrix = problem.normal_matrix(problem.state(theta))
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > -1e-9 * np.abs(matrix).max()
    if name != "scaled":  # that one is bound elsewhere than at rest
        assert problem.value(problem.state(np.zeros(len(theta)))) == 0.0
