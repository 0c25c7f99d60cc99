"""Transfer the active patch: press where its root goes, drag where its axis points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from contact_builtins.tools.drag import Drag, patch_under
from contact_builtins.tools.move import as_seen, heading_to
from contact_core.arrays import FloatArray
from contact_core.contact.placement import Root
from contact_core.document.document import ContactDocument
from contact_core.edit.verbs.group import crowding
from contact_core.errors import ContactError, NotManifold
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.interaction.desk import Desk
from contact_core.interaction.editing import in_order
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, Ghost, Overlay
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture
from contact_core.proposals.draft import Draft
from contact_core.settings import HasSettings, setting

Mirrored: TypeAlias = Literal["auto", "yes", "no"]


@dataclass(frozen=True)
class Transfer(HasSettings):
    """A copy shares the shape: it follows what is done to its original. A press on a patch while none is active,
    or with Ctrl, makes that the active one."""

    name: ClassVar[str] = "transfer"
    summary: ClassVar[str] = "copy the active patch to where you press, along where you drag"
    key: ClassVar[str] = "T"
    hint: ClassVar[str] = (
        "press at the root, drag along the axis; Ctrl takes another patch, Shift mirrors the other way"
    )
    tree: bool = setting(True, help="the descendants of the patch are copied with it")
    pair: bool = setting(True, help="a copy on another surface is paired with its original at once")
    onward: bool = setting(True, help="after a pair, the next patch there that has none yet is the active one")
    mirrored: Mirrored = setting("auto", help="as the mirror image; auto: on another surface, as contact wants it")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        hit, source = self._target(desk, pointer), desk.selection.patch
        if hit is None or source is None or pointer.holds("ctrl"):
            return NOTHING
        try:
            return ghost_of(desk, self, source, hit, _along(desk, source, hit), pointer)
        except ContactError:
            return NOTHING

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        source = desk.selection.patch
        if source is None or pointer.holds("ctrl"):
            found = patch_under(desk, pointer)
            if found is None:
                if source is None and desk.pick(pointer) is not None:
                    desk.remark = "no contact is active, so none is transferred: paint one, or click one first."
                return None
            desk.take(found[0])
            return Gesture()
        hit = self._target(desk, pointer)
        return None if hit is None else Transferring(self, desk, pointer, source, hit)

    def is_mirrored(self, desk: Desk, source: str, surface: str, pointer: Pointer) -> bool:
        """Whether the copy is the mirror image."""
        other = desk.document.patch(source).surface != surface
        wanted = {"yes": True, "no": False, "auto": other}[self.mirrored]
        return wanted != pointer.holds("shift")

    def _target(self, desk: Desk, pointer: Pointer) -> Hit | None:
        return desk.pick(pointer)


class Transferring(Drag):
    """hit: where the root goes. The copy is there from the press on; a drag of more than a few pixels turns it."""

    def __init__(self, tool: Transfer, desk: Desk, pointer: Pointer, source: str, hit: Hit) -> None:
        super().__init__(desk, pointer)
        self.tool, self.source, self.root = tool, source, hit
        self.default = _along(desk, source, hit)
        self.copy, self.copies, self.selected = source, tuple[str, ...](), desk.selection
        self.drag(pointer)

    def move(self, pointer: Pointer) -> None:
        self.drag(pointer)

    def release(self, pointer: Pointer) -> None:
        super().release(pointer)
        self.desk.remark = crowding(self.desk.shown.crowded(self.copies))
        following = _next_unpaired(self.desk.document, self.source) if self.tool.onward else None
        if following is not None:
            self.desk.selection = replace(self.desk.selection, patches=(following,))

    def cancel(self) -> None:
        self.desk.selection = self.selected

    def drag(self, pointer: Pointer) -> None:
        far = float(np.linalg.norm(pointer.pixel - self.start.pixel)) > 6.0 * self.desk.view.pixel_ratio
        end = self.hit(pointer, self.root.surface) if far else None
        draft = self.desk.draft()
        given: dict[str, Any] = {"direction": self.default}
        if end is not None:
            given = self._toward(end.point) or given
        names = draft.patches.transfer_tree(
            self.source, self.root.surface, self.root.point, descendants=self.tool.tree,
            mirrored=self.tool.is_mirrored(self.desk, self.source, self.root.surface, pointer), **given,
        )  # fmt: skip
        self.copy, self.copies = names[self.source], tuple(names.values())
        self.desk.preview(f"Transfer {self.source}", self._paired(draft, names))

    def _toward(self, end: SurfacePoints) -> dict[str, Any]:
        """The heading at the root toward another point, as verbs take it; nothing where the two are one place."""
        shown, surface = self.desk.shown, self.root.surface
        try:
            ends = [shown.on_carrier(surface, point) for point in (self.root.point, end)]
            heading = heading_to(shown.carrier(surface), *ends)
        except NotManifold:  # it gets a proxy when the copy is made
            mesh = shown.mesh(surface)
            return {"direction": end.positions(mesh)[0] - self.root.point.positions(mesh)[0]}
        return {} if heading is None else as_seen(shown, surface, Root.at(ends[0], heading))[1]

    def _paired(self, draft: Draft, names: dict[str, str]) -> Draft:
        if self.tool.pair and self.desk.document.patch(self.source).surface != self.root.surface:
            for name, copy in names.items():
                draft.pairs.add(*in_order(draft.document, name, copy))
        return draft

    def hint(self) -> str:
        return f"{self.copy}: drag along its axis"


def _next_unpaired(document: ContactDocument, source: str) -> str | None:
    """The next patch on the surface of one that is paired now, round and round, that has no pair yet."""
    paired = {end for pair in document.pairs.values() for end in (pair.manipulator, pair.object)}
    names = [name for name, patch in document.patches.items() if patch.surface == document.patch(source).surface]
    after = names.index(source)
    free = (name for name in names[after:] + names[:after] if name not in paired)
    return next(free, None) if source in paired else None


def _along(desk: Desk, source: str, hit: Hit) -> FloatArray:
    """(3,) the direction of the source's axis as it is seen, in the space of the surface that was hit."""
    here = desk.scene.surfaces[desk.document.patch(source).surface]
    root = desk.shown.root(source)
    surface = desk.document.patch(source).surface
    carrier = desk.shown.posed_carrier(surface, here.mesh)
    direction = heading_to_direction(carrier, root.point(), np.array([root.heading]))[0]
    there = desk.scene.surfaces[hit.surface]
    return there.surface[:3, :3] @ here.world[:3, :3] @ direction


def ghost_of(desk: Desk, tool: Transfer, source: str, hit: Hit, direction: FloatArray, pointer: Pointer) -> Overlay:
    """The copies before they are made."""
    draft = Draft(desk.document, desk.session.derived, desk.session.rigs, makers=desk.session.makers)
    mirrored = tool.is_mirrored(desk, source, hit.surface, pointer)
    names = draft.patches.transfer_tree(
        source, hit.surface, hit.point, direction=direction, mirrored=mirrored, descendants=tool.tree
    )
    seen, ghosts = desk.scene.surfaces[hit.surface], []
    for name, copy in names.items():
        points = seen.positions(draft.geometry.points(copy))
        ghosts.append(Ghost(points, np.zeros((0, 3), np.int64), desk.document.patch(name).color, 0.6))
    return Overlay(ghosts=tuple(ghosts))
