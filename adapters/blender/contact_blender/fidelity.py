"""What linear blend skinning cannot reproduce of a Blender rig, each in words; and the largest difference measured.

A rig with any reason here, or with a difference, is solved through `BlenderHost.skin_points` instead: Blender
evaluates, whatever it is made of.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from contact_blender import evaluation
from contact_blender.channels import read_basis
from contact_blender.freedom import is_plain_limit, limits_of
from contact_blender.mesh import active_modifiers
from contact_blender.rig import UNMOVED, RigReading, read_skeleton
from contact_core.errors import InvalidInput
from contact_core.rig.rig import forward_kinematics, skin

TOLERANCE = 1e-5  # of the bounding box diagonal
_HARMLESS = frozenset({"NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WEIGHTED_NORMAL"})  # no vertex moves


def beyond_linear_skinning(scene_object: Any, armature: Any) -> tuple[str, ...]:
    """Sentences on all that the analytic rig of this object leaves out; empty when it is exact."""
    return (*_of_modifiers(scene_object), *_of_shapes(scene_object), *_of_bones(armature), *_of_drivers(armature))


def largest_difference(scene_object: Any, armature: Any, reading: RigReading) -> float | None:
    """Largest distance between Blender's skin and ours in a bent pose, by the skin's bounding box diagonal.

    The pose is set for the comparison and taken back; in rest most of what can differ would not show. A linked
    armature, which nobody may pose, is compared as it stands. None where Blender's skin lost vertices.
    """
    skeleton = read_skeleton(armature)
    bases = {} if armature.library is not None else _probe(armature)
    try:
        with evaluation.posed(armature, bases):
            theirs = evaluation.skin_in_armature(scene_object, armature)
            basis = [read_basis(armature.pose.bones[name]) for name in skeleton.joints]
    except InvalidInput:
        return None
    rig = reading.rig
    local = np.array([*(skeleton.edit_local @ np.array(basis)), *[np.eye(4)] * (UNMOVED in rig.joints)])
    ours = skin(rig, forward_kinematics(rig.parents, local))[reading.vertices]
    farthest = float(np.linalg.norm(theirs - ours, axis=1).max(initial=0.0))
    return farthest / (rig.surface.bounding_box_diagonal or 1.0)


def _probe(armature: Any) -> dict[str, Any]:
    """Channels that bend every bone whose rotation is free by half a radian, about an axis of its own."""
    random = np.random.default_rng(1)
    turns = {bone.name: Rotation.from_rotvec(0.3 * random.normal(size=3)) for bone in armature.pose.bones}
    bases = {}
    for pose_bone in armature.pose.bones:
        if not np.isfinite(limits_of(pose_bone)).any():
            bases[pose_bone.name] = basis = read_basis(pose_bone)
            basis[:3, :3] = turns[pose_bone.name].as_matrix() @ basis[:3, :3]
    return bases


def _of_modifiers(scene_object: Any) -> list[str]:
    found, skinned = [], False
    for modifier in active_modifiers(scene_object):
        if modifier.type == "ARMATURE" and modifier.object is not None and not skinned:
            skinned = True
            settings = {
                "preserve volume": modifier.use_deform_preserve_volume,
                "bone envelopes": modifier.use_bone_envelopes,
                "no vertex groups": not modifier.use_vertex_groups,
                f"the influence of vertex group {modifier.vertex_group!r}": bool(modifier.vertex_group),
                "multi modifier": modifier.use_multi_modifier,
            }
            found += [f"The Armature modifier uses {name}." for name, used in settings.items() if used]
        elif modifier.type not in _HARMLESS:
            place = "after" if skinned else "before"
            found.append(f"The modifier {modifier.name!r} ({modifier.type.lower()}) works {place} the armature.")
    if not skinned and scene_object.parent_type != "ARMATURE":
        found.append("The Armature modifier is switched off in the viewport.")
    return found


def _of_shapes(scene_object: Any) -> list[str]:
    keys = scene_object.data.shape_keys
    if keys is None:
        return []
    moved = keys.animation_data is not None and (keys.animation_data.action or keys.animation_data.drivers)
    found = ["Shape keys are animated or driven."] if moved else []
    if not keys.use_relative:
        found.append("Shape keys are absolute.")
    if scene_object.show_only_shape_key:
        found.append("One shape key is shown alone.")
    return found


def _of_bones(armature: Any) -> list[str]:
    found = ["The armature shows its rest position."] if armature.data.pose_position == "REST" else []
    for pose_bone in armature.pose.bones:
        bone, name = pose_bone.bone, pose_bone.name
        acting = [c for c in pose_bone.constraints if not (c.mute or c.influence == 0.0 or is_plain_limit(c))]
        found += [f"Bone {name!r} has the constraint {c.name!r} ({c.type.lower()})." for c in acting]
        if bone.use_deform and bone.bbone_segments > 1:
            found.append(f"Bone {name!r} is a B-bone of {bone.bbone_segments} segments.")
        if pose_bone.parent is not None and not bone.use_inherit_rotation:
            found.append(f"Bone {name!r} does not inherit rotation.")
        scaled = any(abs(s - 1.0) > 1e-6 for above in pose_bone.parent_recursive for s in above.scale)
        if scaled and bone.inherit_scale != "FULL":
            found.append(f"Bone {name!r} inherits a scale in the way {bone.inherit_scale.lower()!r}.")
        shifted = any(abs(value) > 1e-9 for value in pose_bone.location)
        if pose_bone.parent is not None and shifted and not (bone.use_local_location or bone.use_connect):
            found.append(f"Bone {name!r} is shifted in its parent's directions, not in its own.")
    return found


def _of_drivers(armature: Any) -> list[str]:
    animation = armature.animation_data
    driven = animation.drivers if animation else ()
    paths = sorted({driver.data_path for driver in driven if driver.data_path.startswith("pose.bones")})
    return [f"A driver moves {path}." for path in paths]
