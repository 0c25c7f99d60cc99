"""The panel in a real window: drawn, pressed with the mouse, one Ctrl+Z for each press, looked at."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window


def call_names(window: Window) -> set[str]:
    return {call.removeprefix("bpy.ops.contact.").partition("(")[0] for call in window.found}


@in_window
def test_every_button_is_there(window: Window) -> Iterator[Any]:
    """What the panel shows of nothing, and of a hand with two pairs before and after a solve."""
    window.enable()
    yield 3
    yield from window.open_sidebar()
    window.picture("empty")
    yield from window.buttons()
    assert call_names(window) == {"paint", "add_surfaces"}
    window.hand_and_ball()
    window.shown("human_hand", "baseball")
    yield 3
    window.picture("hand")
    yield from window.buttons()
    above = {
        "paint",
        "remove",
        "select",
        "erase",
        "add_surfaces",
        "transfer",
        "translate",
        "rotate",
        "bend",
        "scale",
    }
    assert above | {"pair", "unpair", "link", "unlink"} <= call_names(window), call_names(window)
    yield from window.scroll_down()
    yield from window.buttons()
    assert {"solve", "settle", "slide", "clear_pose"} <= call_names(window), call_names(window)
    window.picture("lower")


@in_window
def test_a_press_is_one_step_of_undo(window: Window) -> Iterator[Any]:
    """Turn and solve by the mouse; Ctrl+Z and Ctrl+Shift+Z over the view, each one press; the hand goes along."""
    window.enable()
    yield 3
    yield from window.open_sidebar()
    session = window.hand_and_ball()
    yield 3
    before, revision = session.document, session.revision
    yield from window.press("contact.rotate(")
    assert session.revision > revision and session.document is not before
    yield from window.undo()
    assert session.document is before and session.revision == revision
    yield from window.redo()
    turned = session.document
    assert turned is not before
    yield from window.scroll_down()
    yield from window.press("contact.solve(")
    for _ in range(2000):  # it runs beside the window
        if session.document is not turned:
            break
        yield
    yield 3
    solved = session.document
    bones = next(each for each in window.bpy.data.objects if each.type == "ARMATURE").pose.bones
    bent = [tuple(bone.matrix_basis.to_quaternion()) for bone in bones]
    assert solved.poses and max(abs(q[0] - 1.0) for q in bent) > 1e-3
    window.picture("solved")
    yield from window.undo()
    assert session.document is turned
    bones = next(each for each in window.bpy.data.objects if each.type == "ARMATURE").pose.bones
    assert max(abs(bone.matrix_basis.to_quaternion()[0] - 1.0) for bone in bones) < 1e-6
    yield from window.redo()
    assert session.document is solved
    yield from window.undo()
    yield from window.undo()
    assert session.document is before


@in_window
def test_painting_as_an_artist_does(window: Window) -> Iterator[Any]:
    """Tab, A, Tab and the button: the tooltip's own way; in Edit Mode the button is grey and does nothing."""
    window.enable()
    yield 3
    yield from window.open_sidebar()
    yield from window.over_view()
    yield from window.key("TAB")
    assert window.bpy.context.mode == "EDIT_MESH"
    yield from window.key("A")
    yield from window.press("contact.paint(")
    assert "contact_core" not in window.bpy.context.scene
    yield from window.over_view()
    yield from window.key("TAB")
    yield from window.press("contact.paint(")
    session = window.session()
    assert len(session.geometry.points("patch")) == 8
    yield from window.undo()
    assert not session.document.patches
    yield from window.redo()
    assert list(session.document.patches) == ["patch"]


@in_window
def test_a_row_is_renamed_and_recoloured(window: Window) -> Iterator[Any]:
    """What the list tells of its rows reaches the document, as one step; a refusal leaves the row as it was."""
    window.enable()
    yield from window.open_sidebar()
    session = window.hand_and_ball()
    rows = window.bpy.context.window_manager.contact.rows
    rows[0].label = "thumb"
    yield 5
    assert "thumb" in session.document.patches and rows[0].name == rows[0].label == "thumb"
    yield from window.undo()
    assert "thumb" not in session.document.patches and rows[0].label == "thumb_distal"
    before = session.document
    for red in (0.1, 0.2, 0.3):  # as the colour wheel does while it is dragged
        rows[0].color = (red, 0.4, 0.5)
    yield 30
    color = session.document.patch("thumb_distal").color
    assert abs(color[0] - 0.3) < 1e-6
    yield from window.undo()
    assert session.document is before  # one step for all three
    rows[0].label = ""
    yield 5
    assert rows[0].label == "thumb_distal" in session.document.patches
