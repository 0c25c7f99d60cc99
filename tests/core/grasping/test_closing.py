"""Closing a hand: it touches and does not sink, it does not matter where all stands, and frames are those of
poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.closing import ALONG, FOUND, TOUCH, Closed, close_hands, relaxed
from contact_core.grasping.hand import Hand, hand_of, turn_about
from contact_core.grasping.hand_kernels import between, turned_root
from contact_core.grasping.screening import thumb_along
from contact_core.hands.describe import describe_hand
from contact_core.rig.rig import JointFreedom, forward_kinematics
from contact_core.testing import meshes, rigs
from contact_core.testing.grasp_sampler_contract import hand, request_for, thing

N = 24


def placements(one: Hand, mesh: TriangleMesh, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """N hands round an object, palms towards its middle."""
    random = np.random.default_rng(seed)
    placed, ways = np.tile(np.eye(4), (N, 1, 1)), np.zeros((N, 3))
    for n in range(N):
        way = random.normal(size=3)
        way /= np.linalg.norm(way)
        ahead = np.cross(way, random.normal(size=3))
        ahead /= np.linalg.norm(ahead)
        turn = np.stack([way, ahead, np.cross(way, ahead)], axis=1) @ one.frame.T
        placed[n, :3, :3] = turn
        middle = mesh.points.mean(axis=0)
        placed[n, :3, 3] = middle - turn @ (one.description.palm.point + 0.2 * one.length * one.frame[:, 1])
        placed[n, :3, 3] -= 0.4 * one.length * way
        ways[n] = way
    return placed, ways


def closed_on(name: str, shift: np.ndarray | None = None) -> Closed:
    one, mesh = hand(), thing(name)
    if shift is not None:
        mesh = TriangleMesh(mesh.points + shift, mesh.faces)
    placed, ways = placements(one, mesh)
    return close_hands(one, DistanceField.of(mesh, resolution=40), placed, ways)


@pytest.mark.parametrize("name", ["ball", "rod", "slab"])
def test_what_closes_touches_and_does_not_sink(name: str) -> None:
    closed, one = closed_on(name), hand()
    reached = np.isfinite(closed.travel)
    assert reached.mean() > 0.9
    assert (closed.palm[reached] > -0.5 * TOUCH * one.length).all(), "the approach ends at the skin"
    step = np.radians(1.0) * one.levers.max()  # the least step may overshoot by so much
    touches = closed.clear[reached] < TOUCH * one.length
    assert (closed.clear[reached] > -step - TOUCH * one.length).mean() > 0.9
    assert (touches.sum(axis=1) >= 2).mean() > 0.5, "most digits find what they close on"


def test_joints_keep_their_limits() -> None:
    closed, one = closed_on("ball"), hand()
    bends = one.flexes.copy()
    bends[one.bones[one.thumb] : one.bones[one.thumb + 1]] = False  # a thumb's first joint starts where it likes
    assert (closed.angles[:, bends] <= one.high[bends] + 1e-9).all()
    assert (closed.angles[:, bends] >= one.low[bends] - 1e-9).all()


def test_where_all_stands_does_not_matter() -> None:
    here, there = closed_on("slab"), closed_on("slab", np.array([100.0, -30.0, 7.0]))
    assert np.abs(here.angles - there.angles).max() < np.radians(1.5)
    assert np.abs(here.turns - there.turns).max() < 0.05


def test_frames_are_those_of_the_pose() -> None:
    closed, one = closed_on("ball"), hand()
    frames = one.frames(closed.placed, closed.angles, closed.turns)
    for n in (0, N // 2):
        pose = one.pose(closed.placed[n], closed.angles[n], closed.turns[n])
        world = forward_kinematics(one.rig.parents, pose.local)
        assert np.allclose(world[one.joints], frames[n], atol=1e-9)


def test_a_limit_of_nothing_keeps_a_digit_open() -> None:
    asked = request_for("ball")
    one = hand()
    placed, ways = placements(one, asked.mesh)
    limits = np.ones((N, len(one.bones) - 1))
    limits[:, 1] = 0.0
    closed = close_hands(one, asked.field, placed, ways, limits=limits)
    still = slice(int(one.bones[1]), int(one.bones[2]))
    assert np.abs(closed.angles[:, still]).max() < 1e-12
    assert np.abs(closed.angles[:, int(one.bones[2]) : int(one.bones[3])]).max() > 0.1


def test_a_finger_that_is_bent_into_the_object_beforehand_closes_from_straight() -> None:
    one = hand()
    finger = 1 if one.thumb == 0 else 0
    last = int(one.bones[finger + 1]) - 1
    bent = one.frames(
        np.eye(4)[None],
        np.where(one.flexes, 0.4 * one.high, 0.0)[None],
        np.tile(np.eye(3), (1, len(one.bones) - 1, 1, 1)),
    )[0, last]
    tip = bent[:3, :3] @ one.capsules[last, 1] + bent[:3, 3]
    ball = meshes.icosphere(2)
    mesh = TriangleMesh(ball.points * 0.08 * one.length + tip, ball.faces)
    field = DistanceField.of(mesh, resolution=40)
    straight, began = (
        close_hands(one, field, np.eye(4)[None], np.zeros((1, 3)), curls=np.array([curl])) for curl in (0.0, 0.4)
    )
    assert straight.clear[0, finger] > -0.01 * one.length, "from straight it finds the ball from outside"
    assert began.clear[0, finger] > -0.01 * one.length


def test_fingers_keep_out_of_one_another() -> None:
    """The capsules of different digits are nowhere nearer than they may be by more than one step."""
    closed, one = closed_on("rod"), hand()
    frames = one.frames(closed.placed, closed.angles, closed.turns)
    ends = np.einsum("nbij,bej->nbei", frames[:, :, :3, :3], one.capsules) + frames[:, :, None, :3, 3]
    step = 2.0 * np.radians(1.0) * one.levers.max()
    share = np.linspace(0.0, 1.0, 9)[:, None]
    deepest = 0.0
    for n in range(N):
        lines = ends[n, :, None, 0] * (1.0 - share) + ends[n, :, None, 1] * share  # (B, 9, 3)
        gap = np.linalg.norm(lines[:, None, :, None] - lines[None, :, None, :], axis=-1).min(axis=(2, 3))
        fingers = np.arange(len(one.joints)) >= one.bones[1]  # a thumb's start may begin among them
        pairs = (one.room > 0.0) & fingers[:, None] & fingers[None]
        deepest = max(deepest, float((one.room - gap)[pairs].max()))
    assert deepest < step + 0.02 * one.length


def test_fingers_that_found_nothing_are_bent_no_farther_than_those_that_did() -> None:
    closed, one = closed_on("rod"), hand()
    eased = relaxed(one, closed)
    touches = closed.clear < FOUND * one.length
    fingers = np.arange(len(one.bones) - 1) != one.thumb
    lost = 0
    for n in range(N):
        before, after = one.turned(closed.angles[n]), one.turned(eased.angles[n])
        assert np.allclose(before[touches[n]], after[touches[n]]) and (after <= before + 1e-12).all()
        if (touches[n] & fingers).any():
            mean = before[touches[n] & fingers].mean()
            assert (after[~touches[n] & fingers] <= mean + 1e-9).all()
            lost += int((before[~touches[n] & fingers] > mean).sum())
    assert lost, "some finger of some hand went past the rod"


def test_coupled_bones_close_by_their_rule() -> None:
    one = hand()
    middle, last = int(one.bones[2]) - 2, int(one.bones[2]) - 1
    leads = one.leads.copy()
    leads[last] = middle
    robot = replace(one, leads=leads, ratios=np.full(len(leads), 0.6))
    mesh = thing("ball")
    placed, ways = placements(robot, mesh)
    closed = close_hands(robot, DistanceField.of(mesh, resolution=40), placed, ways)
    assert np.allclose(closed.angles[:, last], 0.6 * closed.angles[:, middle])
    assert (closed.angles[:, middle] > 0.2).any() and (closed.clear[:, 1] < TOUCH * one.length).any()


def on_a_rod() -> tuple[Hand, np.ndarray, np.ndarray, DistanceField]:
    one, mesh = hand(), thing("rod")
    return one, *placements(one, mesh), DistanceField.of(mesh, resolution=40)


def test_a_thumb_goes_round_a_rod_with_the_fingers_and_not_along_it() -> None:
    one, placed, ways, field = on_a_rod()
    pads = np.tile(one.has_pad, (N, 1))
    along, near = [], []
    for price in (0.0, ALONG):
        closed = close_hands(one, field, placed, ways, along=price)
        along.append(float(thumb_along(one, closed, pads).mean()))
        near.append(float(np.abs(closed.clear[:, one.thumb]).mean()) / one.length)
    assert along[1] < 0.8 * along[0], along
    assert near[1] < near[0] + 0.01, "it touches as before"


def test_a_thumb_looks_about_the_best_of_its_starts() -> None:
    one, placed, ways, field = on_a_rod()
    still = replace(one, looks=np.array([*one.looks[:3], 0]))
    tip = int(one.bones[1]) - 1
    gaps = []
    for each in (still, one):
        closed = close_hands(each, field, placed, ways, oppose=0.0, along=0.0)
        fit = closed.fits[:, tip]
        gaps.append(float((np.abs(fit[:, 0]) / one.length + 0.04 * (1.0 + fit[:, 1])).mean()))
        root = one.firsts[one.thumb]
        outside = (closed.angles[:, root] < one.look_low[2] - 1e-9) | (closed.angles[:, root] > one.look_high[2])
        assert not outside.any(), "its root stays where its starts are"
    assert gaps[1] < 0.9 * gaps[0], gaps


def test_a_start_is_a_turn_of_the_chart_and_so_is_what_lies_between() -> None:
    one = hand()
    x, y = 0.3, -0.7
    out = np.zeros((3, 3))
    turned_root.py_func(out, one.look_frame, x, y)
    expected = one.look_frame @ turn_about(np.eye(3)[0], x) @ turn_about(np.eye(3)[1], y) @ one.look_frame.T
    assert np.allclose(out, expected, atol=1e-12)
    prices = one.start_prices[one.thumb]
    for place in (0, 7, len(prices) - 1):
        node = np.array(np.unravel_index(place, one.looks[:3]))
        at = one.look_low + node * (one.look_high - one.look_low) / (one.looks[:3] - 1)
        assert between.py_func(prices, one.looks, one.look_low, one.look_high, at) == pytest.approx(prices[place])
        turned_root.py_func(out, one.look_frame, at[0], at[1])
        assert np.allclose(out, one.starts[one.thumb, place], atol=1e-9)
        assert at[2] == pytest.approx(one.start_angles[one.thumb, place])


def with_a_hinged_thumb(locked: bool = False) -> Hand:
    """The plain hand with a robot's thumb: a hinge along the thumb, then two that bend it."""
    bone, across = np.array([0.7, 0.0, -0.7]) / 0.98995, np.array([0.7, 0.0, 0.7]) / 0.98995

    def freedom(joint: int) -> JointFreedom:
        if joint not in (1, 2, 3):
            return rigs.limited_freedom(joint)
        first, other = (bone, across) if joint == 1 else (-across, bone)
        frame = np.stack([first, other, np.cross(first, other)], axis=1)
        low, high = (-0.3, 1.2) if joint == 1 else (-0.1, 1.3)
        still = np.array([locked and joint == 1])
        return JointFreedom("hinge", frame=frame, lower=np.array([low]), upper=np.array([high]), locked=still)

    rig = rigs.hand_like(freedom)
    return hand_of(rig, describe_hand(rig))


def test_a_robots_thumb_turns_on_its_hinge_before_it_bends_and_within_its_limits() -> None:
    one, asked = with_a_hinged_thumb(), request_for("ball")
    assert not one.flexes[0] and one.flexes[1] and one.firsts[one.thumb] == 0
    hinge = one.rig.freedoms[int(one.joints[0])]
    turned = []
    for turn in one.starts[one.thumb, : one.start_counts[one.thumb]]:
        assert np.allclose(turn @ hinge.frame[:, 0], hinge.frame[:, 0], atol=1e-9), "about the hinge"
        local = hinge.frame.T @ turn @ hinge.frame
        turned.append(float(np.arctan2(local[2, 1], local[1, 1])))
    assert np.isclose(min(turned), -0.3) and np.isclose(max(turned), 1.2) and len(turned) >= 3
    placed, ways = placements(one, asked.mesh)
    closed = close_hands(one, asked.field, placed, ways)
    still = close_hands(with_a_hinged_thumb(locked=True), asked.field, placed, ways)
    away, before = (np.abs(each.fits[:, :3, 0][:, one.has_pad[:3]]).mean() for each in (closed, still))
    assert away < 0.9 * before, "it comes nearer than one that does not turn"
    assert (closed.angles[:, 1:3].max(axis=0) > 0.05).all(), "both bones that bend do"
