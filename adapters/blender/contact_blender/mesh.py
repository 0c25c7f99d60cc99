"""Meshes out of Blender: by whole attributes, in single precision as Blender stores them, in any mode.

Functions here take Blender objects for immediate use and return plain arrays. Coordinates are object-local;
`contact_core.geometry.polar` makes the surface of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bmesh
import bpy
import numpy as np

from contact_core.arrays import FloatArray, IntArray

# Modifiers that move vertices, or only touch other data, and keep their number and order.
_KEEPS_VERTICES = (
    "ARMATURE CAST CLOTH CORRECTIVE_SMOOTH CURVE DATA_TRANSFER DISPLACE HOOK LAPLACIANDEFORM LAPLACIANSMOOTH"
    " LATTICE MESH_CACHE MESH_DEFORM MESH_SEQUENCE_CACHE NORMAL_EDIT SHRINKWRAP SIMPLE_DEFORM SMOOTH SOFT_BODY"
    " SURFACE_DEFORM UV_PROJECT UV_WARP VERTEX_WEIGHT_EDIT VERTEX_WEIGHT_MIX VERTEX_WEIGHT_PROXIMITY WARP WAVE"
    " WEIGHTED_NORMAL"
)
KEEPS_VERTICES = frozenset(_KEEPS_VERTICES.split())
_MARK = ".contact_origin"


@dataclass(frozen=True, eq=False)
class LocalPolygons:
    """points: (n, 3) object-local. sizes: (f,) corners per polygon. corners: vertices, polygon after polygon."""

    points: FloatArray
    sizes: IntArray
    corners: IntArray


def current_depsgraph() -> Any:
    """The dependency graph of the window's view layer, with every pending change evaluated."""
    return bpy.context.evaluated_depsgraph_get()


def read_polygons(mesh: Any) -> LocalPolygons:
    """The polygons of a mesh datablock. Block copies, but for the sizes where not all are triangles."""
    count = len(mesh.polygons)
    corners = _attribute(mesh, ".corner_vert", "value", (len(mesh.loops),), np.int32).astype(np.int64)
    sizes = np.full(count, 3, np.int32)
    if len(corners) != 3 * count:
        mesh.polygons.foreach_get("loop_total", sizes)
    return LocalPolygons(read_points(mesh), sizes.astype(np.int64), corners)


@contextmanager
def cage(scene_object: Any) -> Iterator[Any]:
    """The object's own mesh before any modifier; in Edit Mode a copy of what is being edited."""
    if scene_object.mode != "EDIT":
        yield scene_object.data
        return
    copy = bpy.data.meshes.new(".contact_edit")
    try:
        bmesh.from_edit_mesh(scene_object.data).to_mesh(copy)
        yield copy
    finally:
        bpy.data.meshes.remove(copy)


@contextmanager
def evaluated_mesh(scene_object: Any, depsgraph: Any) -> Iterator[Any]:
    """The mesh after all modifiers that the viewport shows, in Edit Mode with the edits so far."""
    evaluated = scene_object.evaluated_get(depsgraph)
    if scene_object.mode != "EDIT":
        yield evaluated.data
        return
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


def read_points(mesh: Any) -> FloatArray:
    """(n, 3) object-local positions alone."""
    return _attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32).astype(np.float64)


def active_modifiers(scene_object: Any) -> tuple[Any, ...]:
    """The modifiers that the viewport evaluates in the object's mode, in their order; for immediate use."""
    editing = scene_object.mode == "EDIT"
    return tuple(m for m in scene_object.modifiers if m.show_viewport and (m.show_in_editmode or not editing))


def keeps_vertices(scene_object: Any) -> bool:
    """Whether the evaluated mesh has the vertices of the original in the same order."""
    return all(modifier.type in KEEPS_VERTICES for modifier in active_modifiers(scene_object))


def evaluated_vertices(scene_object: Any) -> IntArray | None:
    """(n original,) the evaluated vertex of each original one, the first where a modifier made several; -1: none.

    Where modifiers add or remove vertices, every original vertex is marked with three random numbers, the
    modifiers run, and the mark is taken away again: a vertex whose mark came through bit for bit is that
    vertex; one between several carries a blend, which no original has. None for a linked mesh, which nobody
    may mark.
    """
    mesh = scene_object.data
    editing = scene_object.mode == "EDIT"
    count = len(bmesh.from_edit_mesh(mesh).verts) if editing else len(mesh.vertices)
    if keeps_vertices(scene_object):
        return np.arange(count)
    if mesh.library is not None:
        return None
    marks = np.random.default_rng(count).random((count, 3), np.float32)  # (n, 3)
    with _marked(mesh, marks, editing), evaluated_mesh(scene_object, current_depsgraph()) as result:
        if _MARK not in result.attributes:
            return np.full(count, -1)
        seen = _attribute(result, _MARK, "vector", (len(result.vertices), 3), np.float32)
    first = {mark.tobytes(): index for index, mark in zip(range(len(seen) - 1, -1, -1), seen[::-1], strict=True)}
    return np.array([first.get(mark.tobytes(), -1) for mark in marks], np.int64)


@contextmanager
def _marked(mesh: Any, marks: Any, editing: bool) -> Iterator[None]:
    """The mesh with one more attribute, and as it was afterwards."""
    if editing:
        edited = bmesh.from_edit_mesh(mesh)
        layer = edited.verts.layers.float_vector.new(_MARK)
        for vertex, mark in zip(edited.verts, marks.tolist(), strict=True):
            vertex[layer] = mark
    else:
        active = mesh.attributes.active_index
        mesh.attributes.new(_MARK, "FLOAT_VECTOR", "POINT").data.foreach_set("vector", marks.ravel())
    mesh.update_tag()
    try:
        yield
    finally:
        if editing:
            edited = bmesh.from_edit_mesh(mesh)
            edited.verts.layers.float_vector.remove(edited.verts.layers.float_vector[_MARK])
        else:
            mesh.attributes.remove(mesh.attributes[_MARK])
            mesh.attributes.active_index = active
        mesh.update_tag()


def _attribute(mesh: Any, name: str, field: str, shape: tuple[int, ...], dtype: Any) -> Any:
    """One attribute as an array; exact dtype, so that Blender copies one block of memory."""
    values = np.empty(shape, dtype)
    if values.size:
        mesh.attributes[name].data.foreach_get(field, values.ravel())
    return values
