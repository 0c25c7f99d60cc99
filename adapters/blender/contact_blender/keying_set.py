"""The user's active keying set, asked bone by bone which channels a key holds.

Blender's own operator keys what is selected, in a window; a solve keys the bones that it posed, selected or not.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy


@dataclass(frozen=True)
class ChannelKey:
    """A path of an armature object that is keyed. index: of the number in it, -1 for all. group: of its curves."""

    path: str
    index: int
    group: str


@dataclass
class _Paths:
    """Stands in for the paths of a keying set while Blender's own generators say what they would add."""

    found: list[ChannelKey] = field(default_factory=list)

    def add(
        self, owner: Any, data_path: str, index: int = -1, group_method: str = "KEYINGSET", group_name: str = ""
    ) -> None:
        self.found.append(ChannelKey(data_path, index, group_name))


@dataclass
class _Asked:
    paths: _Paths


def active(*, by_auto_key: bool) -> Any:
    """The active keying set for immediate use, None where there is none. Auto-key follows it only where the user
    said so ("Only Active Keying Set")."""
    scene = bpy.context.scene
    if by_auto_key and not scene.tool_settings.use_keyframe_insert_keyingset:
        return None
    return scene.keying_sets_all.active


def channel_keys(keying_set: Any, pose_bone: Any) -> list[ChannelKey]:
    """What the set keys of a bone."""
    armature, start = pose_bone.id_data, pose_bone.path_from_id() + "."
    if keying_set.is_path_absolute:
        found = [
            ChannelKey(each.data_path, -1 if each.use_entire_array else each.array_index, pose_bone.name)
            for each in keying_set.paths
            if each.id == armature
        ]
    else:
        asked = _Asked(_Paths())
        keying_set.type_info.generate(bpy.context, asked, pose_bone)
        found = asked.paths.found
    return [each for each in found if each.path.startswith((start, start[:-1] + "["))]
