"""`contact history`, `replay` and `diff` say what happened in the artist's terms."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.document.schema import dump_document, same_documents
from contact_core.edit.recovery import read_document, write_document
from contact_core.edit.summaries import changes, diff_lines, history_lines, replay_lines
from contact_core.errors import FileRefused
from contact_core.session import Session
from contact_core.testing.random_commands import random_history


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_a_diff_is_empty_exactly_when_documents_are_equal(seed: int) -> None:
    for step in random_history(seed, 25, still=True).steps:
        told = list(changes(step.before, step.after))
        same = dump_document(step.before) == dump_document(step.after)
        assert (told == []) == same, (step.command.label(), told)
        assert all(len(line) < 300 for line in told)
        assert list(changes(step.after, step.after)) == []


def test_edits_are_told_in_words(session: Session) -> None:
    before = session.document
    session.patches.rotate("palm", 0.5)
    session.patches.bend("palm", 1, 0.2)
    session.patches.scale("thumb", along=0.8)
    session.patches.link("tip", "thumb")
    session.patches.recolor("tip", (0.0, 0.0, 0.0))
    assert list(changes(before, session.document)) == [
        "patch palm: rotated by +28.6 degrees",
        "patch palm: bent by +11.5 degrees at axis point 1",
        "patch thumb: scaled to 0.8 along and 1 across its axis",
        "patch tip: is a child of thumb now",
        "patch tip: recoloured",
    ]


def test_history_and_replay_read_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    for step in random_history(3, 8, still=True).steps:
        session.do(step.command, origin="script" if step.revision == 2 else "user")
    session.undo()
    session.save()
    running = history_lines(path)
    assert running[0].startswith("document.json.journal: ") and "not closed" in running[-1]
    assert len(running) == len(session.history.steps) + 2
    assert [line[0] for line in running[1:-1]].count(">") == 1 and running[-2].startswith("- ")
    assert running[2].endswith("(script)")
    wanted = session.document
    session.close()
    assert history_lines(path)[-1] == "closed in order"
    out = tmp_path / "again.json"
    told = replay_lines(path.with_name("document.json.journal"), out)
    assert told[0].startswith("replayed ") and told[-1] == f"wrote {out}"
    assert same_documents(read_document(out)[0], wanted)
    with pytest.raises(FileRefused, match="overwrites nothing"):
        replay_lines(path, out)


def test_titles_send_nothing_to_the_terminal_but_text(tmp_path: Path) -> None:
    session = Session.open(tmp_path / "document.json", discover=False)
    with session.macro("Arr\x1b[2Jange\n> 99 Forged"):
        session.set_extra("a", 1)
        session.set_extra("b", 1)
    assert history_lines(tmp_path / "document.json")[1].endswith("1  Arr?[2Jange?> 99 Forged")
    session.close(discard=True)


def test_a_damaged_journal_is_told(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    for step in random_history(3, 8, still=True).steps:
        session.do(step.command)
    session.close(discard=True)
    beside = path.with_name("document.json.journal")
    beside.write_bytes(beside.read_bytes()[:-30])
    assert any(line.startswith("! What follows line") for line in history_lines(path))


def test_files_that_are_missing_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileRefused, match="no journal of"):
        history_lines(tmp_path / "nothing.json")
    write_document(tmp_path / "a.json", random_history(1, 2).document)
    with pytest.raises(FileRefused, match=r"cannot read .*b\.json"):
        diff_lines(tmp_path / "a.json", tmp_path / "b.json")
