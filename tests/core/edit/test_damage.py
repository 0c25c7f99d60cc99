"""Damaged files: whatever happens to the bytes of a document or its journal, nothing is lost without a word."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_digest
from contact_core.edit.commands import SetExtra
from contact_core.edit.history import History
from contact_core.edit.journal_file import decode_line, read_journal
from contact_core.edit.recovery import journal_path
from contact_core.edit.replay import replay
from contact_core.errors import FileRefused
from contact_core.session import Session
from contact_core.testing.random_commands import random_history

KINDS = ("flip", "hole", "cut", "gone", "twice")


def interrupt(session: Session) -> None:
    """Let go as a killed process does: the journal has no end, and the next opening replays it."""
    assert session._file is not None
    session._file.close(in_order=False)


def damaged(raw: bytes, kind: str, start: int, length: int, bit: int) -> bytes:
    """Bytes of which something happened to `length` from `start` on."""
    data = bytearray(raw)
    if kind == "flip":
        data[start] ^= 1 << bit
    elif kind == "hole":
        data[start : start + length] = bytes(len(data[start : start + length]))
    elif kind == "cut":
        del data[start:]
    elif kind == "gone":
        del data[start : start + length]
    else:
        data[start:start] = data[start : start + length]
    return bytes(data)


@pytest.fixture(scope="module", params=["saved before", "new", "saved since"])
def crashed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, ContactDocument]:
    """A folder as a killed session left it, with edits that were never saved, and the document that it had."""
    path = tmp_path_factory.mktemp("crashed") / "document.json"
    steps = random_history(5, 14, still=True).steps
    session = Session.open(path, discover=False)
    for number, step in enumerate(steps):
        session.do(step.command)
        if number == 5 and request.param == "saved before":
            session.save()
            session.close()
            session = Session.open(path, discover=False)
        if number == 5 and request.param == "saved since":
            session.save()
    session.undo()
    session.do(SetExtra("last", 1))
    session.do(SetExtra("last", 2), merge=True)
    interrupt(session)
    return path, session.document


@settings(max_examples=60)
@given(
    kind=st.sampled_from(KINDS),
    where=st.floats(0.0, 1.0),
    length=st.integers(1, 5000),
    bit=st.integers(0, 7),
    in_journal=st.booleans(),
)
@example(kind="flip", where=0.0, length=1, bit=0, in_journal=True)
def test_nothing_is_lost_in_silence(
    crashed: tuple[Path, ContactDocument], tmp_path_factory: pytest.TempPathFactory,
    kind: str, where: float, length: int, bit: int, in_journal: bool,
) -> None:  # fmt: skip
    """The document comes back as it was, or the notes (or the refusal) tell what is damaged, and the damaged file
    lies there under a name that no later opening takes. What was before the damage is there in any case."""
    source, before = crashed
    folder = tmp_path_factory.mktemp("damage")
    for file in source.parent.iterdir():
        shutil.copy(file, folder)
    path = folder / source.name
    target = journal_path(path) if in_journal or not path.exists() else path
    raw = target.read_bytes()
    broken = damaged(raw, kind, int(where * (len(raw) - 1)), length, bit)
    target.write_bytes(broken)
    try:
        for opening in range(2):
            with Session.open(path, discover=False) as session:
                same = document_digest(session.document) == document_digest(before)
                if opening == 0:
                    told = " ".join(session.notes)
                    assert "not closed in order" in told or "kept as" in told, "nothing is said"
                    if not same and not _is_a_shorter_journal(raw, broken):
                        assert any(word in told for word in ("amaged", "does not fit")), told
                if not same:
                    assert broken in [found.read_bytes() for found in folder.iterdir()], opening
                session._file.close(in_order=False)  # type: ignore[union-attr]
    except FileRefused as refused:
        assert not in_journal and "document.json" in str(refused)
        assert broken in [found.read_bytes() for found in folder.iterdir()]
    shutil.rmtree(folder)


def _is_a_shorter_journal(raw: bytes, broken: bytes) -> bool:
    """Cut exactly between two lines: a journal that such a session might have left a moment before."""
    return raw.startswith(broken) and broken.endswith(b"\n")


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), data=st.data())
def test_what_lies_before_and_after_a_lost_line_is_replayed(
    tmp_path_factory: pytest.TempPathFactory, seed: int, data: st.DataObject
) -> None:
    """Independent edits: all but the lost one are there, whichever it is, and undo goes back through them."""
    count = data.draw(st.integers(2, 12))
    path = tmp_path_factory.mktemp("lost") / "document.json"
    session = Session.open(path, discover=False)
    for number in range(count):
        session.do(SetExtra(f"n{number}", int(seed)))
    interrupt(session)
    lost = data.draw(st.integers(0, count - 1))
    lines = journal_path(path).read_bytes().splitlines(keepends=True)
    journal_path(path).write_bytes(b"".join(lines[: lost + 1] + lines[lost + 2 :]))
    with Session.open(path, discover=False) as again:
        expected = {f"n{number}" for number in range(count) if number != lost}
        assert set(again.document.extras) == expected
        if lost < count - 1:
            assert f"Damaged or missing in document.json.journal: line {lost + 2}." in again.notes[0]
        for _ in range(count - 1):
            again.undo()
        assert not again.document.extras
        again.close(discard=True)


def test_a_lost_first_line_is_made_up_by_the_document_file(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("saved", 1))
        session.save()
    session = Session.open(path, discover=False)
    session.do(SetExtra("unsaved", 2))
    interrupt(session)
    beside = journal_path(path)
    raw = beside.read_bytes()
    beside.write_bytes(b"\0" * raw.index(b"\n") + raw[raw.index(b"\n") :])
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"saved": 1, "unsaved": 2}
        assert "Damaged or missing in document.json.journal: line 1." in again.notes[0]
        again.undo()
        assert again.history.is_clean
        again.close(discard=True)
    other = tmp_path / "other.json"
    with Session.open(other, discover=False) as session:
        session.do(SetExtra("other", 1))
        session.save()
    beside.write_bytes(b"\0" * raw.index(b"\n") + raw[raw.index(b"\n") :])
    path.write_bytes(other.read_bytes())  # not the document that the journal began with
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"other": 1}
        assert "does not lead to the document file" in again.notes[0]


def test_after_a_damaged_line_the_saved_file_is_where_to_begin(tmp_path: Path) -> None:
    """Nothing is lost but the steps to undo: the file holds what the lost line led to."""
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    history = random_history(3, 12, still=True).steps
    for step in history[:8]:
        session.do(step.command)
    session.save()
    for step in history[8:]:
        session.do(step.command)
    interrupt(session)
    beside = journal_path(path)
    raw = bytearray(beside.read_bytes())
    raw[raw.index(b"\n") + 30] ^= 1
    beside.write_bytes(raw)
    with Session.open(path, discover=False) as again:
        assert document_digest(again.document) == document_digest(session.document)
        assert again.revision == session.revision
        assert [step.revision for step in again.history.steps] == [step.revision for step in history[8:]]
        again.close(discard=True)


def test_a_merged_step_whose_first_half_is_lost_is_a_step(tmp_path: Path) -> None:
    """It holds both halves, and must not take the place of the step before."""
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("before", 1))
    session.do(SetExtra("number", 1))
    session.do(SetExtra("number", 2), merge=True)
    interrupt(session)
    lines = journal_path(path).read_bytes().splitlines(keepends=True)
    assert decode_line(lines[3]).event["merged"]  # type: ignore[union-attr]
    journal_path(path).write_bytes(b"".join([*lines[:2], b"garbage\n", lines[3]]))
    history = replay(read_journal(journal_path(path))).history
    assert dict(history.document.extras) == {"before": 1, "number": 2} and len(history.done) == 2


def test_lines_that_moved_or_came_from_elsewhere_are_put_right(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    paths = []
    for name in ("a", "b"):
        paths.append(tmp_path / f"{name}.json")
        with Session.open(paths[-1], discover=False) as session:
            session.do(SetExtra(name, 0))
            session.save()
        session = Session.open(paths[-1], discover=False)
        for number in range(6):
            session.do(SetExtra(f"{name}{number}", 1))
        interrupt(session)
    a, b = (journal_path(path).read_bytes().splitlines(keepends=True) for path in paths)
    mixed = [*a, *a[2:4], b[2], b"junk\n"]
    mixed = [mixed[k] for k in rng.permutation(len(mixed))]
    journal_path(paths[0]).write_bytes(b"".join(mixed))
    with Session.open(paths[0], discover=False) as again:
        assert dict(again.document.extras) == {"a": 0, **{f"a{number}": 1 for number in range(6)}}
        assert "doubled, moved" in again.notes[0] and "kept as a.json.journal.damaged-1" in again.notes[0]
        again.close(discard=True)


def test_going_back_to_a_lost_revision_goes_to_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    for number in range(4):
        session.do(SetExtra("number", number))
    session.undo()
    session.undo()
    interrupt(session)
    lines = journal_path(path).read_bytes().splitlines(keepends=True)
    journal_path(path).write_bytes(b"".join(lines[:2] + lines[3:]))  # number 1 is what the artist went back to
    history = replay(read_journal(journal_path(path))).history
    assert isinstance(history, History) and dict(history.document.extras) == {"number": 0} and history.can_redo
