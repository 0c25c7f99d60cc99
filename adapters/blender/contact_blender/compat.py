"""Every fork between Blender versions (4.2 LTS to 5.x), and nothing else. No other module asks for a version."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from contact_core.errors import MissingExtra

try:
    import bpy as bpy
except ImportError as error:
    raise MissingExtra("The Blender host", "blender") from error

OLDEST = (4, 2, 0)


def version() -> tuple[int, int, int]:
    """(major, minor, patch) of the Blender that this process is."""
    major, minor, patch = bpy.app.version
    return int(major), int(minor), int(patch)


def is_shown(pose_bone: Any) -> bool:
    """Whether an artist sees a bone and can select it. Hiding moved from bones to pose bones in 5.0."""
    bone = pose_bone.bone
    hidden = pose_bone.hide if hasattr(pose_bone, "hide") else bone.hide
    collections = bone.collections
    seen = not len(collections) or any(each.is_visible_effectively for each in collections)
    return bool(seen and not hidden and not bone.hide_select)


def drivers(owner: Any) -> tuple[Any, ...]:
    """The drivers of an ID, for immediate use; alike on every version."""
    return tuple(owner.animation_data.drivers) if owner.animation_data else ()


def fcurves(owner: Any) -> Iterable[Any]:
    """The animation curves of an ID (object): of its action's own slot from 4.4 on, of the action before.

    Empty where nothing is animated. The curves are RNA: read them at once and keep none.
    """
    animation = owner.animation_data
    action = animation.action if animation else None
    if action is None:
        return ()
    if not hasattr(animation, "action_slot"):  # up to 4.3 an action is one list of curves
        return tuple(action.fcurves)
    slot = animation.action_slot
    if slot is None:
        return ()
    return tuple(
        curve
        for layer in action.layers
        for strip in layer.strips
        if (bag := strip.channelbag(slot)) is not None
        for curve in bag.fcurves
    )


def remove_fcurve(owner: Any, curve: Any) -> None:
    """Take one curve of an ID's animation away."""
    animation = owner.animation_data
    if not hasattr(animation, "action_slot"):
        animation.action.fcurves.remove(curve)
        return
    for layer in animation.action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(animation.action_slot)
            if bag is not None and bag.fcurves.find(curve.data_path, index=curve.array_index) == curve:
                bag.fcurves.remove(curve)
                return


def forget_action(owner: Any, action_name: str) -> None:
    """Unassign and remove an action that a step made and did not keep; the object's drivers stay."""
    animation = owner.animation_data
    if animation is not None and animation.action is not None and animation.action.name == action_name:
        animation.action = None
    action = bpy.data.actions.get(action_name)
    if action is not None and action.users == 0:
        bpy.data.actions.remove(action)
