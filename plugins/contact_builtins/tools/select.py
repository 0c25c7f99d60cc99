"""Select patches and surfaces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, Overlay
from contact_core.interaction.settings import Selection
from contact_core.interaction.tool import Gesture


@dataclass(frozen=True)
class Select:
    """A click takes the patch under the pointer; Shift adds it or takes it out; Ctrl takes the surface."""

    name: ClassVar[str] = "select"
    summary: ClassVar[str] = "select patches, and the surface that tools work on"
    key: ClassVar[str] = "Q"
    hint: ClassVar[str] = "click a patch; Shift adds, Ctrl takes the surface"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return NOTHING

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        hit = desk.pick(pointer)
        if hit is None:
            return None
        chosen = desk.selection
        patch = desk.patch_at(hit)
        if pointer.holds("ctrl"):
            surface = None if chosen.surface == hit.surface else hit.surface
            desk.selection = replace(chosen, surface=surface)
        elif patch is None:
            desk.selection = replace(chosen, patches=())
        elif not pointer.holds("shift"):
            desk.selection = replace(chosen, patches=(patch,))
        else:
            others = tuple(name for name in chosen.patches if name != patch)
            desk.selection = replace(chosen, patches=others if patch in chosen.patches else (*others, patch))
        return Selecting(desk, chosen)


class Selecting(Gesture):
    """Holding the button changes nothing more; Escape brings the selection back."""

    def __init__(self, desk: Desk, before: Selection) -> None:
        self._desk, self._before = desk, before

    def cancel(self) -> None:
        self._desk.selection = self._before
