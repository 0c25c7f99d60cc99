"""Poses of a whole armature: read at a frame, written, keyed; Blender's auto-key honoured."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy
import numpy as np

from contact_blender import compat
from contact_blender.channels import read_basis, snapshot, write_basis
from contact_blender.evaluation import graph_at
from contact_blender.rig import UNMOVED, Skeleton, read_skeleton
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.pose.rig import Pose


def read_pose(armature: Any, frame: float | None, unmoved: bool) -> Pose:
    """The pose of all bones in armature space, at a frame with everything that animates them.

    unmoved: whether the rig has the joint of vertices that no bone moves.
    """
    skeleton = read_skeleton(armature)
    with graph_at(frame, armature) as depsgraph:
        bones = (armature if frame is None else armature.evaluated_get(depsgraph)).pose.bones
        local = np.array(
            [skeleton.edit_local[k] @ read_basis(bones[name]) for k, name in enumerate(skeleton.joints)]
        )
    if unmoved:
        return Pose((*skeleton.joints, UNMOVED), np.concatenate([local, np.eye(4)[None]]))
    return Pose(skeleton.joints, local)


def bases_of(skeleton: Skeleton, pose: Pose, armature_name: str) -> dict[str, FloatArray]:
    """Channels (4, 4) by bone that make a pose in armature space. Raises InvalidInput on unknown bones."""
    place = {name: k for k, name in enumerate(skeleton.joints)}
    unknown = [name for name in pose.joints if name not in place and name != UNMOVED]
    if unknown:
        raise InvalidInput(f"{armature_name} has no bone {unknown[0]!r}; is this a pose of another rig?")
    return {
        name: np.linalg.inv(skeleton.edit_local[place[name]]) @ local
        for name, local in zip(pose.joints, pose.local, strict=True)
        if name in place
    }


def write_pose(armature: Any, pose: Pose, frame: float | None) -> None:
    """Set the bones that a pose in armature space names, and key them at a frame.

    For None there is a key only where Blender's auto-key is on, at the current frame, as for an edit by hand. A key
    at another frame than the current one leaves what is seen now to the animation. Raises InvalidInput, with the
    channels as they were.
    """
    before = {pose_bone.name: snapshot(pose_bone) for pose_bone in armature.pose.bones}
    written: dict[str, tuple[str, ...]] = {}
    try:
        for name, basis in bases_of(read_skeleton(armature), pose, armature.name).items():
            written[name] = write_basis(armature.pose.bones[name], basis)
    except InvalidInput:
        for name, restore in before.items():
            restore(armature.pose.bones[name])
        raise
    scene = bpy.context.scene
    if frame is not None:
        _key(armature, written, float(frame), only_available=False)
        if float(frame) != scene.frame_current_final:
            _show_animation(armature, written, scene.frame_current_final)
    elif scene.tool_settings.use_keyframe_insert_auto:
        available = bpy.context.preferences.edit.use_keyframe_insert_available
        _key(armature, written, float(scene.frame_current_final), only_available=available)
    armature.update_tag(refresh={"OBJECT"})


def key_frames(armature: Any) -> tuple[float, ...]:
    """Frames with a key on any bone, ascending."""
    curves = (curve for curve in compat.fcurves(armature) if curve.data_path.startswith("pose.bones"))
    return tuple(sorted({round(float(key.co[0]), 4) for curve in curves for key in curve.keyframe_points}))


def remember(armature: Any) -> Callable[[Any], None]:
    """What puts channels and keys of all bones back, given the armature anew: for a step that fails."""
    channels = {pose_bone.name: snapshot(pose_bone) for pose_bone in armature.pose.bones}
    animation = armature.animation_data
    action = animation.action.name if animation is not None and animation.action is not None else None
    keys = {_curve_id(curve): _keys_of(curve) for curve in compat.fcurves(armature)}

    def restore(again: Any) -> None:
        for name, put_channels in channels.items():
            put_channels(again.pose.bones[name])
        now = again.animation_data.action if again.animation_data is not None else None
        if action is None:
            if now is not None:
                compat.forget_action(again, now.name)
            if animation is None:
                again.animation_data_clear()
            return
        for curve in compat.fcurves(again):
            _put_keys(curve, keys.get(_curve_id(curve), ()))

    animation = None if animation is None else True  # the fact, not the Blender object
    return restore


def _key(armature: Any, written: dict[str, tuple[str, ...]], frame: float, *, only_available: bool) -> None:
    """`keyframe_insert` makes action, slot and curves by itself, alike on every version."""
    there = {curve.data_path for curve in compat.fcurves(armature)} if only_available else set()
    for name, channels in written.items():
        pose_bone = armature.pose.bones[name]
        for channel in channels:
            if not only_available or pose_bone.path_from_id(channel) in there:
                pose_bone.keyframe_insert(channel, frame=frame, group=name)


def _show_animation(armature: Any, written: dict[str, tuple[str, ...]], frame: float) -> None:
    """Set the written channels to what their curves say at the current frame."""
    paths = {armature.pose.bones[name].path_from_id(channel): (name, channel)
             for name, channels in written.items() for channel in channels}  # fmt: skip
    for curve in compat.fcurves(armature):
        if curve.data_path in paths:
            name, channel = paths[curve.data_path]
            getattr(armature.pose.bones[name], channel)[curve.array_index] = curve.evaluate(frame)


def _curve_id(curve: Any) -> tuple[str, int]:
    return str(curve.data_path), int(curve.array_index)


_KEY_FIELDS = ("co", "handle_left", "handle_right")


def _keys_of(curve: Any) -> tuple[tuple[Any, ...], ...]:
    """The keys of a curve as plain values."""
    return tuple(
        (k.handle_left_type, k.handle_right_type, k.interpolation, *(tuple(getattr(k, f)) for f in _KEY_FIELDS))
        for k in curve.keyframe_points
    )


def _put_keys(curve: Any, keys: Iterable[tuple[Any, ...]]) -> None:
    """Give a curve exactly these keys."""
    wanted = tuple(keys)
    if _keys_of(curve) == wanted:
        return
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(wanted))
    for point, (left, right, interpolation, *places) in zip(curve.keyframe_points, wanted, strict=True):
        point.handle_left_type, point.handle_right_type, point.interpolation = left, right, interpolation
        for name, place in zip(_KEY_FIELDS, places, strict=True):
            setattr(point, name, place)
    curve.update()
