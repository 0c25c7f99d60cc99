"""The journal: an append-only file beside an open document, one line for each committed event.

A line is a CRC-32 in eight hex digits, a blank, compact JSON, a newline. The first line holds the whole document
that the history started from, so a journal alone replays to everything that was acknowledged. An event is
acknowledged when the operating system has it (killing the process loses nothing); a thread flushes it to the
disk within FLUSH_SECONDS, which is the window that a power cut can lose.
"""

from __future__ import annotations

import json
import os
import threading
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_from_json, document_to_json, open_envelope
from contact_core.edit.command import command_to_json
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable, command_from_json
from contact_core.edit.history import History, Step
from contact_core.errors import ContactError, FileRefused

SCHEMA = "contact-core.journal"
VERSION = 1
FLUSH_SECONDS = 0.1
MAX_BYTES = 4 << 30

UPGRADES: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}  # of the first line, by version


class Journal:
    """An open journal, for one writer. Use `start` or `resume`."""

    def __init__(self, path: Path) -> None:
        self.path = path
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
    def start(cls, path: Path, history: History, file_digest: str | None) -> Journal:
        """A new journal of a history, its steps so far included, written whole and flushed. Raises FileRefused.

        file_digest: of the document file as it lies on the disk, None where there is none yet.
        """
        header = {
            "journal": SCHEMA,
            "version": VERSION,
            "revision": history.base_revision,
            "file": file_digest,
            "document": document_to_json(history.base),
        }
        events = [_event_of(step) for step in history.steps]
        if history.can_redo:
            events.append({"goto": history.revision})
        write_atomic(path, b"".join(map(encode_line, [header, *events])))
        return cls(path)

    def did(self, step: Step) -> None:
        """Record a step about to be committed.

        Raises FileRefused when it cannot be written; then the journal is as it was, and the step must not be.
        """
        self._append(_event_of(step) | ({"merged": True} if step.merged else {}))

    def went(self, revision: int) -> None:
        """Record an undo, a redo or a jump. Raises FileRefused."""
        self._append({"goto": revision})

    def saved(self, revision: int, file_digest: str) -> None:
        """Record that the document file now holds `revision`. Raises FileRefused."""
        self._append({"saved": revision, "file": file_digest})

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
            with self._lock:
                os.close(self._file)
                self._file = -1
            if self._flusher is not None:
                self._flusher.join()

    def _append(self, event: dict[str, Any]) -> None:
        line = encode_line(event)
        with self._lock:
            if self._file < 0:
                raise FileRefused(f"the journal {self.path} is closed.")
            if self._broken is not None:
                raise FileRefused(self._broken)
            try:
                _write_all(self._file, line)
            except OSError as error:
                self._take_back(error)
            self._length += len(line)
        self._flush_later()

    def _take_back(self, error: OSError) -> None:
        """Cut half a line off again, so that later events stay readable. Always raises FileRefused."""
        reason = f"the journal {self.path} cannot be written: {error.strerror or error}. The edit was not made."
        try:
            os.ftruncate(self._file, self._length)
        except OSError:
            self._broken = f"{reason} Nothing more can be recorded: save elsewhere and open the document again."
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
                self._broken = f"the disk under {self.path} reports {error.strerror or error}; save elsewhere."


@dataclass(frozen=True, eq=False)
class JournalContents:
    """A journal as read. base: the first document. file_digest: of the document file then, None if none.

    events: the whole events. damage: None, or a sentence on what follows.
    """

    base: ContactDocument
    base_revision: int
    file_digest: str | None
    events: tuple[dict[str, Any], ...]
    damage: str | None

    @property
    def closed(self) -> bool:
        """Whether the session ended in order."""
        return bool(self.events) and "closed" in self.events[-1]

    @property
    def saved_revisions(self) -> dict[str, int]:
        """Which revision the document file held, by the digest of the file."""
        saved = [event for event in self.events if "saved" in event]
        return {event["file"]: event["saved"] for event in saved if isinstance(event.get("file"), str)}

    @property
    def edits(self) -> int:
        """How many events changed the document."""
        return sum("do" in event or "goto" in event for event in self.events)


def read_journal(path: Path) -> JournalContents:
    """The sound part of a journal. Raises FileRefused when not even the first line is."""
    damage, records = None, []
    for number, line in enumerate(_lines(read_bounded(path, MAX_BYTES)), start=1):
        event = decode_line(line)
        if event is None:
            damage = f"line {number} of {path.name} is damaged or was cut off; all before it is whole."
            break
        records.append(event)
    if not records:
        raise FileRefused(f"{path} is damaged from its first line on; nothing can be recovered from it.")
    header = records[0]
    body = open_envelope(header, SCHEMA, VERSION, UPGRADES, str(path), schema_key="journal")
    base = document_from_json(body.get("document"), f"the document in {path.name}")
    revision, digest = _whole_number(body, "revision"), body.get("file")
    if not (digest is None or isinstance(digest, str)):
        raise FileRefused(f"{path} names no document file that could be ({str(digest)[:60]!r}).")
    return JournalContents(base, revision, digest, tuple(records[1:]), damage)


def replay(contents: JournalContents, commands: CommandTable = BUILT_IN_COMMANDS) -> tuple[History, str | None]:
    """The history that a journal records, and None or a sentence on the event that could not be replayed.

    commands: the kinds that it may hold.
    """
    history = History(contents.base, contents.base_revision)
    for number, event in enumerate(contents.events, start=2):
        try:
            _replay_event(history, event, commands)
        except ContactError as error:
            return history, f"the event on line {number} cannot be replayed: {error}"
    return history, None


def encode_line(event: dict[str, Any]) -> bytes:
    """One line of a journal."""
    body = json.dumps(event, separators=(",", ":"), allow_nan=False).encode()
    return b"%08x %b\n" % (zlib.crc32(body), body)


def decode_line(line: bytes) -> dict[str, Any] | None:
    """The event of a whole line, or None for a damaged one."""
    if len(line) < 10 or line[8:9] != b" " or not line.endswith(b"\n"):
        return None
    body = line[9:-1]
    if b"%08x" % zlib.crc32(body) != line[:8]:
        return None
    try:
        event = json.loads(body)
    except (ValueError, RecursionError):  # whole, but nothing that this journal would write
        return None
    return event if isinstance(event, dict) else None


def _event_of(step: Step) -> dict[str, Any]:
    return {"at": step.revision, "do": command_to_json(step.command), "origin": step.origin}


def _replay_event(history: History, event: dict[str, Any], commands: CommandTable) -> None:
    if "do" in event:
        command = command_from_json(event["do"], commands)
        merged = bool(event.get("merged"))  # then the recorded command is the merged one
        history.do_as(command, str(event.get("origin")), _whole_number(event, "at"), merged=merged)
    elif "goto" in event:
        history.goto(_whole_number(event, "goto"))
    elif "saved" in event and not (isinstance(event.get("file"), str) and _whole_number(event, "saved") >= 0):
        raise FileRefused("it names no document file.")


def _whole_number(event: Mapping[str, Any], key: str) -> int:
    number = event.get(key)
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 1 << 63:
        raise FileRefused(f"its {key!r} is a whole number, but {str(number)[:60]} came.")
    return number


def _lines(raw: bytes) -> Iterator[bytes]:
    start = 0
    while start < len(raw):
        end = raw.find(b"\n", start) + 1 or len(raw)
        yield raw[start:end]
        start = end


def _write_all(file: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(file, view) :]
