"""Files in the plain window: typed into a prompt, completed, dropped; and what is refused."""

from __future__ import annotations

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
