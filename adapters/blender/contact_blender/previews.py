"""Poses shown on bones while something is dragged or proposed: channels without a step, put back afterwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from contact_blender.channels import snapshot, write_basis
from contact_blender.ids import ObjectIds
from contact_blender.poses import bases_of
from contact_blender.rig import Skeleton, read_skeleton
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose


@dataclass
class _Preview:
    """Of one armature. shown: the pose matrices that were written last, by bone."""

    skeleton: Skeleton
    put_back: dict[str, Callable[[Any], None]]
    shown: dict[str, FloatArray] = field(default_factory=dict)


class PosePreviews:
    """What is shown now, by armature. Holds ids, numbers and functions, never Blender objects."""

    def __init__(self) -> None:
        self._previews: dict[str, _Preview] = {}

    def show(self, armature_id: str, armature: Any, pose: Pose) -> None:
        """Set the bones that a pose in armature space moves from what was shown before. Raises InvalidInput."""
        preview = self._previews.get(armature_id)
        if preview is None:
            skeleton, bones = read_skeleton(armature), armature.pose.bones
            preview = _Preview(skeleton, {name: snapshot(bones[name]) for name in skeleton.joints})
            self._previews[armature_id] = preview
        moved = [
            place
            for place, name in enumerate(pose.joints)
            if name not in preview.shown or not np.array_equal(preview.shown[name], pose.local[place])
        ]
        names = tuple(pose.joints[place] for place in moved)
        bases = bases_of(preview.skeleton, Pose(names, pose.local[moved]), armature.name)
        for name, basis in bases.items():
            write_basis(armature.pose.bones[name], basis)
        preview.shown.update(zip(names, pose.local[moved], strict=True))
        armature.update_tag(refresh={"OBJECT"})

    def forget(self) -> None:
        """Blender's undo went elsewhere, and the channels with it: there is nothing to put back."""
        self._previews = {}

    def put_back(self, ids: ObjectIds) -> None:
        """End all of them, see `BlenderHost.end_previews`."""
        previews, self._previews = self._previews, {}
        for armature_id, preview in previews.items():
            try:
                armature = ids.resolve(armature_id)
            except InvalidInput:
                continue
            for name, restore in preview.put_back.items():
                if name in armature.pose.bones:
                    restore(armature.pose.bones[name])
            armature.update_tag(refresh={"OBJECT"})
