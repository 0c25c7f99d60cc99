"""What the tools share: a drag over one surface as it was seen at the press, and handles on axes."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from contact_core.errors import ContactError
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, Handle, Overlay
from contact_core.interaction.seen import Hit, SeenSurface
from contact_core.interaction.tool import Gesture
from contact_core.interaction.view import shows


class Drag(Gesture):
    """From the press to wherever the pointer is: the preview starts anew from the document at the press each time.

    A pointer that is back where it was pressed is no edit. Where a move is refused or meets nothing, what was shown
    before stays, and is what a release there commits.
    """

    def __init__(self, desk: Desk, pointer: Pointer) -> None:
        self.desk, self.start, self.scene = desk, pointer, desk.scene
        self._last: tuple[object, ...] = ()

    def move(self, pointer: Pointer) -> None:
        now = pointer.x, pointer.y, pointer.modifiers
        if now == self._last:  # let go where it was: what is shown is what the pointer asks for, pose and all
            return
        self._last = now
        if (pointer.x, pointer.y) == (self.start.x, self.start.y):
            self.desk.preview_nothing()
        else:
            self.drag(pointer)

    def release(self, pointer: Pointer) -> None:
        try:
            self.move(pointer)
        except ContactError:
            if self.desk.command is None:
                raise

    @abstractmethod
    def drag(self, pointer: Pointer) -> None:
        """Preview what the pointer's position asks for."""

    def hit(self, pointer: Pointer, surface: str) -> Hit | None:
        """What is under the pointer on a surface where it was at the press: a hand that follows leads no drag."""
        return self.scene.pick(self.desk.view, pointer.pixel, (surface,))


def patch_under(desk: Desk, pointer: Pointer) -> tuple[str, Hit] | None:
    """The patch under the pointer, and where; one that is selected before others that lie there too."""
    hit = desk.pick(pointer)
    if hit is None:
        return None
    patch = desk.patch_at(hit)
    return None if patch is None else (patch, hit)


def root_handle(desk: Desk, patch: str) -> Handle | None:
    """The handle at the root of a patch; None where its surface is not worked on."""
    seen = _worked_on(desk, patch)
    if seen is None:
        return None
    return Handle("root", "root", seen.positions(desk.shown.axis_points(patch))[0])


def axis_handles(desk: Desk, patch: str) -> tuple[tuple[int, Handle], ...]:
    """Handles on the axis of a patch with the axis points where they are: root, end, and interior points that stay
    `handle_gap` pixels apart on the screen. None where its surface is not worked on."""
    seen = _worked_on(desk, patch)
    if seen is None:
        return ()
    at = seen.positions(desk.shown.axis_points(patch))  # (m, 3)
    screen = desk.view.project(at)[:, :2]
    gap, last = desk.settings.handle_gap * desk.view.pixel_ratio, len(at) - 1
    chosen = [0]
    for point in range(1, last):
        if all(np.linalg.norm(screen[point] - screen[other]) >= gap for other in (chosen[-1], last)):
            chosen.append(point)
    if last > 1 and len(chosen) == 1:  # so close that no point has room: the one in the middle serves
        chosen.append(last // 2)
    handles = [(0, Handle("root", "root", at[0]))]
    handles += [(point, Handle(f"bend {point}", "bend", at[point], radius=6.0)) for point in chosen[1:]]
    return (*handles, (last, Handle("end", "end", at[last], radius=5.0))) if last else tuple(handles)


def _worked_on(desk: Desk, patch: str) -> SeenSurface | None:
    """The surface of a patch; None where it is not loaded or shown, or where tools work on another. A patch and
    what it meets lie in one place, so a handle of the one would take presses that are meant for the other."""
    name = desk.document.patch(patch).surface
    return desk.scene.surfaces.get(name) if shows(desk.view, name) and desk.worked_on in (None, name) else None


def shown_handles(desk: Desk) -> Overlay:
    """The handles of the active patch."""
    patch = desk.selection.patch
    if patch is None or patch not in desk.document.patches:
        return NOTHING
    return Overlay(handles=tuple(handle for _, handle in axis_handles(desk, patch)))
