"""Laws of placing: an approach ends at touch, digits close without going in, pads land where they look."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from contact_builtins.demos import demo_recipe
from contact_builtins.placers.closing import STEP, approach, close, search_thumb
from contact_builtins.placers.from_pose import FACING, FromPose
from contact_builtins.placers.hand_pose import HandPose, dominant_joint, flexion_dof, matching, palm_and_digits
from contact_builtins.placers.naive import Naive
from contact_builtins.placers.pads import pads_of
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.tangent import direction_to_heading
from contact_core.geometry.tracing import trace_geodesic
from contact_core.hands.describe import describe_hand
from contact_core.job.job import Job
from contact_core.job.run import perform
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.plugins.slots import PlacementRequest
from contact_core.rig.poses import curled
from contact_core.rig.rig import Pose, skin
from contact_core.rig.rig import forward_kinematics as forward
from contact_core.settings import configured
from contact_core.testing import meshes
from contact_core.testing.settings_checks import check_settings

UPWARD = (0.0, 0.0, 1.0)
UP = np.array([0.0, 0.0, 1.0])  # the palm of the built-in hands looks along +z


@cache
def job() -> Job:
    return perform(demo_recipe("alien"), PluginManager())


def request() -> PlacementRequest:
    """The alien hand open beside the pole."""
    done = job()
    names = list(done.metrics["patches"])
    return PlacementRequest(
        rig=done.session.rigs["manipulator"],
        pose=Pose.rest(done.session.rigs["manipulator"]),
        object_mesh=done.session.geometry.mesh("object"),
        object_from_rig=np.asarray(np.linalg.inv(done.session.document.surface("object").world_from_surface)),
        patch_points={name: done.session.geometry.points(name) for name in names},
        patch_axes={name: done.session.geometry.axis(name).points for name in names},
        solids=done.solids["object"],
    )


def approached() -> HandPose:
    hand = HandPose(request())
    approach(hand, UP, matching(hand.rig, ("thumb*",), "test"))
    return hand


def test_the_hand_pose_skins_as_the_rig_does() -> None:
    hand = approached()
    pose = hand.pose()
    points = skin(hand.rig, forward(hand.rig.parents, pose.local))
    into_object = hand.object_from_rig
    np.testing.assert_allclose(hand.points(), points @ into_object[:3, :3].T + into_object[:3, 3], atol=1e-12)


@pytest.mark.parametrize("start", [-0.2, 0.0, 0.05, 0.3])
def test_an_approach_ends_at_the_first_touch_wherever_it_starts(start: float) -> None:
    hand = HandPose(request())
    hand.shift = start * UP
    thumb = matching(hand.rig, ("thumb*",), "test")
    approach(hand, 7.0 * UP, thumb)
    tested = np.flatnonzero(~np.isin(hand.owner, thumb))
    spacing = hand.fields[0].spacing
    assert 0.0 <= hand.clearance(tested).min() < 0.2 * spacing
    np.testing.assert_allclose(hand.shift, approached().shift, atol=0.2 * spacing)


def test_an_approach_is_ended_by_palm_and_digits_and_not_by_the_wrist() -> None:
    """A small ball before the end of the stump is passed by, one before the palm is not."""
    rig = read_asset("sample:human_hand", PluginManager()).rig
    assert rig is not None
    held, palm = palm_and_digits(rig), describe_hand(rig).palm
    assert 0.5 < held.mean() < 1.0 and held[dominant_joint(rig) != 0].all()
    ball = meshes.icosphere(2, 0.01 * rig.surface.bounding_box_diagonal)

    def before(vertex: int) -> HandPose:
        mesh = TriangleMesh(ball.points + rig.surface.points[vertex] + palm.normal, ball.faces)
        posed = replace(request(), rig=rig, pose=Pose.rest(rig), object_from_rig=np.eye(4))
        hand = HandPose(replace(posed, object_mesh=mesh, solids=()))
        approach(hand, palm.normal, matching(rig, ("thumb*",), "test"))
        return hand

    ahead = rig.surface.points @ palm.fingers
    with pytest.raises(InvalidInput, match="passes the object"):
        before(int(ahead.argmin()))
    assert before(int(np.where(held, ahead, -np.inf).argmax())).shift @ palm.normal > 0.5


def test_closing_stops_at_touch_within_limits_and_moves_nothing_else() -> None:
    hand = approached()
    before = hand.theta.copy()
    deepest = hand.clearance().min()
    digit = matching(hand.rig, ("index*",), "test")
    close(hand, digit)
    dofs = [dof for joint in digit if (dof := flexion_dof(hand.chart, int(joint))) is not None]
    others = np.setdiff1d(np.arange(len(before)), dofs)
    np.testing.assert_array_equal(hand.theta[others], before[others])
    assert (hand.theta[dofs] >= before[dofs]).all() and (hand.theta[dofs] > before[dofs]).any()
    assert (hand.theta[dofs] <= np.maximum(hand.chart.upper[dofs], before[dofs]) + 1e-12).all()
    reach = 0.2  # metres: longer than any finger, so one step goes no deeper than this
    assert hand.clearance().min() > deepest - reach * STEP * len(dofs)
    mine = hand.vertices_of(digit)
    assert hand.clearance(mine).min() < 0.01  # it did arrive


def test_in_the_air_a_digit_closes_to_its_limits() -> None:
    hand = HandPose(request())
    hand.shift = -5.0 * UP
    digit = matching(hand.rig, ("index*",), "test")
    dofs = [dof for joint in digit if (dof := flexion_dof(hand.chart, int(joint))) is not None]
    hand.chart.upper[dofs] = 0.6
    close(hand, digit)
    moved = hand.theta[dofs]
    np.testing.assert_allclose(moved, 0.6)  # the slow last joint goes on alone after the others


def test_the_thumb_search_is_never_worse_than_leaving_the_thumb_open() -> None:
    hand = approached()
    for pattern in ("index*", "middle*"):
        close(hand, matching(hand.rig, (pattern,), "test"))
    thumb = matching(hand.rig, ("thumb*",), "test")
    pads = [points for name, points in request().patch_points.items() if name.startswith("thumb")]
    before = np.abs(hand.distance(pads[0].positions(hand.skin()))).mean()
    search_thumb(hand, thumb, pads)
    assert np.abs(hand.distance(pads[0].positions(hand.skin()))).mean() <= before
    assert hand.clearance(hand.vertices_of(thumb)).min() > -0.02


def test_pads_land_on_faces_that_face_them_and_the_middle_of_the_axis_comes_there() -> None:
    ask = replace(request(), pose=curled(request().rig, job().recipe.manipulators[0].pose))
    result = configured(FromPose, job().recipe.placer_options, "it").place(ask)
    assert result.pose is not None and not result.left_out
    hand = HandPose(replace(ask, pose=result.pose))
    for name, pad in pads_of(ask, hand).items():
        placed = result.placed[name]
        heading = direction_to_heading(ask.object_mesh, placed.root, placed.direction[None])
        middle = trace_geodesic(ask.object_mesh, placed.root, heading * pad.to_root).points
        assert pad.normal @ ask.object_mesh.face_normals[middle.faces[0]] <= FACING + 1e-9
        assert (
            np.linalg.norm(middle.positions(ask.object_mesh)[0] - pad.centre)
            < 0.06 * job().length("manipulator") + 1e-6
        )
        assert abs(np.linalg.norm(placed.direction) - 1.0) < 1e-9


def turned(ask: PlacementRequest) -> tuple[PlacementRequest, FloatArray]:
    """The same scene with the object's own space moved rigidly."""
    generator = np.random.default_rng(3)
    moved = np.eye(4)
    moved[:3, :3] = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    moved[:3, :3] *= np.linalg.det(moved[:3, :3])
    moved[:3, 3] = generator.normal(size=3)
    assert np.linalg.det(moved) == pytest.approx(1.0)

    def carried(mesh: TriangleMesh) -> TriangleMesh:
        return TriangleMesh(mesh.points @ moved[:3, :3].T + moved[:3, 3], mesh.faces)

    mesh = carried(ask.object_mesh)
    return replace(ask, object_mesh=mesh, object_from_rig=moved @ ask.object_from_rig, solids=(mesh,)), moved


def test_placing_does_not_depend_on_where_the_object_has_its_origin() -> None:
    """Closest points are equivariant; the distance field's grid is not, by less than two of its cells."""
    ask, naive = request(), Naive(approach=UPWARD, without=("thumb*",))
    other, moved = turned(ask)
    here, there = naive.place(ask), naive.place(other)
    cell = HandPose(ask).fields[0].spacing
    for name, placed in here.placed.items():
        point = placed.root.positions(ask.object_mesh)[0] @ moved[:3, :3].T + moved[:3, 3]
        assert np.linalg.norm(point - there.placed[name].root.positions(other.object_mesh)[0]) < 2.0 * cell


def test_pads_out_of_reach_are_left_out_and_named_with_their_distance() -> None:
    ask = request()
    result = FromPose(approach=UPWARD, without=("thumb*",), far=0.02).place(ask)
    asked = FromPose(approach=UPWARD, without=("thumb*",)).place(replace(ask, reach=0.02))
    assert asked.left_out == result.left_out  # the request's reach goes before the placer's own
    assert set(result.placed) | set(result.left_out) == set(ask.patch_axes)
    assert result.left_out and all("% of the length away" in why for why in result.left_out.values())
    with pytest.raises(InvalidInput, match="leaves out every part"):
        FromPose(approach=UPWARD, without=("*",)).place(ask)


def test_a_broken_edge_costs_the_pad_beside_it_and_no_other() -> None:
    """A third face on every edge round the place where one pad comes: it is named, and all others are placed."""
    ask = replace(request(), pose=curled(request().rig, job().recipe.manipulators[0].pose))
    closed = configured(FromPose, job().recipe.placer_options, "it").place(ask)
    assert closed.pose is not None
    asked = replace(ask, pose=closed.pose)
    whole = FromPose().place(asked)
    name = next(iter(whole.placed))
    mesh = asked.object_mesh
    here = whole.placed[name].root.positions(mesh)[0]
    away = np.linalg.norm(mesh.points[mesh.faces].mean(axis=1) - here, axis=1)
    near = np.argsort(away)[:12]
    inner = mesh.points.mean(axis=0)
    fins = np.array(
        [
            (a, b, len(mesh.points))
            for face in mesh.faces[near]
            for a, b in zip(face, np.roll(face, -1), strict=True)
        ]
    )
    broken = TriangleMesh(np.vstack([mesh.points, inner]), np.vstack([mesh.faces, fins]))
    found = FromPose().place(replace(asked, object_mesh=broken))
    assert set(found.placed) | set(found.left_out) == set(whole.placed) | set(whole.left_out)
    assert name in found.left_out and "manifold" in found.left_out[name], found.left_out
    assert len(found.placed) >= 1


def test_the_naive_placer_leaves_the_fingers_open() -> None:
    result = Naive(approach=UPWARD, without=("thumb*",)).place(request())
    rig = request().rig
    assert result.pose is not None
    inner = rig.parents >= 0
    np.testing.assert_allclose(result.pose.local[inner], rig.rest_local[inner], atol=1e-12)


@pytest.mark.parametrize("placer", [FromPose(), Naive()])
def test_placers_declare_their_settings(placer: FromPose | Naive) -> None:
    check_settings(placer)
    with pytest.raises(InvalidInput, match="a direction"):
        replace(placer, approach=(0.0, 0.0, 0.0))
