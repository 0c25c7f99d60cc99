"""The session: a document that is being edited, with its meshes, history, journal, plugins and, perhaps, a host."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro, apply_command, register_command
from contact_core.edit.derived import Derived
from contact_core.edit.history import History, Step
from contact_core.edit.open_document import OpenDocument
from contact_core.edit.recovery import journal_path
from contact_core.edit.stroke import Stroke
from contact_core.errors import CommandRejected, FileRefused
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.proposals.verbs import ProposalVerbs

if TYPE_CHECKING:
    from contact_core.contact.brush import Brush
    from contact_core.host_link import HostLink
    from contact_core.plugins.manager import PluginManager
    from contact_core.proposals.proposal import Proposal

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class DocumentChanged:
    """What listeners are told. kind: "preview" comes during a stroke or shows the
    ghost of a proposal; its revision is that of the start.

    command: the one done, undone or redone; None for a jump or a preview.
    """

    kind: Literal["do", "undo", "redo", "goto", "preview"]
    before: ContactDocument
    after: ContactDocument
    revision: int
    command: Command | None
    origin: str


Listener = Callable[[DocumentChanged], None]


class Session(ProposalVerbs):
    """Edits one document.

    document: to start from, empty by default. plugins: modules or objects with hook implementations, of highest
    precedence; discover: whether entry points are read. Use `Session.open` for a document file, and `add_surface`
    for every mesh. Verbs (`paint`, `translate`, `transfer` ...) commit commands; `stroke` gathers a drag into one,
    `macro` several commands. Use it as a context manager, or call `close`.
    """

    def __init__(
        self,
        document: ContactDocument | None = None,
        *,
        host: Any = None,
        plugins: Iterable[object] = (),
        discover: bool = True,
    ) -> None:
        self.history = History(document or ContactDocument())
        self.known_meshes = {}
        self.rigs = {}
        self._derived = Derived(self.known_meshes)
        self._listeners: list[Listener] = []
        self._file: OpenDocument | None = None
        self._macro: list[Command] | None = None
        self._macro_document: ContactDocument | None = None
        self._in_stroke = False
        self._plugins: PluginManager | None = None
        self._plugin_arguments = (tuple(plugins), discover)
        self.host = host
        self._host_link: HostLink | None = None
        if host is not None:
            from contact_core.host_link import HostLink

            self._host_link = HostLink(self, host)
            if document is None:
                self.history = self._host_link.stored_history() or self.history

    # -- files ---------------------------------------------------------------------------------------------------

    @classmethod
    def open(cls, path: Path | str, **arguments: Any) -> Session:
        """A session on a document file, new where there is none, with lock and journal beside it.

        An interrupted journal is replayed, and `notes` says so. Where another process has the document, the session
        is read-only, and `notes` says who. arguments: as for Session. Raises FileRefused.
        """
        session = cls(**arguments)
        if journal_path(Path(path)).exists():
            session.register_commands()  # a journal may hold commands of plugins
        session._file, session.history = OpenDocument.open(Path(path))
        return session

    @property
    def path(self) -> Path | None:
        """The document file, None before the first save."""
        return self._file.path if self._file is not None else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what opening the file found."""
        return self._file.notes if self._file is not None else ()

    @property
    def read_only(self) -> bool:
        """Whether someone else has the document, so that nothing can be committed here."""
        return self._file is not None and self._file.read_only

    def save(self, path: Path | str | None = None) -> Path:
        """Write the document file, whole or not at all. With a new path the session goes on there.

        Raises FileRefused; what was on the disk is untouched then.
        """
        target = Path(path) if path is not None else self.path
        if target is None:
            raise FileRefused("this document has no file yet: save it with a path.")
        if self._file is not None and target == self.path and not self.read_only:
            self._file.save(self.history)
        else:
            opened = OpenDocument.create(target, self.history)
            if self._file is not None:
                self._file.close(in_order=True)
            self._file = opened
        self.history.mark_clean()
        return target

    def close(self, *, discard: bool = False) -> None:
        """End in order and let go of lock and host. Edits that were not saved stay in the journal, and the next
        opening brings them back, unless `discard` says that they are not wanted."""
        if self._file is not None:
            self._file.close(in_order=discard or self.history.is_clean)
        if self._host_link is not None:
            self._host_link.close()
            self._host_link = None

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- commands ------------------------------------------------------------------------------------------------

    @property
    def document(self) -> ContactDocument:
        """The document as it is now; within a macro, as the commands so far have made it."""
        return self._macro_document if self._macro_document is not None else self.history.document

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    @property
    def revision(self) -> int:
        """Revision of the committed document."""
        return self.history.revision

    def do(self, command: Command, *, origin: str = "user", merge: bool = False) -> int:
        """Commit a command; answers the new revision. It is in the journal when this returns.

        merge: where the command before agrees, both become one undo step; not inside a host with undo, whose own
        steps cannot be joined: use a stroke there. Raises CommandRejected, or FileRefused when it cannot be
        recorded; then nothing has changed.
        """
        if self._macro is not None and self._macro_document is not None:
            self._macro_document = apply_command(command, self._macro_document)
            self._macro.append(command)
            return self.revision
        self._check_writable()
        host_keeps_steps = self._host_link is not None and self._host_link.has_undo
        step = self.history.prepare(command, origin, merge=merge and not host_keeps_steps)
        before = self.history.document
        with self._in_host(step.command.label(), step.after, step.revision):
            if self._file is not None:
                self._file.did(step, merged=step.before is not before)
            self.history.commit(step)
        self._tell(DocumentChanged("do", before, step.after, step.revision, step.command, origin))
        return step.revision

    def submit(self, command: Command, *, origin: str = "user") -> int:
        """Commit what a verb made."""
        return self.do(command, origin=origin)

    def undo(self) -> int:
        """Undo one step; answers the revision. With a host that has undo, it is the host's step that is undone."""
        if self._host_link is not None and self._host_link.has_undo:
            return self._host_link.undo()
        return self._go("undo")

    def redo(self) -> int:
        """Redo one step; answers the revision."""
        if self._host_link is not None and self._host_link.has_undo:
            return self._host_link.redo()
        return self._go("redo")

    def goto(self, revision: int, *, origin: str = "user") -> int:
        """Make the document of a revision current. Raises CommandRejected where the history does not hold it."""
        return self._go("goto", revision, origin)

    def _go(self, kind: Literal["undo", "redo", "goto"], revision: int = 0, origin: str = "user") -> int:
        self._check_writable()
        if self._macro is not None:
            raise CommandRejected("a macro is under way: undo comes after its end.")
        before, came_from = self.history.document, self.revision
        step: Step | None = None
        if kind == "goto":
            self.history.goto(revision)
        else:
            step = self.history.undo() if kind == "undo" else self.history.redo()
        try:
            self._record_move(origin)
        except BaseException:
            self.history.goto(came_from)
            raise
        command = step.command if step is not None else None
        self._tell(DocumentChanged(kind, before, self.history.document, self.revision, command, origin))
        return self.revision

    def _record_move(self, origin: str) -> None:
        """Tell host and journal where the history went, the host only when it was not the one who asked."""
        host_asked = origin == "host"
        title = f"Go to revision {self.revision}"
        with contextlib.nullcontext() if host_asked else self._in_host(title, self.history.document, self.revision):
            if self._file is not None:
                self._file.went(self.revision)

    def adopt(self, history: History) -> None:
        """Go on with another history: the host brought a document that this one does not know."""
        before, self.history = self.history.document, history
        if self._file is not None:
            self._file.restart(history)
        self._tell(DocumentChanged("goto", before, history.document, history.revision, None, "host"))

    @contextlib.contextmanager
    def macro(self, title: str) -> Iterator[Session]:
        """Everything done inside is one undo step; an exception takes all of it back."""
        self._check_writable()
        if self._macro is not None:  # a macro within a macro is part of it
            yield self
            return
        self._macro, self._macro_document = [], self.history.document
        try:
            yield self
            commands = tuple(self._macro)
        finally:
            self._macro = self._macro_document = None
        if commands:
            self.do(commands[0] if len(commands) == 1 else Macro(title, commands))

    @contextlib.contextmanager
    def stroke(self) -> Iterator[Stroke]:
        """A drag: the verbs of the stroke preview from its start, and the last one is committed at the end."""
        self._check_writable()
        start = self.document
        stroke = Stroke(start, self.revision, self._derived, lambda shown: self._preview(start, shown))
        self._in_stroke = True
        try:
            yield stroke
        except BaseException:
            self._in_stroke = False
            stroke.end()
            if stroke.command is not None:
                self._preview(start, start)
            raise
        self._in_stroke = False
        command = stroke.end()
        if command is not None:
            self.do(command)

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` after every change and preview; the returned function stops that."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def show_ghost(self, ghost: Proposal | None) -> None:
        """Tell listeners of a preview of what is proposed; None: back to the document."""
        self._preview(self.document, self.document if ghost is None else ghost.ghost)

    # -- plugins -------------------------------------------------------------------------------------------------

    @property
    def plugins(self) -> PluginManager:
        """The plugins of this session, found at the first use."""
        if self._plugins is None:
            from contact_core.plugins.manager import PluginManager

            given, discover = self._plugin_arguments
            self._plugins = PluginManager(given, discover=discover)
        return self._plugins

    def register_commands(self) -> None:
        """Make the commands of plugins known, so that journals which hold them replay."""
        from contact_core.plugins.registry import COMMANDS

        for command in self.plugins.offers(COMMANDS).values():
            register_command(command)

    def default_axis(self, surface: str, patch: str, points: SurfacePoints, generator: str | None) -> SurfacePoints:
        """Axis points from an axis generator: the one named, or the one that the plugins choose."""
        from contact_core.plugins.registry import AXIS_GENERATORS

        offered = self.plugins.offers(AXIS_GENERATORS)
        if generator is None and offered:
            generator = self.plugins.choose(
                "contact_choose_axis_generator", offered, surface=surface, patch=patch
            ) or next(iter(offered))
        if generator is None:
            return super().default_axis(surface, patch, points, generator)
        return self.plugins.get(AXIS_GENERATORS, generator).generate(self.axis_request(surface, patch, points))

    def named_brush(self, name: str) -> Brush:
        """A brush of this session's plugins. Raises InvalidInput that lists what there is."""
        from contact_core.plugins.registry import BRUSHES

        return self.plugins.get(BRUSHES, name)

    # -- inside --------------------------------------------------------------------------------------------------

    def _check_writable(self) -> None:
        if self.read_only:
            raise CommandRejected(" ".join(self.notes) or "this session is read-only.")
        if self._in_stroke:
            raise CommandRejected("a stroke is under way: end it first.")

    def _in_host(self, label: str, document: ContactDocument, revision: int) -> AbstractContextManager[None]:
        if self._host_link is None:
            return contextlib.nullcontext()
        return self._host_link.recording(label, document, revision)

    def _preview(self, start: ContactDocument, shown: ContactDocument) -> None:
        self._tell(DocumentChanged("preview", start, shown, self.revision, None, "user"))

    def _tell(self, change: DocumentChanged) -> None:
        for listener in tuple(self._listeners):
            try:
                listener(change)
            except Exception:  # a panel that fails to redraw must not take back what is committed
                log.exception("a listener of the session failed on %s", change.kind)
        if self._plugins is not None and change.kind != "preview":
            self._plugins.notify(
                "contact_document_changed", document=change.after, revision=change.revision, origin=change.origin
            )
