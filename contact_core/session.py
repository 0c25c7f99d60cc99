"""The session: a document that is being edited, with its meshes, history, journal, plugins and, perhaps, a host."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from contact_core.atomic_file import is_there
from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.edit.command import Command
from contact_core.edit.command_table import BUILT_IN_COMMANDS
from contact_core.edit.commands import SetExtra
from contact_core.edit.derived import Derived
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.history import History, Step
from contact_core.edit.listeners import DocumentChanged, Listener, Listeners
from contact_core.edit.open_document import OpenDocument, real_path
from contact_core.edit.open_edits import OpenEdits
from contact_core.edit.open_macro import OpenMacro
from contact_core.edit.operation_log import log_when_asked
from contact_core.edit.recovery import journal_path
from contact_core.edit.stroke import Stroke
from contact_core.edit.verbs import ContactSets, Film, Pairs, Patches
from contact_core.errors import CommandRejected, FileRefused
from contact_core.grasping.verbs import GraspingSession
from contact_core.plugins.makers import PluginMakers
from contact_core.plugins.registry import COMMANDS, GEODESIC_ENGINES
from contact_core.scene.surfaces import SceneSurfaces

if TYPE_CHECKING:
    from contact_core.document.asset import Asset
    from contact_core.geometry.engine import GeodesicEngine
    from contact_core.plugins.manager import PluginManager
    from contact_core.proposals.proposal import Ghost
    from contact_core.rig.pose_keys import PoseKeys
    from contact_core.rig.rig import Pose
    from contact_core.scene.binding import Binding
    from contact_core.scene.link import HostLink

log = logging.getLogger(__name__)


__all__ = ["DocumentChanged", "Session"]


class Session(GraspingSession):
    """Edits one document: the verbs stand in groups, and each commits one undo step.

    patches: paint, move, bend, link, transfer. pairs: which patches are to touch. surfaces: meshes and rigs behind
    names. sets: save and load contacts. geometry: where everything is now; it reads and never edits. rigs: by
    surface. host: the scene, None without. timeline: keys, spans, and the frame that is shown.

    document: to start from, empty by default. host: the scene in which the document lives; surfaces that the
    document knows are bound to its objects at once, with their meshes and rigs. objects: ids or names of further
    objects that become surfaces, None for all where the document knows none. surfaces: object ids by surface, for
    those that cannot be told. plugins: a manager to share, or modules or objects with hook implementations, of
    highest precedence; discover: whether entry points are read. engine: the geodesic engine, or its name, that
    measures the coordinates of painted points; the exact one by default. notes: what was found while that was read
    of which this session is; `notes` goes on with them.

    Use `Session.open` for a document file, and `surfaces.add` for every mesh. `stroke` gathers a drag into one
    step, `macro` several verbs. Use it as a context manager, or call `close`. It is for one thread at a time: while
    one is in an edit, a stroke or a macro, what another thread commits is refused in words.
    """

    def __init__(
        self,
        document: ContactDocument | None = None,
        *,
        host: Any = None,
        objects: Iterable[str] | None = (),
        surfaces: Mapping[str, str] | None = None,
        plugins: PluginManager | Iterable[object] = (),
        discover: bool = True,
        engine: str | GeodesicEngine | None = None,
        notes: Iterable[str] = (),
    ) -> None:
        self.history = History(document or ContactDocument())
        self.rigs = {}
        self._derived = Derived()
        self._listeners = Listeners()
        self._listeners.listen(self._tell_plugins)
        self._file: OpenDocument | None = None
        self._opening_notes: tuple[str, ...] = tuple(notes)
        self._ended: str | None = None  # why nothing can be edited any more
        self._open_edits = OpenEdits()
        self._plugins: PluginManager | None = None if isinstance(plugins, Iterable) else plugins
        self._plugin_arguments = (tuple(plugins) if isinstance(plugins, Iterable) else (), discover)
        self.makers = PluginMakers(lambda: self.plugins)
        self._derived.proxy_of = self.makers.named_proxy
        self.geometry = DocumentGeometry(lambda: self.document, self._derived, self.rigs)
        self.patches, self.pairs, self.sets = Patches(self), Pairs(self), ContactSets(self)
        self.surfaces, self.timeline = SceneSurfaces(self), Film(self)
        if isinstance(engine, str):
            self._derived.engine = self.plugins.get(GEODESIC_ENGINES, engine)
        elif engine is not None:
            self._derived.engine = engine
        self.host = host
        self._binding: Binding | None = None
        self._host_link: HostLink | None = None
        if host is not None:
            from contact_core.scene.link import HostLink

            link = HostLink(self, host)
            if document is None:
                self.history = link.stored_history() or self.history
            else:
                self.history = link.joined_history(document, "the document that was given") or self.history
            self.history = self._bound(self.history, surfaces, objects)
            link.listen()  # last: a session that refuses its document leaves nothing behind in the host
            self._host_link = link
        log_when_asked(self)

    def _bound(
        self, history: History, told: Mapping[str, str] | None = None, objects: Iterable[str] | None = ()
    ) -> History:
        """A history that begins with its surfaces bound to the scene: opening is no edit, and writes nothing."""
        document = self.binding.bind(history.document, told)
        chosen = None if objects is None else tuple(objects)
        if chosen or (objects is None and not document.surfaces):
            document = self.binding.with_objects(document, chosen)
        for name, found in self.binding.surfaces.items():
            self._derived.bring(found.asset.mesh)
            if found.rig is not None:
                self.rigs[name] = found.rig
        return history if document is history.document else History(document, history.revision)

    @classmethod
    def of_assets(cls, assets: Mapping[str, Asset], **arguments: Any) -> Session:
        """A session on a new document with a surface for each asset, by name. arguments: as for Session."""
        from contact_core.scene.binding import surface_of

        surfaces = {name: surface_of(name, asset) for name, asset in assets.items()}
        told = [f"{name}: {note}" for name, asset in assets.items() for note in asset.notes]
        session = cls(ContactDocument(surfaces=FrozenMap(surfaces)), notes=told, **arguments)
        for name, asset in assets.items():
            session._derived.bring(asset.mesh)
            if asset.rig is not None:
                session.rigs[name] = asset.rig
        return session

    # -- files ---------------------------------------------------------------------------------------------------

    @classmethod
    def open(cls, path: Path | str, **arguments: Any) -> Session:
        """A session on a document file, new where there is none, with lock and journal beside it.

        An interrupted journal is replayed, and `notes` says so. Where another process has the document, the session
        is read-only, and `notes` says who. arguments: as for Session. In a host that keeps documents, the file is
        only read, and the contacts live on in the scene. Raises FileRefused, also where the scene holds others.
        """
        session = cls(**arguments)
        try:
            commands = BUILT_IN_COMMANDS
            if is_there(journal_path(real_path(Path(path)))):  # it may hold commands of plugins
                commands = session.plugins.offers(COMMANDS)
            session._start_from(*OpenDocument.open(Path(path), commands))
        except BaseException:
            session.close()
            raise
        return session

    def _start_from(self, file: OpenDocument, history: History) -> None:
        """Go on with a document file, or, in a host that keeps documents, with its content."""
        self._file = file
        if self._host_link is None or not self._host_link.stores:
            self.history = history
            return
        joined = self._host_link.joined_history(history.document, file.path.name)
        self.history = self._bound(joined or History(history.document))
        self._file = None
        self._opening_notes = (
            *file.notes,
            f"the contacts of {file.path.name} live in the scene now; the file stays as it is.",
        )
        file.close(in_order=history.is_clean)

    @property
    def path(self) -> Path | None:
        """The document file, None before the first save."""
        return self._file.path if self._file is not None else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what opening the file or the scene found, and on surfaces that got proxies since."""
        own = self._file.notes if self._file is not None else ()
        scene = self._binding.notes if self._binding is not None else ()
        before = {surface.carrier_digest for surface in self.history.base.surfaces.values()}
        proxied = tuple(
            f"the contacts of {surface.name!r} run on a proxy now, a closed surface near its mesh"
            f" ({surface.proxy.maker or 'brought by hand'})."
            for surface in self.document.surfaces.values()
            if surface.proxy is not None and surface.carrier_digest not in before
        )
        return self._opening_notes + own + scene + proxied

    @property
    def read_only(self) -> bool:
        """Whether someone else has the document, so that nothing can be committed here."""
        return self._file is not None and self._file.read_only is not None

    def save(self, path: Path | str | None = None) -> Path | None:
        """Write the document, atomically; returns the document file. With a new path the session goes on there.

        In a host that keeps documents, the host's own file is written instead, where it came from or at a path with
        one of the host's suffixes, and None is returned. Raises FileRefused; what is on the disk is then untouched.
        """
        if self._ended is not None:
            raise FileRefused(self._ended)
        if self._file is None and self._host_link is not None and self._host_link.saves(path):
            with self._open_edits.alone():
                self._host_link.save(path)
                self.history.mark_clean()
            return None
        target = real_path(Path(path)) if path is not None else self.path
        if target is None:
            raise FileRefused("this document has no file yet: save it with a path.")
        with self._open_edits.alone():
            if self._file is not None and target == self.path and not self.read_only:
                self._file.save(self.history)
            else:
                before, self._file = self._file, OpenDocument.create(target, self.history)
                if before is not None:
                    with _warned():
                        before.close(in_order=True)
            self.history.mark_clean()
        return target

    def close(self, *, discard: bool = False) -> None:
        """End in order and let go of lock and host. Edits that were not saved stay in the journal, and the next
        opening brings them back, unless `discard` says that they are not wanted.

        Raises FileRefused where the end could not be recorded; everything is let go of all the same.
        """
        link, self._host_link = self._host_link, None
        try:
            if link is not None:
                link.close()
        finally:
            self.host, self._binding = None, None  # the scene ends with its last holder
            if self._file is not None:
                self._file.close(in_order=discard or self.history.is_clean)

    def end(self, reason: str) -> None:
        """Close, and refuse what comes with this sentence: the scene that was edited is there no more. What was
        not saved goes with the scene, as all else in it; what is under way is abandoned."""
        with self._open_edits.alone():
            self._open_edits.abandon()
            self._ended = reason
        self.close(discard=True)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- commands ------------------------------------------------------------------------------------------------

    @property
    def document(self) -> ContactDocument:
        """The document as it is now, at the frame that is shown; within a macro, as the commands so far made it."""
        return self.timeline.shown(self.timed_document)

    @property
    def timed_document(self) -> ContactDocument:
        """The document with its tracks and spans; `document` is what it comes to at the frame that is shown."""
        return self._open_edits.document or self.history.document

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    @property
    def binding(self) -> Binding:
        """Which objects of the host stand behind the surfaces of the document; empty without a host."""
        if self._binding is None:
            from contact_core.scene.binding import Binding

            self._binding = Binding(self.host)
        return self._binding

    @property
    def plugins(self) -> PluginManager:
        """The plugins of this session, found at the first use."""
        if self._plugins is None:
            from contact_core.plugins.manager import PluginManager

            given, discover = self._plugin_arguments
            self._plugins = PluginManager(given, discover=discover)
        return self._plugins

    @property
    def revision(self) -> int:
        """Revision of the committed document; it grows by one with each command."""
        return self.history.revision

    def do(
        self,
        command: Command,
        *,
        origin: str = "user",
        merge: bool = False,
        keys: Mapping[float, Mapping[str, Pose]] | None = None,
        curves: Mapping[str, PoseKeys] | None = None,
    ) -> None:
        """Commit a command. It is in the journal when this returns.

        merge: where the command before agrees, both become one undo step; not inside a host with undo, whose own
        steps cannot be joined: use a stroke there. keys: by frame, poses by surface that are keyed in the scene,
        curves: by surface, cubic keys that it gets, in the same undo step. Raises CommandRejected, or FileRefused
        when it cannot be recorded; then nothing has changed.
        """
        with self._open_edits.alone():
            self._check_writable()
            command = self.timeline.keyed(command)
            if self._open_edits.macro is not None:
                self._open_edits.macro.do(command)
                return
            self._commit(command, origin, merge, keys, curves)

    def _commit(
        self,
        command: Command,
        origin: str = "user",
        merge: bool = False,
        keys: Mapping[float, Mapping[str, Pose]] | None = None,
        curves: Mapping[str, PoseKeys] | None = None,
    ) -> None:
        """Do what `do` says of a command that keys what has tracks."""
        with self._open_edits.alone():
            host_keeps_steps = self._host_link is not None and self._host_link.has_undo
            if self._host_link is not None:
                self._host_link.check_unchanged()
            self._check_not_ended()  # asking the host, it may have found that the scene is gone
            step = self.history.prepare(command, origin, merge=merge and not host_keeps_steps)
            before = self.history.document
            with self._in_host(step.command.label(), before, step.after, step.revision):
                for frame, poses in (keys or {}).items():
                    self.binding.write(poses, frame)
                for name, found in (curves or {}).items():
                    self.binding.write_curves(name, found)
                if self._file is not None:
                    self._file.did(step)
                self.history.commit(step)
            self._tell("do", before, step.after, step.command, origin)

    def set_extra(self, namespace: str, value: Any) -> None:
        """Keep JSON data of a host or a plugin in the document."""
        self.do(SetExtra(namespace, value))

    def undo(self) -> None:
        """Undo one step. With a host that has undo, it is the host's step that is undone."""
        if self._host_link is not None and self._host_link.has_undo:
            self._check_idle()
            self._host_link.undo()
        else:
            self._go("undo")

    def redo(self) -> None:
        """Redo one step, the host's in a host that has undo."""
        if self._host_link is not None and self._host_link.has_undo:
            self._check_idle()
            self._host_link.redo()
        else:
            self._go("redo")

    def goto(self, revision: int, *, origin: str = "user") -> None:
        """Make the document of a revision current. Raises CommandRejected where the history does not hold it."""
        self._go("goto", revision, origin)

    def _go(self, kind: Literal["undo", "redo", "goto"], revision: int = 0, origin: str = "user") -> None:
        with self._open_edits.alone():
            if origin == "host":
                self._open_edits.abandon()
            else:
                self._check_idle()
            before, came_from = self.history.document, self.revision
            step: Step | None = None
            if kind == "goto":
                self.history.goto(revision)
            else:
                step = self.history.undo() if kind == "undo" else self.history.redo()
            try:
                self._record_move(before, origin)
            except BaseException:
                self.history.goto(came_from)
                raise
            command = step.command if step is not None else None
            self._tell(kind, before, self.history.document, command, origin)

    def _record_move(self, before: ContactDocument, origin: str) -> None:
        """Tell host and journal where the history went, the host only when it was not the one who asked."""
        title = f"Go to revision {self.revision}"
        after = self.history.document
        with _warned() if origin == "host" else self._in_host(title, before, after, self.revision):
            if self._file is not None:
                self._file.went(self.revision)

    def adopt(self, history: History) -> None:
        """Go on with another history: the host brought a document that this one does not know."""
        with self._open_edits.alone():
            self._open_edits.abandon()
            before, self.history = self.history.document, self._bound(history)
            if self._file is not None:
                with _warned():
                    self._file.restart(history)
            self._tell("goto", before, self.history.document, None, "host")

    @contextlib.contextmanager
    def macro(self, title: str) -> Iterator[Session]:
        """Everything done inside is one undo step; an exception takes all of it back. A macro within a macro is
        part of it, and an exception takes that part back."""
        with self._open_edits.alone():
            self._check_writable()
            if self._open_edits.macro is not None:
                with self._open_edits.macro.part():
                    yield self
                return
            macro = self._open_edits.macro = OpenMacro(title, self.history.document)
            try:
                yield self
            finally:
                self._open_edits.macro = None
            command = macro.end()
            if command is not None:
                self._commit(command)

    @contextlib.contextmanager
    def stroke(self, seen: ContactDocument | None = None) -> Iterator[Stroke]:
        """A drag: the verbs of the stroke preview from its start, and the last one is committed at the end.

        seen: the document as the scene has it now (`Binding.read`), from which the verbs then start; what they do
        is committed to the document itself.

        What fails, in the drag or in committing it, leaves the document as it was at the start, and listeners see
        that again.
        """
        with self._open_edits.alone():
            self._check_writable()
            start = self.document
            stroke = Stroke(self, lambda shown: self._preview(start, shown), seen)
            self._open_edits.stroke = stroke
            try:
                yield stroke
                command, self._open_edits.stroke = stroke.end(), None
                if command is not None:
                    self.do(command)
            except BaseException:
                if stroke.command is not None and self.document is start:
                    self._preview(start, start)
                raise
            finally:
                stroke.end()
                self._open_edits.stroke = None

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` after every change and preview, in their order; the returned function stops that."""
        return self._listeners.listen(listener)

    def draw(self, path: Path | str, *surfaces: str, size: tuple[int, int] = (1280, 720), **view: Any) -> Path:
        """Draw surfaces, all by default, with their patches and poses into a PNG; returns its path.

        size: pixels. view: camera_from, up, caption, colors, see_through, as for `scene.document_picture`. Raises
        InvalidInput where no renderer can, and FileRefused.
        """
        from contact_core.plugins.drawing import draw
        from contact_core.scene.document_picture import document_picture

        picture = document_picture(self.geometry, surfaces, **view)
        draw([picture], Path(path), self.plugins, size=size)
        return Path(path)

    def show_ghost(self, ghost: Ghost | None) -> None:
        """Tell listeners of a preview of what is proposed; None: back to the document."""
        self._preview(self.document, self.document if ghost is None else ghost.ghost)

    # -- inside --------------------------------------------------------------------------------------------------

    def _check_writable(self) -> None:
        self._check_not_ended()
        if self._file is not None and self._file.read_only is not None:
            raise CommandRejected(self._file.read_only)
        self._open_edits.check_no_stroke()

    def _check_not_ended(self) -> None:
        if self._ended is not None:
            raise CommandRejected(self._ended)

    def _check_idle(self) -> None:
        self._check_writable()
        self._open_edits.check_nothing()

    @contextlib.contextmanager
    def _in_host(
        self, label: str, before: ContactDocument, after: ContactDocument, revision: int
    ) -> Iterator[None]:
        """One undo step of the host in which document and scene change together."""
        if self._host_link is None:
            yield
            return
        with self._host_link.recording(label, after, revision):
            self.binding.follow(self.timeline.shown(before), self.timeline.shown(after))
            yield

    def _tell_plugins(self, change: DocumentChanged) -> None:
        """Plugins hear what is committed, from the first commit on, whether or not they were asked for before."""
        if change.kind not in ("preview", "frame"):
            self.plugins.notify(
                "contact_document_changed", document=change.after, revision=change.revision, origin=change.origin
            )

    def frame_changed(self, before: ContactDocument) -> None:
        """Tell listeners that another frame is shown. before: the document at the frame before it."""
        if self.document is not before:
            change = DocumentChanged("frame", before, self.document, self.revision, None, "user")
            self._listeners.tell(change)

    def _tell(
        self,
        kind: Literal["do", "undo", "redo", "goto"],
        before: ContactDocument,
        after: ContactDocument,
        command: Command | None,
        origin: str,
    ) -> None:
        """Tell listeners what changed, at the frame that is shown."""
        shown = self.timeline.shown(before), self.timeline.shown(after)
        self._listeners.tell(DocumentChanged(kind, *shown, self.revision, command, origin))

    def _preview(self, start: ContactDocument, shown: ContactDocument) -> None:
        self._listeners.tell(DocumentChanged("preview", start, shown, self.revision, None, "user"))


@contextlib.contextmanager
def _warned() -> Iterator[None]:
    """What a file refuses is written down and stops nothing: the host went there already, or the document lives on
    elsewhere."""
    try:
        yield
    except FileRefused as error:
        log.warning("%s", error)
