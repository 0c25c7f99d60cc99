"""The journal: an append-only file beside an open document, one line for each committed event.

The first line holds the whole document that the history started from, so a journal alone replays to everything that
was acknowledged. An event is acknowledged when the operating system has it (killing the process loses nothing); a
thread flushes it to the disk within FLUSH_SECONDS, which is the window that a power cut can lose.
"""

from __future__ import annotations

import contextlib
import os
import threading
from pathlib import Path
from typing import Any

from contact_core.atomic_file import write_atomic
from contact_core.document.schema import content_with_digest
from contact_core.edit.command import command_to_json
from contact_core.edit.history import History, Step
from contact_core.edit.journal_file import ID_DIGITS, SCHEMA, VERSION, JournalContents, encode_head, encode_line
from contact_core.errors import FileRefused

FLUSH_SECONDS = 0.1
_UNTIL_SAVED = (
    "Nothing more can be recorded until the document is saved: here, once the disk answers, or elsewhere."
)


class Journal:
    """An open journal, for one writer; `start` makes a new one.

    last_number: of its last line. journal_id: on each of its lines.
    """

    def __init__(self, path: Path, last_number: int, journal_id: str) -> None:
        self.path = path
        self._number = last_number
        self._id = journal_id
        self._owed: dict[str, Any] | None = None  # a line for which there was no room
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
        except OSError as error:
            raise FileRefused(f"the journal {path} cannot be written: {error.strerror or error}.") from error
        self._length = os.lseek(self._file, 0, os.SEEK_END)
        self._broken: str | None = None
        self._lock = threading.Lock()
        self._dirty = threading.Event()
        self._closing = threading.Event()
        self._flusher: threading.Thread | None = None

    @classmethod
    def start(cls, path: Path, history: History, file_digest: str | None, content: bytes | None = None) -> Journal:
        """A new journal of a history, with its steps so far, written atomically and flushed. Raises FileRefused.

        file_digest: of the document in the file on the disk, None where there is none yet. content: the
        canonical bytes of the history's base, where they are the document in the file, so that none are made.
        """
        header = {"journal": SCHEMA, "version": VERSION, "revision": history.base_revision, "file": file_digest}
        events = [_event_of(step) for step in history.steps]
        if history.can_redo:
            events.append({"goto": history.revision})
        if content is None or file_digest is None:
            content, digest = content_with_digest(history.base)
        else:
            digest = file_digest
        journal_id = digest[:ID_DIGITS]
        lines = (encode_line(event, number, journal_id) for number, event in enumerate(events, start=2))
        write_atomic(path, encode_head(header, content, journal_id) + b"".join(lines))
        return cls(path, 1 + len(events), journal_id)

    @classmethod
    def resume(cls, path: Path, contents: JournalContents) -> Journal | None:
        """Go on with a journal as it was read. Raises FileRefused.

        None where the system takes it for another length than was read, as mounts of other machines' files do for a
        while: a line would be written over others there, and a new journal must be begun.
        """
        journal = cls(path, contents.last_number, contents.journal_id)
        if journal._length == contents.length:
            return journal
        journal.close(record=False)
        return None

    @property
    def is_broken(self) -> bool:
        """Whether it takes no more events: a disk or a server failed, and it is not known what of it is there."""
        return self._broken is not None

    def did(self, step: Step) -> None:
        """Record a step about to be committed.

        Raises FileRefused when it cannot be written; then the journal is as it was, and the step must not be.
        """
        self._append(_event_of(step) | ({"merged": True} if step.merged else {}))

    def went(self, revision: int) -> None:
        """Record an undo, a redo or a jump. Raises FileRefused."""
        self._append({"goto": revision})

    def saved(self, revision: int, file_digest: str) -> None:
        """Record that the document file now holds the document of `revision`.

        The file is written and cannot be taken back, so a journal without room is no error here: the line is
        written with the next event. Until then the documents tell the next opening that the journal belongs here.
        """
        self._owed = {"saved": revision, "file": file_digest}
        with contextlib.suppress(FileRefused):
            self._append()

    def flush(self) -> None:
        """To the disk, now; edits go on being recorded meanwhile. Raises OSError."""
        with self._lock:
            if self._file < 0:
                return
            file = os.dup(self._file)
        try:
            os.fsync(file)
        finally:
            os.close(file)

    def close(self, *, record: bool = True) -> None:
        """Flush and close. `record`: this is an orderly end, so the next opening does not replay the journal.

        Raises FileRefused where that could not be written; it is closed all the same.
        """
        if self._file < 0:
            return
        try:
            if record and self._broken is None:
                self._append({"closed": True})
            self.flush()
        except OSError as error:
            raise FileRefused(f"the disk under {self.path} reports {error.strerror or error}.") from error
        finally:
            self._closing.set()
            self._dirty.set()
            with self._lock, contextlib.suppress(OSError):  # it is flushed; a server that is gone fails this, too
                file, self._file = self._file, -1
                os.close(file)
            if self._flusher is not None:
                self._flusher.join()

    def _append(self, *events: dict[str, Any]) -> None:
        """Write lines for events, after a line that is owed: all or none. Raises FileRefused."""
        with self._lock:
            due = events if self._owed is None else (self._owed, *events)
            lines = b"".join(encode_line(event, self._number + k, self._id) for k, event in enumerate(due, start=1))
            if self._file < 0:
                raise FileRefused(f"the journal {self.path} is closed.")
            if self._broken is not None:
                raise FileRefused(self._broken)
            try:
                _write_all(self._file, lines)
            except OSError as error:
                self._take_back(error)
            self._length += len(lines)
            self._number += len(due)
            self._owed = None
        self._flush_later()

    def _take_back(self, error: OSError) -> None:
        """Cut half a line off again, so that later events stay readable. Always raises FileRefused."""
        reason = f"the journal {self.path} cannot be written: {error.strerror or error}. The edit was not made."
        try:
            os.ftruncate(self._file, self._length)
        except OSError:
            self._broken = f"{reason} {_UNTIL_SAVED}"
            raise FileRefused(self._broken) from error
        raise FileRefused(f"{reason} Make room, or save elsewhere.") from error

    def _flush_later(self) -> None:
        if self._flusher is None:
            self._flusher = threading.Thread(target=self._flush_loop, name="contact-journal", daemon=True)
            self._flusher.start()
        self._dirty.set()

    def _flush_loop(self) -> None:
        while not self._closing.is_set():
            self._dirty.wait()
            self._closing.wait(FLUSH_SECONDS / 2)  # gather what comes within half the window
            self._dirty.clear()
            try:
                self.flush()
            except OSError as error:  # a disk that fails on fsync may have lost what it had taken
                self._broken = f"the disk under {self.path} reports {error.strerror or error}. {_UNTIL_SAVED}"


def _event_of(step: Step) -> dict[str, Any]:
    return {"at": step.revision, "do": command_to_json(step.command), "origin": step.origin}


def _write_all(file: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(file, view) :]
