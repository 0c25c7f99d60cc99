"""The panel in a real window: drawn, pressed with the mouse, looked at."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window


@in_window
def test_the_panel_is_drawn(window: Window) -> Iterator[Any]:
    """What it shows of nothing, and of a hand with two pairs before and after a solve."""
    window.enable()
    yield 3
    yield from window.open_sidebar()
    window.picture("empty")
    yield from window.buttons()
    assert {call.partition("(")[0] for call in window.found} == {
        "bpy.ops.contact.paint",
        "bpy.ops.contact.add_surfaces",
    }
    window.hand_and_ball()
    yield 3
    window.picture("hand")
    window.bpy.ops.contact.solve()
    yield 3
    window.picture("solved")
    yield from window.buttons()
    window.said.append(str(window.found))
