"""Sliding contacts: exact exponential map, exact limits, true gradients, and the complaint they answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.contact.axis import draw_axis
from contact_core.contact.patch import parameterize_patch, reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.proposals.sliding import sliding_problem, solve_sliding
from contact_core.proposals.sliding_targets import SlidingPatch, SlidingTargets
from contact_core.solve.black_box import Differentiable
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.testing import meshes, rigs
from contact_core.testing.term_contract import differences

FLOOR = meshes.plane(16, 2.0)  # normals +z
STAMP = TriangleMesh(FLOOR.points * [1.0, 1.0, -1.0], FLOOR.faces[:, ::-1])  # normals -z, same triangles


def at(mesh: TriangleMesh, points: list[tuple[float, float]]) -> SurfacePoints:
    return Locator.of(mesh).closest(np.array([(x, y, 0.0) for x, y in points])).points


def patch_at(x: float, y: float) -> tuple[PatchShape, Root, SurfacePoints]:
    """A cross of points with an axis along x, centred at (x, y) on the floor."""
    axis_shape, axis = draw_axis(FLOOR, at(FLOOR, [(x, y), (x + 0.15, y)]))
    points = at(FLOOR, [(x + 0.02, y), (x + 0.13, y + 0.03), (x + 0.1, y - 0.11), (x + 0.06, y + 0.12)])
    shape = PatchShape(axis_shape, parameterize_patch(FLOOR, axis, points), np.ones(4))
    return shape, axis.root(), points


def spread_too_far(movable: bool = True) -> tuple[PoseProblem, list[SlidingPatch]]:
    """A stiff stamp whose two patches are 0.8 apart, and targets that are 1.0 apart: finger spacing got lost."""
    contacts, sliding = [], []
    for name, here, there in (("left", 0.6, 0.5), ("right", 1.4, 1.5)):
        shape, root, points = patch_at(there, 1.0)
        mine = at(STAMP, [(x - there + here, y) for x, y, _ in points.positions(FLOOR)])
        contacts.append(PairedPoints(name, "stamp", mine, "floor", points))
        sliding.append(SlidingPatch(name, shape, root, slack=0.2, penalty=0.01))
    bodies = (Body.rigid("stamp", STAMP, movable=movable), Body.rigid("floor", FLOOR))
    return PoseProblem(bodies, tuple(contacts)), sliding


def test_targets_slide_to_the_spacing_of_the_fingers() -> None:
    problem, sliding = spread_too_far()
    fixed = LevenbergMarquardt().solve(problem)
    slid = solve_sliding(LevenbergMarquardt(), problem, sliding)
    before = rigs.mean_gap(problem, fixed.theta)
    after = rigs.mean_gap(slid.solution.problem, slid.solution.theta)
    assert after < 0.15 * before, (before, after)
    places = {name: root.point().positions(FLOOR)[0] for name, root in slid.roots.items()}
    assert places["right"][0] - places["left"][0] == pytest.approx(0.8, abs=0.02)


def test_a_slide_is_the_exponential_map() -> None:
    """Offsets along and across the heading, the heading kept parallel and turned; the points traced from there."""
    _, (patch, _) = spread_too_far()
    target = SlidingTargets(FLOOR, [patch], np.eye(4), [patch_at(0.5, 1.0)[2]])
    root = target.roots(np.array([0.5, -0.25, 0.3]))["left"]
    assert root.point().positions(FLOOR)[0] == pytest.approx([0.6, 0.95, 0.0], abs=1e-9)
    points, normals = target.watch(patch_at(0.5, 1.0)[2])(np.array([0.5, -0.25, 0.3]))
    turn = 0.3 * patch.turn
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    first = patch_at(0.5, 1.0)[2].positions(FLOOR)[:, :2] - [0.5, 1.0]
    assert points[:, :2] == pytest.approx([0.6, 0.95] + first @ rotation.T, abs=1e-9)
    assert normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (4, 1)))
    traced = reconstruct_patch(FLOOR, patch.shape, root).points.positions(FLOOR)
    assert points == pytest.approx(traced, abs=1e-12)


def test_gradients_of_slides_are_exact() -> None:
    problem, sliding = spread_too_far()
    together = sliding_problem(problem, sliding)
    theta = together.start + np.random.default_rng(0).normal(0.0, 0.05, len(together.start))
    numeric = differences(together, theta)
    assert np.abs(together.gradient(together.state(theta)) - numeric).max() <= 1e-6 * np.abs(numeric).max()
    assert np.abs(numeric[-6:]).max() > 0.0


@pytest.mark.parametrize("held", ["nothing", "slides", "one slide"])
def test_what_bones_and_slides_move_together(held: str) -> None:
    """The Gauss-Newton matrix of bones and slides, put together by parts, is that of the whole Jacobian, which is
    that of central differences; also where some or all of the slides are held."""
    problem, sliding = spread_too_far()
    together = sliding_problem(problem, sliding)
    dofs = {"nothing": [], "slides": together.charts[2].dof_names, "one slide": ["right.turn"]}[held]
    together = replace(together, held={"floor.sliding": dofs})
    theta = together.start + np.random.default_rng(1).normal(0.0, 0.05, len(together.start))
    state, gap = together.state(theta), together.pairs.gap
    jacobian = state.jacobian(gap)  # (k, 3, d)
    weights = np.linspace(0.5, 2.0, len(gap))
    whole = np.einsum("kid,k,kie->de", jacobian, weights, jacobian)
    assert state.quadratic(gap, gap.gram(weights)) == pytest.approx(whole, rel=1e-9, abs=1e-9)
    forces = np.random.default_rng(2).normal(size=(len(gap), 3))
    assert state.pull(gap, forces) == pytest.approx(np.einsum("kid,ki->d", jacobian, forces), rel=1e-9, abs=1e-9)
    for q, step in enumerate(1e-6 * np.eye(len(theta))):
        ends = [together.state(theta + sign * step).vectors(gap) for sign in (1.0, -1.0)]
        assert jacobian[:, :, q] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-6)


def test_slack_is_kept_exactly() -> None:
    problem, sliding = spread_too_far(movable=False)
    tight = [replace(patch, slack=0.03, penalty=0.0) for patch in sliding]
    slid = solve_sliding(LevenbergMarquardt(), problem, tight)
    assert np.abs(slid.solution.theta).max() == 1.0
    for patch, start in zip(tight, (0.5, 1.5), strict=True):
        moved = slid.roots[patch.contact].point().positions(FLOOR)[0] - [start, 1.0, 0.0]
        assert np.abs(moved[:2]).max() <= 0.03 + 1e-9


def test_refusals() -> None:
    problem, (patch, other) = spread_too_far()
    for wrong in ({"contact": "none"}, {"slack": 0.0}, {"turn": -1.0}, {"root": other.root}):
        with pytest.raises(InvalidInput) as refusal:
            sliding_problem(problem, [replace(patch, **wrong)])
        assert len(str(refusal.value).split()) > 6


@pytest.mark.parametrize("mirrored", [True, False])
def test_derivatives_on_a_curved_surface(mirrored: bool) -> None:
    """Where no path meets a vertex the derivative of tracing is exact, against central differences."""
    ball = meshes.icosphere(3)
    centre, tip = Locator.of(ball).closest(np.array([[0.3, 0.5, 0.8], [0.5, 0.4, 0.75]])).points, 1
    axis_shape, axis = draw_axis(ball, centre)
    random = np.random.default_rng(4)
    near = axis.points[tip].positions(ball) + random.normal(0.0, 0.15, (12, 3))
    points = Locator.of(ball).closest(near).points
    shape = PatchShape(axis_shape, parameterize_patch(ball, axis, points), np.ones(12))
    bent = replace(axis_shape, along=1.2, spread=0.9).transformed(mirrored=mirrored, unit=1.1)
    world = np.diag([2.0, 2.0, 2.0, 1.0])
    patch = SlidingPatch("c", shape, axis.root(), 0.2, axis=bent)
    meant = reconstruct_patch(ball, shape, axis.root(), bent).points
    evaluate = SlidingTargets(ball, [patch], world, [meant]).watch(meant)
    assert isinstance(evaluate, Differentiable)
    theta, step = np.array([0.31, -0.22, 0.17]), 1e-7
    for found in range(2):
        exact = evaluate.derivatives(theta)[found]  # (3, k, 3)
        for q, unit in enumerate(step * np.eye(3)):
            numeric = (evaluate(theta + unit)[found] - evaluate(theta - unit)[found]) / (2.0 * step)
            away = np.abs(exact[q] - numeric).max(axis=1)
            assert np.abs(numeric).max() > 0.01
            assert np.median(away) < 1e-6 and (away < 1e-6).mean() > 0.8, away
