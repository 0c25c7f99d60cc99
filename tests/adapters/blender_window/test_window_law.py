"""The law of undo by real keys in a window, and the panel of the last operator (F9)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from blender_driver import Window, in_window

STEPS = 120  # tests/adapters/blender walks 300, without a window


@in_window
def test_a_walk_by_keys(window: Window) -> Iterator[Any]:
    """Gestures, Blender's own edits, modes, saving and opening, Ctrl+Z and Ctrl+Shift+Z: scene and model agree."""
    bpy = window.bpy
    window.enable()
    sys.path.insert(0, str(Path(__file__).parents[1] / "blender"))
    import blender_scenes
    import blender_walk

    import contact_core as contact
    from contact_blender.extension import rehearsal, shared

    for each in tuple(bpy.data.objects):
        bpy.data.objects.remove(each)
    rig = rehearsal.finger()
    shared.session().host.add(contact.Asset("arm", rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Z"))
    skin = next(each for each in bpy.data.objects if each.type == "MESH")
    skin.parent.name, skin.name = "bones", "arm"
    with window.override():
        blender_walk.add_sheet_and_tip(bpy)
    yield 5
    window.base()
    walk = blender_walk.Walk(bpy, blender_scenes, shared, window.folder, 2)
    for number in range(STEPS):
        kind = walk.random.uniform()
        if kind < 0.65:
            with window.override():
                walk.act(kind)
            yield
        elif kind >= 0.98:
            path, before = walk.saved()
            yield from window.open_file(path)
            with window.override():
                walk.reopened(before)
        else:
            by, press = (-1, window.undo) if kind < 0.83 else (1, window.redo)
            if 0 <= walk.now + by < len(walk.states):
                yield from press()
                walk.travelled(by)
        walk.agree()
        if number % 20 == 0:
            window.said.append(f"step {number}: {walk.done}")
    assert {"paint", "transfer", "move", "mode WEIGHT_PAINT", "reload"} <= set(walk.done), walk.done
    window.said.append(f"{STEPS} steps: {walk.done}")
    window.picture("walked")


@in_window
def test_the_last_operator_is_changed_in_its_panel(window: Window) -> Iterator[Any]:
    """F9 after a press of the mouse: another value there takes the step back and runs it again, as one step."""
    bpy = window.bpy
    window.enable()
    yield 3
    yield from window.open_sidebar()
    session = window.hand_and_ball()
    yield 3
    for name, field in (("rotate", "angle"), ("scale", "along")):
        before, revision = session.document, session.revision
        yield from window.press(f"contact.{name}(")
        done = session.document
        assert session.revision == revision + 1 and done is not before, name
        yield from window.over_view()
        yield from window.key("F9")
        yield 3
        window.picture(f"panel-{name}")
        yield from drag_field(window)
        changed, value = session.document, getattr(bpy.context.window_manager.operators[-1], field)
        window.said.append(f"{name}: {field} {value}")
        assert changed is not done and changed is not before, name
        yield from window.key("ESC")
        yield from window.undo()
        assert session.document is before and session.revision == revision, f"{name} is one step"
        assert getattr(bpy.ops.contact, name)(**{field: value}) == {"FINISHED"}
        patch = bpy.context.window_manager.contact.patch
        ours, theirs = changed, session.document
        assert ours.patch(patch) == theirs.patch(patch), (name, ours.patch(patch), theirs.patch(patch))
        assert ours.shapes == theirs.shapes
        window.base("another")


def drag_field(window: Window) -> Iterator[Any]:
    """Drag the second field of the panel of the last operator, which came up with its title under the mouse."""
    region = window.region()
    x, y = region.x + region.width // 2 + 90, region.y + region.height // 2 - 48
    for step in range(6):  # into the panel, and never out of it: that would close it
        yield from window.move(x - 90 + 18 * step, y + 40 - 8 * step)
        window.draw()  # a button is under the mouse once it was drawn there
        yield 3
    window.send("LEFTMOUSE", "PRESS")
    yield 5
    window.draw()
    for aside in (5, 12, 25, 40):
        yield from window.move(x + aside, y)
        window.draw()
        yield 3
    window.send("LEFTMOUSE", "RELEASE")
    yield 10
