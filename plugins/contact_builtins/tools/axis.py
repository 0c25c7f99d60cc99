"""Draw the axis of a patch: along what is drawn, or straight between its ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.tools.drag import Drag, shown_handles
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import WHITE, AxisLine, Overlay
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture
from contact_core.settings import HasSettings, setting


@dataclass(frozen=True)
class DrawAxis(HasSettings):
    """Points of the patch stay where they are, and so do its children and partners."""

    name: ClassVar[str] = "axis"
    summary: ClassVar[str] = "draw the axis of the active patch, from its root on"
    key: ClassVar[str] = "W"
    hint: ClassVar[str] = "drag from the root to the end; Shift goes straight"
    every: float = setting(24.0, low=4.0, unit="pixels", help="how far the points that are drawn through lie apart")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return shown_handles(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        hit = desk.pick(pointer)
        if hit is None:
            return None
        active, under = desk.selection.patch, desk.patch_at(hit)
        if active is None or desk.document.patch(active).surface != hit.surface:
            active = under
        if active is None:
            return None
        desk.take(active)
        return DrawingAxis(desk, pointer, active, hit, self.every * desk.view.pixel_ratio)


class DrawingAxis(Drag):
    """every: pixels of the view."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, hit: Hit, every: float) -> None:
        super().__init__(desk, pointer)
        self.patch, self.surface, self.every = patch, hit.surface, every
        self.picks, self.pixels = [hit.point], [pointer.pixel]
        self.end, self.straight = hit, False

    def drag(self, pointer: Pointer) -> None:
        hit = self.hit(pointer, self.surface)
        if hit is None:
            return
        self.end, self.straight = hit, pointer.holds("shift")
        if np.linalg.norm(pointer.pixel - self.pixels[-1]) >= self.every:
            self.picks.append(hit.point)
            self.pixels.append(pointer.pixel)

    def release(self, pointer: Pointer) -> None:
        if (pointer.x, pointer.y) == (self.start.x, self.start.y):
            return
        self.drag(pointer)
        self.desk.stroke.patches.set_axis(self.patch, self.drawn())

    def drawn(self) -> SurfacePoints:
        """The picks: the first and the last, and those between unless the axis goes straight."""
        between = [] if self.straight else self.picks[1:]
        return SurfacePoints.concatenate([self.picks[0], *between, self.end.point])

    def overlay(self) -> Overlay:
        at = self.scene.surfaces[self.surface].positions(self.drawn())
        return Overlay(axes=(AxisLine(at, WHITE, arrow=True),))
