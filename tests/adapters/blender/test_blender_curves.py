"""Cubic keys as Blender's curves: what Blender evaluates is the film, and what lies beside it stays."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.scene.host import SceneSpace
from contact_core.testing.host_scenes import HostScene, SceneRig, affine, arm_rig, bent

FRAMES = (3.0, 9.0, 14.0, 25.0)
MODES = ["QUATERNION", "XYZ", "ZXY", "AXIS_ANGLE"]


@pytest.fixture
def arm(scenes: Any) -> Any:
    """A host with the contract's arm at half its size, turned."""
    world = affine((0.3, 0.4, 0.0), (0.5, 0.5, 0.5), (1.0, 2.0, 3.0))
    return scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig(), world),)))


def film(rig: Rig, frames: tuple[float, ...] = FRAMES, size: float = 0.06) -> PoseKeys:
    """Keys with speeds."""
    random = np.random.default_rng(5)
    poses = tuple(bent(rig, 10 + k) for k in range(len(frames)))
    return PoseKeys("arm", frames, poses, tuple(size * random.normal(size=(len(rig.joints), 6)) for _ in frames))


def armature(bpy: Any) -> Any:
    return bpy.data.objects["arm"].parent


def off(host: Any, rig: Rig, keys: PoseKeys, frame: float) -> float:
    """The largest distance of the skin as Blender's curves pose it from that of the keys."""
    shown, wanted = host.read_pose("arm", frame), keys.at(rig, frame)
    one, two = (skin(rig, forward_kinematics(rig.parents, pose.local)) for pose in (shown, wanted))
    return float(np.linalg.norm(one - two, axis=1).max())


@pytest.mark.parametrize("mode", MODES)
def test_blender_shows_what_lies_between_the_keys(bpy: Any, arm: Any, mode: str) -> None:
    for bone in armature(bpy).pose.bones:
        bone.rotation_mode = mode
    rig = arm.read_rig("arm").rig
    keys = film(rig)
    arm.write_curves("arm", keys)
    if mode == "QUATERNION":
        assert arm.pose_keys("arm") == FRAMES  # the very curve needs no more
        between = [*np.arange(3.0, 25.25, 0.25)]
    else:
        between = [*np.arange(3.0, 26.0)]  # others are near at frames
    size = float(np.ptp(rig.surface.points, axis=0).max())
    near = 2e-6 if mode == "QUATERNION" else 5e-4
    assert max(off(arm, rig, keys, float(frame)) for frame in between) < near * size


def test_few_keys_are_drawn_as_an_artist_draws_them(bpy: Any, arm: Any) -> None:
    from contact_blender import compat

    rig = arm.read_rig("arm").rig
    arm.write_curves("arm", film(rig))
    for curve in compat.fcurves(armature(bpy)):
        points = curve.keyframe_points
        assert [point.co[0] for point in points] == list(FRAMES)
        if "scale" in curve.data_path:
            continue
        assert {point.interpolation for point in points} == {"BEZIER"}
        assert {point.handle_right_type for point in points} == {"ALIGNED"}
        for one, two in pairwise(points):
            third = (two.co[0] - one.co[0]) / 3.0
            assert one.handle_right[0] - one.co[0] == pytest.approx(third, abs=1e-4)
            assert two.co[0] - two.handle_left[0] == pytest.approx(third, abs=1e-4)


def test_what_is_outside_stays(bpy: Any, arm: Any) -> None:
    """Keys before and after the range, other bones, and other objects; within it, old keys give way."""
    from contact_blender import compat

    rig = arm.read_rig("arm").rig
    for frame in (-20.0, -8.0, 5.0, 6.0, 7.0, 40.0, 55.0):
        arm.write_pose("arm", bent(rig, int(frame) + 30), frame)
    cube = bpy.data.objects.new("cube", None)
    bpy.context.scene.collection.objects.link(cube)
    cube.keyframe_insert("location", frame=5)
    outside = (-20.0, -14.3, -8.0, 40.0, 47.7, 55.0)
    before = [arm.read_pose("arm", frame).local for frame in outside]
    curves = {(c.data_path, c.array_index) for c in compat.fcurves(armature(bpy))}
    thumb = [c for c in compat.fcurves(armature(bpy)) if "thumb" in c.data_path]
    kept = [[tuple(point.co) for point in c.keyframe_points] for c in thumb]
    keys = film(rig)
    some = tuple(name for name in rig.joints if name != "thumb")
    rows = [rig.joint_index(name) for name in some]
    poses = tuple(Pose(some, pose.local[rows]) for pose in keys.poses)
    arm.write_curves("arm", PoseKeys("arm", FRAMES, poses, tuple(speed[rows] for speed in keys.speeds)))
    for frame, local in zip(outside, before, strict=True):
        np.testing.assert_allclose(arm.read_pose("arm", frame).local, local, atol=2e-5)
    again = [c for c in compat.fcurves(armature(bpy)) if "thumb" in c.data_path]
    assert [[tuple(point.co) for point in c.keyframe_points] for c in again] == kept
    assert curves <= {(c.data_path, c.array_index) for c in compat.fcurves(armature(bpy))}
    for curve in compat.fcurves(armature(bpy)):
        if "thumb" not in curve.data_path and "rotation" in curve.data_path:
            assert [point.co[0] for point in curve.keyframe_points] == [-20.0, -8.0, *FRAMES, 40.0, 55.0]
    assert len(list(compat.fcurves(cube))) == 3


def test_one_step_that_is_undone_whole(bpy: Any, empty: Any, scenes: Any) -> None:
    arm = scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", arm_rig(), np.eye(4)),)))
    rig = arm.read_rig("arm").rig
    with arm.step("before"):
        arm.write_pose("arm", bent(rig, 1), 5.0)
    before = scenes.whole_state()
    arm.write_curves("arm", film(rig))
    after = scenes.whole_state()
    assert after != before
    assert arm.undo() and scenes.whole_state() == before
    assert arm.redo() and scenes.whole_state() == after


def test_what_fails_leaves_nothing(bpy: Any, arm: Any, scenes: Any) -> None:
    rig = arm.read_rig("arm").rig
    arm.write_pose("arm", bent(rig, 1), 5.0)
    before = scenes.whole_state()
    local = bent(rig, 2).local.copy()
    local[1, 0, 1] += 0.4
    sheared = PoseKeys("arm", (1.0, 8.0), (bent(rig, 3), Pose(rig.joints, local)))
    stranger = PoseKeys("arm", (1.0,), (Pose(("nobody",), np.eye(4)[None]),))
    for keys, words in ((sheared, "shear"), (stranger, "nobody")):
        with pytest.raises(InvalidInput, match=words):
            arm.write_curves("arm", keys)
        assert scenes.whole_state() == before


def test_a_film_solved_in_blender_is_few_keys_on_the_solved_skin(bpy: Any, empty: Any, scenes: Any) -> None:
    import contact_core as contact
    from contact_core.proposals.motion import MotionProposal
    from contact_core.testing import meshes

    rig, small = arm_rig(), meshes.icosphere(2)
    host = scenes.build(HostScene(SceneSpace(1.0, "Z"), rigs=(SceneRig("arm", rig, np.eye(4)),)))
    ball = contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    host.add(contact.Asset("ball", ball, meters_per_unit=1.0))
    with contact.Session(host=host, objects=None, discover=False) as session:
        hand, thing = session.document.surfaces
        mesh, ball = session.geometry.mesh(hand), session.geometry.mesh(thing)
        tip = int(np.argmax(mesh.points[:, 1] + mesh.points[:, 0]))
        near = np.argsort(np.linalg.norm(mesh.points - mesh.points[tip], axis=1))[:6]
        points = contact.SurfacePoints.at_vertices(mesh, near)
        session.patches.paint("tip", points, surface=hand, axis=points[:1], heading=1.0)
        side = contact.SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 0]))])
        session.pairs.add("tip", session.patches.transfer("tip", thing, side, heading=1.0), name="touch")
        session.timeline.set(1, 25, 24)
        session.timeline.key("place", thing, frame=1)
        session.timeline.go(25)
        moved = session.document.surface(thing).world_from_surface.copy()
        moved[:3, 3] += [0.0, 0.2, 0.1]
        session.surfaces.place(thing, moved)
        found = session.solve(frames=session.timeline.settings.frames())
        assert isinstance(found, MotionProposal) and found.motion is not None and not found.keys
        before = scenes.whole_state()
        session.accept(found)
        object_id = session.binding.surfaces[hand].object_id
        keys = host.pose_keys(object_id)
        assert keys == found.reductions[hand].keys.frames and len(keys) <= 12
        known = host.read_rig(object_id).rig
        for frame, pose in zip(found.motion.motion.frames, found.motion.poses(hand), strict=True):
            one, two = (
                skin(known, forward_kinematics(known.parents, each.local))
                for each in (host.read_pose(object_id, frame), pose)
            )
            assert np.linalg.norm(one - two, axis=1).max() <= 1.05e-3  # a millimetre
        session.undo()
        assert scenes.whole_state()[:-1] == before[:-1]


@pytest.mark.parametrize(
    ("chosen", "channels"),
    [
        ("Location, Rotation & Scale", {"location", "rotation_quaternion", "scale"}),
        ("Rotation", {"rotation_quaternion"}),
        (None, {"location", "rotation_quaternion"}),
    ],
)
def test_a_film_is_keyed_by_the_active_keying_set(
    bpy: Any, arm: Any, chosen: str | None, channels: set[str]
) -> None:
    """What it names of the bones that move; what does not move is keyed as it is at the same frames."""
    from contact_blender.compat import fcurves

    sets, rig = bpy.context.scene.keying_sets_all, arm.read_rig("arm").rig
    sets.active = None if chosen is None else next(each for each in sets if each.bl_label == chosen)
    try:
        arm.write_curves("arm", film(rig))
    finally:
        sets.active = None
    curves = list(fcurves(armature(bpy)))
    assert {curve.data_path.rsplit(".", 1)[-1] for curve in curves} == channels
    assert all([point.co[0] for point in curve.keyframe_points] == list(FRAMES) for curve in curves)
    scales = [point.co[1] for curve in curves if "scale" in curve.data_path for point in curve.keyframe_points]
    np.testing.assert_allclose(scales, 1.0, atol=1e-5)


def test_a_keying_set_of_single_numbers_keys_those_of_a_film(bpy: Any, arm: Any) -> None:
    from contact_blender.compat import fcurves

    own, rig = bpy.context.scene.keying_sets.new(name="elbow"), arm.read_rig("arm").rig
    armature(bpy).pose.bones["elbow"]["grip"] = 0.25
    own.paths.add(armature(bpy), 'pose.bones["elbow"].rotation_quaternion', index=1).use_entire_array = False
    own.paths.add(armature(bpy), 'pose.bones["elbow"]["grip"]')
    arm.write_curves("arm", film(rig))
    curves = {(curve.data_path, curve.array_index): curve for curve in fcurves(armature(bpy))}
    assert set(curves) == {('pose.bones["elbow"].rotation_quaternion', 1), ('pose.bones["elbow"]["grip"]', 0)}
    assert all(len(curve.keyframe_points) == len(FRAMES) for curve in curves.values())
    own.paths.clear()
    own.paths.add(armature(bpy), "location")
    with pytest.raises(InvalidInput, match="choose another keying set, or none"):
        arm.write_curves("arm", film(rig))
