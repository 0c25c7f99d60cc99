"""The session between edits: macros within macros, drags that end badly, listeners that edit, hosts that jump,
threads that meet."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from contact_core.document.document import ContactDocument
from contact_core.edit.commands import SetExtra
from contact_core.edit.recovery import journal_path
from contact_core.errors import CommandRejected, FileRefused
from contact_core.geometry.mesh import TriangleMesh
from contact_core.plugins import hookimpl
from contact_core.scene.memory_host import MemoryHost
from contact_core.session import DocumentChanged, Session
from contact_core.testing.strategies import cached_family


def extras(session: Session) -> dict[str, Any]:
    return dict(session.document.extras)


@pytest.fixture
def plain() -> Session:
    return Session(discover=False)


def test_a_macro_within_a_macro_that_fails_takes_back_its_own_part_alone(plain: Session) -> None:
    with plain.macro("outer"):
        plain.set_extra("first", 1)
        with pytest.raises(ZeroDivisionError), plain.macro("inner"):
            plain.set_extra("second", 2)
            with plain.macro("innermost"):
                plain.set_extra("third", 3)
            raise ZeroDivisionError
        assert extras(plain) == {"first": 1}
        plain.set_extra("fourth", 4)
    assert extras(plain) == {"first": 1, "fourth": 4} and len(plain.history.steps) == 1


def test_nothing_but_the_stroke_edits_while_a_stroke_is_under_way(plain: Session) -> None:
    """Not even within a macro, whose commands would come before the drag that began earlier."""
    with plain.macro("outer"):
        with plain.stroke() as stroke:
            stroke.do(SetExtra("drag", 1))
            for act in (lambda: plain.set_extra("other", 1), plain.undo, plain.stroke().__enter__):
                with pytest.raises(CommandRejected, match="stroke is under way"):
                    act()
        plain.set_extra("after", 1)
    assert extras(plain) == {"drag": 1, "after": 1}


@pytest.mark.parametrize("kept", [True, False], ids=["committed", "refused"])
def test_a_drag_that_cannot_be_committed_is_taken_off_the_screen(tmp_path: Path, kept: bool) -> None:
    session = Session.open(tmp_path / "document.json", discover=False)
    told: list[DocumentChanged] = []
    session.listen(told.append)
    if not kept:
        session._file._journal._broken = "the disk is full."  # type: ignore[union-attr]
        with pytest.raises(FileRefused, match="disk is full"), session.stroke() as stroke:
            stroke.do(SetExtra("drag", 1))
    else:
        with session.stroke() as stroke:
            stroke.do(SetExtra("drag", 1))
    assert told[-1].after is session.document
    assert [change.kind for change in told] == ["preview", "do" if kept else "preview"]
    assert ("drag" in session.document.extras) == kept
    session.close(discard=True)


def test_listeners_that_edit_leave_nobody_with_an_older_document(plain: Session) -> None:
    heard: list[tuple[str, int]] = []

    def answers(change: DocumentChanged) -> None:
        if change.kind == "do" and "number" not in change.after.extras:
            plain.set_extra("number", 1)
            plain.undo()
            plain.redo()

    plain.listen(answers)
    plain.listen(lambda change: heard.append((change.kind, change.revision)))
    plain.set_extra("a", 1)
    assert heard == [("do", 1), ("do", 2), ("undo", 1), ("redo", 2)]


def test_who_is_told_of_a_surface_can_ask_for_its_mesh(plain: Session) -> None:
    got: list[TriangleMesh] = []
    plain.listen(lambda change: got.append(plain.geometry.mesh("torus")))
    torus = cached_family("torus")
    plain.surfaces.add("torus", torus)
    stretched = torus.with_points(torus.points * 1.5)
    plain.surfaces.add("torus", stretched)
    assert got == [torus, stretched]


def test_plugins_hear_of_the_first_commit_though_nobody_asked_for_plugins() -> None:
    class Hears:
        told: list[tuple[int, str]] = []

        @hookimpl
        def contact_document_changed(self, document: ContactDocument, revision: int, origin: str) -> None:
            self.told.append((revision, origin))

    session = Session(plugins=[Hears()], discover=False)
    with session.stroke() as stroke:
        stroke.do(SetExtra("a", 1))
    session.undo()
    assert Hears.told == [(1, "user"), (0, "user")]


def test_a_host_asked_to_undo_during_a_drag_is_not_asked() -> None:
    """Its undo would go through, and the session could not follow."""
    host = MemoryHost()
    session = Session(host=host, discover=False)
    session.set_extra("a", 1)
    with session.stroke() as stroke:
        stroke.do(SetExtra("drag", 1))
        for act in (session.undo, session.redo):
            with pytest.raises(CommandRejected, match="stroke is under way"):
                act()
    stamp = host.stored_stamp()
    assert stamp is not None and stamp.revision == session.revision and extras(session) == {"a": 1, "drag": 1}


@pytest.mark.parametrize("known", [True, False], ids=["a revision of the history", "a document unknown"])
def test_a_host_that_undoes_by_itself_during_a_drag_ends_the_drag(known: bool) -> None:
    host = MemoryHost()
    session = Session(host=host, discover=False)
    session.set_extra("a", 1)
    if not known:  # a session that comes later to what another left in the host
        session.close()
        session = Session(host=host, discover=False)
    with session.stroke() as stroke:
        stroke.do(SetExtra("drag", 1))
        assert host.undo()
        assert extras(session) == {}
        with pytest.raises(CommandRejected, match="stroke is over"):
            stroke.do(SetExtra("drag", 2))
    assert extras(session) == {}
    assert host.redo() and extras(session) == {"a": 1}
    with pytest.raises(CommandRejected, match="host went to another document"), session.macro("Arrange"):
        session.set_extra("b", 1)
        assert host.undo() and extras(session) == {}
        with pytest.raises(CommandRejected, match="nothing of it is done"):
            session.set_extra("c", 1)
    assert extras(session) == {}
    session.set_extra("c", 1)
    assert extras(session) == {"c": 1}


def test_where_the_host_went_the_session_goes_though_the_journal_cannot(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    host = MemoryHost()
    session = Session(host=host, discover=False)
    session.set_extra("a", 1)
    session.save(tmp_path / "document.json")
    session._file._journal._broken = "the disk is full."  # type: ignore[union-attr]
    with pytest.raises(FileRefused, match="disk is full"):
        session.set_extra("b", 1)
    stamp = host.stored_stamp()
    assert stamp is not None and stamp.revision == session.revision == 1
    told: list[str] = []
    session.listen(lambda change: told.append(change.kind))
    session.undo()
    assert host.stored_document() is None and extras(session) == {} and told == ["goto"]
    assert "disk is full" in caplog.text
    session.close(discard=True)


@pytest.mark.parametrize("inside", ["stroke", "macro", "listener"])
def test_a_second_thread_is_refused_while_the_first_edits(plain: Session, inside: str) -> None:
    answers: list[str] = []

    def meanwhile() -> None:
        for act in (lambda: plain.do(SetExtra("other", 1)), plain.undo, plain.macro("m").__enter__):
            try:
                act()
                answers.append("done")
            except CommandRejected as error:
                answers.append(str(error))

    def run_other(*_: object) -> None:
        other = threading.Thread(target=meanwhile)
        other.start()
        other.join()

    plain.set_extra("a", 1)
    if inside == "listener":
        dispose = plain.listen(run_other)
        plain.set_extra("b", 1)
        dispose()
    else:
        with getattr(plain, inside)(*["Arrange"][: inside == "macro"]) as editor:
            editor.do(SetExtra("b", 1))
            run_other()
    assert extras(plain) == {"a": 1, "b": 1}
    assert len(answers) == 3 and all("one thread at a time" in answer for answer in answers)
    plain.do(SetExtra("free", 1))


def test_threads_that_race_lose_no_edit_that_was_acknowledged(tmp_path: Path) -> None:
    session = Session.open(tmp_path / "document.json", discover=False)
    begin, acknowledged = threading.Barrier(3), [[], [], []]  # type: ignore[var-annotated]

    def work(number: int) -> None:
        begin.wait()
        for count in range(150):
            try:
                session.do(SetExtra(f"{number}.{count}", count))
                acknowledged[number].append(f"{number}.{count}")
            except CommandRejected:
                pass

    threads = [threading.Thread(target=work, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(session.document.extras) == {name for names in acknowledged for name in names}
    session._file.close(in_order=False)  # type: ignore[union-attr]
    with Session.open(tmp_path / "document.json", discover=False) as again:
        assert extras(again) == extras(session) and journal_path(tmp_path / "document.json").exists()
        again.close(discard=True)


def test_a_drag_sees_the_pose_that_the_session_sees(session: Session) -> None:
    """What touches is asked of the posed skin, within a stroke as without."""
    with session.stroke() as stroke:
        assert stroke.rigs is session.rigs
        assert type(stroke.geometry) is type(session.geometry)
