"""Keys of the interaction's table as Blender spells them, and Blender's events as the interaction's values.

The table is the same for every front end. Where it wants a key that Blender users must not lose (sidebar, toolbar,
modes, playback, quick favourites, undo), another one is taken here; what Blender does itself has none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contact_core.interaction.events import Button, Pointer, PointerKind

_NAMES = {
    "Escape": "ESC", "Enter": "RET", "Space": "SPACE", "Tab": "TAB", "Backspace": "BACK_SPACE", "Delete": "DEL",
    "Home": "HOME", "End": "END", "Left": "LEFT_ARROW", "Right": "RIGHT_ARROW", "Up": "UP_ARROW",
    "Down": "DOWN_ARROW", "[": "LEFT_BRACKET", "]": "RIGHT_BRACKET", ".": "PERIOD", "?": "SLASH",
}  # fmt: skip
_DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
# Blender's own, in every mode and with every tool: N and T sidebar and toolbar, Q favourites, Tab modes, Space
# playback, Z shading, X delete. What stands here instead is free in the 3D view of 4.2 to 5.2.
INSTEAD: Mapping[str, tuple[str, ...]] = {
    "tool.select": ("Shift+Q",),
    "tool.transfer": ("Shift+T",),
    "selection.surface": ("Y",),
    "pose.solve": ("Ctrl+Enter",),
    "pose.settle": ("Shift+Enter",),
    "pose.slide": ("Alt+Enter",),
    "pose.suggest": ("Shift+J",),
    "pose.rest": ("Alt+R",),
    "pose.key": ("I",),
    "film.solve": ("Shift+Alt+Enter",),
    "film.window": ("Alt+T",),
}
# Blender does these, beside what the table leaves to the front end.
_BLENDERS = frozenset(
    ("edit.undo", "edit.redo", "show.xray", "show.isolate", "show.heat", "film.play", "film.first", "tool.place")
)
_OURS = frozenset(("pose.key",))  # left to the front end by the table, and done by us
WHILE_PROPOSED = frozenset(("edit.cancel", "edit.accept", "pose.another", "pose.before"))  # keys of that operator


def item_of(chord: str) -> dict[str, Any]:
    """A chord ("Ctrl+Shift+Z") as an item of a keymap."""
    *held, name = ("+", "+")[1:] if chord == "+" else chord.split("+")
    kind = _NAMES.get(name) or (_DIGITS[int(name)] if name.isdigit() else name.upper())
    item: dict[str, Any] = {"type": kind, "value": "PRESS"}
    return item | {each.lower(): True for each in held}


def is_blenders(action: Mapping[str, Any]) -> bool:
    """Whether Blender does this itself, by its own keys and menus."""
    return action["id"] in _BLENDERS or (action["by_host"] and action["id"] not in _OURS)


def chords_of(action: Mapping[str, Any]) -> tuple[str, ...]:
    """The chords that an action of the table has in Blender, "" for none."""
    if is_blenders(action) or action["id"] in WHILE_PROPOSED:
        return ()
    return INSTEAD.get(action["id"], tuple(action["keys"]))


def taken_twice(actions: Iterable[Mapping[str, Any]]) -> list[str]:
    """Chords that more than one action has."""
    found = [chord for action in actions for chord in chords_of(action)]
    return sorted({chord for chord in found if found.count(chord) > 1})


def pointer_of(event: Any, height: int, kind: PointerKind, button: Button = "none") -> Pointer:
    """What a mouse event did. height: of its region, pixels."""
    from contact_core.interaction.events import Pointer

    held: list[Any] = [name for name in ("ctrl", "alt", "shift") if getattr(event, name)]
    if getattr(event, "oskey", False):
        held.append("ctrl")
    x, y = event.mouse_region_x + 0.5, height - event.mouse_region_y - 0.5
    return Pointer(kind, x, y, button, frozenset(held), pressure=float(event.pressure))
