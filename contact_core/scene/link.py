"""A session inside a host: the document travels in the host's file, and the host's undo moves the history."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from contact_core.document.document import ContactDocument
from contact_core.document.schema import VERSION, dump_document, parse_document
from contact_core.edit.history import History
from contact_core.errors import CommandRejected, FileRefused
from contact_core.scene.host import DocumentStorage, HostAdapter, StoredDocument, Undo

if TYPE_CHECKING:
    from contact_core.session import Session


class HostLink:
    """Keeps a host and a session in step, by what the host can do: storing documents, undo, neither.

    The host stores document and revision. After an undo of the host, foreign steps included, the session goes to
    the revision that the host holds; a document that the history does not know becomes its new beginning.
    """

    def __init__(self, session: Session, host: HostAdapter) -> None:
        self._session = session
        self._storage = host if isinstance(host, DocumentStorage) else None
        self._undo = host if isinstance(host, Undo) and self._storage is not None else None
        self._stop: Callable[[], None] | None = None
        self._began_in_host = False  # the history starts at a document that the host stored

    def listen(self) -> None:
        """Follow the host's undo from now on, until `close`."""
        if self._undo is not None:
            self._stop = self._undo.on_undo(self.follow)

    @property
    def has_undo(self) -> bool:
        """Whether undo and redo are the host's."""
        return self._undo is not None

    def stored_history(self) -> History | None:
        """A history that starts at the document in the host, None where there is none.

        Raises FileRefused for one that a newer release wrote; it stays untouched.
        """
        stored = self._storage.stored_document() if self._storage is not None else None
        self._began_in_host = stored is not None
        if stored is None:
            return None
        if stored.schema > VERSION:
            raise FileRefused(
                f"the scene holds a document of schema version {stored.schema}, but this release reads up to"
                f" {VERSION}: install a newer contact-core. It is left untouched."
            )
        return History(parse_document(stored.data, "the document in the scene"), stored.revision)

    @contextlib.contextmanager
    def recording(self, label: str, document: ContactDocument, revision: int) -> Iterator[None]:
        """One host undo step in which the document is stored and the caller commits."""
        if self._storage is None:
            yield
            return
        stored = StoredDocument(dump_document(document), revision, VERSION)
        with self._undo.step(label) if self._undo is not None else contextlib.nullcontext():
            self._storage.store_document(stored)
            yield

    def undo(self) -> int:
        """The host's undo; answers the revision then. Raises CommandRejected when the host has nothing to undo."""
        if self._undo is None or not self._undo.undo():
            raise CommandRejected("there is nothing to undo in the host.")
        self.follow()
        return self._session.revision

    def redo(self) -> int:
        """The host's redo; answers the revision then. Raises CommandRejected when the host has nothing to redo."""
        if self._undo is None or not self._undo.redo():
            raise CommandRejected("there is nothing to redo in the host.")
        self.follow()
        return self._session.revision

    def follow(self) -> None:
        """Go to the document that the host holds now."""
        session = self._session
        stored = self._storage.stored_document() if self._storage is not None else None
        if stored is None and self._began_in_host:  # undone past the beginning of all that was ever stored
            self._began_in_host = False
            session.adopt(History(ContactDocument()))
            return
        revision = stored.revision if stored is not None else session.history.base_revision
        if revision == session.revision:
            return
        if session.history.holds(revision):
            session.goto(revision, origin="host")
            return
        found = self.stored_history()
        session.adopt(found if found is not None else History(ContactDocument(), revision))

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
