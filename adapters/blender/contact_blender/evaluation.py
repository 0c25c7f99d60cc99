"""What Blender itself makes of a frame or of a pose, with the scene left as it was."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from contact_blender import mesh as meshes
from contact_blender.channels import is_there, snapshot, write_basis
from contact_blender.rig import armature_from_mesh
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points


@contextmanager
def graph_at(frame: float | None, *scene_objects: Any) -> Iterator[Any]:
    """A dependency graph of the objects at a frame; of the scene as it stands for None.

    Another frame is evaluated in a scene of its own: setting the frame of the user's scene would throw away
    every pose that has animation but no key yet.
    """
    if frame is None:
        yield meshes.current_depsgraph()
        return
    user_scene = bpy.context.scene
    aside = bpy.data.scenes.new(".contact_frame")
    try:
        aside.render.fps, aside.render.fps_base = user_scene.render.fps, user_scene.render.fps_base
        for each in scene_objects:
            if each.name not in aside.collection.objects:
                aside.collection.objects.link(each)
        whole = int(np.floor(frame))
        aside.frame_set(whole, subframe=float(frame) - whole)
        yield aside.view_layers[0].depsgraph
    finally:
        bpy.data.scenes.remove(aside)


@contextmanager
def posed(armature: Any, bases: Mapping[str, FloatArray]) -> Iterator[None]:
    """The armature with its bones' channels set to bases (4, 4), and afterwards as it was, bit for bit.

    Bones that are there already are left alone: of a control rig that is nearly all of them.
    """
    bones = armature.pose.bones
    moved = {name: basis for name, basis in bases.items() if not is_there(bones[name], basis)}
    before = {name: snapshot(bones[name]) for name in moved}
    try:
        for name, basis in moved.items():
            write_basis(bones[name], basis)
        yield
    finally:
        for name, restore in before.items():
            restore(bones[name])
        bpy.context.view_layer.update()


def skin_in_armature(scene_object: Any, armature: Any) -> FloatArray:
    """(n source, 3) where Blender's whole evaluation puts the cage's vertices, in armature space.

    Raises InvalidInput where modifiers take vertices of the cage away.
    """
    sources = meshes.evaluated_vertices(scene_object)
    depsgraph = meshes.current_depsgraph()
    with meshes.evaluated_mesh(scene_object, depsgraph) as result:
        points = meshes.read_points(result)
    if sources is None or (sources < 0).any():
        raise InvalidInput(
            f"the modifiers of {scene_object.name} remove vertices of its mesh, so its skin cannot be compared"
            " with them; switch those modifiers off in the viewport."
        )
    matrix = armature_from_mesh(scene_object, armature, depsgraph)
    return transform_points(matrix, points[sources])
