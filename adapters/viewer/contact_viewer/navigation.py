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
    """Moves the eye that an event is for."""

    def __init__(self) -> None:
        self._drag: Callable[[float, float], None] | None = None
        self._at = (0.0, 0.0)

    @property
    def is_dragging(self) -> bool:
        """Whether the camera follows the pointer now."""
        return self._drag is not None

    def handle(self, event: Pointer, eye: Eye) -> bool:
        """Take an event; whether the camera moved."""
        before, self._at = self._at, (event.x, event.y)
        if event.kind == "wheel":
            eye.zoom(event.wheel, event.pixel)
            return True
        if event.kind == "press":
            self._drag = self._choose(event, eye)
        elif event.kind in ("release", "leave"):
            self._drag = None
        elif self._drag is not None:
            self._drag(event.x - before[0], event.y - before[1])
            return True
        return False

    def _choose(self, event: Pointer, eye: Eye) -> Callable[[float, float], None]:
        def pull(_: float, dy: float) -> None:
            eye.zoom(-dy / (_ZOOM * eye.pixel_ratio))

        if event.button == "right":
            return pull if event.holds("ctrl") else eye.pan
        if event.holds("shift"):
            return eye.pan
        return pull if event.button == "middle" and event.holds("ctrl") else eye.orbit
