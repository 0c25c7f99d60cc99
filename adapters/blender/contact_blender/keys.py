"""Keys of pose bones: set by `keyframe_insert`, which is alike on every version, and taken back exactly."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import bpy
import numpy as np

from contact_blender import compat, keying_set, nla
from contact_blender.keying_set import ChannelKey
from contact_core.errors import InvalidInput

Written = Mapping[str, tuple[str, ...]]  # channels that were set, by bone
_FIELDS = {  # of a key: numbers each, and their kind
    "co": (2, np.float32),
    "handle_left": (2, np.float32),
    "handle_right": (2, np.float32),
    "handle_left_type": (1, np.int32),
    "handle_right_type": (1, np.int32),
    "interpolation": (1, np.int32),
}


def key_frame(frame: float | None) -> float | None:
    """Where a pose written at `frame` is keyed: for None at the current frame when Blender's auto-key is on."""
    scene = bpy.context.scene
    if frame is None and scene.tool_settings.use_keyframe_insert_auto:
        return float(scene.frame_current_final)
    return None if frame is None else float(frame)


def insert(armature: Any, written: Written, frame: float, *, by_auto_key: bool) -> None:
    """Key the channels that were written, or of those bones what the user's active keying set names.

    Auto-key's own preferences ("only available", "only active keying set") hold where auto-key is what keys. What a
    driver sets is left out. Raises InvalidInput where the keying set has nothing of these bones, where the action
    is another file's, and where strips of the NLA would show something else.
    """
    check_action(armature)
    chosen = keying_set.active(by_auto_key=by_auto_key)
    found = _written(armature, written) if chosen is None else named(armature, written, chosen)
    if chosen is None and by_auto_key and bpy.context.preferences.edit.use_keyframe_insert_available:
        there = {curve.data_path for curve in compat.fcurves(armature)}
        found = [each for each in found if each.path in there]
    values = {
        (each.path, place): float(armature.path_resolve(each.path)[place])
        for each in found
        for place in _places(armature, each)
        if _count(armature, each.path) > 1
    }
    insert_at(armature, found, frame)
    nla.check_seen(armature, {frame: values})


def insert_at(armature: Any, found: Sequence[ChannelKey], frame: float) -> None:
    """Key what channels hold now, but for what drivers set."""
    for each in found:
        places = _places(armature, each)
        whole = each.index < 0 and len(places) == _count(armature, each.path)
        for place in (-1,) if whole else places:
            armature.keyframe_insert(each.path, index=place, frame=frame, group=each.group)


def _places(armature: Any, channel: ChannelKey) -> list[int]:
    """Which numbers of its path a channel key sets: those that no driver does."""
    driven = {each.array_index for each in compat.drivers(armature) if each.data_path == channel.path}
    chosen = range(_count(armature, channel.path)) if channel.index < 0 else (channel.index,)
    return [place for place in chosen if place not in driven]


def _written(armature: Any, written: Written) -> list[ChannelKey]:
    """All channels that a pose has set."""
    bones = armature.pose.bones
    return [ChannelKey(bones[n].path_from_id(c), -1, n) for n, channels in written.items() for c in channels]


def named(armature: Any, written: Written, chosen: Any) -> list[ChannelKey]:
    """What a keying set names of the bones that were written. Raises InvalidInput where that is nothing."""
    found = [each for name in written for each in keying_set.channel_keys(chosen, armature.pose.bones[name])]
    if written and not found:
        raise InvalidInput(
            f"the active keying set {chosen.bl_label!r} has no channel of the posed bones"
            f" ({', '.join(list(written)[:3])} ...), so the pose would be lost at the next frame: choose another"
            " keying set, or none."
        )
    return found


def _count(armature: Any, path: str) -> int:
    """How many numbers a path has."""
    value = armature.path_resolve(path)
    return len(value) if hasattr(value, "__len__") and not isinstance(value, str) else 1


def check_action(armature: Any) -> None:
    """Raises InvalidInput where the action is another file's."""
    action = armature.animation_data.action if armature.animation_data else None
    if action is not None and action.library is not None:
        raise InvalidInput(
            f"the action {action.name!r} of {armature.name} is linked from {action.library.filepath}, so no key can"
            " be set in it: give the armature an action of this file, or make this one local."
        )


def show_animation(armature: Any, written: Written) -> None:
    """Set channels that were keyed elsewhere to what their curves say at the current frame."""
    frame = bpy.context.scene.frame_current_final
    channel_of = _paths(armature, written)
    curves = [curve for curve in compat.fcurves(armature) if curve.data_path in channel_of]
    if nla.has_strips(armature):
        numbers = tuple(_id(curve) for curve in curves)
        shown = nla.seen(armature, frame, numbers)
    else:
        shown = {_id(curve): curve.evaluate(frame) for curve in curves}
    for (path, place), value in shown.items():
        name, channel = channel_of[path]
        getattr(armature.pose.bones[name], channel)[place] = value


def frames(armature: Any) -> tuple[float, ...]:
    """Frames with a key on any bone, ascending."""
    found: set[float] = set()
    for curve in compat.fcurves(armature):
        if curve.data_path.startswith("pose.bones"):
            found.update(keys_of(curve)["co"].reshape(-1, 2)[:, 0].astype(float).tolist())
    return tuple(sorted(set(np.round(nla.scene_frames(armature, sorted(found)), 4).tolist())))


def remember(armature: Any, bones: Collection[str]) -> Callable[[Any], None]:
    """What puts the keys of bones back, given the armature anew; an action made since goes again."""
    animation = armature.animation_data
    had_animation = animation is not None
    had_action = animation is not None and animation.action is not None
    before = {_id(curve): keys_of(curve) for curve in _curves(armature, bones)}

    def restore(again: Any) -> None:
        if not had_action:
            now = again.animation_data.action if again.animation_data is not None else None
            if now is not None:
                compat.forget_action(again, now.name)
            if not had_animation:
                again.animation_data_clear()
            return
        for curve in _curves(again, bones):
            if _id(curve) in before:
                put_keys(curve, before[_id(curve)])
            else:
                compat.remove_fcurve(again, curve)

    return restore


def _paths(armature: Any, written: Written) -> dict[str, tuple[str, str]]:
    """Bone and channel by data path."""
    bones = armature.pose.bones
    return {
        bones[name].path_from_id(channel): (name, channel)
        for name, channels in written.items()
        for channel in channels
    }


def _curves(armature: Any, bones: Collection[str]) -> list[Any]:
    """The curves of some bones; for immediate use."""
    starts = tuple(armature.pose.bones[name].path_from_id() + "." for name in bones)
    return [curve for curve in compat.fcurves(armature) if curve.data_path.startswith(starts)]


def _id(curve: Any) -> tuple[str, int]:
    return str(curve.data_path), int(curve.array_index)


def keys_of(curve: Any) -> dict[str, Any]:
    """The keys of a curve as flat arrays by field."""
    points = curve.keyframe_points
    values = {name: np.empty(width * len(points), dtype) for name, (width, dtype) in _FIELDS.items()}
    for name, array in values.items():
        points.foreach_get(name, array)
    return values


def put_keys(curve: Any, wanted: dict[str, Any]) -> None:
    """Give a curve exactly these keys."""
    now = keys_of(curve)
    if all(np.array_equal(now[name], wanted[name]) for name in _FIELDS):
        return
    curve.keyframe_points.clear()
    curve.keyframe_points.add(len(wanted["interpolation"]))
    for name in ("handle_left_type", "handle_right_type", "interpolation", "co", "handle_left", "handle_right"):
        curve.keyframe_points.foreach_set(name, wanted[name])
    curve.update()
