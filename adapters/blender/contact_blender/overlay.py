"""Pictures drawn over Blender's 3D views: nothing is added to the scene."""

from __future__ import annotations

from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from contact_core.scene.picture import Picture, PictureMesh

_POINT_SIZE, _LINE_WIDTH = 7.0, 2.5  # pixels


class Overlay:
    """What is drawn in every 3D view of every window, until something else is shown or None."""

    def __init__(self) -> None:
        self._picture: Picture | None = None
        self._batches: list[tuple[Any, Any, dict[str, Any]]] | None = None
        self._handle: Any = None

    def show(self, picture: Picture | None) -> None:
        if self._handle is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")
            self._handle = None
        self._picture, self._batches = picture, None
        if picture is not None:
            self._handle = bpy.types.SpaceView3D.draw_handler_add(self.draw, (), "WINDOW", "POST_VIEW")
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas if window.screen else ():
                if area.type == "VIEW_3D":
                    area.tag_redraw()

    def draw(self) -> None:
        """Draw into the bound framebuffer, with the matrices that are set; called by Blender for each view."""
        if self._picture is None:
            return
        if self._batches is None:  # made at the first drawing: only then is there a GPU for sure
            self._batches = _batches(self._picture)
        before = gpu.state.blend_get(), gpu.state.depth_test_get()
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.point_size_set(_POINT_SIZE)
        *_, width, height = gpu.state.viewport_get()
        try:
            for shader, batch, uniforms in self._batches:
                shader.bind()
                for name, value in uniforms.items():
                    shader.uniform_float(name, value)
                if "lineWidth" in uniforms:
                    shader.uniform_float("viewportSize", (width, height))
                batch.draw(shader)
        finally:
            gpu.state.blend_set(before[0])
            gpu.state.depth_test_set(before[1])


def _batches(picture: Picture) -> list[tuple[Any, Any, dict[str, Any]]]:
    """(shader, batch, uniforms) of all that a picture holds, opaque meshes first."""
    made = [_mesh_batch(each) for each in sorted(picture.meshes, key=lambda each: -each.opacity)]
    for positions, color in picture.points:
        shader = gpu.shader.from_builtin("POINT_UNIFORM_COLOR")
        batch = batch_for_shader(shader, "POINTS", {"pos": _single(positions)})
        made.append((shader, batch, {"color": (*color, 1.0)}))
    for segments, color in picture.lines:
        shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
        batch = batch_for_shader(shader, "LINES", {"pos": _single(np.reshape(segments, (-1, 3)))})
        made.append((shader, batch, {"color": (*color, 1.0), "lineWidth": _LINE_WIDTH}))
    return made


def _mesh_batch(item: PictureMesh) -> tuple[Any, Any, dict[str, Any]]:
    """Triangles in one colour, or in the colours of their vertices."""
    positions, indices = _single(item.mesh.points), item.mesh.faces.astype(np.int32)
    if item.vertex_colors is None:
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        batch = batch_for_shader(shader, "TRIS", {"pos": positions}, indices=indices)
        return shader, batch, {"color": (*item.color, item.opacity)}
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    colors = np.c_[item.vertex_colors, np.full(len(positions), item.opacity)]
    batch = batch_for_shader(shader, "TRIS", {"pos": positions, "color": _single(colors)}, indices=indices)
    return shader, batch, {}


def _single(values: Any) -> Any:
    return np.ascontiguousarray(values, np.float32)
