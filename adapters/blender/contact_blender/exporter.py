"""Our assets into Blender: triangles, and for a rig an armature with vertex groups."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from contact_blender.channels import write_basis
from contact_blender.freedom import write_freedom
from contact_blender.rig import REST_BASIS
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.rig import Rig

_REST_NOISE = 1e-6  # relative to the rig's size: a rest pose this near to the bind pose is the bind pose


def add_asset(asset: Asset, world_from_local: FloatArray) -> Any:
    """The new mesh object of an asset (4, 4 world_from_local), linked to the scene; a rig's armature is its parent.

    Raises InvalidInput when the rig's bind pose is not rigid: a bone has no scale at rest.
    """
    world = Matrix(world_from_local.tolist())
    if asset.rig is None:
        mesh_object = _new_mesh_object(asset.name, asset.mesh.points, asset.mesh.faces)
        mesh_object.matrix_world = world
        return mesh_object
    rig = asset.rig
    _check_rigid(rig)
    armature = _new_armature(rig)
    armature.matrix_world = world
    mesh_object = _new_mesh_object(asset.name, rig.bind_points, rig.faces)
    mesh_object.parent = armature
    modifier = mesh_object.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    _write_weights(mesh_object, rig)
    _write_rest_and_freedoms(armature, rig)
    bpy.context.view_layer.update()
    return mesh_object


def remove_object(scene_object: Any) -> None:
    """Take an added object away again, with its armature and their data."""
    for each in (scene_object, scene_object.parent):
        if each is None:
            continue
        data, collection = each.data, bpy.data.meshes if each.type == "MESH" else bpy.data.armatures
        bpy.data.objects.remove(each)
        if data.users == 0:
            collection.remove(data)


def _new_mesh_object(name: str, points: FloatArray, faces: Any) -> Any:
    """A mesh object of points (n, 3) and triangles (m, 3), in the scene's collection."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.attributes["position"].data.foreach_set("vector", np.asarray(points, np.float32).ravel())
    mesh.loops.add(3 * len(faces))
    mesh.polygons.add(len(faces))
    mesh.loops.foreach_set("vertex_index", np.asarray(faces, np.int32).ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh_object = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(mesh_object)
    return mesh_object


def _new_armature(rig: Rig) -> Any:
    """An armature object whose bones rest where the rig's skin was bound."""
    armature = bpy.data.objects.new(f"{rig.name} rig", bpy.data.armatures.new(f"{rig.name} rig"))
    bpy.context.scene.collection.objects.link(armature)
    layer = bpy.context.view_layer
    active = layer.objects.active
    if bpy.context.mode != "OBJECT":
        raise InvalidInput(f"adding a rig needs Object Mode, but Blender is in {bpy.context.mode.lower()}.")
    layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        lengths = _bone_lengths(rig)
        for place, name in enumerate(rig.joints):
            bone = armature.data.edit_bones.new(name)
            bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, float(lengths[place]), 0.0)
            bone.matrix = Matrix(rig.bind_world[place].tolist())
            if rig.parents[place] >= 0:
                bone.parent = armature.data.edit_bones[rig.joints[rig.parents[place]]]
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        layer.objects.active = active
    return armature


def _bone_lengths(rig: Rig) -> FloatArray:
    """(j,) a length to draw each bone with: to its nearest child, or as its parent's; it has no other meaning."""
    heads = rig.bind_world[:, :3, 3]
    size = float(np.ptp(heads, axis=0).max(initial=0.0)) or float(np.ptp(rig.bind_points, axis=0).max(initial=1.0))
    lengths = np.full(len(heads), np.inf)
    for child, parent in enumerate(rig.parents):
        if parent >= 0:
            lengths[parent] = min(lengths[parent], float(np.linalg.norm(heads[child] - heads[parent])))
    for place, parent in enumerate(rig.parents):
        if not 0.01 * size < lengths[place] < np.inf:
            lengths[place] = lengths[parent] if parent >= 0 else 0.1 * size
    return lengths


def _write_weights(mesh_object: Any, rig: Rig) -> None:
    """A vertex group for each joint that moves something."""
    groups = [mesh_object.vertex_groups.new(name=name) for name in rig.joints]
    for vertex, (joints, weights) in enumerate(
        zip(rig.skin_joints.tolist(), rig.skin_weights.tolist(), strict=True)
    ):
        for joint, weight in zip(joints, weights, strict=True):
            if weight > 0.0:
                groups[joint].add((vertex,), weight, "ADD")


def _write_rest_and_freedoms(armature: Any, rig: Rig) -> None:
    """The rest pose where it is not the bind pose, and what each joint may do."""
    bind_local = rig.bind_world.copy()
    inner = rig.parents >= 0
    bind_local[inner] = np.linalg.inv(rig.bind_world[rig.parents[inner]]) @ rig.bind_world[inner]
    offset = np.linalg.inv(bind_local) @ rig.rest_local  # (j, 4, 4)
    noise = _REST_NOISE * max(1.0, float(np.abs(rig.bind_points).max(initial=0.0)))
    for place, name in enumerate(rig.joints):
        pose_bone = armature.pose.bones[name]
        write_freedom(pose_bone, rig.freedoms[place])
        if np.abs(offset[place] - np.eye(4)).max() > noise:
            pose_bone[REST_BASIS] = offset[place].ravel().tolist()
            write_basis(pose_bone, offset[place])


def _check_rigid(rig: Rig) -> None:
    linear = rig.bind_world[:, :3, :3]
    off = np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max(axis=(1, 2), initial=0.0)  # (j,)
    if (off > 1e-4).any():
        raise InvalidInput(
            f"joint {rig.joints[int(off.argmax())]!r} of {rig.name} is scaled where its skin is bound; Blender's"
            " bones have no scale at rest. Apply the scale to the rig first."
        )
