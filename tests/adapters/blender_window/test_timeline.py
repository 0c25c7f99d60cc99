"""The timeline as an artist sees it: bars of pairs, their tints, and keys, drawn by a Blender with a window."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window

FIRST, LAST = 1, 24


@in_window
def test_bars_and_keys_are_drawn(window: Window) -> Iterator[Any]:
    """Two spans, a solve of all frames, and what was measured: green, yellow or red where they hold."""
    bpy = window.bpy
    film = window.enable().film
    yield 3
    session = window.hand_and_ball()
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FIRST, LAST
    window.window.workspace = bpy.data.workspaces["Animation"]
    yield 10
    sheets = [each for each in window.window.screen.areas if each.type == "DOPESHEET_EDITOR"]
    area = max(sheets, key=lambda each: each.height)
    region = next(each for each in area.regions if each.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.action.view_all()
    thumb, index = session.document.pairs
    for frame, pair in ((7, thumb), (10, index)):
        bpy.context.scene.frame_set(frame)
        assert bpy.ops.contact.span_add(pair=pair, frames=8.0, ease_in=4.0, ease_out=4.0) == {"FINISHED"}
    yield 5
    before = window.pixels()
    with window.override():
        assert bpy.ops.contact.solve(keyed=True, first=FIRST, last=LAST) == {"FINISHED"}
        assert bpy.ops.contact.film_measure() == {"FINISHED"}
    yield 5
    after = window.picture("timeline")
    height = len(after)
    part = slice(height - region.y - region.height, height - region.y), slice(region.x, region.x + region.width)
    made = film.shapes()
    assert made is not None and {thumb, index} <= set(made.lanes)
    for color in {tuple(color[:3]) for color in made.colors if color[3] > 0.9}:
        wanted = [round(255 * each) for each in color]
        near = abs(after[part].astype(int) - wanted).max(axis=2) < 40
        assert near.sum() > 200, f"nothing of {wanted} in the timeline"
    assert (before[part] != after[part]).any() and session.timeline.spans(thumb)
