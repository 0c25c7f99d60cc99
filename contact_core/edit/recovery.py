"""Opening a document file: take its lock, read it, replay an interrupted journal. Nothing unsaved is deleted."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path

from contact_core.atomic_file import is_there, put_in_place, read_bounded, remove_leftovers, write_atomic
from contact_core.document.document import ContactDocument
from contact_core.document.lock import DocumentLock
from contact_core.document.schema import (
    MAX_BYTES,
    content_with_digest,
    document_digest,
    parse_edited,
    parse_with_content,
    parse_with_digest,
    same_documents,
    with_digest,
    written_digest,
)
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable
from contact_core.edit.history import History
from contact_core.edit.journal import Journal
from contact_core.edit.journal_file import MAX_BYTES as JOURNAL_BYTES
from contact_core.edit.journal_file import JournalContents, read_journal
from contact_core.edit.replay import Replayed, replay
from contact_core.errors import EditedFile, FileRefused


@dataclass(frozen=True, eq=False)
class OpenedFile:
    """An opened document. journal and lock are None when read-only. notes: sentences for the artist.

    read_only: why nothing can be written, None where it can. digest: of the document in the file, None without one.
    """

    path: Path
    history: History
    journal: Journal | None
    lock: DocumentLock | None
    notes: tuple[str, ...]
    read_only: str | None = None
    digest: str | None = None


@dataclass(frozen=True, eq=False)
class _Found:
    """What lies on the disk. document, digest: empty and None where there is no file, or a damaged one.

    content: the canonical bytes of the document, where the file has them.
    """

    path: Path
    lock: DocumentLock
    notes: list[str]
    document: ContactDocument = field(default_factory=ContactDocument)
    digest: str | None = None
    content: bytes | None = None
    damaged: bool = False

    @property
    def journal(self) -> Path:
        return journal_path(self.path)

    @property
    def saved(self) -> ContactDocument | None:
        return None if self.digest is None else self.document


def journal_path(path: Path) -> Path:
    """Where the journal of a document lies."""
    return path.with_name(path.name + ".journal")


def read_document(path: Path) -> tuple[ContactDocument, str]:
    """The document in a file and its digest. Raises FileRefused, EditedFile."""
    return parse_with_digest(read_bounded(path, MAX_BYTES), str(path))


def write_document(path: Path, document: ContactDocument) -> str:
    """Write a document atomically; returns its digest. Raises FileRefused."""
    return write_with_content(path, document)[1]


def write_with_content(path: Path, document: ContactDocument) -> tuple[bytes, str]:
    """Write a document atomically; returns its canonical bytes and its digest. Raises FileRefused."""
    content, digest = content_with_digest(document)
    write_atomic(path, with_digest(content, digest))
    return content, digest


def accept_file(path: Path) -> str:
    """State the digest of a document file that was edited by hand anew; returns it.

    Raises FileRefused where it is no document, cannot be written, or another session has it open.
    """
    lock = DocumentLock.take(path) if is_there(path) else None
    if isinstance(lock, str):
        raise FileRefused(f"cannot accept {path}: {lock}.")
    try:
        return write_document(path, parse_edited(read_bounded(path, MAX_BYTES), str(path)))
    finally:
        if lock is not None:
            lock.release()


def digest_of(path: Path) -> str | None:
    """Digest of the document in the file at a path, None without one; of its bytes where it is no document.

    Raises FileRefused where it cannot be read.
    """
    if not is_there(path):
        return None
    raw = read_bounded(path, MAX_BYTES)
    digest = written_digest(raw)
    if digest.encode() in raw[:200]:
        return digest
    try:
        return parse_with_digest(raw, str(path))[1]  # somebody changed its layout, perhaps nothing else
    except FileRefused:
        return digest


def open_file(path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> OpenedFile:
    """Open a document for writing, or read-only where someone else has it. A path without a file is a new document.

    commands: the kinds that its journal may hold. Raises FileRefused for a file that is no document, of a newer
    schema, or edited by hand (EditedFile); such a file is left untouched.
    """
    lock = DocumentLock.take(path)
    if isinstance(lock, str):
        if not is_there(path) and not is_there(journal_path(path)):
            raise FileRefused(f"cannot begin {path}: {lock}.")
        reason = f"{lock}; it is opened read-only here."
        return OpenedFile(path, History(read_only_document(path, commands)), None, None, (reason,), reason)
    try:
        remove_leftovers(path)
        remove_leftovers(journal_path(path))
        return _open_locked(path, lock, commands)
    except BaseException:
        lock.release()
        raise


def read_only_document(path: Path, commands: CommandTable = BUILT_IN_COMMANDS) -> ContactDocument:
    """The document at a path as last saved, nothing locked and nothing written; before its first save, as the
    journal beside it has it. Raises FileRefused."""
    beside = journal_path(path)
    if not is_there(path) and is_there(beside):
        return replay(read_journal(beside), commands).history.document
    return read_document(path)[0]


def keep_foreign(path: Path, digest: str | None) -> str | None:
    """Keep a copy of a document file that holds another document; returns its name, None where it is the same."""
    found = digest_of(path)
    return None if found in (None, digest) else _keep(path, "replaced", copy=True).name


def set_aside(path: Path) -> str | None:
    """Move the journal of a document out of the way of a new one; returns the name under which it is kept, None
    where nothing that is not saved is in it: then it is PATH.journal.previous until the next."""
    beside = journal_path(path)
    try:
        old = read_journal(beside) if is_there(beside) else None
    except FileRefused:
        return _keep(beside, "damaged").name
    return None if old is None else _set_aside(beside, old)


def _set_aside(beside: Path, old: JournalContents) -> str | None:
    if old.damage or (not old.closed and old.edits):
        return _keep(beside, "damaged" if old.damage else "unused").name
    try:
        put_in_place(beside, beside.with_name(beside.name + ".previous"))
    except OSError as error:
        raise FileRefused(f"cannot move {beside} out of the way: {error.strerror or error}.") from error
    return None


def _open_locked(path: Path, lock: DocumentLock, commands: CommandTable) -> OpenedFile:
    found, refused = _Found(path, lock, []), None
    try:
        if is_there(path):
            found = _Found(path, lock, found.notes, *parse_with_content(read_bounded(path, MAX_BYTES), str(path)))
    except FileRefused as error:
        refused = error
    old = _read_old_journal(found)
    if refused is not None:
        if old is None or isinstance(refused, EditedFile) or "newer contact-core" in str(refused):
            raise refused  # what can be read is somebody's edit, perhaps
        replayed = _replay(old, commands, None)
        if replayed is None:
            raise refused
        found.notes.append(
            f"{refused} It is kept as {_keep(path, 'damaged').name}; the journal holds the document."
        )
        return _resume(replace(found, damaged=True), old, replayed)
    if old is not None and not old.closed:
        replayed = _replay(old, commands, found.saved)
        if replayed is not None and _belongs(old, replayed, found):
            return _resume(found, old, replayed)
    return _begin(found, old)


def _begin(found: _Found, old: JournalContents | None) -> OpenedFile:
    """Open a document as its file has it, with a new journal; an old one that may hold more is kept."""
    name = found.path.name
    kept = _set_aside(found.journal, old) if old is not None else None
    if old is not None and kept is not None:
        state = f"{name} was changed by something else since its journal was written"
        if old.damage:
            ending = "it was closed in order" if old.closed else "what it holds does not lead to the document file"
            state = f"{old.damage} {name} is opened as it was saved ({ending})"
        found.notes.append(f"{state}; the journal is kept as {kept} (contact replay reads it).")
    history = History(found.document)
    journal = Journal.start(found.journal, history, found.digest, found.content)
    return OpenedFile(found.path, history, journal, found.lock, tuple(found.notes), digest=found.digest)


def _replay(old: JournalContents, commands: CommandTable, saved: ContactDocument | None) -> Replayed | None:
    try:
        return replay(old, commands, saved)
    except FileRefused:  # nothing is known to begin with
        return None


def _belongs(old: JournalContents, replayed: Replayed, found: _Found) -> bool:
    """Whether a journal speaks of this document file: it names it, or leads to what it holds (the session ended
    between writing the file and saying so, or the line that said so is lost)."""
    if _names(old, found.digest):
        return True
    history = replayed.history
    if old.damage is None:
        return same_documents(history.document, found.document)
    digest = document_digest(found.document)
    revisions = [history.base_revision, *(step.revision for step in history.steps)]
    return any(document_digest(history.document_at(revision)) == digest for revision in reversed(revisions))


def _names(old: JournalContents, digest: str | None) -> bool:
    return (old.first is not None and digest == old.file_digest) or digest in old.saved_revisions


def _read_old_journal(found: _Found) -> JournalContents | None:
    """The journal beside a document, None without one; one that is none is kept, and a note says so."""
    if not is_there(found.journal):
        return None
    try:
        return read_journal(found.journal, None if found.content is None else (found.content, found.document))
    except FileRefused as error:
        if "newer contact-core" in str(error):
            raise
        found.notes.append(f"{error} It is kept as {_keep(found.journal, 'damaged').name}.")
        return None


def _resume(found: _Found, old: JournalContents, replayed: Replayed) -> OpenedFile:
    """Go on with the journal of a session that was interrupted."""
    history, beside = replayed.history, found.journal
    saved = _saved_revision(old, history, found)
    history.mark_saved(saved)
    sound = not (old.damage or replayed.trouble)
    if not sound:
        kept = _keep(beside, "damaged", copy=True)
        told = " ".join(sentence for sentence in (old.damage, *replayed.trouble) if sentence)
        found.notes.append(f"{told} The whole journal is kept as {kept.name}.")
    found.notes.append(_outcome(found, history))
    journal = None
    if sound and not old.closed and not found.damaged and _names(old, found.digest):
        journal = Journal.resume(beside, old)
    if journal is None:  # of what was replayed, and naming the file as it is now
        journal = Journal.start(beside, history, found.digest)
        if saved is not None and found.digest is not None:
            journal.saved(saved, found.digest)
    return OpenedFile(found.path, history, journal, found.lock, tuple(found.notes), digest=found.digest)


def _outcome(found: _Found, history: History) -> str:
    name = found.path.name
    if not found.damaged and same_documents(history.document, found.document):
        return f"{name} was not closed in order; its journal records no edit that is not saved."
    return f"{name} was not closed in order: {len(history.done)} committed steps were recovered from its journal."


def _saved_revision(old: JournalContents, history: History, found: _Found) -> int | None:
    """The revision that the document file holds, None where it holds none of this history."""
    if found.damaged:
        return None
    for revision in (history.revision, history.base_revision):
        if same_documents(history.document_at(revision), found.document):
            return revision
    return old.saved_revisions.get(found.digest or "")


def _keep(path: Path, why: str, *, copy: bool = False) -> Path:
    """Move (or copy) a file aside under the first free name. Raises FileRefused."""
    number = 1
    while os.path.lexists(aside := path.with_name(f"{path.name}.{why}-{number}")):
        number += 1
    try:
        if copy:
            write_atomic(aside, read_bounded(path, JOURNAL_BYTES))
        else:
            put_in_place(path, aside)
    except OSError as error:
        raise FileRefused(f"cannot keep {path} as {aside.name}: {error.strerror or error}.") from error
    return aside
