"""Opening a document file: take its lock, read it, replay an interrupted journal. Nothing is ever deleted."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from pathlib import Path

from contact_core.document.document import ContactDocument
from contact_core.document.lock import DocumentLock
from contact_core.document.schema import dump_document, parse_document, same_documents
from contact_core.edit.history import History
from contact_core.edit.journal import Journal, JournalContents, read_journal, replay
from contact_core.errors import FileRefused
from contact_core.whole_file import write_whole


@dataclass(frozen=True, eq=False)
class OpenedFile:
    """What opening a path gave. journal and lock are None when read-only. notes: sentences for the artist."""

    path: Path
    history: History
    journal: Journal | None
    lock: DocumentLock | None
    notes: tuple[str, ...]


def journal_path(path: Path) -> Path:
    """Where the journal of a document lies."""
    return path.with_name(path.name + ".journal")


def read_document(path: Path) -> tuple[ContactDocument, str]:
    """The document in a file and the digest of the file. Raises FileRefused."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FileRefused(f"cannot read {path}: {error.strerror or error}.") from error
    return parse_document(raw, str(path)), file_digest(raw)


def write_document(path: Path, document: ContactDocument) -> str:
    """Write a document whole or not at all; answers the digest of the file. Raises FileRefused."""
    raw = dump_document(document)
    write_whole(path, raw)
    return file_digest(raw)


def file_digest(raw: bytes) -> str:
    """Digest of the bytes of a document file."""
    return hashlib.sha256(raw).hexdigest()


def open_file(path: Path) -> OpenedFile:
    """Open a document for writing, or read-only where someone else has it. A path without a file is a new document.

    Raises FileRefused for a file that is no document or of a newer schema; such a file is left untouched.
    """
    lock = DocumentLock.take(path)
    if isinstance(lock, str):
        document, _ = read_document(path)
        return OpenedFile(path, History(document), None, None, (lock,))
    try:
        return _open_locked(path, lock)
    except BaseException:
        lock.release()
        raise


def _open_locked(path: Path, lock: DocumentLock) -> OpenedFile:
    beside = journal_path(path)
    old, notes = _read_old_journal(beside)
    try:
        document, digest = read_document(path) if path.exists() else (ContactDocument(), None)
    except FileRefused as error:
        if old is None or "newer contact-core" in str(error):
            raise
        kept = _keep(path, "damaged")
        notes.append(f"{error} It is kept as {kept.name}; the journal holds the document.")
        document, digest = old.base, old.file_digest
    if old is not None and not old.closed and digest in old.file_digests:
        return _resume(path, lock, beside, old, document, notes)
    if old is not None and not old.closed and old.edits:
        kept = _keep(beside, "unused")
        notes.append(
            f"{path.name} was changed by something else since its journal was written; the journal is kept as"
            f" {kept.name} (contact replay reads it)."
        )
    elif old is not None:
        beside.replace(beside.with_name(beside.name + ".previous"))
    history = History(document)
    return OpenedFile(path, history, Journal.start(beside, history, digest), lock, tuple(notes))


def _read_old_journal(beside: Path) -> tuple[JournalContents | None, list[str]]:
    if not beside.exists():
        return None, []
    try:
        return read_journal(beside), []
    except FileRefused as error:
        if "newer contact-core" in str(error):
            raise
        return None, [f"{error} It is kept as {_keep(beside, 'damaged').name}."]


def _resume(
    path: Path, lock: DocumentLock, beside: Path, old: JournalContents, document: ContactDocument, notes: list[str]
) -> OpenedFile:
    """Go on with the journal of a session that was interrupted."""
    history, trouble = replay(old)
    if old.damage or trouble:
        kept = _keep(beside, "damaged", copy=True)
        notes.append(f"{old.damage or trouble} The whole journal is kept as {kept.name}.")
    if trouble:  # go on from what was replayed, in a new journal
        journal = Journal.start(beside, history, old.file_digest)
    else:
        if old.damage:
            write_whole(beside, beside.read_bytes()[: old.good_bytes])
        journal = Journal(beside)
    if not same_documents(history.document, document):
        steps = len(history.done)
        notes.append(
            f"{path.name} was not closed in order: {steps} committed steps were recovered from its journal."
        )
    return OpenedFile(path, history, journal, lock, tuple(notes))


def _keep(path: Path, why: str, *, copy: bool = False) -> Path:
    """Move (or copy) a file aside under the first free name."""
    number = 1
    while (aside := path.with_name(f"{path.name}.{why}-{number}")).exists():
        number += 1
    if copy:
        shutil.copy2(path, aside)
    else:
        path.replace(aside)
    return aside
