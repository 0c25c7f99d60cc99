"""Opening and saving in trouble: whatever ended a session, the next one has all that was committed, and says so."""

from __future__ import annotations

import errno
import os
import stat
import threading
import zlib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from contact_core.cli import main
from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_digest, document_to_json, dump_document
from contact_core.edit.commands import SetExtra
from contact_core.edit.history import History
from contact_core.edit.journal_file import decode_line, encode_line, read_journal
from contact_core.edit.recovery import accept_file, journal_path, read_only_document, write_document
from contact_core.edit.replay import replay
from contact_core.errors import CommandRejected, FileRefused
from contact_core.session import Session
from contact_core.testing.random_commands import random_history


def interrupt(session: Session) -> None:
    """Let go as a killed process does: the journal has no end, and the next opening replays it."""
    assert session._file is not None
    session._file.close(in_order=False)


EMPTY_ID = document_digest(ContactDocument())[:8]


def next_line(journal: Path, event: dict[str, Any]) -> bytes:
    """The line that a journal would get for an event."""
    contents = read_journal(journal)
    return encode_line(event, contents.last_number + 1, contents.journal_id)


def kept_beside(path: Path) -> list[bytes]:
    return [found.read_bytes() for found in path.parent.iterdir() if found.name.startswith(path.name)]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), position=st.floats(0.0, 1.0), backwards=st.integers(0, 4))
@example(seed=3825, position=0.9375, backwards=1)
def test_a_history_that_began_elsewhere_is_recovered_with_all_its_steps(
    tmp_path_factory: pytest.TempPathFactory, seed: int, position: float, backwards: int
) -> None:
    """Saved for the first time, or under another name, in the middle of a history: undo past that point, then a
    crash. Journals that began at the save could not replay such an undo, nor anything after it."""
    folder = tmp_path_factory.mktemp("elsewhere")
    steps = random_history(seed, 12, still=True).steps
    session, middle = Session(discover=False), int(position * len(steps))
    for step in steps[:middle]:
        session.do(step.command)
    session.save(folder / "a.json")
    if seed % 2:
        session.save(folder / "b.json")
    for _ in range(min(backwards, middle)):
        session.undo()
    if seed % 3:
        session.do(SetExtra("after", seed))
    path = session.path
    assert path is not None
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert dump_document(again.document) == dump_document(session.document)
        assert again.revision == session.revision
        # saved is what the file says: after the undo of a step that changed nothing, too
        assert again.history.is_clean == (dump_document(session.document) == path.read_bytes())
        assert [step.revision for step in again.history.steps] == [s.revision for s in session.history.steps]
        while again.history.can_undo:
            again.undo()
        assert dump_document(again.document) == dump_document(session.history.base)
        again.close(discard=True)


def test_a_damaged_document_lives_on_in_its_journal_until_it_is_saved(tmp_path: Path) -> None:
    """Opened and closed without an edit it is not clean: no document file holds it."""
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("precious", 1))
    session.save()
    for in_order in (True, False):
        session._file.close(in_order=in_order)  # type: ignore[union-attr]
        path.write_bytes(b"garbage")
        for _ in range(3):
            session = Session.open(path, discover=False)
            assert dict(session.document.extras) == {"precious": 1} and not session.history.is_clean
            session.close()
        session = Session.open(path, discover=False)
        session.save()
    assert kept_beside(path).count(b"garbage") == 2
    session.close()
    with Session.open(path, discover=False) as sound:
        assert sound.notes == () and dict(sound.document.extras) == {"precious": 1}


def test_an_edit_by_hand_is_no_loss(tmp_path: Path) -> None:
    """It is refused untouched, with the journal that holds the other version, until somebody accepts it."""
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("number", 1))
        session.save()
    edited = path.read_bytes().replace(b'"number": 1', b'"number": 7')
    path.write_bytes(edited)
    beside = kept_beside(path)
    with pytest.raises(FileRefused, match="does not fit its content"):
        Session.open(path, discover=False)
    assert kept_beside(path) == beside
    assert main(["accept", str(path)]) == 0
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"number": 7}
        with pytest.raises(FileRefused, match=r"cannot accept .*is open in process"):
            accept_file(path)
    with pytest.raises(FileRefused, match="cannot read"):
        accept_file(tmp_path / "nothing.json")


def test_a_crash_between_writing_the_file_and_noting_it_keeps_the_history(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("a", 1))
    write_document(path, session.document)
    interrupt(session)
    session = Session.open(path, discover=False)
    assert "no edit that is not saved" in session.notes[0] and session.history.is_clean and session.history.can_undo
    session.do(SetExtra("b", 2))  # and the crash after that
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"a": 1, "b": 2} and not again.history.is_clean
        again.close(discard=True)


def test_a_journal_that_cannot_be_replayed_to_its_end_goes_on_from_there(tmp_path: Path) -> None:
    """The artist undoes past the place where the new journal began, and crashes again."""
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    for number in range(3):
        session.do(SetExtra("number", number))
    session.save()
    interrupt(session)
    beside = journal_path(path)
    lost = {"at": 9, "do": {"command": "contact.of an absent plugin"}, "origin": "user"}
    beside.write_bytes(beside.read_bytes() + next_line(beside, lost))
    whole = beside.read_bytes()
    session = Session.open(path, discover=False)
    assert "the plugin that brings it is absent" in session.notes[0] and session.history.is_clean
    assert whole in kept_beside(path)
    session.undo()
    session.undo()
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"number": 0} and len(again.history.steps) == 3
        again.close(discard=True)


def test_a_document_that_the_host_brought_is_recovered_too(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("mine", 1))
    session.save()
    theirs = History(session.document, 40)
    theirs.do(SetExtra("host", 2))
    session.adopt(theirs)
    session.undo()
    session.do(SetExtra("after", 3))
    interrupt(session)
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"mine": 1, "after": 3} and again.revision == session.revision
        assert not again.history.is_clean
        again.close(discard=True)


def test_saving_over_an_interrupted_document_keeps_its_journal(tmp_path: Path) -> None:
    session = Session.open(tmp_path / "b.json", discover=False)
    session.do(SetExtra("precious", 1))
    interrupt(session)
    with Session(discover=False) as other:
        other.save(tmp_path / "b.json")
        assert "is kept as b.json.journal.unused-1" in other.notes[0]
    kept = replay(read_journal(tmp_path / "b.json.journal.unused-1")).history
    assert dict(kept.document.extras) == {"precious": 1}


def test_saving_keeps_what_something_else_wrote_meanwhile(tmp_path: Path) -> None:
    """Version control brought another version while the session was open; no lock keeps it from that."""
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("a", 1))
        session.save()
        session.do(SetExtra("a", 2))
        session.save()
        assert session.notes == ()
        theirs = History(ContactDocument())
        theirs.do(SetExtra("theirs", 1))
        write_document(path, theirs.document)
        session.save()
        assert session.notes == ("document.json was changed by something else; that version is kept as"
                                 " document.json.replaced-1.",)  # fmt: skip
        assert dict(read_only_document(path).extras) == {"a": 2}
        kept = path.with_name("document.json.replaced-1")
        assert dict(read_only_document(kept).extras) == {"theirs": 1}


def test_one_file_is_one_document_however_it_is_spelt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "document.json"
    link = tmp_path / "link.json"
    monkeypatch.chdir(tmp_path)
    with Session.open("document.json", discover=False) as session:
        session.save()
        link.symlink_to(path)
        for spelling in (link, tmp_path / "." / "document.json", Path("document.json")):
            with Session.open(spelling, discover=False) as second:
                assert second.read_only, spelling
        assert session.save(link) == path and not session.read_only
        assert link.is_symlink()
        (tmp_path / "elsewhere").mkdir()
        monkeypatch.chdir(tmp_path / "elsewhere")
        session.do(SetExtra("a", 1))
        session.save()
        assert list(Path().iterdir()) == []
    with Session.open(link, discover=False) as again:
        assert dict(again.document.extras) == {"a": 1}
        again.do(SetExtra("b", 1))
        again.save()
    assert link.is_symlink() and b'"b": 1' in path.read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="permissions of other systems differ")
def test_permissions_are_kept_and_obeyed(tmp_path: Path) -> None:
    """What is private stays private, and what version control protects is not renamed away."""
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.save()
        path.chmod(0o600)
        session.do(SetExtra("a", 1))
        session.save()
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.chmod(0o444)
    before = path.read_bytes()
    with Session.open(path, discover=False) as protected:
        assert protected.read_only and "write-protected; it is opened read-only" in protected.notes[0]
        with pytest.raises(CommandRejected, match="write-protected"):
            protected.do(SetExtra("a", 2))
        with pytest.raises(FileRefused, match=r"cannot save there: document\.json is write-protected"):
            protected.save()
        protected.save(tmp_path / "mine.json")
        protected.do(SetExtra("a", 2))
        protected.close(discard=True)
    assert path.read_bytes() == before


def test_a_document_without_a_file_yet_is_read_from_the_journal_of_its_holder(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as holder:
        holder.do(SetExtra("a", 1))
        with Session.open(path, discover=False) as second:
            assert second.read_only and "is open in process" in second.notes[0]
            assert dict(second.document.extras) == {"a": 1}
        assert dict(read_only_document(path).extras) == {"a": 1}
        holder.close(discard=True)


def test_a_closed_session_says_that_it_is_closed(tmp_path: Path) -> None:
    session = Session.open(tmp_path / "document.json", discover=False)
    session.do(SetExtra("a", 1))
    interrupt(session)
    session = Session.open(tmp_path / "document.json", discover=False)
    assert session.notes  # what opening found is no reason to refuse an edit
    session.close()
    session.close()
    for act in (lambda: session.do(SetExtra("a", 1)), session.undo):
        with pytest.raises(CommandRejected, match=r"document\.json is closed"):
            act()


def test_a_failing_disk_lets_go_of_the_document(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Closing fails in a sentence and lets go; saving elsewhere goes on there."""
    real = os.fsync

    def fails_on_journals(file: int) -> None:
        if Path(f"/proc/self/fd/{file}").readlink().name in ("a.json.journal", "b.json.journal"):
            raise OSError(5, "Input/output error")
        real(file)

    if not Path("/proc/self/fd").exists():
        pytest.skip("which file a descriptor means is asked of /proc")
    session = Session.open(tmp_path / "a.json", discover=False)
    session.do(SetExtra("a", 1))
    monkeypatch.setattr(os, "fsync", fails_on_journals)
    session.save(tmp_path / "b.json")
    assert session.path == tmp_path / "b.json"
    with pytest.raises(FileRefused, match="Input/output error"):
        session.close()
    monkeypatch.undo()
    with Session.open(tmp_path / "a.json", discover=False) as again:
        assert not again.read_only  # whether its journal could note its end is the disk's affair
    with Session.open(tmp_path / "b.json", discover=False) as again:
        assert not again.read_only and dict(again.document.extras) == {"a": 1}


def test_an_edit_does_not_wait_for_a_slow_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While the flushing thread hangs in fsync, edits are recorded all the same."""
    flushing, go_on, went_on, real = threading.Event(), threading.Event(), threading.Event(), os.fsync

    def hangs(file: int) -> None:
        flushing.set()
        go_on.wait(60.0)
        went_on.set()
        real(file)

    with Session.open(tmp_path / "document.json", discover=False) as session:
        monkeypatch.setattr(os, "fsync", hangs)
        session.do(SetExtra("number", 0))
        assert flushing.wait(30.0)
        for number in range(100):
            session.do(SetExtra("number", number))
        assert not went_on.is_set(), "the edits waited for the disk"
        assert len(read_journal(journal_path(tmp_path / "document.json")).events) == 101
        go_on.set()
        session.close(discard=True)


EVENTS: list[Any] = [
    {"at": "x", "do": {"command": "document.extra", "namespace": "a", "value": 1}, "origin": "user"},
    {"at": 3.7, "do": {"command": "document.extra", "namespace": "a", "value": 1}, "origin": "user"},
    {"at": 1 << 70, "do": {"command": "document.extra", "namespace": "a", "value": 1}, "origin": "user"},
    {"do": {"command": "document.extra", "namespace": "a", "value": 1}, "origin": "user"},
    {"at": 1, "do": 5, "origin": "user"},
    {"at": 1, "merged": True, "do": {"command": "document.extra", "namespace": "a", "value": 1}},
    {"goto": "q"},
    {"goto": None},
    {"goto": True},
    {"saved": 1},
    {"saved": "x", "file": "y"},
    {"saved": 1, "file": ["y"]},
]


@pytest.mark.parametrize("event", EVENTS, ids=repr)
def test_an_event_that_nobody_wrote_is_left_out_in_a_sentence(tmp_path: Path, event: Any) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("sound", 1))
    session.do(SetExtra("sound", 2))
    interrupt(session)
    lines = journal_path(path).read_bytes().splitlines(keepends=True)
    last = decode_line(lines[2])
    assert last is not None
    lines[2:] = [encode_line(event, 3, EMPTY_ID), encode_line(last.event, 4, EMPTY_ID)]
    journal_path(path).write_bytes(b"".join(lines))
    with Session.open(path, discover=False) as again:
        assert "the event on line 3 cannot be replayed: " in again.notes[0]
        assert "Replayed without what is lost before: 1 step;" in again.notes[0]
        assert dict(again.document.extras) == {"sound": 2}
        again.undo()
        assert dict(again.document.extras) == {"sound": 1}
        again.close(discard=True)


@pytest.mark.parametrize("body", [b"[" * 100_000, b"nope", b"5", b"\xff", b"1" * 5000], ids=lambda body: body[:4])
def test_a_whole_line_that_is_no_event_is_damage(tmp_path: Path, body: bytes) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("sound", 1))
    interrupt(session)
    beside = journal_path(path)
    body = b"3 %b %b" % (EMPTY_ID.encode(), body)
    beside.write_bytes(beside.read_bytes() + b"%08x %b\n" % (zlib.crc32(body), body))
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"sound": 1} and "follows line 2 of" in again.notes[0]
        again.close(discard=True)


@pytest.mark.parametrize(
    "change",
    [{"revision": None}, {"revision": "x"}, {"revision": -1}, {"version": True}, {"version": 0}, {"file": [1]}],
    ids=repr,
)
def test_a_first_line_that_nobody_wrote_is_kept_and_said(tmp_path: Path, change: dict[str, Any]) -> None:
    head = {"journal": "contact-core.journal", "version": 1, "revision": 0, "file": None}
    path = tmp_path / "document.json"
    head = {**head, "document": document_to_json(ContactDocument()), **change}
    line = encode_line(head, 1, EMPTY_ID)
    journal_path(path).write_bytes(line)
    with Session.open(path, discover=False) as session:
        assert "is kept as document.json.journal.damaged-1" in session.notes[0]
    assert line in kept_beside(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a file without an end")
def test_files_without_an_end_are_refused_before_they_are_read(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    for path in (Path("/dev/zero"), pipe, tmp_path):
        with pytest.raises(FileRefused, match="cannot read"):
            read_only_document(path)
    huge = tmp_path / "huge.json"
    with huge.open("wb") as stream:
        stream.truncate((1 << 30) + 1)  # a hole: no disk is used
    with pytest.raises(FileRefused, match="are refused"):
        read_only_document(huge)


@pytest.mark.skipif(os.name == "nt", reason="locks as POSIX has them")
def test_a_drive_that_refuses_locks_is_named_and_opened_read_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As NFS 3 does without its lock service; nobody is blamed for having the document open."""
    import fcntl

    def refused(file: int, how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    path = tmp_path / "d.json"
    write_document(path, ContactDocument())
    before = path.read_bytes()
    monkeypatch.setattr(fcntl, "flock", refused)
    with Session.open(path, discover=False) as session:
        assert session.read_only and "takes no locks (No locks available)" in session.notes[0]
        with pytest.raises(FileRefused, match="takes no locks"):
            session.save()
    monkeypatch.undo()
    assert path.read_bytes() == before
    with Session.open(path, discover=False) as session:
        assert not session.read_only
