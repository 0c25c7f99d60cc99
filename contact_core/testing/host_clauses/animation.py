"""Which bones are posed, and keys that curves join: what programs have in which artists animate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import JointFreedom, Pose, Rig
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import ACCURACY, object_id, pose_error
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import FINGERS, bent

BETWEEN = 1e-3  # of a pose's entries: how far curves of Euler angles may be off between the keys


class AnimationClauses(HostGround):
    """Which bones are posed, and keys that curves join."""

    @needs("curves")
    def test_h39_curves_move_as_the_keys_say(self, host: Any) -> None:
        """Cubic keys come back at their frames, and what lies between them is their curve and no straight blend."""
        for name in ("arm", "half_arm"):
            rig_id = object_id(host, name)
            rig = host.read_rig(rig_id).rig
            keys = swing(rig, (2.0, 9.0, 14.0))
            host.write_curves(rig_id, keys)
            assert host.pose_keys(rig_id) == keys.frames
            for frame in keys.frames:
                assert pose_error(host.read_pose(rig_id, frame), keys.at(rig, frame)) < ACCURACY
            for frame in (4.0, 5.5, 12.0):
                assert pose_error(host.read_pose(rig_id, frame), keys.at(rig, frame)) < BETWEEN

    @needs("curves")
    def test_h40_curves_take_the_place_of_keys(self, host: Any) -> None:
        """Keys of the named joints from the first frame to the last go; keys outside and of other joints stay."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        for frame, seed in ((1.0, 6), (6.0, 7), (20.0, 8)):
            host.write_pose(rig_id, bent(rig, seed), frame)
        frames = (1.0, 3.0, 6.0, 8.0, 20.0)
        before = {frame: host.read_pose(rig_id, frame) for frame in frames}
        named = ("elbow", "thumb")
        keys = swing(rig, (4.0, 10.0))
        host.write_curves(rig_id, of_joints(keys, named))
        assert host.pose_keys(rig_id) == (1.0, 4.0, 6.0, 10.0, 20.0)
        others = [name for name in rig.joints if name not in named]
        for frame in frames:
            assert pose_error(part(host.read_pose(rig_id, frame), others), part(before[frame], others)) < ACCURACY
        for frame in (1.0, 20.0):
            assert pose_error(host.read_pose(rig_id, frame), before[frame]) < ACCURACY
        assert pose_error(part(host.read_pose(rig_id, 6.0), named), part(keys.at(rig, 6.0), named)) < BETWEEN
        host.write_curves(rig_id, keys)
        assert host.pose_keys(rig_id) == (1.0, 4.0, 10.0, 20.0)

    @needs("curves", "undo")
    def test_h41_curves_come_whole_or_not_at_all(self, host: Any) -> None:
        """Curves are one step, which one undo takes back; those of a joint that is not there change nothing."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        host.write_pose(rig_id, bent(rig, 6), 6.0)
        before, keys = self.scene_state(host), swing(rig, (4.0, 10.0))
        host.write_curves(rig_id, keys)
        after = self.scene_state(host)
        assert after != before
        assert host.undo() and self.scene_state(host) == before
        assert host.redo() and self.scene_state(host) == after
        renamed = tuple(Pose(("elbow", "no_such_joint"), pose.local[:2]) for pose in keys.poses)
        with pytest.raises(InvalidInput, match="no_such_joint"):
            host.write_curves(rig_id, PoseKeys(rig.name, (5.0, 7.0), renamed, tuple(s[:2] for s in keys.speeds)))
        assert self.scene_state(host) == after

    @needs("curves", "files")
    def test_h42_curves_are_saved(self, host: Any, tmp_path: Path) -> None:
        """Curves are the same after saving and opening."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        keys = swing(rig, (4.0, 10.0))
        host.write_curves(rig_id, keys)
        opened = self.reopen(host, tmp_path / f"saved{host.suffixes[0]}")
        again = object_id(opened, "arm")
        assert opened.pose_keys(again) == keys.frames
        for frame in (4.0, 6.0, 8.0, 10.0):
            assert pose_error(opened.read_pose(again, frame), keys.at(rig, frame)) < BETWEEN

    @needs("bones", "undo")
    def test_h43_the_bones_that_are_posed_are_chosen(self, host: Any) -> None:
        """Choosing bones is one step and holds for their rig alone; what the host has not is refused by name."""
        arm, other = object_id(host, "arm"), object_id(host, "half_arm")
        at_first, choice = host.bones_of(arm), self.choice_of("fingers")
        assert at_first != choice and host.bones_of(other) == at_first
        host.choose_bones(arm, choice)
        assert (host.bones_of(arm), host.bones_of(other)) == (choice, at_first)
        with pytest.raises(InvalidInput, match="no_such_bones"):
            host.choose_bones(arm, "no_such_bones")
        assert host.undo() and host.bones_of(arm) == at_first
        assert host.redo() and host.bones_of(arm) == choice

    @needs("bones")
    def test_h44_what_is_not_chosen_rests(self, host: Any) -> None:
        """Joints that are not chosen are fixed, the others as free as before, in `freedoms` as in the rig."""
        rig_id = object_id(host, "arm")
        joints, free = host.read_rig(rig_id).rig.joints, host.freedoms(rig_id)
        assert not any(freedom.kind == "fixed" for freedom in free)
        host.choose_bones(rig_id, self.choice_of("fingers"))
        chosen, rig = host.freedoms(rig_id), host.read_rig(rig_id).rig
        assert {name for name, each in zip(joints, chosen, strict=True) if each.kind != "fixed"} == set(FINGERS)
        alike = [each.is_like(was) for name, each, was in zip(joints, chosen, free, strict=True) if name in FINGERS]
        assert all(alike)
        assert rig.joints == joints and all(map(JointFreedom.is_like, rig.freedoms, chosen))

    @needs("bones", "files")
    def test_h45_a_choice_is_saved(self, host: Any, tmp_path: Path) -> None:
        """Which bones are posed is the same after saving and opening."""
        choice = self.choice_of("fingers")
        host.choose_bones(object_id(host, "arm"), choice)
        opened = self.reopen(host, tmp_path / f"saved{host.suffixes[0]}")
        assert opened.bones_of(object_id(opened, "arm")) == choice
        assert opened.bones_of(object_id(opened, "half_arm")) != choice


def swing(rig: Rig, frames: tuple[float, ...]) -> PoseKeys:
    """Cubic keys of all joints whose curves leave the straight blends by far."""
    rng = np.random.default_rng(11)
    poses = tuple(bent(rig, 20 + k) for k in range(len(frames)))
    speeds = tuple(0.2 * rng.uniform(-1.0, 1.0, (len(rig.joints), 6)) for _ in frames)
    for speed in speeds:
        speed[rig.parents >= 0, :3] = 0.0  # bones may be connected
    keys = PoseKeys(rig.name, frames, poses, speeds)
    middle = (frames[0] + frames[1]) / 2.0
    straight = PoseKeys(rig.name, frames, poses)
    assert pose_error(keys.at(rig, middle), straight.at(rig, middle)) > 100.0 * BETWEEN
    return keys


def of_joints(keys: PoseKeys, names: tuple[str, ...]) -> PoseKeys:
    """The same keys of some joints."""
    rows = [keys.poses[0].joints.index(name) for name in names]
    return PoseKeys(
        keys.rig, keys.frames, tuple(part(pose, names) for pose in keys.poses), tuple(s[rows] for s in keys.speeds)
    )


def part(pose: Pose, names: Any) -> Pose:
    """A pose of some of its joints."""
    return Pose(tuple(names), pose.local[[pose.joints.index(name) for name in names]])
