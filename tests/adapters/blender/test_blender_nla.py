"""Strips of the NLA under what is keyed: it is seen, or refused in words; a tweaked strip has its own times."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from contact_core.errors import InvalidInput
from contact_core.scene.host import SceneSpace
from contact_core.testing.host_checks import pose_error
from contact_core.testing.host_clauses.animation import BETWEEN, swing
from contact_core.testing.host_scenes import HostScene, SceneRig, arm_rig, bent


@pytest.fixture
def arm(bpy: Any, scenes: Any) -> Any:
    """A host with the contract's arm, whose action from 1 to 11 has become a strip; no action lies above it."""
    host = scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig()),)))
    rig = host.read_rig("arm").rig
    for frame, seed in ((1.0, 1), (11.0, 2)):
        host.write_pose("arm", bent(rig, seed), frame)
    animation = bpy.data.objects["arm"].parent.animation_data
    track = animation.nla_tracks.new()
    track.strips.new("walk", 1, animation.action)
    animation.action = None
    return host


def animation(bpy: Any) -> Any:
    return bpy.data.objects["arm"].parent.animation_data


def shows(host: Any, frame: float, pose: Any, near: float = 1e-5) -> bool:
    return pose_error(host.read_pose("arm", frame), pose) < near


def test_what_is_keyed_lies_above_strips(bpy: Any, arm: Any) -> None:
    rig = arm.read_rig("arm").rig
    assert arm.pose_keys("arm") == () and not shows(arm, 6.0, bent(rig, 3), 0.1)
    arm.write_pose("arm", bent(rig, 3), 6.0)
    assert shows(arm, 6.0, bent(rig, 3)) and arm.pose_keys("arm") == (6.0,)
    keys = swing(rig, (2.0, 5.0, 10.0))
    arm.write_curves("arm", keys)
    assert arm.pose_keys("arm") == keys.frames
    assert all(shows(arm, frame, keys.at(rig, frame), BETWEEN) for frame in (2.0, 3.5, 5.0, 7.0, 10.0))


def solo(bpy: Any) -> None:
    animation(bpy).nla_tracks[0].is_solo = True


def half(bpy: Any) -> None:
    animation(bpy).action_influence = 0.5


def added(bpy: Any) -> None:
    animation(bpy).action_blend_type = "ADD"


@pytest.mark.parametrize(("hide", "words"), [(solo, "is solo"), (half, "influence 0.5"), (added, "blended")])
def test_what_would_not_be_seen_is_refused(
    bpy: Any, arm: Any, scenes: Any, hide: Callable[[Any], None], words: str
) -> None:
    """Keys that Blender sets so that the pose is seen all the same are taken; curves are not."""
    rig = arm.read_rig("arm").rig
    arm.write_pose("arm", bent(rig, 3), 4.0)
    hide(bpy)
    bpy.context.scene.frame_set(bpy.context.scene.frame_current)  # as Blender shows it then
    before = scenes.whole_state()
    with pytest.raises(InvalidInput, match=words):
        arm.write_curves("arm", swing(rig, (2.0, 9.0)))
    assert scenes.whole_state() == before
    try:
        arm.write_pose("arm", bent(rig, 5), 8.0)
    except InvalidInput as refused:
        assert words in str(refused) and scenes.whole_state() == before
    else:
        assert shows(arm, 8.0, bent(rig, 5), BETWEEN)


def tweak(bpy: Any, **values: float) -> None:
    """Enter the tweak mode of the strip, with values of it."""
    track = animation(bpy).nla_tracks[0]
    for name, value in values.items():
        setattr(track.strips[0], name, value)
    animation(bpy).nla_tracks.active = track
    track.select = track.strips[0].select = True
    animation(bpy).use_tweak_mode = True
    assert animation(bpy).use_tweak_mode and animation(bpy).action is not None


def test_a_tweaked_strip_is_keyed_at_frames_of_the_scene(bpy: Any, arm: Any) -> None:
    """A strip that begins at 21 and runs at half the speed."""
    tweak(bpy, frame_start=21.0, scale=2.0)
    rig = arm.read_rig("arm").rig
    assert arm.pose_keys("arm") == (21.0, 41.0)
    arm.write_pose("arm", bent(rig, 3), 31.0)
    assert arm.pose_keys("arm") == (21.0, 31.0, 41.0) and shows(arm, 31.0, bent(rig, 3))
    keys = swing(rig, (23.0, 30.0, 38.0))
    arm.write_curves("arm", keys)
    assert arm.pose_keys("arm") == (21.0, 23.0, 30.0, 38.0, 41.0)
    assert all(shows(arm, frame, keys.at(rig, frame), BETWEEN) for frame in (23.0, 26.0, 30.0, 33.5, 38.0))


def test_a_strip_that_repeats_takes_no_curves(bpy: Any, arm: Any, scenes: Any) -> None:
    tweak(bpy, repeat=2.0)
    rig, before = arm.read_rig("arm").rig, scenes.whole_state()
    with pytest.raises(InvalidInput, match="leave the tweak mode"):
        arm.write_curves("arm", swing(rig, (5.0, 15.0, 18.0)))
    assert scenes.whole_state() == before
