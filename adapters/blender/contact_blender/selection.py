"""What is selected in Blender, as vertices of the object's own mesh: the live selection, groups, attributes."""

from __future__ import annotations

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
