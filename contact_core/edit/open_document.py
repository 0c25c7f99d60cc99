"""An open document file: its path, lock and journal, and what is told to them."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from contact_core.document.lock import DocumentLock
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable
from contact_core.edit.history import History, Step
from contact_core.edit.journal import Journal
from contact_core.edit.recovery import (
    digest_of,
    journal_path,
    keep_foreign,
    open_file,
    set_aside,
    write_document,
    write_with_content,
)
from contact_core.errors import FileRefused


class OpenDocument:
    """The file side of a session.

    path: absolute, links followed, so that no other spelling and no other working directory means another file.
    notes: sentences for the artist on what opening found. read_only: why nothing may be written here, None where
    it may.
    """

    def __init__(
        self,
        path: Path,
        journal: Journal | None,
        lock: DocumentLock | None,
        notes: tuple[str, ...] = (),
        read_only: str | None = None,
        digest: str | None = None,
    ) -> None:
        self.path = path
        self.notes = notes
        self.read_only = read_only
        self._digest = digest  # of the document in the file as this session read or wrote it last
        self._journal = journal
        self._lock = lock

    @classmethod
    def open(cls, path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> tuple[OpenDocument, History]:
        """Open a path, replaying an interrupted journal of these kinds of commands. Raises FileRefused."""
        opened = open_file(real_path(path), commands)
        document = cls(opened.path, opened.journal, opened.lock, opened.notes, opened.read_only, opened.digest)
        return document, opened.history

    @classmethod
    def create(cls, path: Path, history: History) -> OpenDocument:
        """Write the document to a path that nobody else has open, and start a journal there. Raises FileRefused.

        A journal that is there already, of an interrupted session, is kept under another name.
        """
        path = real_path(path)
        lock = DocumentLock.take(path)
        if isinstance(lock, str):
            raise FileRefused(f"cannot save there: {lock}.")
        try:
            kept = set_aside(path)
            notes = () if kept is None else (f"a journal of {path.name} with edits is kept as {kept}.",)
            content, digest = write_with_content(path, history.document)
            known = content if history.document is history.base else None
            journal = Journal.start(journal_path(path), history, digest, known)
            journal.saved(history.revision, digest)
            return cls(path, journal, lock, notes, digest=digest)
        except BaseException:
            lock.release()
            raise

    def did(self, step: Step) -> None:
        """Record a step about to be committed. Raises FileRefused; then it must not be."""
        if self._journal is not None:
            self._journal.did(step)

    def went(self, revision: int) -> None:
        """Record where the history went. Raises FileRefused."""
        if self._journal is not None:
            self._journal.went(revision)

    def save(self, history: History) -> None:
        """Write the current document atomically. Raises FileRefused.

        A file that something else wrote meanwhile is kept under another name, and `notes` says so.
        """
        kept = keep_foreign(self.path, self._digest)
        if kept is not None:
            self.notes += (f"{self.path.name} was changed by something else; that version is kept as {kept}.",)
        self._digest = write_document(self.path, history.document)
        if self._journal is not None:
            if self._journal.is_broken:  # the disk is back: what it was not told of is in the history
                with contextlib.suppress(FileRefused):
                    self._journal.close(record=False)
                self._journal = Journal.start(journal_path(self.path), history, self._digest)
            self._journal.saved(history.revision, self._digest)

    def restart(self, history: History) -> None:
        """Begin the journal anew with a history that did not come out of it. Raises FileRefused."""
        if self._journal is not None:
            self._journal.close()
            set_aside(self.path)
            self._journal = Journal.start(journal_path(self.path), history, digest_of(self.path))

    def close(self, *, in_order: bool) -> None:
        """Let go. in_order: the journal is done with; otherwise the next opening replays it.

        Raises FileRefused where the end could not be recorded; it is let go of all the same.
        """
        journal, lock, self._journal, self._lock = self._journal, self._lock, None, None
        self.read_only = f"{self.path.name} is closed."
        try:
            if journal is not None:
                journal.close(record=in_order)
        finally:
            if lock is not None:
                lock.release()


def real_path(path: Path) -> Path:
    """The file that a path means: absolute, links followed."""
    return Path(os.path.realpath(path))
