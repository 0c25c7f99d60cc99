"""Poses into channels and keys as an animator expects them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose
from contact_core.scene.host import SceneSpace
from contact_core.testing.host_checks import pose_error
from contact_core.testing.host_scenes import HostScene, SceneRig, affine, arm_rig, bent


@pytest.fixture
def arm(scenes: Any) -> Any:
    """A host with the contract's arm at half its size."""
    world = affine((0.3, 0.0, 0.0), (0.5, 0.5, 0.5), (1.0, 2.0, 3.0))
    return scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig(), world),)))


def bones(bpy: Any) -> Any:
    return bpy.data.objects["arm"].parent.pose.bones


@pytest.mark.parametrize("mode", ["QUATERNION", "XYZ", "ZXY", "AXIS_ANGLE"])
def test_channels_do_not_jump_along_a_turn(bpy: Any, arm: Any, mode: str) -> None:
    """Over two whole turns in steps of ten degrees no channel jumps by more than its step: curves stay smooth."""
    rig = arm.read_rig("arm").rig
    elbow = rig.joint_index("elbow")
    bones(bpy)["elbow"].rotation_mode = mode
    channel = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}.get(mode, "rotation_euler")
    seen = []
    for angle in np.radians(np.arange(0.0, 721.0, 10.0)):
        local = rig.rest_local[elbow].copy()
        local[:3, :3] = local[:3, :3] @ Rotation.from_rotvec([0.1 * angle, 0.0, angle]).as_matrix()
        arm.write_pose("arm", Pose(("elbow",), local[None]))
        seen.append(np.array(getattr(bones(bpy)["elbow"], channel)))
    # Leaving the identity an axis appears from nowhere: there the first step of axis and angle is free.
    first = 1 if mode == "AXIS_ANGLE" else 0
    assert max(np.abs(after - before).max() for before, after in pairwise(seen[first:])) < np.radians(25.0)


def test_a_chain_is_posed_without_evaluating_in_between(bpy: Any, arm: Any) -> None:
    """Parents and children in one call; the bones that Blender evaluates afterwards are where they were wanted."""
    rig = arm.read_rig("arm").rig
    pose = bent(rig, 4)
    evaluations: list[Any] = []
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: evaluations.append(1))
    try:
        from contact_blender import poses
        from contact_core.scene.reading import unstretch_pose

        stretch = np.eye(3) * 0.5
        poses.write_pose(bpy.data.objects["arm"].parent, unstretch_pose(pose, stretch), None, pose.joints)
        assert evaluations == []
    finally:
        bpy.app.handlers.depsgraph_update_post.pop()
    assert pose_error(arm.read_pose("arm"), pose) < 1e-6


def test_keys_only_where_asked(bpy: Any, arm: Any) -> None:
    """No key without a frame; with one, just there, and what is seen at another frame follows the animation."""
    rig = arm.read_rig("arm").rig
    arm.write_pose("arm", bent(rig, 1))
    assert arm.pose_keys("arm") == () and bpy.data.objects["arm"].parent.animation_data is None
    bpy.context.scene.frame_set(1)
    arm.write_pose("arm", bent(rig, 2), 1.0)
    arm.write_pose("arm", bent(rig, 3), 11.0)
    assert arm.pose_keys("arm") == (1.0, 11.0)
    assert pose_error(arm.read_pose("arm"), bent(rig, 2)) < 1e-5  # frame 1 is shown, and still is
    for frame, seed in ((11, 3), (1, 2)):
        bpy.context.scene.frame_set(frame)
        assert pose_error(arm.read_pose("arm"), bent(rig, seed)) < 1e-5
        assert pose_error(arm.read_pose("arm", 12.0 - frame), bent(rig, 5 - seed)) < 1e-5


def test_reading_another_frame_keeps_an_unkeyed_pose(bpy: Any, arm: Any) -> None:
    """Blender drops a pose that has animation but no key when its frame changes; reading frames does not."""
    rig = arm.read_rig("arm").rig
    for frame, seed in ((1.0, 1), (9.0, 2)):
        arm.write_pose("arm", bent(rig, seed), frame)
    arm.write_pose("arm", bent(rig, 3))
    import blender_scenes

    before = blender_scenes.whole_state()
    assert pose_error(arm.read_pose("arm", 9.0), bent(rig, 2)) < 1e-5
    assert np.abs(arm.placement("arm", 9.0) - arm.placement("arm")).max() == 0.0
    assert blender_scenes.whole_state() == before
    assert pose_error(arm.read_pose("arm"), bent(rig, 3)) < 1e-6


def test_placement_at_a_frame_is_the_animated_one(bpy: Any, arm: Any) -> None:
    """Also between frames, and when a parent is what moves."""
    above = bpy.data.objects.new("above", None)
    bpy.context.scene.collection.objects.link(above)
    bpy.data.objects["arm"].parent.parent = above
    for frame, x in ((1, 0.0), (11, 5.0)):
        above.location.x = x
        above.keyframe_insert("location", frame=frame)
    from contact_blender.compat import fcurves

    for curve in fcurves(above):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    bpy.context.scene.frame_set(1)
    start = arm.placement("arm")[0, 3]
    assert arm.placement("arm", 11.0)[0, 3] - start == pytest.approx(5.0, abs=1e-5)
    assert arm.placement("arm", 3.5)[0, 3] - start == pytest.approx(1.25, abs=1e-5)
    assert bpy.context.scene.frame_current == 1


@pytest.mark.parametrize("only_available", [False, True])
def test_auto_key_is_honoured(bpy: Any, arm: Any, only_available: bool) -> None:
    """With Blender's auto-key on, a pose is keyed at the current frame as an edit by hand would be."""
    tools, edit = bpy.context.scene.tool_settings, bpy.context.preferences.edit
    rig = arm.read_rig("arm").rig
    bpy.context.scene.frame_set(7)
    try:
        tools.use_keyframe_insert_auto, edit.use_keyframe_insert_available = True, only_available
        arm.write_pose("arm", bent(rig, 1))
        assert arm.pose_keys("arm") == (() if only_available else (7.0,))
        bones(bpy)["elbow"].keyframe_insert("rotation_quaternion", frame=2)
        arm.write_pose("arm", bent(rig, 2))
        assert arm.pose_keys("arm") == (2.0, 7.0)
        arm.write_pose("arm", bent(rig, 3), 15.0)  # asked for by name: all bones
        bpy.context.scene.frame_set(15)
        assert pose_error(arm.read_pose("arm"), bent(rig, 3)) < 1e-5
    finally:
        tools.use_keyframe_insert_auto = edit.use_keyframe_insert_available = False


def test_a_pose_that_no_channel_can_hold_changes_nothing(bpy: Any, arm: Any) -> None:
    """Shear, a mirror, a shift of a connected bone, an unknown bone: refused in words, every channel as before."""
    import blender_scenes

    armature = bpy.data.objects["arm"].parent
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones["elbow"].tail = armature.data.edit_bones["wrist"].head
    armature.data.edit_bones["wrist"].use_connect = True
    bpy.ops.object.mode_set(mode="OBJECT")
    rig = arm.read_rig("arm").rig
    before = blender_scenes.whole_state()
    wrist = rig.joint_index("wrist")
    shear = np.eye(4)
    shear[0, 1] = 0.4
    for change in (shear, np.diag([1.0, 1.0, -1.0, 1.0])):
        with pytest.raises(InvalidInput, match="shear or a mirror"):
            arm.write_pose("arm", Pose(rig.joints, rig.rest_local @ change))
        assert blender_scenes.whole_state() == before
    shifted = np.array(rig.rest_local)
    shifted[wrist, :3, 3] += 0.2
    with pytest.raises(InvalidInput, match="connected to its parent"):
        arm.write_pose("arm", Pose(rig.joints, shifted))
    with pytest.raises(InvalidInput, match="no bone 'tail'"):
        arm.write_pose("arm", Pose(("tail",), np.eye(4)[None]))
    assert blender_scenes.whole_state() == before


@pytest.mark.parametrize("frame", [np.nan, np.inf, -np.inf])
def test_frames_that_are_no_numbers_are_refused(bpy: Any, arm: Any, frame: float) -> None:
    import blender_scenes

    pose, before = arm.read_pose("arm"), blender_scenes.whole_state()
    for call in (arm.placement, arm.read_pose, lambda key, frame: arm.write_pose(key, pose, frame)):
        with pytest.raises(InvalidInput, match="a frame is a number"):
            call("arm", frame)
    assert blender_scenes.whole_state() == before


def test_scale_of_bones_is_kept_and_keyed_when_it_changes(bpy: Any, arm: Any) -> None:
    rig = arm.read_rig("arm").rig
    local = np.array(bent(rig, 1).local)
    elbow = rig.joint_index("elbow")
    local[elbow, :3, :3] *= [1.5, 1.0, 0.75]
    arm.write_pose("arm", Pose(rig.joints, local), 3.0)
    bpy.context.scene.frame_set(3)
    assert pose_error(arm.read_pose("arm"), Pose(rig.joints, local)) < 1e-5
    from contact_blender.compat import fcurves

    keyed = {curve.data_path for curve in fcurves(bpy.data.objects["arm"].parent)}
    assert [path for path in keyed if path.endswith("scale")] == ['pose.bones["elbow"].scale']


def test_a_failed_step_leaves_every_key_as_it_was(bpy: Any, arm: Any) -> None:
    """Over an animation of some bones, with handles and interpolations of its own: values, handles, curves."""
    import blender_scenes

    rig = arm.read_rig("arm").rig
    elbow = rig.joint_index("elbow")
    for frame, seed in ((1.0, 1), (9.0, 2), (20.0, 3)):
        arm.write_pose("arm", Pose(("elbow",), bent(rig, seed).local[elbow : elbow + 1]), frame)
    from contact_blender.compat import fcurves

    curves = list(fcurves(bpy.data.objects["arm"].parent))
    for k, curve in enumerate(curves):
        for key in curve.keyframe_points:
            key.interpolation = ("BEZIER", "LINEAR", "CONSTANT")[k % 3]
            key.handle_left_type = key.handle_right_type = ("FREE", "VECTOR", "AUTO_CLAMPED")[k % 3]
        curve.keyframe_points[1].handle_right[1] += 0.3
        curve.update()

    def handles() -> Any:
        found = fcurves(bpy.data.objects["arm"].parent)
        return [[(tuple(k.co), tuple(k.handle_left), tuple(k.handle_right), k.handle_left_type, k.handle_right_type,
                  k.interpolation) for k in curve.keyframe_points] for curve in found]  # fmt: skip

    before = blender_scenes.whole_state(), handles()
    for frame in (9.0, 5.0, None):
        with pytest.raises(ZeroDivisionError), arm.step("fails"):
            arm.write_pose("arm", bent(rig, 7), frame)
            raise ZeroDivisionError
        assert (blender_scenes.whole_state(), handles()) == before


def keyed_paths(armature: Any) -> set[str]:
    from contact_blender.compat import fcurves

    return {curve.data_path.rsplit(".", 1)[1] for curve in fcurves(armature)}


@pytest.mark.parametrize(
    ("chosen", "channels"),
    [
        ("Location, Rotation & Scale", {"location", "rotation_quaternion", "scale"}),
        ("Rotation", {"rotation_quaternion"}),
        ("Whole Character", {"location", "rotation_quaternion", "scale"}),
        (None, {"location", "rotation_quaternion"}),
    ],
)
def test_the_active_keying_set_says_what_is_keyed(
    bpy: Any, arm: Any, chosen: str | None, channels: set[str]
) -> None:
    """Without one, what a pose sets: rotations, and where the root is."""
    sets = bpy.context.scene.keying_sets_all
    sets.active = None if chosen is None else next(each for each in sets if each.bl_label == chosen)
    try:
        arm.write_pose("arm", bent(arm.read_rig("arm").rig, 2), 5.0)
    finally:
        sets.active = None
    assert keyed_paths(bpy.data.objects["arm"].parent) == channels
    assert arm.pose_keys("arm") == (5.0,)


def test_a_keying_set_of_single_paths_keys_those(bpy: Any, arm: Any) -> None:
    armature, scene = bpy.data.objects["arm"].parent, bpy.context.scene
    own = scene.keying_sets.new(name="elbow")
    own.paths.add(armature, 'pose.bones["elbow"].rotation_quaternion')
    own.paths.add(armature, "location")
    rig = arm.read_rig("arm").rig
    arm.write_pose("arm", bent(rig, 2), 5.0)
    from contact_blender.compat import fcurves

    assert {curve.data_path for curve in fcurves(armature)} == {'pose.bones["elbow"].rotation_quaternion'}
    own.paths.remove(own.paths[0])
    before = arm.read_pose("arm").local
    with pytest.raises(InvalidInput, match="choose another keying set, or none"):
        arm.write_pose("arm", bent(rig, 3), 6.0)
    assert np.array_equal(arm.read_pose("arm").local, before) and arm.pose_keys("arm") == (5.0,)


def test_keys_go_into_the_slot_of_the_armature_and_nowhere_else(bpy: Any, arm: Any) -> None:
    """An action with another object's slot, and other channels of the armature: only the bones' curves change."""
    armature = bpy.data.objects["arm"].parent
    if not hasattr(bpy.types, "ActionSlot"):
        pytest.skip("actions have slots from Blender 4.4 on")
    lamp = bpy.data.objects.new("lamp", None)
    bpy.context.scene.collection.objects.link(lamp)
    lamp.keyframe_insert("location", frame=1)
    action = lamp.animation_data.action
    armature.animation_data_create().action = action
    armature.animation_data.action_slot = action.slots.new("OBJECT", "arm")
    armature.keyframe_insert("scale", frame=2)

    def curves(owner: Any) -> dict[Any, Any]:
        from contact_blender.compat import fcurves

        return {(c.data_path, c.array_index): [tuple(k.co) for k in c.keyframe_points] for c in fcurves(owner)}

    others, own = curves(lamp), curves(armature)
    rig = arm.read_rig("arm").rig
    arm.write_pose("arm", bent(rig, 2), 5.5)
    assert armature.animation_data.action == action and len(action.slots) == 2 and len(action.layers) == 1
    assert curves(lamp) == others and {key: curves(armature)[key] for key in own} == own
    assert arm.pose_keys("arm") == (5.5,)  # between two frames
    assert np.abs(arm.read_pose("arm", 5.5).local - bent(rig, 2).local).max() < 1e-6
