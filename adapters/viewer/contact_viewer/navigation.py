"""How pointer and keys move the camera: what no tool has taken comes here.

Middle button: orbit, with Shift: pan. Left button where nothing is: orbit. Right button: pan, with Ctrl: zoom.
Wheel: zoom at the pointer. So a pen, a trackpad and a mouse with two buttons all get everywhere.
"""

from __future__ import annotations

from collections.abc import Callable

from contact_core.interaction.events import Pointer
from contact_viewer.eye import Eye

_ZOOM = 60.0  # pixels for a notch


class Navigation:
    """Moves an eye."""

    def __init__(self, eye: Eye) -> None:
        self._eye = eye
        self._drag: Callable[[float, float], None] | None = None
        self._at = (0.0, 0.0)

    @property
    def is_dragging(self) -> bool:
        """Whether the camera follows the pointer now."""
        return self._drag is not None

    def handle(self, event: Pointer) -> bool:
        """Take an event; whether the camera moved."""
        before, self._at = self._at, (event.x, event.y)
        if event.kind == "wheel":
            self._eye.zoom(event.wheel, event.pixel)
            return True
        if event.kind == "press":
            self._drag = self._choose(event)
        elif event.kind in ("release", "leave"):
            self._drag = None
        elif self._drag is not None:
            self._drag(event.x - before[0], event.y - before[1])
            return True
        return False

    def _choose(self, event: Pointer) -> Callable[[float, float], None]:
        if event.button == "right":
            return self._pull if event.holds("ctrl") else self._eye.pan
        if event.holds("shift"):
            return self._eye.pan
        return self._pull if event.button == "middle" and event.holds("ctrl") else self._eye.orbit

    def _pull(self, _: float, dy: float) -> None:
        self._eye.zoom(-dy / (_ZOOM * self._eye.pixel_ratio))
