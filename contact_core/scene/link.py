"""A session inside a host: the document travels in the host's file, and the host's undo moves the history."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from contact_core.document.document import ContactDocument
from contact_core.document.parts import NO_PARTS, DocumentParts
from contact_core.document.schema import VERSION
from contact_core.edit.history import History
from contact_core.errors import CommandRejected, FileRefused
from contact_core.scene.host import DocumentStamp, DocumentStorage, HostAdapter, SceneLifetime, Undo


class FollowingSession(Protocol):
    """What the link asks of a session."""

    @property
    def history(self) -> History: ...

    @property
    def revision(self) -> int: ...

    def goto(self, revision: int, *, origin: str = "user") -> None: ...

    def adopt(self, history: History) -> None: ...

    def end(self, reason: str) -> None: ...


class HostLink:
    """Keeps a host and a session in step, by what the host can do: storing documents, undo, neither.

    The host stores the document in parts under a stamp: its revision and the digest of its content. What a session
    last saw in the host is known by both: a revision alone is a number that another session may have used, too.
    After an undo of the host, foreign steps included, the session goes to what the host holds; a document that the
    history does not know becomes its new beginning.
    """

    def __init__(self, session: FollowingSession, host: HostAdapter) -> None:
        self._session = session
        self._storage = host if isinstance(host, DocumentStorage) else None
        self._undo = host if isinstance(host, Undo) and self._storage is not None else None
        self._lifetime = host if isinstance(host, SceneLifetime) else None
        self._stops: list[Callable[[], None]] = []
        self._began_in_host = False  # the history starts at a document that the host stored
        self._digests: dict[int, str] = {}  # by revision, of what was stored or found in the host
        self._found = NO_PARTS  # of the document that was found in the host last
        self._parts = NO_PARTS  # of the document that was stored or found last

    def listen(self) -> None:
        """Follow the host's undo, and end with its scene, from now on until `close`."""
        if self._undo is not None:
            self._stops.append(self._undo.on_undo(self.follow))
        if self._lifetime is not None:
            self._stops.append(self._lifetime.on_close(self._scene_closed))

    def _scene_closed(self) -> None:
        self._session.end(
            "this session has ended with its scene, which was closed: begin one in the scene now open."
        )

    @property
    def has_undo(self) -> bool:
        """Whether undo and redo are the host's."""
        return self._undo is not None

    @property
    def stores(self) -> bool:
        """Whether the host keeps the document."""
        return self._storage is not None

    def stored_history(self) -> History | None:
        """A history that starts at the document in the host, None where there is none.

        Raises FileRefused for one that is damaged or that a newer release wrote; it stays untouched.
        """
        stamp = self._stamp()
        self._began_in_host = stamp is not None
        if stamp is None:
            return None
        if stamp.schema > VERSION:
            raise FileRefused(
                f"the scene holds a document of schema version {stamp.schema}, but this release reads up to"
                f" {VERSION}: install a newer contact-core. It is left untouched."
            )
        self._found = self._parts = self._stored_parts()
        self._digests = {stamp.revision: stamp.digest}
        return History(self._parts.document, stamp.revision)

    def joined_history(self, document: ContactDocument, origin: str) -> History | None:
        """The history in the host for a session that brings a document of its own, None where the host has none.

        origin: what the document is called in words. Raises FileRefused where the host holds other contacts: one
        would overwrite the other.
        """
        history, stamp = self.stored_history(), self._stamp()
        if stamp is not None and DocumentParts.of(document).digest != stamp.digest:
            raise FileRefused(
                f"the scene holds contacts of its own, and {origin} holds others: open the scene's with"
                " Session(host=host), and bring the others in with sets.read."
            )
        return history

    def check_unchanged(self) -> None:
        """The host holds what this session knows, so that an edit overwrites nothing unseen.

        Raises CommandRejected where another session or script has stored contacts there; the session goes on with
        those.
        """
        stamp = self._stamp()
        if stamp is None or (stamp.revision == self._session.revision and self._knows(stamp)):
            return
        self.follow()
        raise CommandRejected(
            "another session or a script has changed the contacts in this scene: they have been read again, and"
            " this edit was not made. Look at them, and make it again."
        )

    @contextlib.contextmanager
    def recording(self, label: str, document: ContactDocument, revision: int) -> Iterator[None]:
        """One host undo step in which what the document changes is stored and the caller commits."""
        if self._storage is None:
            yield
            return
        parts, change = self._held_parts().to(document)
        with self._undo.step(label) if self._undo is not None else contextlib.nullcontext():
            self._storage.store_document(DocumentStamp(revision, parts.digest, VERSION), change.put, change.removed)
            yield
        self._parts, self._digests[revision] = parts, parts.digest

    def undo(self) -> None:
        """The host's undo. Raises CommandRejected when the host has nothing to undo."""
        if self._undo is None or not self._undo.undo():
            raise CommandRejected("there is nothing to undo.")
        self.follow()

    def redo(self) -> None:
        """The host's redo. Raises CommandRejected when the host has nothing to redo."""
        if self._undo is None or not self._undo.redo():
            raise CommandRejected("there is nothing to redo.")
        self.follow()

    def follow(self) -> None:
        """Go to the document that the host holds now."""
        session, stamp = self._session, self._stamp()
        if stamp is None and self._began_in_host:  # undone past the beginning of all that was ever stored
            self._began_in_host = False
            session.adopt(History(ContactDocument()))
            return
        revision = stamp.revision if stamp is not None else session.history.base_revision
        known = stamp is None or self._knows(stamp)
        if known and revision == session.revision:
            return
        if known and session.history.holds(revision):
            session.goto(revision, origin="host")
            return
        found = self.stored_history()
        session.adopt(found if found is not None else History(ContactDocument(), revision))

    def _stamp(self) -> DocumentStamp | None:
        return self._storage.stored_stamp() if self._storage is not None else None

    def _knows(self, stamp: DocumentStamp) -> bool:
        """Whether this session stored or read just that."""
        return self._digests.get(stamp.revision) == stamp.digest

    def _held_parts(self) -> DocumentParts:
        """The parts of what the host holds now; an undo may have led to another document of the history.

        Raises FileRefused where it is damaged.
        """
        stamp, history = self._stamp(), self._session.history
        if stamp is None:
            return NO_PARTS
        for known in (self._parts, self._found):
            if known.digest == stamp.digest:
                return known
        if history.holds(stamp.revision):
            parts, _ = self._parts.to(history.document_at(stamp.revision))
            if parts.digest == stamp.digest:
                return parts
        return self._stored_parts()

    def _stored_parts(self) -> DocumentParts:
        """What the host holds, read whole. Raises FileRefused where it is damaged or of a newer schema."""
        stored = self._storage.stored_document() if self._storage is not None else None
        return NO_PARTS if stored is None else stored.read("the document in the scene")

    def saves(self, path: Path | str | None) -> bool:
        """Whether the host keeps the document, and writes files of that name."""
        if self._storage is None:
            return False
        return path is None or Path(path).suffix.lower() in self._storage.suffixes

    def save(self, path: Path | str | None) -> None:
        """Have the host write its file. Raises FileRefused."""
        assert self._storage is not None  # `saves` said so
        self._storage.save(None if path is None else Path(path))

    def close(self) -> None:
        """Stop listening to the host."""
        for stop in self._stops:
            stop()
        self._stops.clear()
