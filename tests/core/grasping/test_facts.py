"""What an eye sees: closure and enclosure of contacts, skin through a thin wall, verdicts in words."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.grasping.closing import close_hands
from contact_core.grasping.facts import (
    along,
    closure,
    contact_wrenches,
    crossing,
    digits_in_contact,
    enclosure,
    opposition,
    skin_through,
    thumb_along,
    thumb_away,
)
from contact_core.grasping.hand import Hand
from contact_core.grasping.slots import KINDS
from contact_core.grasping.verdict import judge_hold, margin, told_through
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.testing import meshes
from contact_core.testing.grasp_sampler_contract import hand, request_for, thing
from contact_core.testing.grasp_score_contract import GOOD


def cap(direction: np.ndarray, below: float) -> TriangleMesh:
    """Part of a sphere a little larger than the unit ball, facing it: as skin that lies on it does."""
    ball = meshes.icosphere(3)
    keep = (ball.points[ball.faces].mean(axis=1) @ direction) > below
    return TriangleMesh(1.001 * ball.points, ball.faces[keep][:, ::-1])


def test_what_surrounds_a_ball_holds_it_and_what_lies_on_one_side_does_not() -> None:
    ball = meshes.icosphere(3)
    up = np.array([0.0, 0.0, 1.0])
    round_it = closure(contact_wrenches(cap(up, -2.0), ball, 4.0))
    on_top = closure(contact_wrenches(cap(up, 0.85), ball, 4.0))
    assert round_it > 0.05 > 0.0 > on_top
    assert closure(np.zeros((0, 6))) == -1.0


def test_closure_does_not_ask_where_the_object_stands() -> None:
    ball = meshes.icosphere(3)
    moved = np.array([5.0, -2.0, 1.0])
    own = cap(np.array([0.0, 0.0, 1.0]), -0.5)
    here = closure(contact_wrenches(own, ball, 4.0))
    there = closure(
        contact_wrenches(
            TriangleMesh(own.points + moved, own.faces), TriangleMesh(ball.points + moved, ball.faces), 4.0
        )
    )
    assert here == pytest.approx(there, rel=0.05)


def test_enclosure_is_positive_only_where_no_way_out_is_free() -> None:
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3.0)
    two_sided = np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 1.0], [0, 0, -1.0]])
    values = enclosure(np.stack([corners, two_sided, np.abs(corners)]), np.ones((3, 4)))
    assert values[0] > 0.2 and values[1] < 0.2 and values[2] < 0.0


def test_skin_beyond_a_thin_wall_is_seen_and_skin_beside_it_is_not() -> None:
    """A sheet of no thickness through a finger: no vertex is inside anything, and yet half the finger is
    through."""
    one = hand()
    posed = skin(one.rig, one.rig.rest_world)
    middle = one.rig.rest_world[one.joints[int(one.bones[3]) - 1], :3, 3]
    sheet = meshes.plane(12)
    flat = (sheet.points - np.array([0.5, 0.5, 0.0])) * np.array([6.0, 6.0, 1.0])
    level = flat[:, [0, 2, 1]] + middle  # across y, as the palm is

    def through(offset: float) -> float:
        moved = TriangleMesh(level + np.array([0.0, offset, 0.0]), sheet.faces)
        return float(skin_through(one, posed, one.rig.rest_world, moved).max())

    assert through(-3.0) == 0.0 and through(0.3) > 0.2
    assert through(0.6) < through(0.3)


def test_digits_that_touch_are_counted() -> None:
    one = hand()
    posed = skin(one.rig, one.rig.rest_world)
    tip = one.description.fingers[0].tip
    ball = meshes.icosphere(2)
    touching = digits_in_contact(one, posed, Locator.of(TriangleMesh(0.8 * ball.points + tip, ball.faces)))
    assert touching[1] and touching.sum() == 1


def test_a_flat_hand_on_a_plate_does_not_oppose_and_one_round_a_ball_does() -> None:
    one = hand()
    used = np.ones(len(one.bones) - 1, bool)
    flat = skin(one.rig, one.rig.rest_world)
    palm = one.description.palm
    away = (flat - palm.point) @ palm.normal
    skin_of_fingers = np.concatenate(one.skin_of_digits[1:])
    plate = meshes.plane(8)
    across = np.stack([one.frame[:, 1], one.frame[:, 2], -palm.normal])
    low = palm.point + away[skin_of_fingers].max() * palm.normal
    under = TriangleMesh(4.0 * one.length * (plate.points - [0.5, 0.5, 0.0]) @ across + low, plate.faces)
    assert opposition(one, flat, under, used) < np.radians(30.0)
    mesh = thing("ball")
    request = request_for("ball")
    closed = close_hands(one, request.field, *around(one, mesh))
    angles = []
    for n in range(len(closed.placed)):
        pose = one.pose(closed.placed[n], closed.angles[n], closed.turns[n])
        posed = skin(one.rig, forward_kinematics(one.rig.parents, pose.local))
        angles.append(opposition(one, posed, mesh, used))
    assert max(angles) > np.radians(120.0)
    assert opposition(one, flat + 100.0 * one.length, mesh, used) == 0.0


def test_two_fingers_that_hold_a_thing_between_them_oppose_where_the_thumb_takes_no_part() -> None:
    one = hand()
    flat, ball = skin(one.rig, one.rig.rest_world), meshes.icosphere(3)
    first, second = (flat[one.skin_of_digits[d]] for d in (1, 2))
    apart = np.linalg.norm(first[:, None] - second[None], axis=2)
    apart[first @ one.frame[:, 1] < np.median(first @ one.frame[:, 1])] = np.inf  # by the outer half of the finger
    a, b = np.unravel_index(apart.argmin(), apart.shape)
    middle, radius = 0.5 * (first[a] + second[b]), 0.5 * apart[a, b]
    held = TriangleMesh(middle + 1.02 * radius * ball.points, ball.faces)
    used = np.isin(np.arange(len(one.bones) - 1), (1, 2))
    assert opposition(one, flat, held, used) > np.radians(90.0)
    used[one.thumb] = True
    assert opposition(one, flat, held, used) == 0.0, "the thumb was to take part"


def around(one: Hand, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """A few hands that come to the middle of a mesh, its middle below the fingers."""
    placed = np.tile(np.eye(4), (6, 1, 1))
    for n, ahead in enumerate(np.linspace(0.05, 0.3, 6)):
        placed[n, :3, 3] = (
            mesh.points.mean(axis=0) - one.description.palm.point - 0.5 * one.length * one.frame[:, 0]
        )
        placed[n, :3, 3] -= ahead * one.length * one.frame[:, 1]
    return placed, np.tile(one.frame[:, 0], (6, 1))


def test_digits_at_rest_do_not_cross_and_those_that_spread_through_one_another_do() -> None:
    one = hand()
    assert crossing(one, one.rig.rest_world) == 0.0
    world = one.rig.rest_world.copy()
    first, second = one.bones[2], one.bones[3]
    moved = one.joints[second : one.bones[4]]
    world[moved, :3, 3] += world[one.joints[first], :3, 3] - world[one.joints[second], :3, 3]
    assert crossing(one, world) > 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_a_good_hold_has_no_failure_and_each_fault_is_named(kind: str) -> None:
    assert judge_hold(GOOD, kind) == ()
    faults = {
        "digits_in_contact": (0, "touch"),
        "thumb_in_contact": (False, "thumb"),
        "pads_placed": (0.1, "pads"),
        "skin_through": (0.06, "wall"),
        "uneven_curl_deg": (150.0, "bent"),
        "crossing": (0.6, "into one another"),
    }
    if kind != "hook":
        faults["opposition_deg"] = (60.0, "laid on the object")
    for key, (value, word) in faults.items():
        told = judge_hold({**GOOD, key: value}, kind)
        assert len(told) == 1 and word in told[0], (key, told)
    if kind == "power":
        slips = {**GOOD, "closure": -0.2, "opposition_deg": 60.0}
        assert "hold" in judge_hold(slips, kind)[0] and "laid on" in judge_hold(slips, kind)[1]
        assert len(judge_hold({**slips, "digits_through": 1}, kind)) == 2
        assert judge_hold({**slips, "digits_through": 2}, kind) == (), "two fingers through a loop cannot lose it"


def test_what_goes_through_loops_is_told_in_words() -> None:
    assert told_through({"loops_held": 0, "through_loop": []}) == ""
    assert told_through({"loops_held": 1, "through_loop": ["index", "middle"]}) == "through the loop: index, middle"
    assert told_through({"loops_held": 2, "through_loop": ["thumb", "index"]}) == "through 2 loops: thumb, index"


def test_along_is_the_way_of_a_rod_and_no_way_on_a_plate_or_a_ball() -> None:
    angle = np.linspace(0.0, 1.5 * np.pi, 12)
    rod = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    ball = np.concatenate([np.eye(3), -np.eye(3)])
    plate = np.tile([0.0, 1.0, 0.0], (12, 1))
    tips = np.array([[0.0, 0.0, 3.0], [0.2, 0.0, 0.0], [1.0, 0.0, 1.0]])

    def told(normals: np.ndarray, press: float = 1.0) -> np.ndarray:
        many = np.tile(normals, (len(tips), 1, 1))
        return along(many, np.full(many.shape[:2], bool(press)), tips)

    assert np.allclose(told(rod), [1.0, 0.0, 0.5])
    assert np.allclose(told(ball), 0.0) and np.allclose(told(plate), 0.0) and np.allclose(told(rod, 0.0), 0.0)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.25])
def test_a_thumb_is_as_far_away_as_the_nearest_skin_of_its_last_bone(share: float) -> None:
    one, ball = hand(), meshes.icosphere(2)
    posed = skin(one.rig, one.rig.rest_world)
    used = np.ones(len(one.bones) - 1, bool)
    last = np.flatnonzero(one.bone_of_skin == one.bones[1] - 1)
    tip = posed[last][(posed[last] @ np.array([0.7, 0.0, -0.7])).argmax()]
    beyond = tip + (0.02 + share) * one.length * np.array([0.7, 0.0, -0.7]) / 0.98995
    thing_there = TriangleMesh(0.02 * one.length * ball.points + beyond, ball.faces)
    away = thumb_away(one, posed, thing_there, used)
    nearest = np.linalg.norm(posed[last] - beyond, axis=1).min() / one.length - 0.02
    assert abs(away - nearest) < 0.003 and away > 0.8 * share
    at_root = TriangleMesh(0.02 * one.length * ball.points + one.rig.rest_world[1, :3, 3], ball.faces)
    assert thumb_away(one, posed, at_root, used) > 0.2, "that its root touches does not count"
    used[one.thumb] = False
    assert thumb_away(one, posed, thing_there, used) == 0.0, "in a hook it may"


def test_a_thumb_at_rest_beside_a_rod_is_along_it_and_one_without_a_rod_is_not() -> None:
    one = hand()
    world = one.rig.rest_world
    last = one.bones[1] - 1
    tip = world[one.joints[last], :3, :3] @ np.diff(one.capsules[last], axis=0)[0]
    far = skin(one.rig, world) + 100.0 * one.length
    assert thumb_along(one, far, world, thing("ball")) == 0.0
    normals = np.cross(tip, np.random.default_rng(0).normal(size=(1, 9, 3)))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    assert along(normals, np.ones((1, 9), bool), tip[None])[0] > 0.95


@pytest.mark.parametrize("kind", KINDS)
def test_a_margin_is_nothing_at_a_limit_and_whole_far_from_all(kind: str) -> None:
    clear = {**GOOD, "gap": 0.003, "opposition_deg": 160.0, "closure": 0.1, "crossing": 0.0}
    clear |= {"skin_through": 0.0, "uneven_curl_deg": 10.0, "bones_through": 0, "opposed_normals": 1.0}
    assert margin(clear, kind) == 1.0
    assert margin({**clear, "gap": 0.015}, kind) == 0.0 and margin({**clear, "gap": 0.02}, kind) == 0.0
    assert 0.0 < margin({**clear, "gap": 0.0135}, kind) < 1.0
    if kind in ("power", "precision"):
        assert margin({**clear, "opposition_deg": 101.0}, kind) < 0.2
        assert margin({**clear, "opposition_deg": 98.0}, kind) == 0.0
