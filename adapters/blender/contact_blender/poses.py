"""Poses of a whole armature: read at a frame, written, keyed; Blender's auto-key honoured."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Any

import bpy
import numpy as np

from contact_blender import keys
from contact_blender.channels import is_there, read_basis, snapshot, write_basis
from contact_blender.evaluation import graph_at
from contact_blender.rig import UNMOVED, Skeleton, read_skeleton
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose


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


def write_pose(armature: Any, pose: Pose, frame: float | None, posed: Collection[str]) -> None:
    """Set the bones that a pose in armature space names, and key them at a frame.

    posed: the bones that a solve may pose; another is set, and keyed, only where it is to be elsewhere than it is.

    For None there is a key only where Blender's auto-key is on, at the current frame, as for an edit by hand. A key
    at another frame than the current one leaves what is seen now to the animation. Raises InvalidInput, with the
    channels as they were.
    """
    bones = armature.pose.bones
    before = {name: snapshot(bones[name]) for name in pose.joints if name in bones}
    written: dict[str, tuple[str, ...]] = {}
    try:
        for name, basis in bases_of(read_skeleton(armature), pose, armature.name).items():
            if name in posed or not is_there(bones[name], basis):
                written[name] = write_basis(bones[name], basis)
    except InvalidInput:
        for name, restore in before.items():
            restore(bones[name])
        raise
    at = keys.key_frame(frame)
    if at is not None:
        keys.insert(armature, written, at, by_auto_key=frame is None)
    if at is not None and at != bpy.context.scene.frame_current_final:
        keys.show_animation(armature, written)
    armature.update_tag(refresh={"OBJECT"})


def check_local(armature: Any) -> None:
    """Raises InvalidInput for one that another file holds."""
    if armature.library is not None:
        raise InvalidInput(
            f"{armature.name} is linked from {armature.library.filepath}, so its pose would not be saved: make"
            " a library override of it and pose that."
        )


def remember(armature: Any, bones: Iterable[str], frame: float | None) -> Callable[[Any], None]:
    """What puts the channels and keys of bones back, given the armature anew: for a step that fails.

    Keys are looked at only where a pose written at `frame` sets some.
    """
    channels = {name: snapshot(armature.pose.bones[name]) for name in bones if name in armature.pose.bones}
    put_keys = keys.remember(armature, channels) if keys.key_frame(frame) is not None else None

    def restore(again: Any) -> None:
        for name, put_channels in channels.items():
            put_channels(again.pose.bones[name])
        if put_keys is not None:
            put_keys(again)

    return restore
