"""A session inside a host: the document travels in the host's file, and the host's undo moves the history."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from contact_core.document.document import ContactDocument
from contact_core.document.schema import (
    VERSION,
    document_digest,
    dump_with_digest,
    parse_document,
    stated_digest,
)
from contact_core.edit.history import History
from contact_core.errors import CommandRejected, FileRefused
from contact_core.scene.host import DocumentStorage, HostAdapter, StoredDocument, Undo


class FollowingSession(Protocol):
    """What the link asks of a session."""

    @property
    def history(self) -> History: ...

    @property
    def revision(self) -> int: ...

    def goto(self, revision: int, *, origin: str = "user") -> None: ...

    def adopt(self, history: History) -> None: ...


class HostLink:
    """Keeps a host and a session in step, by what the host can do: storing documents, undo, neither.

    The host stores the document, which states its own digest, and its revision. What a session last saw in the host
    is known by both: a revision alone is a number that another session may have used, too. After an undo of the
    host, foreign steps included, the session goes to what the host holds; a document that the history does not know
    becomes its new beginning.
    """

    def __init__(self, session: FollowingSession, host: HostAdapter) -> None:
        self._session = session
        self._storage = host if isinstance(host, DocumentStorage) else None
        self._undo = host if isinstance(host, Undo) and self._storage is not None else None
        self._stop: Callable[[], None] | None = None
        self._began_in_host = False  # the history starts at a document that the host stored
        self._digests: dict[int, str | None] = {}  # by revision, of what was stored or found in the host

    def listen(self) -> None:
        """Follow the host's undo from now on, until `close`."""
        if self._undo is not None:
            self._stop = self._undo.on_undo(self.follow)

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

        Raises FileRefused for one that a newer release wrote; it stays untouched.
        """
        stored = self._stored()
        self._began_in_host = stored is not None
        if stored is None:
            return None
        if stored.schema > VERSION:
            raise FileRefused(
                f"the scene holds a document of schema version {stored.schema}, but this release reads up to"
                f" {VERSION}: install a newer contact-core. It is left untouched."
            )
        document = parse_document(stored.data, "the document in the scene")
        self._digests = {stored.revision: stated_digest(stored.data)}
        return History(document, stored.revision)

    def joined_history(self, document: ContactDocument, origin: str) -> History | None:
        """The history in the host for a session that brings a document of its own, None where the host has none.

        origin: what the document is called in words. Raises FileRefused where the host holds other contacts: one
        would overwrite the other.
        """
        stored = self._stored()
        if stored is None:
            return None
        history = self.stored_history()
        if document_digest(document) != self._digests[stored.revision]:
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
        stored = self._stored()
        known = self._digests.get(self._session.revision)
        if stored is None or (stored.revision == self._session.revision and stated_digest(stored.data) == known):
            return
        self.follow()
        raise CommandRejected(
            "another session or a script has changed the contacts in this scene: they have been read again, and"
            " this edit was not made. Look at them, and make it again."
        )

    @contextlib.contextmanager
    def recording(self, label: str, document: ContactDocument, revision: int) -> Iterator[None]:
        """One host undo step in which the document is stored and the caller commits."""
        if self._storage is None:
            yield
            return
        data, digest = dump_with_digest(document)
        with self._undo.step(label) if self._undo is not None else contextlib.nullcontext():
            self._storage.store_document(StoredDocument(data, revision, VERSION))
            yield
        self._digests[revision] = digest

    def undo(self) -> None:
        """The host's undo. Raises CommandRejected when the host has nothing to undo."""
        if self._undo is None or not self._undo.undo():
            raise CommandRejected("there is nothing to undo in the host.")
        self.follow()

    def redo(self) -> None:
        """The host's redo. Raises CommandRejected when the host has nothing to redo."""
        if self._undo is None or not self._undo.redo():
            raise CommandRejected("there is nothing to redo in the host.")
        self.follow()

    def follow(self) -> None:
        """Go to the document that the host holds now."""
        session, stored = self._session, self._stored()
        if stored is None and self._began_in_host:  # undone past the beginning of all that was ever stored
            self._began_in_host = False
            session.adopt(History(ContactDocument()))
            return
        revision = stored.revision if stored is not None else session.history.base_revision
        known = stored is None or self._digests.get(revision) == stated_digest(stored.data)
        if known and revision == session.revision:
            return
        if known and session.history.holds(revision):
            session.goto(revision, origin="host")
            return
        found = self.stored_history()
        session.adopt(found if found is not None else History(ContactDocument(), revision))

    def _stored(self) -> StoredDocument | None:
        return self._storage.stored_document() if self._storage is not None else None

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
        if self._stop is not None:
            self._stop()
            self._stop = None
