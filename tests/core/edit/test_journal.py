"""The journal: what was acknowledged survives kills, full disks and damage; nothing is deleted; one writer only."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from contact_core.document.document import ContactDocument
from contact_core.document.schema import dump_document, same_documents
from contact_core.edit import journal as journals
from contact_core.edit import journal_file
from contact_core.edit.commands import SetExtra
from contact_core.edit.history import History
from contact_core.edit.journal_file import encode_line, read_journal
from contact_core.edit.recovery import journal_path, open_file
from contact_core.edit.replay import replay
from contact_core.errors import CommandRejected, FileRefused
from contact_core.session import Session
from contact_core.testing.random_commands import random_history

KILLS = int(os.environ.get("CONTACT_KILLS", "200"))  # more of them by `make explore`

posix = pytest.mark.skipif(os.name != "posix", reason="needs fork, SIGKILL and resource limits")


def fill(session: Session, seed: int, steps: int = 40) -> None:
    """Commit a random history in a session."""
    for step in random_history(seed, steps, still=True).steps:
        session.do(step.command)


def interrupt(session: Session) -> None:
    """Let go as a killed process does: the journal has no end, and the next opening replays it."""
    assert session._file is not None
    session._file.close(in_order=False)


class Twin(Session):
    """Does what the child does, in memory alone."""

    def save(self, path: Path | str | None = None) -> Path:
        self.history.mark_clean()
        return Path()


def act(session: Session, chance: random.Random, number: int) -> None:
    """One action of a busy artist: mostly edits, some merges, undos, jumps, now and then a save."""
    kind = chance.random()
    if kind < 0.70 or not session.history.can_undo:
        session.do(SetExtra("number", number), merge=kind < 0.15)
    elif kind < 0.80:
        session.undo()
    elif kind < 0.90 and session.history.can_redo:
        session.redo()
    elif kind < 0.98:
        session.goto(chance.choice(session.history.steps).revision)
    else:
        session.save()


def killed_child(path: Path, seed: int, delay: float) -> int:
    """Fork a child that acts until it is killed; answers how many actions it acknowledged."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            session, chance = Session.open(path, discover=False), random.Random(seed)
            os.write(write_end, b".")
            for number in range(100_000):
                act(session, chance, number)
                os.write(write_end, b".")
        finally:
            os._exit(1)
    os.close(write_end)
    os.read(read_end, 1)  # it is open
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    acknowledged = 0
    while chunk := os.read(read_end, 1 << 16):
        acknowledged += len(chunk)
    os.close(read_end)
    return acknowledged


@posix
def test_kills_lose_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    """In a process of their own, which has no thread while it forks."""
    kills = subprocess.run(
        [sys.executable, __file__, str(tmp_path)], capture_output=True, text=True, timeout=300 + KILLS, check=False
    )
    assert kills.returncode == 0, kills.stderr


def kill_many_times(tmp_path: Path) -> None:
    """After each kill the document is the acknowledged one, or that of the one action that was under way."""
    actions, history = 0, History(ContactDocument())
    for number in range(KILLS):
        path = tmp_path / f"{number // 8}.json"  # eight interruptions each, recovered one upon the other
        if number % 8 == 0:
            history = History(ContactDocument())
        twin, chance = Twin(discover=False), random.Random(number)
        twin.history = history
        acknowledged = killed_child(path, number, random.Random(number).uniform(0.0, 0.004))
        for k in range(acknowledged):
            act(twin, chance, k)
        allowed = [dump_document(twin.document)]
        act(twin, chance, acknowledged)
        allowed.append(dump_document(twin.document))
        recovered = Session.open(path, discover=False)
        assert dump_document(recovered.document) in allowed, f"kill {number} after {acknowledged} actions"
        assert not [found for found in tmp_path.iterdir() if found.name.startswith(f".{path.name}.")]
        interrupt(recovered)
        history = recovered.history
        actions += acknowledged
    assert actions > 2 * KILLS, "the children were killed before they did anything"


@posix
def test_a_full_disk_refuses_the_edit_and_keeps_everything(tmp_path: Path) -> None:
    import resource

    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        fill(session, 1)
        before, revision = session.document, session.revision
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        size = journal_path(path).stat().st_size
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 20, limits[1]))
        try:
            with pytest.raises(FileRefused, match=r"cannot be written: .*The edit was not made"):
                session.do(SetExtra("big", "x" * 5000))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert session.document is before and session.revision == revision
        assert journal_path(path).stat().st_size == size
        session.do(SetExtra("small", 1))  # there is room again, and the journal is still sound
        wanted = session.document
    assert same_documents(replay(read_journal(journal_path(path))).history.document, wanted)


@posix
def test_a_save_that_the_journal_has_no_room_to_record_is_recorded_with_the_next_edit(tmp_path: Path) -> None:
    """The document is written all the same: saving succeeds, and after a crash the journal still belongs to it."""
    import resource

    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    for number in range(40):
        session.do(SetExtra("number", number))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (journal_path(path).stat().st_size, limits[1]))
    try:
        session.save()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert session.history.is_clean and "saved" not in read_journal(journal_path(path)).events[-1]
    session.do(SetExtra("number", "after"))
    assert ["saved" in event for event in read_journal(journal_path(path)).events[-2:]] == [True, False]
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"number": "after"} and "recovered" in again.notes[0]
        again.undo()
        assert again.history.is_clean


def test_an_interrupted_journal_is_replayed_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    fill(session, 3)
    session.save()
    session.do(SetExtra("unsaved", [1, 2]))
    session.undo()
    session.redo()
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert same_documents(again.document, session.document)
        assert again.revision == session.revision and len(again.history.steps) == len(session.history.steps)
        assert "committed steps were recovered" in " ".join(again.notes)
        again.undo()  # the history came back too
        assert again.history.is_clean


def test_an_orderly_end_leaves_nothing_to_recover(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        fill(session, 4)
        session.save()
        saved = session.document
    with Session.open(path, discover=False) as again:
        assert again.notes == () and same_documents(again.document, saved)
        assert journal_path(path).with_name("document.json.journal.previous").exists()


def test_unsaved_edits_come_back_unless_discarded(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    for discard in (False, True):
        session = Session.open(path, discover=False)
        session.save()
        session.do(SetExtra("unsaved", discard))
        session.close(discard=discard)
        again = Session.open(path, discover=False)
        assert ("unsaved" in again.document.extras) != discard
        again.close(discard=True)


def test_a_document_changed_by_others_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.save()
    session.do(SetExtra("mine", 1))
    interrupt(session)
    other = History(session.history.base)
    other.do(SetExtra("theirs", 1))
    path.write_bytes(dump_document(other.document))
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"theirs": 1}
        assert "changed by something else" in again.notes[0]
    kept = path.with_name("document.json.journal.unused-1")
    assert dict(replay(read_journal(kept)).history.document.extras) == {"mine": 1}


def test_the_second_process_is_told_who_holds_it_and_reads_only(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    script = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from contact_core.edit.recovery import open_file, write_document\n"
        f"opened = open_file(Path({str(path)!r}))\n"
        "write_document(opened.path, opened.history.document)\n"
        "print('open', flush=True)\n"
        "sys.stdin.read()\n"
    )
    holder = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert holder.stdout is not None and holder.stdout.readline() == b"open\n"
        with Session.open(path, discover=False) as second:
            assert second.read_only
            assert f"process {holder.pid} of" in second.notes[0] and "read-only" in second.notes[0]
            with pytest.raises(CommandRejected, match="read-only"):
                second.do(SetExtra("a", 1))
            copy = second.save(tmp_path / "copy.json")  # elsewhere it may go on
            assert not second.read_only and copy.exists()
            second.do(SetExtra("a", 1))
            second.close(discard=True)
    finally:
        holder.kill()
        holder.wait()
    with Session.open(path, discover=False) as third:  # the lock died with its holder
        assert not third.read_only


def test_a_folder_that_cannot_be_written_opens_read_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A document on a read-only share can be looked at and saved elsewhere."""
    path = tmp_path / "share" / "document.json"
    with Session.open(path, discover=False) as session:
        fill(session, 5)
        session.save()
    real = os.open

    def refuse(name: object, flags: int, mode: int = 0o777) -> int:
        if flags & os.O_CREAT and "share" in str(name):
            raise PermissionError(13, "Permission denied")
        return real(name, flags, mode)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", refuse)
    with Session.open(path, discover=False) as shared:
        assert shared.read_only and "cannot be written (Permission denied)" in shared.notes[0]
        assert same_documents(shared.document, session.document)
        shared.save(tmp_path / "mine.json")
        shared.do(SetExtra("a", 1))
        shared.close(discard=True)
    with pytest.raises(FileRefused, match=r"cannot begin .*Permission denied"):
        Session.open(tmp_path / "share" / "new.json", discover=False)


def test_flushing_is_batched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Committing does not wait for the disk: a hundred edits in a burst cause a handful of flushes."""
    calls: list[float] = []
    real = os.fsync
    with Session.open(tmp_path / "document.json", discover=False) as session:
        monkeypatch.setattr(os, "fsync", lambda file: (calls.append(time.monotonic()), real(file))[1])
        begun = time.monotonic()
        for number in range(100):
            session.do(SetExtra("number", number))
        burst = time.monotonic() - begun
        deadline = time.monotonic() + 5.0
        while not calls and time.monotonic() < deadline:
            time.sleep(0.01)
        assert calls, "nothing was flushed to the disk"
        assert len(calls) <= 2 + burst / (journals.FLUSH_SECONDS / 2)
        session.close(discard=True)


def test_a_newer_journal_is_refused_and_left_untouched(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    header = encode_line(
        {"journal": "contact-core.journal", "version": 99, "revision": 0, "document": {}}, 1, "0" * 8
    )
    journal_path(path).write_bytes(header)
    with pytest.raises(FileRefused, match=r"version 99.*newer contact-core"):
        open_file(path)
    assert journal_path(path).read_bytes() == header


if __name__ == "__main__":
    kill_many_times(Path(sys.argv[1]))


def test_opening_what_was_closed_in_order_costs_its_document_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The old journal's document is not decoded and the new one's is not encoded, and the new journal is whole."""
    path = tmp_path / "d.json"
    with Session.open(path) as session:
        fill(session, 5)
        session.save()
        document = session.timed_document
    told: list[str] = []

    def count(module: ModuleType, name: str) -> None:
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *arguments: (told.append(name), real(*arguments))[1])

    count(journals, "content_with_digest")
    count(journal_file, "document_from_json")
    session = Session.open(path)
    assert told == [] and same_documents(session.timed_document, document)
    session.do(SetExtra("number", 1))
    interrupt(session)
    path.unlink()
    replayed = replay(read_journal(journal_path(path))).history
    assert same_documents(replayed.base, document) and replayed.document.extras["number"] == 1


def test_edits_that_were_not_saved_are_recovered_without_decoding_their_document_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The journal begins with the very bytes of the file: what they say is known. What nobody edited is shared."""
    path = tmp_path / "d.json"
    with Session.open(path) as session:
        fill(session, 5)
        session.save()
    session = Session.open(path)
    session.do(SetExtra("number", 1))
    meant = session.timed_document
    interrupt(session)
    decoded: list[str] = []
    real = journal_file.document_from_json
    monkeypatch.setattr(
        journal_file, "document_from_json", lambda *given: (decoded.append(given[1]), real(*given))[1]
    )
    with Session.open(path) as session:
        assert same_documents(session.timed_document, meant) and not decoded
        assert session.notes and session.history.base_revision == 0
    whole = read_journal(journal_path(path))
    other = ContactDocument()
    beside = read_journal(journal_path(path), (dump_document(other), other))  # another document than the line has
    assert same_documents(whole.base or other, beside.base or other) and len(decoded) == 2
