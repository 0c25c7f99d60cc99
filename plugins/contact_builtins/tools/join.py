"""Tools that drag from one patch to another: link a child to its parent, pair what is to touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.tools.drag import patch_under
from contact_core.contact.placement import Link
from contact_core.errors import CommandRejected
from contact_core.interaction.desk import Desk
from contact_core.interaction.editing import in_order
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import ACCENT, NOTHING, AxisLine, Overlay
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture


class Joining(Gesture):
    """A line from the first patch to the pointer; what it ends on decides, in another view as well."""

    crosses: ClassVar[bool] = True

    def __init__(self, desk: Desk, first: str, hit: Hit) -> None:
        self.desk, self.first, self.start, self.end = desk, first, hit.position, hit.position
        self.other: str | None = None

    def move(self, pointer: Pointer) -> None:
        found = self.under(pointer)
        self.other = None if found is None or found[0] == self.first else found[0]
        if found is not None:
            self.end = found[1].position

    def under(self, pointer: Pointer) -> tuple[str, Hit] | None:
        """The patch under the pointer, and where."""
        return patch_under(self.desk, pointer)

    def overlay(self) -> Overlay:
        return Overlay(axes=(AxisLine(np.stack([self.start, self.end]), ACCENT, arrow=True),))

    def hint(self) -> str:
        return f"{self.first} to {self.other}" if self.other else f"{self.first} to ..."


@dataclass(frozen=True)
class LinkPatches:
    """From the child to the parent."""

    name: ClassVar[str] = "link"
    summary: ClassVar[str] = "drag from a patch to its parent; drop it beside every patch to take it off"
    key: ClassVar[str] = "K"
    hint: ClassVar[str] = "drag from the child to the parent; drop it beside to unlink"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return _link_lines(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = patch_under(desk, pointer)
        if found is None:
            return None
        desk.take(found[0])
        return Linking(desk, *found)


class Linking(Joining):
    def release(self, pointer: Pointer) -> None:
        desk, found = self.desk, self.under(pointer)
        if found is not None and found[0] == self.first:
            return
        if found is None:
            if isinstance(desk.document.patch(self.first).placement, Link):
                desk.stroke.patches.unlink(self.first)
            return
        parent, hit = found
        seen = desk.scene.surfaces[hit.surface]
        away = np.linalg.norm(seen.positions(desk.shown.axis_points(parent)) - hit.position, axis=1)
        desk.stroke.patches.link(self.first, parent, parent_point=int(away.argmin()))


@dataclass(frozen=True)
class PairPatches:
    """Along a pair that is there, the drag dissolves it."""

    name: ClassVar[str] = "pair"
    summary: ClassVar[str] = "drag from a patch to the one that it shall touch; again to dissolve the pair"
    key: ClassVar[str] = "P"
    hint: ClassVar[str] = "drag from one patch to the other, on any surface"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return NOTHING

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = _anywhere(desk, pointer)
        if found is None:
            return None
        desk.take(found[0])
        return Pairing(desk, *found)


class Pairing(Joining):
    def under(self, pointer: Pointer) -> tuple[str, Hit] | None:
        return _anywhere(self.desk, pointer, but=self.first)

    def release(self, pointer: Pointer) -> None:
        found, document = self.under(pointer), self.desk.document
        if found is None:
            return
        both = {self.first, found[0]}
        there = [pair.name for pair in document.pairs.values() if {pair.manipulator, pair.object} == both]
        if there:
            self.desk.stroke.pairs.remove(there[0])
            return
        if document.patch(self.first).surface == document.patch(found[0]).surface:
            raise CommandRejected("patches of two surfaces are paired, but both are on one: link them instead.")
        self.desk.stroke.pairs.add(*in_order(document, self.first, found[0]))


def _anywhere(desk: Desk, pointer: Pointer, but: str | None = None) -> tuple[str, Hit] | None:
    """The patch under the pointer on any surface, the nearest to the eye first: through those that hide it."""
    hits = (desk.pick(pointer, (name,)) for name in desk.scene.surfaces)
    found = []
    for hit in hits:
        patch = None if hit is None else desk.patch_at(hit)
        if hit is not None and patch is not None and patch != but:
            found.append((hit.distance, patch, hit))
    if not found:
        return None
    _, patch, hit = min(found, key=lambda each: each[0])
    return patch, hit


def _link_lines(desk: Desk) -> Overlay:
    """A line from every linked patch to its parent."""
    lines = []
    for patch in desk.document.patches.values():
        seen = desk.scene.surfaces.get(patch.surface)
        if isinstance(patch.placement, Link) and seen is not None:
            ends = (desk.shown.axis_points(name)[0] for name in (patch.name, patch.placement.parent))
            lines.append(AxisLine(np.concatenate([seen.positions(end) for end in ends]), patch.color, arrow=True))
    return Overlay(axes=tuple(lines)) if lines else NOTHING
