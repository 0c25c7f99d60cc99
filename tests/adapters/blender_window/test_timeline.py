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
    scale = bpy.context.preferences.system.ui_scale

    def place(frame: float, lane: float) -> tuple[int, int]:
        """Window pixels."""
        across = region.view2d.view_to_region(frame, 0.0, clip=False)[0]
        return round(region.x + across), round(region.y + (22.0 + 18.0 * lane) * scale)

    x, low = place(6.0, made.lanes.index(thumb))  # under the name of the pair, where its ramp rises
    column = after[height - low - round(18.0 * scale) : height - low, x].astype(int)
    assert (column.max(axis=1) - column.min(axis=1)).max() > 25, f"the name hides the bar: {column.tolist()}"
    yield from clicks_go_to_frames(window, made, place, region)


def clicks_go_to_frames(window: Window, made: Any, place: Any, region: Any) -> Iterator[Any]:
    """A click on a curve goes to its frame, one elsewhere does not, and Blender selects as always with both."""
    bpy = window.bpy
    from contact_blender.compat import fcurves

    armature = next(each for each in bpy.data.objects if each.type == "ARMATURE")
    sheet = next(each for each in window.window.screen.areas if region in each.regions[:])
    sheet.spaces.active.dopesheet.show_only_selected = False  # its keys in the rows of the sheet

    def selected(put: bool | None = None) -> int:
        """How many keys are selected; `put` selects all or none before."""
        points = [point for curve in fcurves(armature) for point in curve.keyframe_points]
        for point in points if put is not None else ():
            point.select_control_point = put
        return sum(point.select_control_point for point in points)

    solid = [row for row, color in enumerate(made.segment_colors) if color[3] == 1.0]
    middles = made.segments[solid].mean(axis=1)
    frame, lane = min(middles, key=lambda each: abs(each[0] - 15.5))
    bpy.context.scene.frame_set(3)
    yield 3
    yield from window.click(*place(frame, made.lanes.index("pose of human_hand") + 0.5))
    yield 3
    assert bpy.context.scene.frame_current == 3, "a click beside the curves is Blender's alone"
    yield from window.click(*place(frame + 0.2, lane))
    yield 3
    assert bpy.context.scene.frame_current == round(frame + 0.2), "a click on a curve goes to its frame"
    top = region.y + region.height - 50
    for what, (x, y) in (("beside", place(13.0, len(made.lanes) + 1.0)), ("on", place(frame, lane))):
        assert selected(False) == 0
        yield 3
        yield from window.drag([(x, y), (x + 6, y + 6), (x + 70, y + 20), (x + 70, (y + top) // 2), (x + 70, top)])
        yield 3
        window.said.append(f"{selected()} keys in the box that begins {what} a curve")
        assert selected() > 0, f"no keys are in the box that begins {what} a curve"
