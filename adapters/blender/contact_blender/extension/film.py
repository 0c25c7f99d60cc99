"""Contacts over time in Blender's Timeline and Dope Sheet: bars of pairs and marks of keys above the frames.

What is drawn are the core's shapes (`contact_core.interaction.film_shapes`), the same bars and colours as in the
application's timeline; they are made anew only when the document or what was measured has changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from contact_blender.extension import shared

if TYPE_CHECKING:
    from contact_core.interaction.film_shapes import FilmShapes
    from contact_core.session import Session

_LANE, _KEY, _ABOVE = 18.0, 4.5, 22.0  # pixels of a plain screen: a lane, half a key, and the scrollbar below
_WORDS, _NEAR = 11.0, 6.0  # the same: letters, and how near a curve a click counts
_handlers: list[Any] = []
_items: list[Any] = []  # (keymap, item)


class CONTACT_OT_film_go(bpy.types.Operator):  # noqa: N801 (Blender's spelling)
    """Go to the frame of the curve under the pointer. Blender hears the press as well, and selects as always"""

    bl_idname = "contact.film_go"
    bl_label = "Go to Frame of Curve"
    bl_options = {"INTERNAL"}  # noqa: RUF012 (Blender's spelling)

    def invoke(self, context: Any, event: Any) -> set[str]:
        scale = float(context.preferences.system.ui_scale)
        frame = frame_at(context, (event.mouse_region_x, event.mouse_region_y), scale)
        if frame is not None:
            context.scene.frame_set(frame)
        return {"PASS_THROUGH"}  # nothing else: one that is finished ends Blender's waiting for a drag


def register() -> None:
    """Draw in every timeline from now on, and hear presses there."""
    _handlers.append(bpy.types.SpaceDopeSheetEditor.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL"))
    config = bpy.context.window_manager.keyconfigs.addon
    if config is not None:  # none without a window
        found = config.keymaps.new(name="Dopesheet", space_type="DOPESHEET_EDITOR")
        _items.append((found, found.keymap_items.new(CONTACT_OT_film_go.bl_idname, "LEFTMOUSE", "PRESS")))


def unregister() -> None:
    """Draw no more."""
    while _handlers:
        bpy.types.SpaceDopeSheetEditor.draw_handler_remove(_handlers.pop(), "WINDOW")
    while _items:
        keymap, item = _items.pop()
        keymap.keymap_items.remove(item)


def redraw() -> None:
    """Ask for a drawing of every timeline."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas if window.screen else ():
            if area.type == "DOPESHEET_EDITOR":
                area.tag_redraw()


def measure(session: Session) -> str:
    """Measure every frame, for the tints of bars and the curves. Raises InvalidInput, Cancelled."""
    from contact_core.interaction.film import drafts_of
    from contact_core.proposals.film import measure_film

    document, frames = session.timeline.document, session.timeline.settings.frames()
    found = shared.held()
    assert found is not None  # the session that runs this
    drafts = drafts_of(session, frames)
    found.measured = document, measure_film(document, frames, drafts, progress=session.host)
    redraw()
    series, unit = found.measured[1].series, found.measured[1].meters_per_unit
    worst = np.nanmax(series.error) if np.isfinite(series.error).any() else 0.0
    return f"Measured {len(frames)} frames: contacts within {1e3 * unit * worst:.2f} mm."


def show_worst(session: Session, curve: str) -> str:
    """Go to the frame at which a curve is worst. Raises InvalidInput where it was not measured."""
    from contact_core.errors import InvalidInput
    from contact_core.interaction.film import curves_of

    found = shared.held()
    known = () if found is None or found.measured is None else curves_of(found.measured[1])
    worst = next((each for each in known if each.name == curve and each.worst is not None), None)
    if worst is None or worst.worst is None:
        raise InvalidInput(f"nothing is known of {curve} yet: measure the contacts over time first.")
    whole = int(np.floor(worst.worst))
    bpy.context.scene.frame_set(whole, subframe=worst.worst - whole)
    return f"{curve} is worst at frame {worst.worst:g}{f', of {worst.pair}' if worst.pair else ''}."


def shapes() -> FilmShapes | None:
    """What is to be drawn of the open scene, None where it has no film. Begins nothing."""
    found = shared.held()
    if found is None or not found.session.timeline.document.is_timed:
        return None
    asked = found.session.timeline.document, found.measured
    if found.shapes is None or found.shapes[0] != asked:
        from contact_core.interaction.film import bars_of, curves_of, film_view, marks_of
        from contact_core.interaction.film_shapes import shapes_of

        session, measures = found.session, None if found.measured is None else found.measured[1]
        curves = () if measures is None else curves_of(measures)
        view = film_view(session, bars_of(session, measures), marks_of(session), curves)
        found.shapes = asked, shapes_of(view)
    return found.shapes[1]


CLASSES = (CONTACT_OT_film_go,)


def frame_at(context: Any, place: tuple[float, float], scale: float) -> int | None:
    """The whole frame of a measured curve next to pixels of a timeline, None where no curve is near."""
    from contact_core.interaction.film_shapes import LIMIT

    made = _shown(context)
    if made is None or not len(made.segments):
        return None
    drawn = (made.segment_colors != LIMIT).any(axis=1)  # limits are lines, too
    ends = _pixels(made.segments[drawn].reshape(-1, 2), context.region, scale).reshape(-1, 2, 2)
    along, here = ends[:, 1] - ends[:, 0], np.array(place) - ends[:, 0]
    share = (along * here).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-9)
    away = np.linalg.norm(here - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
    if not len(away) or away.min() > _NEAR * scale:
        return None
    return round(context.region.view2d.region_to_view(*place)[0])


def _shown(context: Any) -> FilmShapes | None:
    """What is drawn in a timeline, None for nothing."""
    overlays = getattr(context.space_data, "overlays", None)
    made = shapes() if getattr(overlays, "show_overlays", True) else None
    return made if made is not None and made.lanes else None


def draw() -> None:
    """Called by Blender for each timeline."""
    context = bpy.context
    made = _shown(context)
    if made is None:
        return
    scale = float(context.preferences.system.ui_scale)
    gpu.state.blend_set("ALPHA")
    try:
        _draw_ground(len(made.lanes), context.region, scale)
        triangles = _pixels(made.triangles.reshape(-1, 2), context.region, scale)
        _fill(triangles, np.repeat(made.colors, 3, axis=0))
        _draw_lines(_pixels(made.segments.reshape(-1, 2), context.region, scale), made.segment_colors, scale)
        _draw_keys(made, _pixels(made.keys, context.region, scale), scale)
        _write_names(made.lanes, scale)
    finally:
        gpu.state.blend_set("NONE")


def _pixels(places: Any, region: Any, scale: float) -> Any:
    """(n, 2) of (frame, lane)."""
    start, step = (region.view2d.view_to_region(frame, 0.0, clip=False)[0] for frame in (0.0, 1000.0))
    across = start + places[:, 0] * (step - start) / 1000.0
    return np.stack([across, (_ABOVE + places[:, 1] * _LANE) * scale], axis=1)


def _draw_ground(lanes: int, region: Any, scale: float) -> None:
    """Dark, so that bars are read over the rows of channels."""
    _fill(*_box(0.0, 0.85 * _ABOVE * scale, float(region.width), (_ABOVE + lanes * _LANE) * scale, 0.72))


def _write_names(names: Sequence[str], scale: float) -> None:
    """Over all else at the left of each lane, on dark ground, for a bar may begin there and shows through."""
    blf.size(0, _WORDS * scale)
    blf.color(0, 1.0, 1.0, 1.0, 0.95)
    lows = [(_ABOVE + place * _LANE) * scale for place in range(len(names))]
    for name, low in zip(names, lows, strict=True):
        _fill(*_box(0.0, low, blf.dimensions(0, name)[0] + 14.0 * scale, low + _LANE * scale, 0.55))
    for name, low in zip(names, lows, strict=True):  # only now: writing leaves Blender's blending off
        blf.position(0, 8.0 * scale, low + 0.3 * _LANE * scale, 0.0)
        blf.draw(0, name)


def _box(left: float, low: float, right: float, high: float, opacity: float) -> tuple[Any, Any]:
    """Corners (6, 2) and colours (6, 4) of a dark rectangle."""
    corners = [(left, low), (right, low), (right, high), (left, low), (right, high), (left, high)]
    return np.array(corners), np.tile((0.08, 0.08, 0.08, opacity), (6, 1))


def _draw_lines(ends: Any, colors: Any, scale: float) -> None:
    """Segments between pixels (2 m, 2), as slim rectangles."""
    first, second = ends[0::2], ends[1::2]
    along = second - first
    side = np.stack([-along[:, 1], along[:, 0]], axis=1)
    side *= 0.75 * scale / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    corners = [first - side, second - side, second + side, first - side, second + side, first + side]
    _fill(np.stack(corners, axis=1).reshape(-1, 2), np.repeat(colors, 6, axis=0))


def _draw_keys(made: Any, middles: Any, scale: float) -> None:
    diamond = np.array([(-1, 0), (0, -1), (1, 0), (-1, 0), (1, 0), (0, 1)]) * _KEY * scale
    for size, chosen, colors in (
        (1.35, np.ones(len(middles), bool), np.tile((0.05, 0.05, 0.05, 1.0), (len(middles), 1))),
        (1.0, np.ones(len(middles), bool), made.key_colors),
        (0.5, np.array(made.hollow, bool), np.tile((0.08, 0.08, 0.08, 1.0), (len(middles), 1))),
    ):
        corners = (middles[chosen, None, :] + size * diamond).reshape(-1, 2)
        _fill(corners, np.repeat(colors[chosen], 6, axis=0))


def _fill(corners: Any, colors: Any) -> None:
    """Triangles of pixels (n, 2) in colours (n, 4)."""
    if len(corners):
        shader = gpu.shader.from_builtin("SMOOTH_COLOR")
        content = {"pos": np.ascontiguousarray(np.c_[corners, np.zeros(len(corners))], np.float32),
                   "color": np.ascontiguousarray(colors, np.float32)}  # fmt: skip
        batch = batch_for_shader(shader, "TRIS", content)
        shader.bind()
        batch.draw(shader)
