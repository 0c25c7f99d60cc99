"""The interaction's overlay in Blender's 3D views, through gpu batches that are made anew only when data changed.

Decals, ghosts, lines and rings are drawn among the objects (POST_VIEW), handles and labels over them (POST_PIXEL).
A shader of our own draws what a stroke has covered: distances are interpolated, so that its rim is sharp.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.interaction.overlay import NOTHING, Handle, Overlay, StrokeTint

_LINE, _PAIR, _DOT = 2.0, 1.0, 5.0  # pixels of a plain screen
_THROUGH = 0.18  # how strongly contacts show that something hides
_GHOSTS = "LESS"  # their depth test, by which they are known: only their front is drawn, or it would show through
_WITHIN = 0.002  # of its size, how far a ghost lies within its surface
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 33)
_RIM = (0.05, 0.05, 0.05, 0.9)
Part = tuple[FloatArray, tuple[float, ...]]  # ends of segments, and their colour
Batch = tuple[Any, Any, dict[str, Any], str]  # shader, batch, uniforms, depth test


class Drawing:
    """What is drawn in every 3D view while `is_shown` says so."""

    def __init__(self, is_shown: Callable[[], bool]) -> None:
        self._is_shown = is_shown
        self._overlay, self._tinted = NOTHING, np.zeros((0, 3))
        self._tint_faces: Any = None
        self._batches: list[Batch] | None = None
        self._handlers = [
            bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", kind)
            for draw, kind in ((self.draw_view, "POST_VIEW"), (self.draw_pixels, "POST_PIXEL"))
        ]
        self.rebuilt = 0  # how often batches were made; tests guard the cost by counting

    def close(self) -> None:
        """Draw no more."""
        while self._handlers:
            bpy.types.SpaceView3D.draw_handler_remove(self._handlers.pop(), "WINDOW")

    def replace(self, overlay: Overlay, points: Any = None, faces: Any = None) -> None:
        """Draw another overlay from now on. points (n, 3) world, faces (m, 3): of the tint's surface."""
        self._overlay, self._batches = overlay, None
        self._tinted, self._tint_faces = points, faces

    def draw_view(self) -> None:
        """Called by Blender for each view, with its matrices set."""
        if not self._is_shown():
            return
        if self._batches is None:
            self._batches, self.rebuilt = _batches(self._overlay, self._tinted, self._tint_faces), self.rebuilt + 1
        before = gpu.state.blend_get(), gpu.state.depth_test_get()
        gpu.state.blend_set("ALPHA")
        gpu.state.point_size_set(_DOT * _scale())
        try:
            for shader, batch, uniforms, depth in self._batches:
                gpu.state.depth_test_set(depth)
                gpu.state.face_culling_set("BACK" if depth == _GHOSTS else "NONE")
                _draw(shader, batch, uniforms)
        finally:
            gpu.state.blend_set(before[0])
            gpu.state.depth_test_set(before[1])
            gpu.state.face_culling_set("NONE")

    def draw_pixels(self) -> None:
        """Handles as discs, and names, where their places are seen."""
        region, data = bpy.context.region, bpy.context.region_data
        if not self._is_shown() or region is None or data is None:
            return
        from contact_blender.extension.region_view import RegionView

        view = RegionView.of(region, data)
        gpu.state.blend_set("ALPHA")
        handles = self._overlay.handles
        if handles:
            _draw_discs(handles, view.project(np.stack([each.position for each in handles])), view.viewport[1])
        for label in self._overlay.labels:
            x, y, depth = view.project(label.position[None])[0]
            if depth > 0.0:
                _write(label.text, x, view.viewport[1] - y, (*label.color, 1.0))
        gpu.state.blend_set("NONE")


def redraw() -> None:
    """Ask for a drawing of every 3D view."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas if window.screen else ():
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _batches(overlay: Overlay, points: Any, faces: Any) -> list[Batch]:
    """All that is drawn among the objects, what is filled first."""
    made: list[Batch] = []
    for ghost in overlay.ghosts:
        if len(ghost.triangles):
            within = _shrunk(ghost.points, ghost.triangles)
            made.append(_triangles(within, ghost.triangles, (*ghost.color, ghost.opacity)))
        else:
            made.append(_points([ghost.points], [(*ghost.color, 0.8)]))
    if overlay.tint is not None and points is not None:
        made.append(_tint(overlay.tint, points, faces))
    made += _decals(overlay)
    made += _lines(overlay)
    return made


def _shrunk(points: FloatArray, triangles: Any) -> FloatArray:
    """(n, 3) a surface a little within itself. Where a proposal leaves the skin alone its ghost lies in the skin
    that Blender draws, whose points differ in the last digits: it would show through in stripes."""
    mesh = TriangleMesh(points, triangles)
    return np.asarray(points - _WITHIN * mesh.bounding_box_diagonal * mesh.vertex_normals)


def _decals(overlay: Overlay) -> list[Batch]:
    """Every filled patch in one batch, drawn twice: where it is seen, and faintly where something hides it."""
    filled = [decal for decal in overlay.decals if len(decal.triangles)]
    dots = [decal for decal in overlay.decals if not len(decal.triangles)]
    made: list[Batch] = []
    if filled:
        starts = np.cumsum([0, *(len(decal.points) for decal in filled)])
        points = np.concatenate([decal.points for decal in filled])
        indices = np.concatenate(
            [decal.triangles + start for decal, start in zip(filled, starts, strict=False)]
        ).astype(np.int32)
        shader = gpu.shader.from_builtin("SMOOTH_COLOR")
        for depth, strength in (("LESS_EQUAL", 1.0), ("GREATER", _THROUGH)):
            colors = [
                np.tile((*decal.color, strength * decal.opacity * (0.9 if decal.selected else 0.65)),
                        (len(decal.points), 1))
                for decal in filled
            ]  # fmt: skip
            content = {"pos": _single(points), "color": _single(np.concatenate(colors))}
            made.append((shader, batch_for_shader(shader, "TRIS", content, indices=indices), {}, depth))
    if dots:
        made.append(_points([decal.points for decal in dots], [(*decal.color, 1.0) for decal in dots]))
    return made


def _lines(overlay: Overlay) -> list[Batch]:
    """Axes and rings on the skin, pairs through everything."""
    made = []
    on_skin: list[Part] = [
        (_segments(line.points), (*line.color, 1.0)) for line in overlay.axes if len(line.points) > 1
    ]
    on_skin += [(_arrow(line.points), (*line.color, 1.0)) for line in overlay.axes if line.arrow]
    on_skin += [(_segments(_ring(ring)), (*ring.color, 0.9)) for ring in overlay.rings]
    if on_skin:
        made.append(_polylines(on_skin, _LINE, "LESS_EQUAL"))
    pairs: list[Part] = []
    roots: list[Part] = []
    for pair in overlay.pair_lines:
        many = np.stack([pair.starts, pair.ends], axis=1).reshape(-1, 3)
        pairs.append((many, (*pair.color, 0.6 if pair.selected else 0.3)))
        roots.append((np.asarray(pair.middle), (*pair.color, 0.9)))
    if pairs:
        made += [_polylines(pairs, _PAIR, "NONE"), _polylines(roots, _LINE, "NONE")]
    return made


def _polylines(parts: Sequence[Part], width: float, depth: str) -> Batch:
    """Segments, each part in its colour."""
    shader = gpu.shader.from_builtin("POLYLINE_SMOOTH_COLOR")
    points = np.concatenate([segments for segments, _ in parts])
    colors = np.concatenate([np.tile(color, (len(segments), 1)) for segments, color in parts])
    batch = batch_for_shader(shader, "LINES", {"pos": _single(points), "color": _single(colors)})
    return shader, batch, {"lineWidth": width}, depth


def _triangles(points: FloatArray, triangles: Any, color: tuple[float, ...]) -> Batch:
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    batch = batch_for_shader(shader, "TRIS", {"pos": _single(points)}, indices=np.asarray(triangles, np.int32))
    return shader, batch, {"color": color}, _GHOSTS


def _points(parts: list[FloatArray], colors: list[tuple[float, ...]]) -> Batch:
    shader = gpu.shader.from_builtin("POINT_FLAT_COLOR")
    each = np.concatenate([np.tile(color, (len(part), 1)) for part, color in zip(parts, colors, strict=True)])
    content = {"pos": _single(np.concatenate(parts)), "color": _single(each)}
    return shader, batch_for_shader(shader, "POINTS", content), {}, "LESS_EQUAL"


def _tint(tint: StrokeTint, points: FloatArray, faces: Any) -> Batch:
    """The faces that a stroke reaches, drawn where the distance is within its radius."""
    near = tint.distances <= 2.0 * tint.radius
    reached = np.asarray(faces)[near[faces].any(axis=1)]
    distances = np.where(np.isfinite(tint.distances), tint.distances, 4.0 * tint.radius)
    shader = _tint_shader()
    content = {"pos": _single(points), "distance": _single(distances)}
    batch = batch_for_shader(shader, "TRIS", content, indices=np.asarray(reached, np.int32))
    return shader, batch, {"color": (*tint.color, 0.75), "radius": tint.radius}, "LESS_EQUAL"


_shaders: dict[str, Any] = {}


def _tint_shader() -> Any:
    if "tint" not in _shaders:
        passed = gpu.types.GPUStageInterfaceInfo("contact_tint")
        passed.smooth("FLOAT", "away")
        info = gpu.types.GPUShaderCreateInfo()
        info.push_constant("MAT4", "ModelViewProjectionMatrix")
        info.push_constant("VEC4", "color")
        info.push_constant("FLOAT", "radius")
        info.vertex_in(0, "VEC3", "pos")
        info.vertex_in(1, "FLOAT", "distance")
        info.vertex_out(passed)
        info.fragment_out(0, "VEC4", "fragColor")
        info.vertex_source(
            "void main() { away = distance; gl_Position = ModelViewProjectionMatrix * vec4(pos, 1.0);"
            " gl_Position.z -= 1e-4 * gl_Position.w; }"
        )
        info.fragment_source("void main() { if (away > radius) { discard; } fragColor = color; }")
        _shaders["tint"] = gpu.shader.create_from_info(info)
    return _shaders["tint"]


def _draw(shader: Any, batch: Any, uniforms: dict[str, Any]) -> None:
    shader.bind()
    for name, value in uniforms.items():
        shader.uniform_float(name, value * _scale() if name == "lineWidth" else value)
    if "lineWidth" in uniforms:
        *_, width, height = gpu.state.viewport_get()
        shader.uniform_float("viewportSize", (width, height))
    batch.draw(shader)


def _draw_discs(handles: Iterable[Handle], seen: FloatArray, height: int) -> None:
    """Each handle as a disc with a dark rim, that of a turn as a ring."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    circle = np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)], axis=1)
    for handle, (x, y, depth) in zip(handles, seen, strict=True):
        if depth <= 0.0:
            continue
        middle, radius = np.array([x, height - y]), handle.radius * _scale()
        hollow = handle.role in ("turn", "bend")
        for size, color in ((radius, _RIM), (radius - 1.5, (*handle.color, 1.0))):
            fan = np.concatenate([middle[None], middle + size * circle])
            _draw(shader, batch_for_shader(shader, "TRI_FAN", {"pos": _single(fan)}), {"color": color})
        if hollow:
            fan = np.concatenate([middle[None], middle + 0.45 * radius * circle])
            _draw(shader, batch_for_shader(shader, "TRI_FAN", {"pos": _single(fan)}), {"color": _RIM})


def _write(text: str, x: float, y: float, color: tuple[float, ...]) -> None:
    blf.size(0, 12.0 * _scale())
    blf.color(0, *color)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0.0, 0.0, 0.0, 1.0)
    for number, line in enumerate(text.splitlines()):
        blf.position(0, x + 12.0 * _scale(), y - 15.0 * _scale() * number, 0.0)
        blf.draw(0, line)
    blf.disable(0, blf.SHADOW)


def _segments(points: FloatArray) -> FloatArray:
    """(2 (k - 1), 3) the ends of the segments of a line (k, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3)


def _arrow(points: FloatArray) -> FloatArray:
    """(4, 3) the two strokes of a head at the end of a line (k, 3)."""
    if len(points) < 2:
        return np.zeros((0, 3))
    whole = float(np.linalg.norm(points[-1] - points[0]))
    along = points[-1] - points[-2]
    along = along / max(float(np.linalg.norm(along)), 1e-12)
    side = np.cross(along, np.cross(along, [0.31, 0.53, 0.79]))
    back, wide = points[-1] - 0.12 * whole * along, 0.07 * whole * side
    return np.stack([points[-1], back + wide, points[-1], back - wide])


def _ring(ring: Any) -> FloatArray:
    """(k, 3) the brush's circle, a little off the skin."""
    normal = ring.normal / max(float(np.linalg.norm(ring.normal)), 1e-12)
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first = first / np.linalg.norm(first)
    second = np.cross(normal, first)
    circle = np.cos(_CIRCLE)[:, None] * first + np.sin(_CIRCLE)[:, None] * second
    return np.asarray(ring.centre + ring.radius * (circle + 0.05 * normal))


def _scale() -> float:
    return float(bpy.context.preferences.system.ui_scale)


def _single(values: Any) -> Any:
    return np.ascontiguousarray(values, np.float32)
