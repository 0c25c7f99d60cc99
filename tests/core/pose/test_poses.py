"""Poses: charts go round, blends and mirrors keep their laws, files come back, keys interpolate."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import FileRefused, InvalidInput
from contact_core.rig.chart import Chart
from contact_core.rig.pose_files import load_pose, save_pose
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.poses import blend, mirrored_name, mirrored_pose, set_angles
from contact_core.rig.rig import JointFreedom, Pose, Rig, forward_kinematics, skin
from contact_core.testing import rigs

HAND = rigs.hand_like(rigs.any_freedom)
CHART = Chart(HAND)


def random_pose(seed: int, rig: Rig = HAND) -> Pose:
    random = np.random.default_rng(seed)
    chart = Chart(rig)
    theta = np.clip(random.normal(0.0, 0.6, chart.size), chart.lower, chart.upper)
    return Pose(rig.joints, chart.local(theta))


@given(st.integers(0, 10_000))
@settings(max_examples=40)
def test_chart_goes_round(seed: int) -> None:
    """theta -> pose -> theta is the identity for angles below half a turn, of every kind of joint."""
    theta = np.clip(np.random.default_rng(seed).uniform(-1.4, 1.4, CHART.size), CHART.lower, CHART.upper)
    back, leftover = CHART.theta_of(Pose(HAND.joints, CHART.local(theta)))
    assert leftover is None
    assert np.abs(back - theta).max() < 1e-9


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_any_pose_goes_through_the_chart_unchanged(seed: int) -> None:
    """Also one with scales, shears and turns that no freedom has."""
    local = HAND.rest_local @ np.random.default_rng(seed).normal(np.eye(4), 0.1, (len(HAND.joints), 4, 4))
    local[:, 3] = [0.0, 0.0, 0.0, 1.0]
    theta, leftover = CHART.theta_of(Pose(HAND.joints, local))
    assert np.abs(CHART.local(theta, leftover) - local).max() < 1e-9


def test_motion_is_forward_kinematics() -> None:
    theta = np.random.default_rng(2).normal(0.0, 0.5, CHART.size)
    assert np.abs(CHART.motion(theta).world - forward_kinematics(HAND.parents, CHART.local(theta))).max() < 1e-12


def test_a_pose_may_name_some_joints_only() -> None:
    turned = random_pose(1)
    part = Pose(HAND.joints[3:5], turned.local[3:5])
    theta, _ = CHART.theta_of(part)
    assert np.abs(CHART.local(theta)[3:5] - part.local).max() < 1e-12
    assert np.abs(CHART.local(theta)[:3] - HAND.rest_local[:3]).max() < 1e-12
    with pytest.raises(InvalidInput, match="another rig"):
        CHART.theta_of(Pose(("nobody",), np.eye(4)[None]))


def test_set_angles_sets_what_it_names() -> None:
    hinge = CHART.dof_names[CHART.rotation_slices[1].start]
    pose = set_angles(HAND, Pose.rest(HAND), {hinge: 0.75})
    theta, _ = CHART.theta_of(pose)
    assert theta[CHART.dof_names.index(hinge)] == pytest.approx(0.75)
    assert np.count_nonzero(np.abs(theta) > 1e-12) == 1
    with pytest.raises(InvalidInput, match="limited to"):
        set_angles(HAND, pose, {hinge: 3.0})
    with pytest.raises(InvalidInput, match=r"near are wrist\.x"):
        set_angles(HAND, pose, {"wrist.w": 0.1})


@given(st.integers(0, 1000), st.floats(0.0, 1.0))
@settings(max_examples=20)
def test_blend_runs_evenly_from_one_to_the_other(seed: int, share: float) -> None:
    one, two = random_pose(seed), random_pose(seed + 1)
    assert np.abs(blend(HAND, one, two, 0.0).local - one.local).max() < 1e-9
    assert np.abs(blend(HAND, one, two, 1.0).local - two.local).max() < 1e-9
    there = blend(HAND, one, two, share).local
    assert np.abs(blend(HAND, two, one, 1.0 - share).local - there).max() < 1e-7
    linear = there[:, :3, :3]
    assert np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max() < 1e-9


def two_hands() -> Rig:
    """A symmetric rig of a spine and two arms whose frames do not mirror one another."""
    names = ("spine", "upper.L", "lower.L", "upper.R", "lower.R")
    world = np.tile(np.eye(4), (5, 1, 1))
    random = np.random.default_rng(0)
    for j, point in enumerate([(0, 0, 0), (1, 1, 0), (2, 1, 0), (-1, 1, 0), (-2, 1, 0)]):
        world[j, :3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0]
        world[j, :3, :3] *= np.sign(np.linalg.det(world[j, :3, :3]))
        world[j, :3, 3] = point
    parents = np.array([-1, 0, 1, 0, 3])
    local = np.array([world[j] if p < 0 else np.linalg.inv(world[p]) @ world[j] for j, p in enumerate(parents)])
    cloud = np.concatenate([random.normal(world[j, :3, 3], 0.2, (6, 3)) for j in (0, 1, 2)])
    points = np.concatenate([cloud, cloud * [-1, 1, 1]])
    owner = np.concatenate([np.repeat([0, 1, 2], 6), np.repeat([0, 3, 4], 6)])
    return Rig("arms", names, parents, local, world, points, np.arange(36).reshape(-1, 3), owner[:, None],
               np.ones((36, 1)), tuple(JointFreedom(translates=j == 0) for j in range(5)))  # fmt: skip


@given(st.integers(0, 1000))
@settings(max_examples=20)
def test_mirror_mirrors_the_skin(seed: int) -> None:
    """The skin of the mirrored pose is the mirror image of the skin, and mirroring twice changes nothing."""
    rig = two_hands()
    pose = random_pose(seed, rig)
    image = mirrored_pose(rig, pose)
    points, mirrored = (skin(rig, forward_kinematics(rig.parents, p.local)) for p in (pose, image))
    swapped = np.concatenate([points[18:], points[:18]]) * [-1.0, 1.0, 1.0]
    assert np.abs(mirrored - swapped).max() < 1e-9
    assert np.abs(mirrored_pose(rig, image).local - pose.local).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "partner"),
    [("hand_l", "hand_r"), ("LeftArm", "RightArm"), ("finger.R.001", "finger.L.001"), ("spine", "spine"),
     ("leg-right-upper", "leg-left-upper"), ("collar", "collar"), ("RIGHT_EYE", "LEFT_EYE")],
)  # fmt: skip
def test_mirrored_names(name: str, partner: str) -> None:
    assert mirrored_name(name) == partner
    assert mirrored_name(partner) == name


def test_files_come_back_to_the_bit(tmp_path: Path) -> None:
    pose = random_pose(5)
    save_pose(tmp_path / "a.json", pose, rig="hand")
    again = load_pose(tmp_path / "a.json")
    assert again.joints == pose.joints
    assert np.array_equal(again.local, pose.local)


@pytest.mark.parametrize(
    "content",
    ["", "[]", '{"kind": "contact.pose", "schema": 99}', '{"kind": "contact.pose", "schema": 1, "joints": ["a"]}',
     '{"kind": "contact.pose", "schema": 1, "joints": ["a"], "local": [[1, 2]]}',
     json.dumps({"kind": "contact.pose", "schema": 1, "joints": ["a"], "local": [[float("nan")] * 16]})],
)  # fmt: skip
def test_damaged_files_are_refused_in_words(tmp_path: Path, content: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(content)
    with pytest.raises(FileRefused) as refusal:
        load_pose(path)
    assert "bad.json" in str(refusal.value)


def test_keys_blend_between_and_hold_beyond() -> None:
    one, two = random_pose(1), random_pose(2)
    keys = PoseKeys("hand").with_key(10, one).with_key(20, two)
    assert keys.at(HAND, 3) is one
    assert keys.at(HAND, 30) is two
    assert np.abs(keys.at(HAND, 14).local - blend(HAND, one, two, 0.4).local).max() < 1e-12
    assert keys.without_key(10).frames == (20.0,)
    with pytest.raises(InvalidInput, match="no key at frame 7"):
        keys.without_key(7)
