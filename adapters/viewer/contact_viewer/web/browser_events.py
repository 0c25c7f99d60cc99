"""What the browser tells, as events of the interaction.

Pointer events come from trame-rca in the page's pixels, from the left and from below the last row: the pixel at the
top has the height of the view as its y. Keys come from the page's own listener, once each, never from a text field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from contact_core.errors import InvalidInput
from contact_core.interaction.events import KEY_NAMES, Button, Key, Modifier, Pointer, PointerKind

_BUTTONS: Mapping[str, Button] = {"Left": "left", "Middle": "middle", "Right": "right"}
_KEYS = {
    " ": "Space",
    "ArrowLeft": "Left",
    "ArrowRight": "Right",
    "ArrowUp": "Up",
    "ArrowDown": "Down",
}


def pointer_of(event: Mapping[str, Any], height: int, time: float, scale: float = 1.0) -> Pointer | None:
    """The pointer event in one of trame-rca's; None for what is none, at the centre of the page's pixel.

    height: of the image, in its own pixels, of which `scale` are one of the page's.
    """
    kind, button = _kind(str(event.get("type", "")))
    if kind is None:
        return None
    x, y = _number(event.get("x")), _number(event.get("y"))
    if x is None or y is None:
        if kind != "leave":
            return None
        x = y = 0.0
    wheel = 0.0
    if kind == "wheel":
        spin = _number(event.get("spinY")) or 0.0
        wheel = -max(-4.0, min(4.0, spin))
    right, down = scale * (x + 0.5), height - scale * (y - 0.5)
    return Pointer(kind, right, down, button, _modifiers(event), time=time, wheel=wheel)


def key_of(event: Mapping[str, Any], time: float) -> Key | None:
    """The key in what the page's listener tells: {"key": "z", "ctrl": true, ...}; None for keys that mean
    nothing."""
    name = str(event.get("key", ""))
    name = _KEYS.get(name, name)
    if len(name) != 1 and name not in KEY_NAMES:
        return None
    try:
        return Key(name, _modifiers(event), time)
    except InvalidInput:
        return None


def _kind(name: str) -> tuple[PointerKind | None, Button]:
    if name == "MouseMove":
        return "move", "none"
    if name == "MouseWheel":
        return "wheel", "none"
    if name in ("MouseLeave", "Leave"):
        return "leave", "none"
    for side, button in _BUTTONS.items():
        if name == f"{side}ButtonPress":
            return "press", button
        if name == f"{side}ButtonRelease":
            return "release", button
    return None, "none"


def _modifiers(event: Mapping[str, Any]) -> frozenset[Modifier]:
    held: dict[Modifier, tuple[str, ...]] = {
        "ctrl": ("ctrl", "controlKey", "ctrlKey", "meta"),
        "alt": ("alt", "altKey"),
        "shift": ("shift", "shiftKey"),
    }
    return frozenset(name for name, spelt in held.items() if any(bool(event.get(key)) for key in spelt))


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return float(value)
