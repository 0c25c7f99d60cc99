"""Every registered term keeps the term contract, and does what its name says."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from contact_builtins.terms.aims import Look, LookTerm, Pin, PinTerm
from contact_builtins.terms.balance import BalanceTerm, away_from, convex_hull
from contact_builtins.terms.self_collision import SelfCollisionTerm
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import skin
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.penetration import PenetrationTerm, thinned
from contact_core.solve.problem import PoseProblem
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import DistanceTerm, NormalTerm, PriorTerm, paper_terms
from contact_core.testing import meshes, rigs
from contact_core.testing.term_contract import TermContract, scene


class TestDistance(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return DistanceTerm()


class TestDistanceUnsquared(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return DistanceTerm()

    @pytest.fixture
    def problem(self) -> PoseProblem:
        return replace(scene(), form="paper")


class TestNormal(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return NormalTerm()


class TestPrior(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return PriorTerm()


class TestPenetration(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return PenetrationTerm(resolution=24, samples=400)


class TestSelfCollision(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return SelfCollisionTerm()

    @pytest.fixture
    def problem(self) -> PoseProblem:
        crossed = pulled_together()
        pose = LevenbergMarquardt().solve(crossed).poses["hand-like"]
        return scene(rigs.hand_like(), pose=pose)


def on_still_ground(gain: float = 1.0) -> PoseProblem:
    """The scene of the contract, with a ball that stands still and bears."""
    problem = scene()
    ball = problem.bodies[1]
    still = Body.rigid("ball", ball.rig.surface, world_from_surface=ball.world_from_rig)
    held, *others = problem.contacts
    return replace(problem, bodies=(problem.bodies[0], still), contacts=(replace(held, gain=gain), *others))


class TestBalance(TermContract):
    @pytest.fixture
    def term(self) -> PoseTerm:
        return BalanceTerm()

    @pytest.fixture
    def problem(self) -> PoseProblem:
        return on_still_ground()


class TestPin(TermContract):
    cannot: ClassVar[dict[str, str]] = {"scale_free": "targets are points of the world, which this scene moves"}

    @pytest.fixture
    def term(self) -> PoseTerm:
        pins = (
            Pin("hand-like", "finger1_2", (3.0, 4.0, 5.0), (1.0, 0.0, 0.0)),
            Pin("ball", "ball", (0.0, 1.0, 0.0)),
        )
        return PinTerm(pins)


class TestLook(TermContract):
    cannot: ClassVar[dict[str, str]] = {"scale_free": "targets are points of the world, which this scene moves"}

    @pytest.fixture
    def term(self) -> PoseTerm:
        looks = (Look("hand-like", "finger2_2", (3.0, 40.0, 5.0)), Look("ball", "ball", (0.0, 30.0, 0.0)))
        return LookTerm(looks)


def pressed_into_ball() -> PoseProblem:
    """A hand whose palm is paired with points on the far side of a ball: it wants to go through."""
    rig = rigs.hand_like(rigs.limited_freedom)
    ball = meshes.icosphere(3, 4.0)
    palm = np.flatnonzero(rig.skin_joints[rig.faces[:, 0], 0] == 0)[:40]
    ends = SurfacePoints(palm, np.full((40, 3), 1 / 3))
    top = np.argsort(ball.points[ball.faces].mean(axis=1)[:, 1])[-40:]
    placed = np.eye(4)
    placed[:3, 3] = [5.0, -7.0, 0.0]
    held = {"hand-like": [joint for joint in rig.joints if joint != "wrist"]}
    return PoseProblem(
        (Body.skinned(rig), Body.rigid("ball", ball, world_from_surface=placed)),
        (PairedPoints("palm", "hand-like", ends, "ball", SurfacePoints(top, np.full((40, 3), 1 / 3))),),
        held=held,
    )


def deepest(problem: PoseProblem, theta: np.ndarray) -> float:
    """How deep skin vertices are inside the ball of radius 4."""
    state = problem.state(theta)
    points = skin(problem.bodies[0].rig, state.motions[0].world)
    centre = state.motions[1].world[0, :3, 3]
    return float(4.0 - np.linalg.norm(points - centre, axis=1).min())


def test_penetration_keeps_skin_out() -> None:
    problem = pressed_into_ball()
    depths = []
    for extra in ((), (PenetrationTerm(weight=20.0, resolution=32),)):
        posed = replace(problem, terms=(*paper_terms(), *extra))
        depths.append(deepest(posed, LevenbergMarquardt().solve(posed).theta))
    assert depths[1] < 0.5 * depths[0], depths


def test_a_proxy_counts_instead_of_the_surface() -> None:
    """Skin inside a hollow thing's filled proxy costs; without the proxy only its walls do."""
    problem = pressed_into_ball()
    shell = problem.bodies[1].rig.surface
    inner = shell.with_points(0.9 * shell.points)
    faces = np.concatenate([shell.faces, inner.faces[:, ::-1] + len(shell.points)])
    hollow = TriangleMesh(np.concatenate([shell.points, inner.points]), faces)
    walls = Body.rigid("ball", hollow, world_from_surface=problem.bodies[1].world_from_rig @ _up(5.0))
    values = []
    for solids in (None, {"ball": [shell]}):
        term = PenetrationTerm(solids=solids, resolution=48)
        posed = replace(problem, bodies=(problem.bodies[0], walls), terms=(term,))
        values.append(posed.value(posed.start_state))
    assert values[1] > 5.0 * values[0] > 0.0, values


def _up(distance: float) -> np.ndarray:
    result = np.eye(4)
    result[1, 3] = distance
    return result


def pulled_together() -> PoseProblem:
    """A hand-like rig whose index and middle tips are pulled into each other."""
    rig = rigs.hand_like()
    owner = rig.skin_joints[rig.faces[:, 0], 0]
    tips = [np.flatnonzero(owner == rig.joint_index(name))[:30] for name in ("finger1_2", "finger2_2")]
    one, two = (SurfacePoints(faces, np.full((30, 3), 1 / 3)) for faces in tips)
    pull = PairedPoints("pull", rig.name, one, rig.name, two)
    return PoseProblem((Body.skinned(rig),), (pull,), terms=(DistanceTerm(), PriorTerm(0.1)))


def test_self_collision_parts_fingers() -> None:
    """Two fingertips that are pulled through each other stop at the sum of their radii, nearly."""
    problem = pulled_together()
    values = []
    for extra in ((), (SelfCollisionTerm(weight=50.0),)):
        theta = LevenbergMarquardt().solve(replace(problem, terms=(*problem.terms, *extra))).theta
        judge = replace(problem, terms=(SelfCollisionTerm(weight=1.0),))
        values.append(judge.value(judge.state(theta)))
    assert values[1] < 0.2 * values[0], values


def test_self_collision_leaves_out_pairs_that_cannot_move_against_one_another() -> None:
    """With one finger free it varies as with all free: what is left out is constant, and most pairs are."""
    crossed = pulled_together()
    pose = LevenbergMarquardt().solve(crossed).poses["hand-like"]
    whole = PoseProblem((Body.skinned(rigs.hand_like(), pose=pose),), (), terms=(SelfCollisionTerm(),))
    fingers = ["finger1_0", "finger1_1", "finger1_2"]
    some = replace(whole, free={"hand-like": fingers}, length=whole.manipulator_length)
    rows = np.searchsorted(whole.free_of_body[0], some.free_of_body[0])
    random, apart = np.random.default_rng(0), []
    for _ in range(6):
        theta, moved = whole.start.copy(), some.start + random.normal(scale=0.2, size=len(some.start))
        theta[rows] = moved
        apart.append(whole.value(whole.state(theta)) - some.value(some.state(moved)))
    assert np.ptp(apart) < 1e-12 and abs(apart[0]) < 1.0
    (all_pairs,), (own_pairs,) = (
        [body.pairs for body in problem.bound_terms["self-collision"].bodies] for problem in (whole, some)
    )
    assert 0 < len(own_pairs) < 0.7 * len(all_pairs)


def test_pin_and_look_reach_their_targets() -> None:
    rig = rigs.tentacle(8)
    target = (9.0, 6.0, 4.0)
    eye = rig.joints[-1]
    terms = (
        PinTerm((Pin("tentacle", eye, target),)),
        LookTerm((Look("tentacle", eye, (9.0, 60.0, 4.0)),)),
        PriorTerm(0.01),
    )
    problem = PoseProblem((Body.skinned(rig),), (), terms=terms)
    state = problem.state(LevenbergMarquardt().solve(problem).theta)
    end = state.motions[0].world[-1]
    assert np.linalg.norm(end[:3, 3] - target) < 0.05 * problem.unit
    assert end[:3, 2] @ [0.0, 1.0, 0.0] > 0.999


@pytest.mark.parametrize("term", [PinTerm(), LookTerm(), PenetrationTerm(), SelfCollisionTerm()])
def test_terms_that_lack_something_say_so(term: PoseTerm) -> None:
    still = PoseProblem((Body.skinned(rigs.tentacle(4)),), (), terms=(term,), free={})
    with pytest.raises(InvalidInput) as refusal:
        still.value(still.start_state)
    assert len(str(refusal.value).split()) >= 6


@given(arrays(np.float64, (9, 2), elements=st.integers(-4, 4).map(float)), st.tuples(*[st.floats(-9, 9)] * 2))
def test_what_is_off_a_support_is_the_way_to_its_nearest_point(points: FloatArray, at: tuple[float, float]) -> None:
    hull, place = convex_hull(points), np.array(at)
    off, derivative = away_from(hull, place)
    for corner in hull:  # the nearest point of a convex set: no corner lies beyond it
        assert (corner - (place - off)) @ off <= 1e-9 * (1.0 + off @ off)
    back, _ = away_from(hull, place - off)
    assert np.abs(back).max() < 1e-9 and np.abs(derivative - derivative.T).max() < 1e-12
    assert {tuple(corner) for corner in hull} <= {tuple(point) for point in points}


def test_a_support_that_fades_in_changes_the_balance_smoothly() -> None:
    problem = replace(on_still_ground(), terms=(BalanceTerm(),))
    values = []
    for gain in np.linspace(0.0, 1.0, 41):
        now = replace(on_still_ground(float(gain)), terms=problem.terms)
        values.append(now.value(now.start_state))
    assert values[0] == 0.0  # nothing bears
    assert np.abs(np.diff(values[1:])).max() < 0.1 * max(values)


def test_thinned_vertices_share_the_whole_area() -> None:
    mesh = meshes.icosphere(4)
    vertices, areas = thinned(mesh, 300)
    assert 100 < len(vertices) <= 300
    assert len(np.unique(vertices)) == len(vertices)
    assert areas.sum() == pytest.approx(mesh.face_areas.sum())
