"""Files in the plain window: typed into a prompt, completed, dropped; and what is refused."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("vtkmodules")

from contact_viewer.prompt import completed, paths
from tests.adapters.viewer.test_viewer_library import typed
from tests.adapters.viewer.viewer_scenes import Hand, application


@pytest.fixture
def hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hand]:
    monkeypatch.chdir(tmp_path)
    app = application(["sample:baseball"], tmp_path / "state")
    yield Hand(app)
    app.close()


def test_a_path_is_completed_as_far_as_it_is_clear(tmp_path: Path) -> None:
    for name in ("hand.glb", "hammer.obj", ".hidden"):
        (tmp_path / name).touch()
    (tmp_path / "have").mkdir()
    at = tmp_path.as_posix()
    assert paths(f"{at}/") == [f"{at}/hammer.obj", f"{at}/hand.glb", f"{at}/have/"]
    assert completed(f"{at}/h", paths(f"{at}/h")) == f"{at}/ha"
    assert completed(f"{at}/han", paths(f"{at}/han")) == f"{at}/hand.glb"
    assert paths(f"first.obj;{at}/han") == [f"first.obj;{at}/hand.glb"]
    assert paths(f"{at}/nowhere/x") == [] and completed("x", []) == "x"


def test_open_save_export_and_drop(hand: Hand, tmp_path: Path) -> None:
    from vtkmodules.vtkCommonCore import vtkStringArray

    app = hand.app
    hand.key("Ctrl+E")
    assert hand.front.prompt is not None and hand.front.prompt.text.endswith("contacts.glb")
    hand.key("Enter")
    assert (tmp_path / "contacts.glb").exists() and "wrote" in app.line()
    tool = app.interaction.tool
    hand.key("Ctrl+O")
    typed(hand, "cont")
    assert app.interaction.tool == tool  # letters are text here and no tools
    hand.key("Tab")
    hand.key("Enter")
    assert hand.front.prompt is None and len(app.session.document.surfaces) == 2, app.line()
    hand.key("Ctrl+S")
    assert app.session.history.is_clean and "saved" in app.line()
    (tmp_path / "bad.obj").write_bytes(b"")
    for name, says in (("contacts.glb", "stands beside"), ("bad.obj", "bad.obj"), ("state", "folder")):
        names = vtkStringArray()
        names.InsertNextValue(str(tmp_path / name))
        hand.front.events._interactor.InvokeEvent("DropFilesEvent", names)
        hand.front.events.raise_errors()
        hand.front.tick()
        assert says in app.line(), name
    assert len(app.session.document.surfaces) == 3


BOOK = (
    "".join(  # three pages that share their spine: an edge of three faces
        f"v {x} {y} {z}\n" for x, z in ((0, 0), (0.06, 0), (-0.03, 0.05), (-0.03, -0.05)) for y in (0, 0.08)
    )
    + "f 1 2 4 3\nf 1 2 6 5\nf 1 2 8 7\n"
)


def open_by_prompt(hand: Hand, name: str) -> None:
    """Ctrl+O, the name, Enter."""
    hand.key("Ctrl+O")
    assert hand.front.prompt is not None
    while hand.front.prompt.text:
        hand.event("KeyPressEvent", symbol="BackSpace")
    typed(hand, name)
    hand.key("Enter")
    assert hand.front.prompt is None


def test_what_cannot_be_read_is_a_sentence_and_the_next_name_may_be_typed(hand: Hand, tmp_path: Path) -> None:
    """Each is told by its name; session, document and tool stay, and a good file comes in after all of them."""
    app = hand.app
    session, document, tool = app.session, app.session.document, app.interaction.tool
    (tmp_path / "cut.glb").write_bytes(b"glTF\x02\x00\x00\x00\x00\x10\x00\x00")
    (tmp_path / "mess.glb").write_bytes(bytes(range(256)))
    (tmp_path / "words.obj").write_text("this is no mesh")
    (tmp_path / "things").mkdir()
    (tmp_path / "book.obj").write_text(BOOK)
    told = {
        "none.glb": "cannot be read",
        "nowhere/none.obj": "cannot be read",
        "things": "folder",
        "cut.glb": "damaged",
        "mess.glb": "damaged",
        "words.obj": "words.obj",
    }
    for name, says in told.items():
        open_by_prompt(hand, name)
        line = app.line()
        assert says in line and Path(name).name in line and "Traceback" not in line, line
        assert app.session is session and session.document is document and app.interaction.tool == tool
    open_by_prompt(hand, "book.obj;none.glb")  # one of two
    assert "none.glb" in app.line() and session.document is document, app.line()
    open_by_prompt(hand, "book.obj")
    assert "book" in session.document.surfaces, app.line()


def test_a_file_that_may_not_be_read_is_a_sentence(hand: Hand, tmp_path: Path) -> None:
    secret = tmp_path / "secret.obj"
    secret.write_text(BOOK)
    secret.chmod(0)
    if os.access(secret, os.R_OK):
        pytest.skip("whoever runs the tests may read every file")
    before = hand.app.session.document
    open_by_prompt(hand, "secret.obj")
    assert "secret.obj" in hand.app.line() and hand.app.session.document is before


def test_escape_and_nothing_leave_everything_as_it_is(hand: Hand) -> None:
    session = hand.app.session
    hand.key("Ctrl+O")
    hand.key("Escape")
    assert hand.front.prompt is None
    hand.key("Ctrl+O")
    assert hand.front.prompt is not None
    while hand.front.prompt.text:
        hand.event("KeyPressEvent", symbol="BackSpace")
    hand.key("Enter")
    assert "name a file" in hand.app.line() and hand.app.session is session
