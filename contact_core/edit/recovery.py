"""Opening a document file: take its lock, read it, replay an interrupted journal. Nothing is ever deleted."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from pathlib import Path

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.document.document import ContactDocument
from contact_core.document.lock import DocumentLock
from contact_core.document.schema import MAX_BYTES, dump_document, parse_document, parse_edited, same_documents
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable
from contact_core.edit.history import History
from contact_core.edit.journal import Journal, JournalContents, read_journal, replay
from contact_core.errors import EditedFile, FileRefused


@dataclass(frozen=True, eq=False)
class OpenedFile:
    """What opening a path gave. journal and lock are None when read-only. notes: sentences for the artist.

    read_only: why nothing can be written, None where it can. digest: of the document file, None without one.
    """

    path: Path
    history: History
    journal: Journal | None
    lock: DocumentLock | None
    notes: tuple[str, ...]
    read_only: str | None = None
    digest: str | None = None


def journal_path(path: Path) -> Path:
    """Where the journal of a document lies."""
    return path.with_name(path.name + ".journal")


def read_document(path: Path) -> tuple[ContactDocument, str]:
    """The document in a file and the digest of the file. Raises FileRefused."""
    raw = read_bounded(path, MAX_BYTES)
    return parse_document(raw, str(path)), file_digest(raw)


def write_document(path: Path, document: ContactDocument) -> str:
    """Write a document atomically; returns its digest. Raises FileRefused."""
    raw = dump_document(document)
    write_atomic(path, raw)
    return file_digest(raw)


def accept_file(path: Path) -> str:
    """State the digest of a document file that was edited by hand anew; returns it.

    Raises FileRefused where it is no document, cannot be written, or another session has it open.
    """
    lock = DocumentLock.take(path) if path.exists() else None
    if isinstance(lock, str):
        raise FileRefused(f"cannot accept {path}: {lock}.")
    try:
        return write_document(path, parse_edited(read_bounded(path, MAX_BYTES), str(path)))
    finally:
        if lock is not None:
            lock.release()


def file_digest(raw: bytes) -> str:
    """Digest of the bytes of a document file."""
    return hashlib.sha256(raw).hexdigest()


def digest_of(path: Path) -> str | None:
    """Digest of the document file at a path, None without one. Raises FileRefused."""
    return file_digest(read_bounded(path, MAX_BYTES)) if path.exists() else None


def open_file(path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> OpenedFile:
    """Open a document for writing, or read-only where someone else has it. A path without a file is a new document.

    commands: the kinds that its journal may hold. Raises FileRefused for a file that is no document or of a newer
    schema; such a file is left untouched.
    """
    lock = DocumentLock.take(path)
    if isinstance(lock, str):
        reason = f"{lock}; it is opened read-only here."
        return OpenedFile(path, History(read_only_document(path, commands)), None, None, (reason,), reason)
    try:
        return _open_locked(path, lock, commands)
    except BaseException:
        lock.release()
        raise


def read_only_document(path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> ContactDocument:
    """The document at a path as last saved, nothing locked and nothing written; before its first save, as the
    journal beside it has it. Raises FileRefused."""
    beside = journal_path(path)
    if not path.exists() and beside.exists():
        return replay(read_journal(beside), commands)[0].document
    return read_document(path)[0]


def keep_foreign(path: Path, digest: str | None) -> str | None:
    """Keep a copy of a document file that has another digest; answers its name, None where it has this one."""
    found = digest_of(path)
    return None if found in (None, digest) else _keep(path, "replaced", copy=True).name


def set_aside(path: Path) -> str | None:
    """Move the journal of a document out of the way of a new one; answers the name that one keeps which was not
    closed in order."""
    beside = journal_path(path)
    old, _ = _read_old_journal(beside)
    if old is not None and not old.closed and old.edits:
        return _keep(beside, "unused").name
    if old is not None:
        beside.replace(beside.with_name(beside.name + ".previous"))
    return None


def _open_locked(path: Path, lock: DocumentLock, commands: CommandTable) -> OpenedFile:
    beside = journal_path(path)
    old, notes = _read_old_journal(beside)
    document, digest = ContactDocument(), None
    try:
        if path.exists():
            document, digest = read_document(path)
    except FileRefused as error:
        if old is None or isinstance(error, EditedFile) or "newer contact-core" in str(error):
            raise  # what can be read is somebody's edit, perhaps
        notes.append(f"{error} It is kept as {_keep(path, 'damaged').name}; the journal holds the document.")
        return _resume(path, lock, old, None, None, notes, commands)
    if old is not None and not old.closed and _belongs(old, document, digest, commands):
        return _resume(path, lock, old, document, digest, notes, commands)
    kept = set_aside(path) if old is not None else None
    if kept is not None:
        notes.append(
            f"{path.name} was changed by something else since its journal was written; the journal is kept as"
            f" {kept} (contact replay reads it)."
        )
    history = History(document)
    return OpenedFile(path, history, Journal.start(beside, history, digest), lock, tuple(notes), digest=digest)


def _belongs(old: JournalContents, document: ContactDocument, digest: str | None, commands: CommandTable) -> bool:
    """Whether a journal speaks of this document file: it names it, or leads to what it holds (the session ended
    between writing the file and saying so)."""
    return _names(old, digest) or same_documents(replay(old, commands)[0].document, document)


def _names(old: JournalContents, digest: str | None) -> bool:
    return digest == old.file_digest or digest in old.saved_revisions


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
    path: Path,
    lock: DocumentLock,
    old: JournalContents,
    document: ContactDocument | None,
    digest: str | None,
    notes: list[str],
    commands: CommandTable,
) -> OpenedFile:
    """Go on with the journal of a session that was interrupted. document, digest: of the file, None without one."""
    beside = journal_path(path)
    history, trouble = replay(old, commands)
    history.mark_saved(_saved_revision(old, history, document, digest))
    if old.damage or trouble:
        kept = _keep(beside, "damaged", copy=True)
        notes.append(f"{old.damage or trouble} The whole journal is kept as {kept.name}.")
    sound = not (old.damage or trouble or old.closed)
    if sound and document is not None and _names(old, digest):
        journal = Journal(beside)
    else:  # whole, of what was replayed, and naming the file as it is now
        journal = Journal.start(beside, history, digest)
    if document is None or not same_documents(history.document, document):
        steps = len(history.done)
        notes.append(
            f"{path.name} was not closed in order: {steps} committed steps were recovered from its journal."
        )
    return OpenedFile(path, history, journal, lock, tuple(notes), digest=digest)


def _saved_revision(
    old: JournalContents, history: History, document: ContactDocument | None, digest: str | None
) -> int | None:
    """The revision that the document file holds, None where it holds none of this history."""
    if document is None:
        return None
    for revision in (history.revision, history.base_revision):
        if same_documents(history.document_at(revision), document):
            return revision
    return old.saved_revisions.get(digest or "")


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
