"""What is selected in Blender, as vertices of the object's own mesh: the live selection, groups, attributes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import numpy as np

from contact_blender.mesh import cage
from contact_blender.weights import group_weights
from contact_core.arrays import IntArray
from contact_core.errors import InvalidInput

LIVE = "selection"


def names(scene_object: Any) -> tuple[str, ...]:
    """The live selection where there is one, then vertex groups, then boolean attributes of points or faces."""
    live = (LIVE,) if len(_live(scene_object)) else ()
    groups = tuple(group.name for group in scene_object.vertex_groups)
    return tuple(dict.fromkeys((*live, *groups, *_flags(scene_object))))


def vertices(scene_object: Any, selection: str) -> IntArray:
    """(k,) vertices of the cage, ascending. Raises InvalidInput listing what there is."""
    if selection == LIVE:
        return _live(scene_object)
    if selection in scene_object.vertex_groups:
        wanted = scene_object.vertex_groups[selection].index
        with cage(scene_object) as mesh:
            (weights,) = group_weights(mesh, [wanted])
        return np.flatnonzero(weights > 0.0)
    if selection in _flags(scene_object):
        return _flagged(scene_object, selection)
    there = ", ".join(map(repr, names(scene_object))) or "nothing"
    raise InvalidInput(f"{scene_object.name} has no selection {selection!r}; there is {there}.")


def check_writable(scene_object: Any, selection: str) -> None:
    """Raises InvalidInput for a vertex group that deforms the mesh: a bone's, or one that a modifier reads."""
    armatures = [each.object for each in scene_object.modifiers if each.type == "ARMATURE" and each.object]
    bones = {bone.name for armature in armatures for bone in armature.data.bones}
    read = {getattr(each, "vertex_group", "") for each in scene_object.modifiers}
    if selection in bones | read - {""}:
        raise InvalidInput(
            f"the vertex group {selection!r} of {scene_object.name} deforms the mesh; give another name."
        )


def choose(scene_object: Any, wanted: IntArray, selection: str) -> Callable[[Any], None]:
    """Let the selection, or the vertex group of this name, be these vertices of the cage; outside of Edit Mode.

    Returns what puts back how it was, given the object anew.
    """
    before = vertices(scene_object, selection) if selection in names(scene_object) else None
    if selection == LIVE:
        _select(scene_object, wanted)
        return lambda again: _select(again, np.zeros(0, np.int64) if before is None else before)
    _write_group(scene_object, selection, wanted)
    return lambda again: _write_group(again, selection, before)


def _select(scene_object: Any, wanted: IntArray) -> None:
    """Vertices, with the edges and faces that lie between them: Edit Mode reads all three."""
    mesh = scene_object.data
    chosen = np.zeros(len(mesh.vertices), np.bool_)
    chosen[wanted] = True
    edges = np.empty(2 * len(mesh.edges), np.int32)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.vertices.foreach_set("select", chosen)
    mesh.edges.foreach_set("select", chosen[edges].reshape(-1, 2).all(axis=1))
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    if len(starts):
        mesh.polygons.foreach_set("select", np.logical_and.reduceat(chosen[corners], starts))
    mesh.update()


def _write_group(scene_object: Any, name: str, wanted: IntArray | None) -> None:
    """A vertex group of these vertices with weight 1; None: no such group."""
    group = scene_object.vertex_groups.get(name)
    if group is not None:
        scene_object.vertex_groups.remove(group)
    if wanted is not None:
        scene_object.vertex_groups.new(name=name).add(wanted.tolist(), 1.0, "REPLACE")


def _live(scene_object: Any) -> IntArray:
    mesh = scene_object.data
    if scene_object.mode == "EDIT":
        return np.flatnonzero([vertex.select for vertex in bmesh.from_edit_mesh(mesh).verts])
    chosen = np.empty(len(mesh.vertices), np.bool_)
    mesh.vertices.foreach_get("select", chosen)
    return np.flatnonzero(chosen)


def _flags(scene_object: Any) -> tuple[str, ...]:
    return tuple(
        attribute.name
        for attribute in scene_object.data.attributes
        if attribute.data_type == "BOOLEAN"
        and attribute.domain in ("POINT", "FACE")
        and not attribute.name.startswith(".")
        and attribute.name not in ("sharp_face",)
    )


def _flagged(scene_object: Any, name: str) -> IntArray:
    with cage(scene_object) as mesh:
        attribute = mesh.attributes[name]
        chosen = np.empty(len(attribute.data), np.bool_)
        attribute.data.foreach_get("value", chosen)
        if attribute.domain == "POINT":
            return np.flatnonzero(chosen)
        touched = {v for face in np.flatnonzero(chosen) for v in mesh.polygons[int(face)].vertices}
        return np.array(sorted(touched), np.int64)
