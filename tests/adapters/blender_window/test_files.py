"""Files in a real window: saved, reopened, another one opened under a live session."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window


@in_window
def test_another_file_under_a_live_session(window: Window) -> Iterator[Any]:
    """The session ends with its file, its contacts stay there, and none go into the file that is opened."""
    bpy = window.bpy
    other, shot = str(window.folder / "other.blend"), str(window.folder / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=other)
    extension = window.enable()
    yield 3
    yield from window.open_sidebar()
    session = window.hand_and_ball()
    bpy.ops.contact.solve()
    solved = {
        name: dict(pose.rotations) if hasattr(pose, "rotations") else pose
        for name, pose in session.document.poses.items()
    }
    pairs = list(session.document.pairs)
    bpy.ops.wm.save_as_mainfile(filepath=shot)
    yield from window.open_file(other)
    assert session.host is None and extension.shared.held() is None and "contact_core" not in bpy.context.scene
    yield from window.open_sidebar()
    yield from window.press("contact.add_surfaces(")
    assert list(window.session().document.surfaces) == ["Cube"] and not window.session().document.patches
    yield from window.undo()
    yield from window.open_file(shot)
    yield from window.open_sidebar()
    yield from window.press("contact.begin(")
    again = window.session()
    assert (
        again is not session and list(again.document.pairs) == pairs and list(again.document.poses) == list(solved)
    )
    assert [row.name for row in bpy.context.window_manager.contact.rows] == list(again.document.patches)
    yield from window.press("contact.rotate(")
    turned = again.document
    yield from window.undo()
    assert again.document is not turned and list(again.document.pairs) == pairs
    window.picture("reopened")
