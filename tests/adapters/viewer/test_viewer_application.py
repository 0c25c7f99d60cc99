"""The application by VTK's own events, drawn without a screen: an artist's whole way, files, what goes wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.document.schema import document_to_json
from contact_core.errors import FileRefused
from contact_core.session import Session
from contact_core.testing.meshes import icosphere

pytest.importorskip("vtkmodules")

from contact_viewer import panel
from contact_viewer.application import Application
from contact_viewer.files import open_files
from tests.adapters.viewer.viewer_scenes import Hand, application

FILES = ["sample:human_hand", "sample:mug"]


@pytest.fixture
def hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hand]:
    monkeypatch.chdir(tmp_path)
    app = application(FILES, tmp_path / "state")
    yield Hand(app)
    app.close()


def by(pixel: Any, right: float, down: float) -> Any:
    """(2,) a pixel so far from another."""
    return np.asarray(pixel) + np.array([right, down])


def painted(hand: Hand, joint: str = "index_distal") -> str:
    """Paint a patch on a finger; its name."""
    before = set(hand.app.session.document.patches)
    hand.key("B")
    start = hand.on_joint("human_hand", joint)
    hand.drag(start, by(start, 2, 3), by(start, -1, 5))
    (name,) = set(hand.app.session.document.patches) - before
    return name


def transferred(hand: Hand) -> None:
    """Bring the selected patch to the mug."""
    hand.key("T")
    start = hand.on_thing("mug")
    hand.drag(start, by(start, 0, -8), by(start, 0, -16))


def settled(app: Application) -> list[float]:
    """The gap of every pair, metres."""
    return [each.gap for each in app.meets]


@pytest.mark.slow
def test_paint_transfer_drag_solve_and_undo(hand: Hand) -> None:
    """The whole way of an artist, each gesture one step with a name, undone to the very document of the start."""
    app = hand.app
    start = app.session.document
    bare = app.canvas.image().astype(int)
    name = painted(hand)
    assert app.undo_name() == f"Paint {name}" and app.interaction.selection.patches == (name,)
    assert np.abs(app.canvas.image().astype(int) - bare).max() > 60  # and it is seen
    transferred(hand)
    copies = [p for p in app.session.document.patches.values() if p.surface == "mug"]
    assert len(copies) == 1 and len(app.session.document.pairs) == 1, app.line()
    assert "human_hand" in app.session.document.poses  # the hand followed while it was dragged
    gap = settled(app)
    hand.key("G")
    middle = app.session.geometry.points(copies[0].name)
    seen = app.interaction.desk.scene.surfaces["mug"]
    at = hand.pixel(seen.positions(middle).mean(axis=0))
    app.interaction.select(copies[0].name, surface="mug")  # through the hand, which lies over it
    root = app.session.geometry.root(copies[0].name).point()
    hand.drag(at, by(at, 4, 4), by(at, 9, 6))
    now = app.session.geometry.root(copies[0].name).point()
    assert np.linalg.norm(seen.positions(now) - seen.positions(root)) > 1e-3, app.line()
    hand.key("Space")
    hand.wait()
    assert app.interaction.status.proposed, app.line()
    hand.key("Enter")
    assert app.undo_name() == "Solve" and settled(app)[0] <= max(gap[0], 0.01)
    for _ in range(len(app.session.history.done)):
        hand.key("Ctrl+Z")
    assert document_to_json(app.session.document) == document_to_json(start)
    hand.key("Ctrl+Shift+Z")
    assert app.undo_name() == f"Paint {name}"


@pytest.mark.slow
def test_the_operations_of_the_paper_on_the_real_hand_and_bunny(assets: Path, tmp_path: Path) -> None:
    """Paint, axis, transfer, move, turn, bend, scale and link: each by mouse and keys, each one step, each seen."""
    files = ["rigs/webxr_generic_hand_left.glb", "objects/stanford_bunny_35k.obj"]
    app = application([str(assets / each) for each in files], tmp_path / "state", (900, 600))
    hand = Hand(app)
    _, bunny = app.session.document.surfaces
    app.interaction.set(live=False)  # what the hand does meanwhile has tests of its own
    app.interaction.select(surface=bunny)
    middle = hand.on_thing(bunny)
    told: list[str] = []

    def does(key: str, title: str, *path: Any, held: tuple[Any, ...] = ()) -> None:
        """One gesture is one step of that name, and another picture."""
        hand.key(key)
        before, revision = app.canvas.image().astype(int), app.session.revision
        hand.drag(*path, held=held)
        assert app.session.revision == revision + 1, (title, app.line(), app.refusal())
        assert app.undo_name().startswith(title)
        assert np.abs(app.canvas.image().astype(int) - before).max() > 40
        told.append(title)

    across = [by(middle, right, 0.3 * right) for right in (-50, -30, -10, 10, 30)]
    does("B", "Paint", *across)
    (first,) = app.session.document.patches
    does("W", "Set the axis of", *across)
    does("G", "Translate", hand.on_patch(first), by(hand.on_patch(first), 6, -9))
    does("R", "Rotate", hand.on_patch(first, 0.9), by(hand.on_patch(first, 0.9), -6, -22))
    does("D", "Bend", hand.on_patch(first, 0.8), by(hand.on_patch(first, 0.8), 10, -14))
    does("S", "Scale", hand.on_patch(first, 0.9), by(hand.on_patch(first, 0.9), -14, 2))
    app.interaction.select(first, surface=bunny)
    does("T", "Transfer", by(middle, 10, 80), by(middle, 30, 85), by(middle, 50, 88))
    (second,) = set(app.session.document.patches) - {first}
    does("K", "Link", hand.on_patch(second), hand.on_patch(first))
    assert len(told) == 8
    script = document_to_json(app.session.document)
    for _ in told:
        hand.key("Ctrl+Z")
    assert not app.session.document.patches
    for _ in told:
        hand.key("Ctrl+Shift+Z")
    assert document_to_json(app.session.document) == script
    app.close()


def test_escape_puts_everything_back(hand: Hand) -> None:
    app = hand.app
    start = app.session.document
    hand.key("B")
    at = hand.on_joint("human_hand", "middle_distal")
    hand.event("LeftButtonPressEvent", at)
    hand.event("MouseMoveEvent", by(at, 3, 3))
    hand.key("Escape")
    hand.event("LeftButtonReleaseEvent", by(at, 3, 3))
    assert app.session.document is start and not app.interaction.is_busy


def test_what_no_tool_takes_moves_the_camera(hand: Hand) -> None:
    app = hand.app
    before = app.canvas.eye.eye
    hand.key("B")
    hand.drag((5, 5), (60, 30))  # nothing lies there
    assert np.linalg.norm(app.canvas.eye.eye - before) > 1e-3
    assert not app.session.document.patches
    before = app.canvas.eye.eye
    hand.event("MouseWheelForwardEvent", (320, 200))
    assert np.linalg.norm(app.canvas.eye.eye - before) > 1e-4
    hand.key("7")
    assert abs(app.canvas.eye.direction @ [0, 1, 0]) > 0.99
    hand.key("Home")
    assert (app.canvas.eye.project(app.drawer.points())[:, 2] > 0).all()


def test_letters_do_nothing_of_vtks_own(hand: Hand) -> None:
    """w makes no wireframe, s no surface, q and e end nothing, p picks nothing: they are tools or nothing."""
    for letter in "WSQEPRJTFU3":
        hand.key(letter)
    hand.event("CharEvent", (0, 0), symbol="w")
    for actor in hand.app.canvas._base.GetActors():
        assert actor.GetProperty().GetRepresentation() == 2  # surface


def test_an_error_in_an_observer_is_not_lost(hand: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK swallows what observers raise; ours is raised by whoever runs the loop."""

    def broken(*_: object) -> None:
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr(hand.app.interaction, "handle", broken)
    with pytest.raises(RuntimeError, match="on purpose"):
        hand.event("MouseMoveEvent", (10, 10))


def test_a_refusal_is_a_sentence_in_the_line(hand: Hand) -> None:
    hand.key("Space")
    assert "no pair yet" in hand.app.line() + hand.app.refusal()
    hand.key("Delete")
    assert "no patch is selected" in hand.app.line() + hand.app.refusal()
    hand.key("Right")
    assert "no pose key" in hand.app.line() + hand.app.refusal()


def test_the_page_of_keys_names_every_action(hand: Hand) -> None:
    from contact_viewer.window import help_text

    text = help_text(hand.app)
    for action in hand.app.table():
        if action.keys:
            assert action.label[:23] in text
    before = hand.app.canvas.image().astype(int)
    hand.key("?")
    assert hand.app.help_wanted
    assert np.abs(hand.app.canvas.image().astype(int) - before).max() > 60


def test_isolate_xray_and_hiding_change_what_is_drawn(hand: Hand) -> None:
    app = hand.app
    app.interaction.select(surface="human_hand")
    hand.front.tick()
    mug = hand.on_thing("mug").astype(int)
    seen = [app.canvas.image()[mug[1], mug[0]].astype(int)]
    for key in ("X", "I"):
        hand.key(key)
        seen.append(app.canvas.image()[mug[1], mug[0]].astype(int))
    app.hide("surface", "human_hand")
    hand.front.tick()
    assert len({tuple(each) for each in seen}) == 3
    assert np.ptp(app.canvas.image()[120:340, 30:200].astype(int), axis=1).max() < 30  # no hand either


def test_saved_and_opened_again_it_is_the_same(hand: Hand) -> None:
    app = hand.app
    painted(hand)
    hand.key("Ctrl+S")
    assert app.session.history.is_clean and "saved" in app.line()
    (path,) = Path.cwd().glob("*.contactscene")
    with open_files([str(path)], app.plugins) as again:
        assert document_to_json(again.document) == document_to_json(app.session.document)
        assert set(again.rigs) == {"human_hand"}
    hand.key("Ctrl+S")
    assert len(list(Path.cwd().glob("*.contactscene"))) == 1


def test_what_was_not_saved_comes_back(hand: Hand, tmp_path: Path) -> None:
    """The application is let go of without an end, as when its process is killed."""
    painted(hand)
    kept = hand.app.session.document
    again = application(FILES, tmp_path / "state")
    assert document_to_json(again.session.document) == document_to_json(kept)
    assert "is back" in again.line()
    again.save(tmp_path / "kept.contactscene")
    third = application(FILES, tmp_path / "state")
    assert not third.session.document.patches  # saved: nothing to bring back
    for app in (again, third):
        app.close()


def test_exports_are_read_by_others(hand: Hand, tmp_path: Path) -> None:
    import trimesh

    hand.app.export(tmp_path / "scene.glb")
    scene = trimesh.load(tmp_path / "scene.glb")
    assert len(scene.geometry) == 2
    with pytest.raises(FileRefused, match=r"nothing here writes \.exe"):
        hand.app.export(tmp_path / "scene.exe")


def test_files_that_cannot_be_opened_leave_everything_as_it_is(hand: Hand, tmp_path: Path) -> None:
    session = hand.app.session
    (tmp_path / "bad.glb").write_bytes(b"not a model")
    for sources in ([str(tmp_path / "bad.glb")], [str(tmp_path / "none.obj")], ["sample:nobody"]):
        hand.app.attempt(lambda sources=sources: hand.app.open(sources))
        assert hand.app.session is session and hand.app.line()


def test_a_mesh_is_added_beside_what_is_there(hand: Hand) -> None:
    app = hand.app
    app.add(["sample:baseball"])
    hand.front.tick()
    scene = app.interaction.desk.scene.surfaces
    assert set(scene) == {"human_hand", "mug", "baseball"}
    assert scene["baseball"].points[:, 0].min() > scene["mug"].points[:, 0].max()
    assert app.session.binding.surfaces["baseball"].object_id


def test_a_document_needs_its_meshes(tmp_path: Path, hand: Hand) -> None:
    painted(hand)
    hand.app.save(tmp_path / "contacts.json")
    with pytest.raises(FileRefused, match="human_hand"):
        open_files([str(tmp_path / "contacts.json")], hand.app.plugins)
    with open_files([str(tmp_path / "contacts.json"), *FILES], hand.app.plugins) as session:
        assert len(session.document.patches) == 1


def test_settings_come_from_a_panel_checked(hand: Hand) -> None:
    interaction = hand.app.interaction
    interaction.take_up("paint")
    groups = {group["name"]: group for group in panel.settings(interaction)}
    assert {"paint", "disk", "interaction"} <= set(groups)
    panel.set_setting(interaction, groups["paint"]["slot"], "paint", "radius", "0.01")
    assert getattr(interaction.tool_named("paint"), "radius") == 0.01  # noqa: B009  (a setting of this tool)
    panel.set_setting(interaction, "", "interaction", "held", "wrist, thumb_tip")
    assert interaction.settings.held == ("wrist", "thumb_tip")
    for slot, name, item, value in (
        (groups["paint"]["slot"], "paint", "radius", "-1"),
        (groups["paint"]["slot"], "paint", "radius", "wide"),
        (groups["paint"]["slot"], "paint", "nothing", "1"),
        ("no_slot", "paint", "radius", "1"),
        ("", "interaction", "iterations", "0"),
    ):
        hand.app.attempt(lambda a=(slot, name, item, value): panel.set_setting(interaction, *a))
        assert item in hand.app.line() or "no_slot" in hand.app.line()


def test_the_report_names_the_worst_first(hand: Hand) -> None:
    rows = [
        replace(panel.Residual("a", ("a", "b"), 0.001, 5.0)),
        panel.Residual("b", ("c", "d"), 0.004, 5.0),
        panel.Residual("c", ("e", "f"), 0.0, 70.0),
    ]
    assert [each.level for each in rows] == [0, 1, 2]
    assert rows[0].words() == "touches" and "4.0 mm away" in rows[1].words() and "tilted by 70°" in rows[2].words()
    assert panel.report([], hand.app.session.document)["head"] == "No pairs yet."
    assert "Paint" in panel.next_step(hand.app.session, hand.app.interaction)
    assert "Ctrl+O" in panel.next_step(Session(), hand.app.interaction)


def test_a_large_mesh_is_sent_once(hand: Hand) -> None:
    """Frames without a change send nothing, however large the scene is."""
    surface = hand.app.canvas.surface("ball")
    ball = icosphere(4)
    surface.set_shape(ball.points, ball.faces)
    uploaded = surface._polygons.data.GetMTime()
    for _ in range(3):
        surface.set_shape(ball.points, ball.faces)
    assert surface._polygons.data.GetMTime() == uploaded
    hand.wait()  # what is prepared beside the window on opening shows its progress
    hand.front.tick()
    assert not hand.front.tick()


def test_the_tutorial_comes_once_by_itself_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    app = application([], tmp_path / "state")
    hand = Hand(app)
    card = app.guide.card()
    assert card is not None and card["title"] == "Paint where the hand touches" and card["progress"] == "0 of 4"
    assert {"text": "B", "key": True} in card["words"] and "Press B" in app.guide.text()
    assert len(app.guide.overlay().axes) == 1
    name = painted(hand)
    assert (app.guide.card() or {})["progress"] == "1 of 4"
    hand.key("F2")
    assert (app.guide.card() or {})["title"] == "Give a contact its axis"
    hand.key("Shift+F2")
    hand.key("F1")
    assert app.guide.card() is None and app.guide.text() == "" and not app.guide.overlay().axes
    hand.key("F1")  # once more, from the start: one step, and undo brings the contact back
    assert app.guide.card() is not None and not app.session.document.patches
    hand.key("Ctrl+Z")
    assert list(app.session.document.patches) == [name]
    app.turn_card("end")
    app.close()
    again = application([], tmp_path / "other")
    assert again.guide.lesson is not None
    again.turn_card("end")
    again.close()
    third = application([], tmp_path / "other")
    assert third.guide.lesson is None
    third.close()


def test_the_tutorial_leaves_other_files_and_they_come_back(hand: Hand, tmp_path: Path) -> None:
    app = hand.app
    app.open(["sample:baseball"])
    app.session.patches.brush("disk", "spot", surface="baseball", at=[0.0, 0.0, 1.0], radius=0.01)
    app.do("show.tutorial")
    assert app.guide.lesson is not None and set(app.session.document.surfaces) == {"human_hand", "mug"}
    app.open(["sample:baseball"])
    assert app.guide.lesson is None and "spot" in app.session.document.patches
