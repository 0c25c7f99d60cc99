"""Our keys beside Blender's own: without a window Blender loads 12 of some 3,200 default keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from blender_driver import Window, in_window

# Where a key that is pressed in the 3D view is looked for, in these modes; our own are in some of them.
VIEW = (
    "3D View",
    "3D View Generic",
    "Object Mode",
    "Object Non-modal",
    "Pose",
    "Weight Paint",
    "Paint Vertex Selection (Weight, Vertex)",
    "Frames",
)
TOOLS = "3D View Tool: "  # keymaps that act only while their tool is in the hand, and may shadow others then
NEVER = (
    "N",
    "T",
    "Q",
    "X",
    "Z",
    "TAB",
    "SPACE",
)  # plain, not even by a tool: sidebar, toolbar, modes, playback ...
EVERYWHERE = ("Window", "Screen", "Screen Editing", "View2D", "User Interface")


def chord(item: Any) -> tuple[Any, ...]:
    modifiers = ("any", "shift", "ctrl", "alt", "oskey", "key_modifier")
    return (item.type, item.value, *(getattr(item, name) for name in modifiers))


def clashes(default: Any, ours: Any) -> list[str]:
    """Keys of `ours` (a key configuration) that Blender has a use for in the same place."""
    taken = {
        chord(item): f"{name}: {item.idname}"
        for name in (*VIEW, *EVERYWHERE)
        if name in default.keymaps
        for item in default.keymaps[name].keymap_items
        if item.active and item.map_type == "KEYBOARD"
    }
    return [
        f"{item.idname} has {item.to_string()}, which is {taken[chord(item)]}"
        for keymap in ours.keymaps
        if not keymap.name.startswith(TOOLS)
        for item in keymap.keymap_items
        if (item.idname.startswith("contact.") or "contact" in getattr(item.properties, "name", "").lower())
        and chord(item) in taken
    ]


@in_window
def test_no_key_is_taken_twice(window: Window) -> Iterator[Any]:
    window.enable()
    yield 5
    configurations = window.bpy.context.window_manager.keyconfigs
    default, ours = configurations.default, configurations.addon
    number = sum(len(keymap.keymap_items) for keymap in default.keymaps)
    assert number > 2500, f"only {number} keys are there: this tests nothing"
    assert not clashes(default, ours), clashes(default, ours)
    tools = [keymap for keymap in ours.keymaps if keymap.name.startswith(TOOLS) and "Contact" in keymap.name]
    items = [item for keymap in tools for item in keymap.keymap_items]
    assert len(tools) > 20 and len(items) > 500, f"{len(tools)} tools with {len(items)} keys"
    plain = {item.type for item in items if not (item.any or item.shift or item.ctrl or item.alt)}
    assert "B" in plain and plain.isdisjoint(NEVER), plain
    keymap = ours.keymaps.new("Object Mode", space_type="EMPTY")
    planted = keymap.keymap_items.new("contact.paint", "G", "PRESS")
    assert len(clashes(default, ours)) == 1, "a key that is known to be taken was not found"
    keymap.keymap_items.remove(planted)
    window.said.append(f"{number} default keys")
