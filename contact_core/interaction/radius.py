"""The radius of a brush, set by the pointer alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contact_core.interaction.events import Pointer
from contact_core.interaction.tool import TOOLS, Gesture

if TYPE_CHECKING:
    from contact_core.interaction.holding import Holding


class RadiusGesture(Gesture):
    """The radius of the brush by moving the pointer, without a button: twice as large every 120 pixels."""

    def __init__(self, holding: Holding) -> None:
        self._holding = holding
        self._before = getattr(holding.tool_named(holding.tool), "radius", None)
        self._start: Pointer | None = None
        holding.resize(1.0)  # refuses a tool that has no radius

    def move(self, pointer: Pointer) -> None:
        self._start = self._start or pointer
        doublings = (pointer.x - self._start.x) / (120.0 * self._holding.desk.view.pixel_ratio)
        self.cancel()
        self._holding.resize(2.0 ** min(max(doublings, -6.0), 6.0))

    def cancel(self) -> None:
        self._holding.configure(TOOLS, self._holding.tool, radius=self._before)

    def hint(self) -> str:
        return "move to set the radius, click to keep it"
