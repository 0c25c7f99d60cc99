"""The law of undo by real keys in a window, and the panel of the last operator (which F9 brings up, too)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from blender_driver import Window, in_window

STEPS = 300  # some five minutes; tests/adapters/blender walks as far without a window


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
    bpy.data.orphans_purge(do_recursive=True)  # a file that is saved forgets what nobody uses
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
    """Another value in the panel that F9 shows, too, takes the step back and runs it again, as one step."""
    bpy = window.bpy
    window.enable()
    from contact_core.document.schema import document_to_json

    yield 3
    yield from window.open_sidebar()
    session = window.hand_and_ball()
    yield 3
    for name, field in (("rotate", "angle"), ("scale", "along")):
        before, revision = session.document, session.revision
        yield from window.press(f"contact.{name}(")
        done = session.document
        assert session.revision == revision + 1 and done is not before, name
        yield 10
        yield from drag_field(window, name)
        changed, value = session.document, getattr(bpy.context.window_manager.operators[-1], field)
        window.said.append(f"{name}: {field} {value}")
        assert changed is not done and changed is not before, name
        yield from window.undo()
        assert session.document is before and session.revision == revision, f"{name} is one step"
        assert getattr(bpy.ops.contact, name)(**{field: value}) == {"FINISHED"}
        assert document_to_json(changed) == document_to_json(session.document), name
        window.base("another")


def drag_field(window: Window, name: str) -> Iterator[Any]:
    """Drag the second field of the panel of the last operator, at the lower left of the view; opened first."""
    panel = window.region("HUD")
    if panel.height < 60:
        yield from window.click(panel.x + 40, panel.y + panel.height - 12)
        yield 10
        panel = window.region("HUD")
    x, y = panel.x + int(0.6 * panel.width), panel.y + 35
    yield from window.move(x, y)
    yield 10
    window.picture(f"panel-{name}")
    window.send("LEFTMOUSE", "PRESS")
    yield 8
    for aside in (5, 12, 25, 40):
        yield from window.move(x + aside, y)
        yield 5
    window.send("LEFTMOUSE", "RELEASE")
    yield 10
