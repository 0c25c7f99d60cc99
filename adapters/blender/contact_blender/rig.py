"""Blender's armatures as analytic rigs: bones, rest, vertex groups, in the armature's own space.

What Blender's Armature modifier does there, and `contact_core.rig.rig.skin` as well:

    x' = sum over deforming bones b of w_b P_b B_b^-1 x / sum of w_b        (x itself where the sum is below 1e-4)

with P_b and B_b the posed and the rest matrix of a bone, x the vertex before the modifier. The scale of the
armature object comes in afterwards, by `scene.reading.stretch_rig`, as for every host.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_blender import bones
from contact_blender import mesh as meshes
from contact_blender.weights import group_weights, influences
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.sound import sound_polygons
from contact_core.geometry.transform import transform_points
from contact_core.geometry.triangulate import triangulate
from contact_core.rig.rig import JointFreedom, Rig, forward_kinematics, still_following, tree_order

UNMOVED = "(unmoved)"  # the joint of vertices that no bone moves
REST_BASIS = "contact_rest_basis"  # on a pose bone: the rest pose as an offset from the armature's own rest
_LEAST_WEIGHT = 1e-4  # below this sum Blender leaves a vertex where it is
_MATRIX_NOISE = 1e-6  # relative, of products of Blender's single precision world matrices


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones as joints, depth first. edit_local: (j, 4, 4) parent_from_joint of the armature's own rest, at which
    the skin is bound; rest_local: (j, 4, 4) of the rest pose, which an exporter may have put elsewhere."""

    joints: tuple[str, ...]
    parents: IntArray
    edit_local: FloatArray
    rest_local: FloatArray


@dataclass(frozen=True, eq=False)
class RigReading:
    """rig: in armature space. vertices: (n source,) rig point of each cage vertex. polygons: (m,) of each face."""

    rig: Rig
    vertices: IntArray
    polygons: IntArray
    notes: tuple[str, ...]

    @property
    def kept(self) -> IntArray:
        """(n,) the cage vertex that each rig point was read from."""
        return np.unique(self.vertices, return_index=True)[1]


def armature_of(scene_object: Any) -> Any:
    """The armature object that skins a mesh object, by its first Armature modifier or by parenting; or None."""
    if scene_object.type != "MESH":
        return None
    for modifier in scene_object.modifiers:
        if modifier.type == "ARMATURE" and modifier.object is not None:
            return modifier.object
    parented = scene_object.parent is not None and scene_object.parent_type == "ARMATURE"
    return scene_object.parent if parented else None


def read_skeleton(armature: Any) -> Skeleton:
    """The bones of an armature. Raises InvalidInput where there are none, and in Edit Mode: the rest is in flux."""
    if armature.mode == "EDIT":
        raise InvalidInput(f"{armature.name} is in Edit Mode: leave it first, its bones are still being edited.")
    bones = _depth_first(armature.data.bones)
    if not bones:
        raise InvalidInput(f"{armature.name} has no bones, so nothing of it can be posed.")
    index = {bone.name: place for place, bone in enumerate(bones)}
    parents = np.array([index[bone.parent.name] if bone.parent else -1 for bone in bones], np.int64)  # (j,)
    world = np.array([bone.matrix_local for bone in bones], float).reshape(-1, 4, 4)  # armature space
    left, _, right = np.linalg.svd(world[:, :3, :3])  # single precision leaves 1e-7 that would count as scale
    world[:, :3, :3] = left @ right
    local = world.copy()
    inner = parents >= 0
    local[inner] = np.linalg.inv(world[parents[inner]]) @ world[inner]
    rest = local.copy()
    for place, bone in enumerate(bones):
        offset = armature.pose.bones[bone.name].get(REST_BASIS)
        if offset is not None:
            rest[place] = local[place] @ np.array(offset, float).reshape(4, 4)
    return Skeleton(tuple(bone.name for bone in bones), parents, local, rest)


def read_rig(scene_object: Any, armature: Any, depsgraph: Any, name: str, choice: str) -> RigReading:
    """The analytic rig of a skinned mesh object, with notes on what was normalised, merged or added.

    choice: which bones are posed, see `bones`.
    """
    skeleton = read_skeleton(armature)
    with meshes.cage(scene_object) as cage:
        local = meshes.read_polygons(cage)
        points = _shaped_points(scene_object, local.points)
        joints, weights = _influences(cage, scene_object, armature, skeleton)
    placed = armature_from_mesh(scene_object, armature, depsgraph)
    points = transform_points(placed, points)  # (n source, 3)
    joints, weights, notes = _normalised(joints, weights, len(skeleton.joints))
    mirrored = bool(np.linalg.det(placed[:3, :3]) < 0)
    alike = np.unique(np.hstack([joints, weights]), axis=0, return_inverse=True)[1].reshape(-1)
    sound = sound_polygons(points, local.sizes, local.corners, apart=alike, exact=True, clockwise=mirrored)
    kept = sound.first  # points at one position stay apart where they would move apart
    faces, cut, cut_notes = triangulate(sound.sizes, sound.indices, points[kept])
    if mirrored:
        faces = faces[:, ::-1]
    names, parents, rest = skeleton.joints, skeleton.parents, skeleton.rest_local
    bind = forward_kinematics(parents, skeleton.edit_local)
    if (joints == len(names)).any():
        names, parents = (*names, UNMOVED), np.append(parents, -1)
        rest, bind = np.concatenate([rest, np.eye(4)[None]]), np.concatenate([bind, np.eye(4)[None]])
    coupled = freedoms(scene_object, armature, choice, UNMOVED in names)
    rig = Rig(name, names, parents, rest, bind, points[kept], faces, joints[kept], weights[kept], coupled)
    return RigReading(rig, sound.point_of, sound.face_of[cut], (*notes, *sound.notes, *cut_notes))


def freedoms(scene_object: Any, armature: Any, choice: str, unmoved: bool) -> tuple[JointFreedom, ...]:
    """What a solve may do with each joint of the rig that `read_rig` gives, as the scene has it now.

    unmoved: whether the rig has the joint of vertices that no bone moves.
    """
    joints = tuple(bone.name for bone in _depth_first(armature.data.bones))
    found = bones.freedoms(scene_object, armature, joints, choice)
    if unmoved:
        joints, found = (*joints, UNMOVED), [*found, JointFreedom("fixed")]
    return still_following(joints, found)


def _depth_first(bones: Any) -> list[Any]:
    """The bones in the order in which every host gives joints."""
    found = list(bones)
    index = {bone.name: place for place, bone in enumerate(found)}
    return [found[k] for k in tree_order([index[bone.parent.name] if bone.parent else -1 for bone in found])]


def armature_from_mesh(scene_object: Any, armature: Any, depsgraph: Any) -> FloatArray:
    """(4, 4). Of a mesh parented to its armature it does not depend on where the two stand in the scene."""
    direct = scene_object.parent == armature and scene_object.parent_type in ("OBJECT", "ARMATURE")
    if direct and not scene_object.constraints:
        parent_inverse = np.array(scene_object.matrix_parent_inverse, float)
        return parent_inverse @ np.array(scene_object.matrix_basis, float)
    worlds = [np.array(each.evaluated_get(depsgraph).matrix_world, float) for each in (armature, scene_object)]
    relative = np.linalg.inv(worlds[0]) @ worlds[1]
    step = _MATRIX_NOISE * float(np.abs(relative[:3, :3]).max())
    return np.asarray(np.round(relative, -int(np.floor(np.log10(step)))) + 0.0)


def _shaped_points(scene_object: Any, points: FloatArray) -> FloatArray:
    """(n, 3) the cage with its shape keys as they stand, mixed as Blender mixes relative keys."""
    keys = scene_object.data.shape_keys
    if keys is None or not keys.use_relative or scene_object.mode == "EDIT":
        return points
    mixed = np.array(points)
    for block in keys.key_blocks:
        if block.mute or block.value == 0.0 or block == block.relative_key:
            continue
        both = np.empty((2, len(points), 3), np.float32)
        block.data.foreach_get("co", both[0].ravel())
        block.relative_key.data.foreach_get("co", both[1].ravel())
        strength = block.value * _group_weights(scene_object, block.vertex_group)  # (n,)
        mixed += strength[:, None] * (both[0].astype(float) - both[1])
    return mixed


def _group_weights(scene_object: Any, group: str) -> FloatArray:
    """(n,) weights of a vertex group; all ones for no group."""
    if not group or group not in scene_object.vertex_groups:
        return np.ones(len(scene_object.data.vertices))
    (weights,) = group_weights(scene_object.data, [scene_object.vertex_groups[group].index])
    return weights


def _influences(cage: Any, scene_object: Any, armature: Any, skeleton: Skeleton) -> tuple[IntArray, FloatArray]:
    """(n, K) joints and weights of the groups that have a deforming bone; unused places weigh 0."""
    joint = {name: place for place, name in enumerate(skeleton.joints) if armature.data.bones[name].use_deform}
    groups = scene_object.vertex_groups
    return influences(cage, {group.index: joint[group.name] for group in groups if group.name in joint})


def _normalised(joints: IntArray, weights: FloatArray, unmoved: int) -> tuple[IntArray, FloatArray, list[str]]:
    """Weights that sum to 1, vertices without any on the joint `unmoved`, and sentences on both."""
    total = weights.sum(axis=1)  # (n,)
    loose = total <= _LEAST_WEIGHT
    off = ~loose & (np.abs(total - 1.0) > 1e-3)
    notes = []
    if off.any():
        notes.append(
            f"The weights of {int(off.sum())} of {len(total)} vertices summed to between {total[off].min():.2f} and"
            f" {total[off].max():.2f} and were normalised, as Blender does when it skins."
        )
    if loose.any():
        notes.append(f"{int(loose.sum())} of {len(total)} vertices belong to no deforming bone and stay at rest.")
    weights = weights / np.where(loose, 1.0, total)[:, None]
    weights[loose] = np.eye(1, weights.shape[1])
    joints = np.where(loose[:, None], unmoved, joints)
    return np.where(weights > 0.0, joints, joints[:, :1]), weights, notes
