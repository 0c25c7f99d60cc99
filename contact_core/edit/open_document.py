"""An open document file: its path, lock and journal, and what is told to them."""

from __future__ import annotations

from pathlib import Path

from contact_core.document.lock import DocumentLock
from contact_core.edit.history import History, Step
from contact_core.edit.journal import Journal
from contact_core.edit.recovery import journal_path, open_file, write_document
from contact_core.errors import FileRefused


class OpenDocument:
    """The file side of a session.

    notes: sentences for the artist on what opening found. read_only: someone else has the document.
    """

    def __init__(
        self, path: Path, journal: Journal | None, lock: DocumentLock | None, notes: tuple[str, ...]
    ) -> None:
        self.path = path
        self.notes = notes
        self._journal = journal
        self._lock = lock

    @classmethod
    def open(cls, path: Path) -> tuple[OpenDocument, History]:
        """Open a path, replaying an interrupted journal. Raises FileRefused."""
        opened = open_file(path)
        return cls(path, opened.journal, opened.lock, opened.notes), opened.history

    @classmethod
    def create(cls, path: Path, history: History) -> OpenDocument:
        """Write the document to a path that nobody else has open, and start a journal there. Raises FileRefused."""
        lock = DocumentLock.take(path)
        if isinstance(lock, str):
            raise FileRefused(f"cannot save there: {lock}")
        try:
            digest = write_document(path, history.document)
            return cls(path, Journal.start(journal_path(path), history, digest), lock, ())
        except BaseException:
            lock.release()
            raise

    @property
    def read_only(self) -> bool:
        """Whether nothing may be written here."""
        return self._lock is None

    def did(self, step: Step, *, merged: bool) -> None:
        """Record a step about to be committed. Raises FileRefused; then it must not be."""
        if self._journal is not None:
            self._journal.did(step, merged=merged)

    def went(self, revision: int) -> None:
        """Record where the history went. Raises FileRefused."""
        if self._journal is not None:
            self._journal.went(revision)

    def save(self, history: History) -> None:
        """Write the current document, whole or not at all. Raises FileRefused."""
        digest = write_document(self.path, history.document)
        if self._journal is not None:
            self._journal.saved(history.revision, digest)

    def restart(self, history: History) -> None:
        """Begin the journal anew with a history that did not come out of it."""
        if self._journal is not None:
            self._journal.close(record=False)
            self._journal = Journal.start(journal_path(self.path), history, None)

    def close(self, *, in_order: bool) -> None:
        """Let go. in_order: the journal is done with; otherwise the next opening replays it."""
        if self._journal is not None:
            self._journal.close(record=in_order)
            self._journal = None
        if self._lock is not None:
            self._lock.release()
            self._lock = None
