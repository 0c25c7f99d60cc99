"""Reading a journal: each line has a checksum, its number and the journal it belongs to, so that damage is seen.

A line is a CRC-32 in eight hex digits, the number of the line, the id of the journal, compact JSON and a newline,
with blanks between; the checksum is taken over everything after it. The id is the first eight hex digits of the
digest of the document that the journal begins with. So a line that was changed, lost, doubled, moved or left over
from another journal is known as such, and where the first line is lost, it is known which document it held.
"""

from __future__ import annotations

import json
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded
from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_from_json, open_envelope
from contact_core.errors import FileRefused

SCHEMA = "contact-core.journal"
VERSION = 1
ID_DIGITS = 8
MAX_BYTES = 4 << 30
_DOCUMENT = b',"document":'

UPGRADES: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {}  # of the first line, by version


@dataclass(frozen=True, eq=False)
class Line:
    """A sound line. number: 1 is the first line, with the document that the journal begins with; then events."""

    number: int
    journal_id: str
    text: bytes

    @cached_property
    def event(self) -> dict[str, Any]:
        """What it says. The first line, which is long, is read when it is wanted; other lines have been.

        Raises FileRefused for what is no JSON object.
        """
        try:
            event = json.loads(self.text)
        except (ValueError, RecursionError) as error:
            raise FileRefused(f"line {self.number} of the journal is no JSON: {error}.") from error
        if not isinstance(event, dict):
            raise FileRefused(f"line {self.number} of the journal is no JSON object.")
        return event


@dataclass(frozen=True, eq=False)
class JournalContents:
    """The sound lines of a journal.

    first: the line with the document that it begins with, None where it is lost. lines: the events, in order.
    damage: None, or a sentence on what is lost. cut_off: whether damage follows the last of the lines. name: of the
    file. beside: the canonical bytes of a document and the document: where the first line holds those very bytes,
    they are not decoded again. length: of the file, in bytes.
    """

    first: Line | None
    journal_id: str
    lines: tuple[Line, ...]
    damage: str | None
    cut_off: bool
    name: str
    beside: tuple[bytes, ContactDocument] | None = None
    length: int = 0

    @cached_property
    def _header(self) -> bytes | None:
        """The first line up to its document, where that is the one beside the journal."""
        if self.first is None or self.beside is None:
            return None
        ending = _DOCUMENT + _one_line(self.beside[0]) + b"}"
        return self.first.text.removesuffix(ending) if self.first.text.endswith(ending) else None

    @cached_property
    def _head(self) -> tuple[Mapping[str, Any], int, str | None]:
        if self.first is None:
            return {}, 0, None
        first = self.first if self._header is None else Line(1, self.journal_id, self._header + b"}")
        return _read_head(first.event, self.name)

    @property
    def base_revision(self) -> int:
        """Revision of the document that it begins with."""
        return self._head[1]

    @property
    def file_digest(self) -> str | None:
        """Digest of the document file when it began, None without one."""
        return self._head[2]

    @cached_property
    def base(self) -> ContactDocument | None:
        """The document that it begins with, None where the first line is lost.

        Raises FileRefused for what is none. It is made when it is wanted: opening a document whose session ended in
        order never asks for it.
        """
        if self.first is None:
            return None
        if self._header is not None and self.beside is not None and self._head:
            return self.beside[1]
        return document_from_json(self._head[0].get("document"), f"the document in {self.name}")

    @property
    def events(self) -> tuple[dict[str, Any], ...]:
        """The events of the lines."""
        return tuple(line.event for line in self.lines)

    @property
    def closed(self) -> bool:
        """Whether the session ended in order."""
        return bool(self.lines) and "closed" in self.lines[-1].event and not self.cut_off

    @property
    def last_number(self) -> int:
        """Number of the last line."""
        return self.lines[-1].number if self.lines else 1

    @property
    def saves(self) -> tuple[Line, ...]:
        """The lines that say that the document file was written."""
        return tuple(line for line in self.lines if _is_save(line.event))

    @property
    def saved_revisions(self) -> dict[str, int]:
        """Which revision the document file held, by the digest of the document."""
        return {line.event["file"]: line.event["saved"] for line in self.saves}

    @property
    def edits(self) -> int:
        """How many events changed the document."""
        return sum("do" in event or "goto" in event for event in self.events)


def read_journal(path: Path, beside: tuple[bytes, ContactDocument] | None = None) -> JournalContents:
    """The sound lines of a journal. Raises FileRefused when there is none, or for a newer journal.

    beside: the document file's canonical bytes and its document, as in `JournalContents`.
    """
    content = read_bounded(path, MAX_BYTES)
    found = [decode_line(raw) for raw in _raw_lines(content)]
    sound = [line for line in found if line is not None]
    if not sound:
        raise FileRefused(f"{path} holds no sound line of a journal; nothing can be recovered from it.")
    journal_id = Counter(line.journal_id for line in sound).most_common(1)[0][0]
    lines: dict[int, Line] = {}
    for line in sound:
        if line.journal_id == journal_id:
            lines.setdefault(line.number, line)
    cut_off = found[-1] is None
    in_order = len(lines) == len(sound) and list(lines) == sorted(lines) and found.count(None) == cut_off
    damage = _damage(path.name, sorted(lines), cut_off, in_order)
    head = lines.pop(1, None)
    events = tuple(lines[number] for number in sorted(lines))
    contents = JournalContents(head, journal_id, events, damage, cut_off, path.name, beside, len(content))
    if not contents.closed:
        _ = contents.base  # refused now where it is none
    return contents


def encode_line(event: Mapping[str, Any], number: int, journal_id: str) -> bytes:
    """One line of a journal."""
    return _line(json.dumps(event, separators=(",", ":"), allow_nan=False).encode(), number, journal_id)


def encode_head(header: Mapping[str, Any], document: bytes, journal_id: str) -> bytes:
    """The first line of a journal, which holds a document; document: its JSON, in any layout.

    Line ends within JSON lie between its words, because a text spells them as escapes: a blank does the same.
    """
    start = json.dumps(header, separators=(",", ":"), allow_nan=False).encode().removesuffix(b"}")
    return _line(start + _DOCUMENT + _one_line(document) + b"}", 1, journal_id)


def _one_line(document: bytes) -> bytes:
    return document.replace(b"\n", b" ")


def _line(text: bytes, number: int, journal_id: str) -> bytes:
    body = b"%d %b %b" % (number, journal_id.encode(), text)
    return b"%08x %b\n" % (zlib.crc32(body), body)


def decode_line(raw: bytes) -> Line | None:
    """The sound line that bytes hold, or None."""
    if raw[8:9] != b" " or not raw.endswith(b"\n") or b"%08x" % zlib.crc32(raw[9:-1]) != raw[:8]:
        return None
    try:
        number, journal_id, text = raw[9:-1].split(b" ", 2)
        line = Line(int(number), journal_id.decode("ascii"), text)
        if line.number > 1:
            _ = line.event
        return line if 0 < line.number < 1 << 62 else None
    except (ValueError, FileRefused):  # sound, but nothing that a journal would hold
        return None


def whole_number(data: Mapping[str, Any], key: str) -> int:
    """A number of an event. Raises FileRefused."""
    number = data.get(key)
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 1 << 63:
        raise FileRefused(f"expected a whole number as its {key!r}, got {str(number)[:60]}.")
    return number


def _is_save(event: Mapping[str, Any]) -> bool:
    revision = event.get("saved")
    return isinstance(event.get("file"), str) and isinstance(revision, int) and 0 <= revision < 1 << 63


def _read_head(head: dict[str, Any], name: str) -> tuple[Mapping[str, Any], int, str | None]:
    body = open_envelope(head, SCHEMA, VERSION, UPGRADES, name, schema_key="journal")
    revision, digest = whole_number(body, "revision"), body.get("file")
    if not (digest is None or isinstance(digest, str)):
        raise FileRefused(f"{name} names no document file that could be ({str(digest)[:60]!r}).")
    return body, revision, digest


def _damage(name: str, numbers: list[int], cut_off: bool, in_order: bool) -> str | None:
    """A sentence on what is lost, None where nothing is."""
    gaps = [(a + 1, b - 1) for a, b in zip([0, *numbers], numbers, strict=False) if b > a + 1]
    told = [str(a) if a == b else f"{a} to {b}" for a, b in gaps[:5]] + (["more"] if len(gaps) > 5 else [])
    sentences = [f"Damaged or missing in {name}: line {', '.join(told)}."] if gaps else []
    if cut_off:
        sentences.append(f"What follows line {numbers[-1]} of {name} is damaged or was cut off.")
    if not in_order and not sentences:
        sentences.append(f"{name} holds lines that are damaged, doubled, moved or of another journal.")
    return " ".join(sentences) or None


def _raw_lines(raw: bytes) -> Iterator[bytes]:
    start = 0
    while start < len(raw):
        end = raw.find(b"\n", start) + 1 or len(raw)
        yield raw[start:end]
        start = end
