"""What goes wrong is a sentence, and nothing is lost: bad files, solves that fail, disks that are full."""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("vtkmodules")

from contact_core.document.schema import document_to_json
from tests.adapters.viewer.test_viewer_application import painted, transferred
from tests.adapters.viewer.viewer_scenes import Hand, application

FILES: dict[str, tuple[bytes, str]] = {  # name: content, what the sentence says
    "zero.glb": (b"", "damaged"),
    "zero.obj": (b"", "it is empty"),
    "zero.contactscene": (b"", "damaged"),
    "zero.json": (b"", "not valid JSON"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
    "far.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged"),
    "program.exe": (b"MZ", "no reader"),
    "no suffix": (b"x", "no reader"),
    "list.json": (b"[1]", "not a contact-core.document"),
    "no-mesh.gltf": (
        b'{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"name":"a"}]}',
        "no triangles",
    ),
}
HUGE = 9 << 30  # bytes of a file that holds none of them


@pytest.fixture(scope="module")
def hand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hand]:
    """A hand and a mug with one pair of contacts."""
    app = application(["sample:human_hand", "sample:mug"], tmp_path_factory.mktemp("state"))
    made = Hand(app)
    painted(made)
    transferred(made)
    yield made
    app.close()


@contextlib.contextmanager
def full_disk(most: int) -> Iterator[None]:
    """No file can be larger than so many bytes: writing beyond fails as on a disk that is full."""
    resource = pytest.importorskip("resource", reason="files are bounded by POSIX systems alone")
    before, beyond = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, beyond)


def test_files_that_cannot_be_read_leave_everything_as_it_is(hand: Hand, tmp_path: Path) -> None:
    app = hand.app
    session, document = app.session, app.session.document
    for name, (content, _) in FILES.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "folder").mkdir()
    for name in ("huge.glb", "huge.obj", "huge.json"):
        with (tmp_path / name).open("wb") as file:
            file.truncate(HUGE)
    told = {name: says for name, (_, says) in FILES.items()} | {
        "folder": "name the file to open",
        "none.obj": "cannot be read",
        "huge.glb": "bytes are read",
        "huge.obj": "bytes are read",
        "huge.json": "are refused",
    }
    for name, says in told.items():
        app.attempt(lambda name=name: app.bring([str(tmp_path / name)]))
        assert says in app.line() and Path(name).name in app.line(), app.line()
        assert app.session is session and session.document is document


def test_a_solve_that_cannot_be_is_a_sentence(hand: Hand) -> None:
    app = hand.app
    document = app.session.document
    for surface in ("mug", "human_hand"):
        app.lock("surface", surface)
    hand.key("Shift+Space")  # contacts would move
    hand.wait()
    assert "locked" in app.refusal() or app.interaction.status.proposed
    hand.key("Escape")
    for surface in ("mug", "human_hand"):
        app.lock("surface", surface)
    assert app.session.document is document
    app.interaction.set(held=("no such joint",))
    hand.key("Space")
    hand.wait()
    hand.key("Escape")
    app.interaction.set(held=())
    app.do("selection.clear")
    hand.key("Space")
    assert "no pair yet" in app.refusal()
    hand.key("Ctrl+Z")
    assert document_to_json(app.session.document) == document_to_json(document)


def test_what_was_refused_is_gone_with_the_next_action(tmp_path: Path) -> None:
    app = application(["sample:human_hand"], tmp_path)
    hand = Hand(app)
    for key in ("Home", "3", "?", "?"):
        hand.key("Ctrl+Z")
        assert app.refusal() == "there is nothing to undo."
        hand.key(key)
        assert not app.refusal(), key
    hand.key("Home")
    hand.key("T")
    at = hand.on_thing("human_hand")
    hand.drag(at, by(at, 9, 0))  # turns the camera, and says why it copies nothing
    assert "no contact is active" in app.line()
    hand.key("Q")
    assert "no contact is active" not in app.line()
    app.close()


def by(pixel: Any, right: float, down: float) -> Any:
    """(2,) a pixel so far from another."""
    return pixel + np.array([right, down])


def test_a_thing_that_is_no_closed_surface_is_worked_on(tmp_path: Path) -> None:
    """Three pages that share their spine: painted across it, moved over it, met by the hand, without a mistake."""
    sheets = ((0.06, 0.0), (-0.03, 0.05), (-0.03, -0.05))
    points = [(0.0, 0.01 * k, 0.0) for k in range(9)]
    points += [(u * x / 6, 0.01 * k, u * z / 6) for x, z in sheets for u in range(1, 7) for k in range(9)]
    columns = [(0, *range(1 + 6 * page, 7 + 6 * page)) for page in range(3)]
    quads = [(9 * a + k, 9 * a + k + 1, 9 * b + k + 1, 9 * b + k) for page in columns
             for a, b in pairwise(page) for k in range(8)]  # fmt: skip
    lines = [f"v {x} {y} {z}" for x, y, z in points] + ["f " + " ".join(str(k + 1) for k in q) for q in quads]
    (tmp_path / "book.obj").write_text("\n".join(lines))
    app = application(["sample:human_hand", str(tmp_path / "book.obj")], tmp_path / "state")
    hand = Hand(app)
    hand.key("Home")
    palm, spine = (
        hand.on_thing("human_hand"),
        hand.pixel(app.interaction.desk.scene.surfaces["book"].points[:9].mean(axis=0)),
    )
    hand.key("B")
    hand.drag(palm, by(palm, 3, 8), by(palm, 6, 16))
    hand.key("T")
    hand.drag(by(spine, 9, 0), by(spine, 9, -12), by(spine, 9, -24))
    assert len(app.session.document.pairs) == 1, app.refusal()
    hand.key("Space")
    hand.wait()
    hand.key("Enter")
    assert app.undo_name() == "Solve", app.refusal()
    (met,) = [patch.name for patch in app.session.document.patches.values() if patch.surface == "book"]
    app.interaction.select(met, surface="book")
    hand.key("G")
    at = hand.on_patch(met)
    hand.drag(at, by(at, -10, 0), by(at, -30, 0))
    hand.key("Shift+H")  # what is inside of a thing that has no inside
    hand.key("Ctrl+Z")
    assert "mistake" not in app.refusal() + app.line()
    app.close()


@pytest.mark.skipif(sys.platform == "win32", reason="files are bounded by POSIX systems alone")
def test_a_full_disk_loses_nothing(hand: Hand, tmp_path: Path) -> None:
    """What was saved before is whole, what could not be written is told, and the document goes on."""
    app, scene = hand.app, tmp_path / "kept.contactscene"
    app.save(scene)
    saved = scene.read_bytes()
    with full_disk(1000):
        app.rename("contact", "pad")
        assert "not kept against a crash" in app.refusal()
        hand.key("Ctrl+S")
        assert "kept.contactscene" in app.line() and not app.session.history.is_clean
        app.attempt(lambda: app.export(tmp_path / "scene.glb"))
        assert "scene.glb" in app.line()
    assert scene.read_bytes() == saved and not (tmp_path / "scene.glb").exists()
    assert [each.name for each in tmp_path.iterdir()] == ["kept.contactscene"]
    assert "pad" in app.session.document.patches
    hand.key("Ctrl+S")
    assert app.session.history.is_clean and scene.read_bytes() != saved and not app.refusal()


def test_where_nothing_can_be_written_it_says_so(hand: Hand, tmp_path: Path) -> None:
    app, document = hand.app, hand.app.session.document
    (tmp_path / "file").write_text("no folder")
    for path in (tmp_path / "file" / "a.contactscene", tmp_path / "none" / "a.glb", tmp_path / "file" / "a.usda"):
        app.attempt(lambda path=path: app.write(path))
        assert "file" in app.line() or "none" in app.line(), app.line()
        assert not path.exists()
    assert app.session.document is document
