"""What a tool finds before it: the session, the scene as it is seen, selection, settings, and one stroke."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import CommandRejected
from contact_core.interaction.events import Pointer
from contact_core.interaction.lock import Locks
from contact_core.interaction.overlay import Handle, handle_under
from contact_core.interaction.seen import Hit, SeenScene
from contact_core.interaction.settings import InteractionSettings, Selection
from contact_core.interaction.view import View, shows
from contact_core.plugins.slot import Slot
from contact_core.proposals.draft import Draft
from contact_core.solve.term import PoseTerm

if TYPE_CHECKING:
    from contact_core.edit.stroke import Stroke
    from contact_core.session import Session


class Desk:
    """See the module. Tools read everything; of the document they change only what `stroke` previews.

    view: of the event that is handled. ghost: a proposal's document, which is shown in place of the session's.
    hidden: surfaces that the scene does not show: they are neither drawn nor picked. locks: what no tool changes.
    pins: terms that pull on hands while a gesture lasts: the pose that follows is the edit. Such a term names its
    `bodies`. held: joints that do not follow meanwhile. settled: whether the gesture itself has posed the
    hand, so that no solve follows it. remark: what is worth knowing of what a gesture did, for the line of status.
    """

    def __init__(self, session: Session, view: View, *, meters_per_unit: float = 1.0) -> None:
        self.session, self.view = session, view
        self.settings = InteractionSettings()
        self.selection = Selection()
        self.scene = SeenScene({}, meters_per_unit)
        self.ghost: ContactDocument | None = None
        self.pins: tuple[PoseTerm, ...] = ()
        self.held: tuple[str, ...] = ()
        self.settled = False
        self.remark = ""
        self.hidden: frozenset[str] = frozenset()
        self.locks = Locks()
        self._base = self._base_of = session.document
        self._stack: contextlib.ExitStack | None = None
        self._stroke: Stroke | None = None
        self._begun_at = session.document
        self._given: dict[tuple[str, str], dict[str, Any]] = {}
        self._made: dict[tuple[str, str], Any] = {}
        self.follow()

    # -- reading ---------------------------------------------------------------------------------------------

    @property
    def document(self) -> ContactDocument:
        """As it is shown now: what the stroke previews, what is proposed, else the session's."""
        if self._stroke is not None:
            return self._stroke.preview_document
        return self.ghost or self.base

    @property
    def base(self) -> ContactDocument:
        """The session's document as the scene had it when it was last looked at; itself without a scene."""
        if self._base_of is not self.session.document:
            self._base_of, self._base = self.session.document, self._read(self.session.document)
        return self._base

    def look(self) -> frozenset[str]:
        """Look at the scene again, where others move things and pose; returns the surfaces that moved."""
        self._base = self._read(self.base)
        return self.follow()

    def _read(self, document: ContactDocument) -> ContactDocument:
        binding = self.session.binding
        return binding.read(document, leave=self.hidden) if binding.has_scene else document

    @property
    def shown(self) -> DocumentGeometry:
        """The geometry of the shown document: axes, roots, points."""
        return self.session.geometry.of(self.document)

    def follow(self) -> frozenset[str]:
        """Bring the scene to the shown document; returns the surfaces that moved."""
        before = self.scene
        self.scene = before.following(
            self.document, self.session.derived.known_meshes, self.session.rigs, self.hidden
        )
        return self.scene.moved_since(before)

    @property
    def worked_on(self) -> str | None:
        """The surface that tools work on, through all others; None for whatever is in front, and in a view that
        does not show it."""
        name = self.selection.surface
        return name if name is not None and name in self.scene.surfaces and shows(self.view, name) else None

    def pick(self, pointer: Pointer, among: Iterable[str] | None = None) -> Hit | None:
        """What is under the pointer: on some surfaces, by default on that which tools work on, through all others,
        or on whatever is in front where there is none such."""
        if among is None and self.worked_on is not None:
            among = (self.worked_on,)
        return self.scene.pick(self.view, pointer.pixel, among)

    def patch_at(self, hit: Hit, reach: float = 0.0) -> str | None:
        """The patch that lies under a hit: the one with the nearest point, where that is no farther than its own
        points lie apart, or `reach`, world units."""
        best, name = np.inf, None
        seen = self.scene.surfaces[hit.surface]
        for patch in self.document.patches.values():
            if patch.surface != hit.surface:
                continue
            at = seen.positions(self.shown.points(patch.name))
            away = np.linalg.norm(at - hit.position, axis=1)
            if len(away) and away.min() < best and away.min() <= max(reach, _spacing(at)):
                best, name = float(away.min()), patch.name
        return name

    def take(self, patch: str) -> None:
        """Make a patch the active one: the only one selected, unless it is selected among others."""
        others = tuple(name for name in self.selection.patches if name != patch)
        kept = others if patch in self.selection.patches else ()
        if self.selection.patches != (*kept, patch):
            self.selection = replace(self.selection, patches=(*kept, patch))

    def handle_at(self, pointer: Pointer, handles: Iterable[Handle]) -> Handle | None:
        """The handle that a press here takes."""
        return handle_under(tuple(handles), self.view, pointer.pixel)

    # -- settings --------------------------------------------------------------------------------------------

    def configure(self, slot: Slot[Any], name: str, **values: Any) -> None:
        """Set settings of a tool, a brush, a solver ...; they hold from now on. Raises InvalidInput."""
        given = {**self._given.get((slot.hook, name), {}), **values}
        self._made[slot.hook, name] = self.session.plugins.make(slot, name, **given)
        self._given[slot.hook, name] = given

    def made(self, slot: Slot[Any], name: str) -> Any:
        """A tool, a brush, a solver ... by name, with its settings as they are now. Raises InvalidInput."""
        if (slot.hook, name) not in self._made:
            self._made[slot.hook, name] = self.session.plugins.make(slot, name)
        return self._made[slot.hook, name]

    def given(self, slot: Slot[Any], name: str) -> Mapping[str, Any]:
        """The settings that were set, by name."""
        return self._given.get((slot.hook, name), {})

    # -- the stroke ------------------------------------------------------------------------------------------

    @property
    def stroke(self) -> Stroke:
        """The stroke of the gesture: its verbs preview, from the document at the press. Opened when first asked
        for; raises CommandRejected where the session cannot be edited."""
        if self._stroke is None:
            with contextlib.ExitStack() as stack:
                self._begun_at = self.session.document
                self._stroke = stack.enter_context(self.session.stroke(self.base))
                self._stack = stack.pop_all()
        return self._stroke

    @property
    def command(self) -> Command | None:
        """What the stroke would commit now."""
        return None if self._stroke is None else self._stroke.command

    @property
    def edit(self) -> Command | None:
        """What the gesture previews now, without the pose that follows it."""
        return None if self._stroke is None else self._stroke.edit

    def preview_nothing(self) -> None:
        """Show the document of the press again: a drag that came back is nothing."""
        if self._stroke is not None and self._stroke.command is not None:
            self._stroke.cancel()

    def check_locks(self) -> None:
        """Raises CommandRejected, and shows the document of the press, where the stroke changes what is locked."""
        if self._stroke is not None and self._stroke.command is not None:
            try:
                self.locks.check(self._stroke.document, self._stroke.preview_document)
            except CommandRejected:
                self._stroke.cancel()
                raise

    def draft(self) -> Draft:
        """A draft for several verbs, from the document at the press, for `preview`."""
        session = self.session
        return Draft(self.stroke.document, session.derived, session.rigs, makers=session.makers)

    def preview(self, title: str, draft: Draft) -> None:
        """Preview what was done to a draft as one step. Raises CommandRejected."""
        self.stroke.do(Macro(title, draft.commands))

    def commit(self) -> None:
        """End the stroke with what it previews, as one step of the session; nothing where it previews nothing."""
        stack, self._stack = self._stack, None
        try:
            if stack is not None:
                stack.close()
        finally:
            self._over()

    def roll_back(self) -> None:
        """End the stroke with nothing: the document is the very one of the press."""
        if self._stroke is not None:
            if self._begun_at is self.session.document:  # else a host went elsewhere, and ended it
                self._stroke.cancel()
            self._stroke.abandon()
        self.commit()

    def _over(self) -> None:
        self._stroke, self.pins, self.held, self.settled = None, (), (), False
        self.follow()


def _spacing(at: Any) -> float:
    """About how far the points (n, 3) of a patch lie apart: twice the median distance to the nearest other."""
    if len(at) < 2:
        return 0.0
    from scipy.spatial import cKDTree

    some = at[:: max(len(at) // 64, 1)]
    return 2.0 * float(np.median(cKDTree(at).query(some, k=2)[0][:, 1]))
