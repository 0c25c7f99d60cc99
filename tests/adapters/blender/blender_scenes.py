"""Scenes made by Blender's own means, independent of the adapter that reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix

from contact_blender.host import BlenderHost as BlenderHost
from contact_core.rig.rig import Rig

if TYPE_CHECKING:
    from contact_core.testing.host_scenes import HostScene  # which needs pytest; a Blender with a window has none


def build(scene: HostScene) -> BlenderHost:
    """The contract's scene in a new Blender scene, with nothing to undo."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.unit_settings.scale_length = scene.space.meters_per_unit
    for item in scene.meshes:
        made = mesh_object(item.name, item.points, item.face_sizes, item.face_indices)
        if item.parent is not None:
            made.parent = bpy.data.objects[item.parent]
        made.matrix_basis = Matrix(item.parent_from_local.tolist())
        for name, vertices in item.selections.items():
            made.vertex_groups.new(name=name).add(list(vertices), 1.0, "REPLACE")
    for rig in scene.rigs:
        armature = skinned(rig.rig, rig.name).parent
        armature.matrix_basis = Matrix(rig.world_from_local.tolist())
        for group, names in rig.groups.items():
            collection = armature.data.collections.new(group)
            for name in names:
                collection.assign(armature.data.bones[name])
    bpy.context.view_layer.update()
    return BlenderHost()


def mesh_object(name: str, points: Any, sizes: Any, indices: Any) -> Any:
    """A mesh object of polygons, in the scene."""
    ends = np.cumsum(sizes)
    faces = [np.asarray(indices)[end - size : end].tolist() for size, end in zip(sizes, ends, strict=True)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points).tolist(), [], faces)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def skinned(rig: Rig, name: str, *, deform: Any = None) -> Any:
    """The mesh object of a rig (bound in its rest pose), parented to a new armature object with its modifier."""
    armature = bpy.data.objects.new(f"{name} armature", bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for joint, parent, world in zip(rig.joints, rig.parents, rig.rest_world, strict=True):
        bone = armature.data.edit_bones.new(joint)
        bone.tail = (0.0, 0.4, 0.0)
        bone.matrix = Matrix(world.tolist())
        bone.parent = armature.data.edit_bones[rig.joints[parent]] if parent >= 0 else None
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = None
    made = mesh_object(name, rig.bind_points, np.full(len(rig.faces), 3), rig.faces.ravel())
    made.parent = armature
    made.modifiers.new("Armature", "ARMATURE").object = armature
    for k, joint in enumerate(rig.joints):
        group = made.vertex_groups.new(name=joint)
        for vertex in range(len(rig.bind_points)):
            weight = float(rig.skin_weights[vertex][rig.skin_joints[vertex] == k].sum())
            if weight > 0.0:
                group.add([vertex], weight, "REPLACE")
    return made


def whole_state() -> Any:
    """All objects' places and data, all bones' channels, all curves and the scene's properties, as plain values."""
    state: list[Any] = []
    for item in sorted(bpy.data.objects, key=lambda each: each.name):
        state.append((item.name, item.type, item.users, [tuple(row) for row in item.matrix_world]))
        if item.type == "MESH":
            state.append(([tuple(v.co) for v in item.data.vertices], item.data.attributes.keys()))
        if item.type == "ARMATURE":
            state.append([_bone_state(bone) for bone in item.pose.bones])
            state.append([_curve_state(curve) for curve in _curves(item)])
    kept = sorted(bpy.context.scene.keys())
    datablocks = [len(bpy.data.scenes), len(bpy.data.meshes), len(bpy.data.actions), len(bpy.data.armatures)]
    document = bpy.context.scene.get("contact_core")
    return [*state, kept, datablocks, None if document is None else _property_state(document)]


def _property_state(document: Any) -> Any:
    """The stored document, in which order its parts were put or not."""
    parts = sorted((key, bytes(text)) for key, text in document["parts"].items())
    return document["revision"], document["digest"], document["schema"], document["ids"], parts


def _bone_state(bone: Any) -> Any:
    channels = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")
    return (bone.name, bone.rotation_mode, [tuple(getattr(bone, channel)) for channel in channels])


def _curve_state(curve: Any) -> Any:
    return (curve.data_path, curve.array_index, [tuple(key.co) for key in curve.keyframe_points])


def _curves(item: Any) -> list[Any]:
    from contact_blender.compat import fcurves

    return sorted(fcurves(item), key=lambda curve: (curve.data_path, curve.array_index))
