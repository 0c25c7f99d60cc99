"""The split view: the hand at the left, the object at the right, a camera each, and every tool in both."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("vtkmodules")

from contact_viewer.eye import Eye
from tests.adapters.viewer.viewer_scenes import SIZE, Hand, application


@pytest.fixture(scope="module")
def hand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hand]:
    app = application(["sample:human_hand", "sample:mug"], tmp_path_factory.mktemp("state"))
    yield Hand(app)
    app.close()


def looks(eye: Eye) -> tuple[float, ...]:
    """Where an eye is, and how it looks."""
    return (*eye.eye.tolist(), *eye.direction.tolist())


def test_both_halves_are_painted_paired_and_looked_at(hand: Hand) -> None:
    app, half = hand.app, SIZE[0] / 2
    app.interaction.select(surface="human_hand")  # which takes nothing away from the other half
    hand.key("Shift+X")
    left, right = (pane.eye for pane in app.panes.all)

    def at(eye: Eye, points: object) -> Any:
        """(2,) the pixel of the window in which an eye sees a point."""
        seen = eye.project(np.asarray(points, float)[None])[0, :2]
        return seen + np.array([half * (eye is right), 0.0])

    hand.key("B")
    for name, eye in (("mug", right), ("human_hand", left)):
        seen = app.interaction.desk.scene.surfaces[name]
        facing = seen.mesh.vertex_normals @ eye.direction < -0.9
        start = at(eye, seen.points[facing][0])
        hand.drag(start, start + np.array([2, 3]), start + np.array([-1, 6]), held=("shift",))
        assert [patch.surface for patch in app.session.document.patches.values()][-1] == name, app.line()
    on_mug, on_hand = app.session.document.patches
    hand.key("P")
    roots = {
        name: app.interaction.desk.scene.surfaces[surface].positions(app.session.geometry.points(name)).mean(axis=0)
        for name, surface in ((on_mug, "mug"), (on_hand, "human_hand"))
    }
    hand.drag(at(left, roots[on_hand]), (half, 300), at(right, roots[on_mug]))  # from one half to the other
    (pair,) = app.session.document.pairs.values()
    assert (pair.manipulator, pair.object) == (on_hand, on_mug)
    before = looks(left), looks(right)
    hand.drag((half + 5, 5), (half + 60, 40))
    assert looks(left) == before[0] and looks(right) != before[1]
    hand.drag((5, 5), (half + 60, 40))  # the half of the press keeps the pointer
    assert looks(left) != before[0]


def test_each_half_draws_its_own_and_one_view_both(hand: Hand) -> None:
    app = hand.app
    if not app.panes.is_split:
        hand.key("Shift+X")
    hand.key("Home")
    app.drawer.stale = True  # heads of arrows are laid for the camera of now
    hand.front.tick()
    split = app.canvas.image().astype(int)
    hand.app.hide("surface", "mug")
    hand.front.tick()
    changed = np.abs(app.canvas.image().astype(int) - split).max(axis=2)[60:-60] > 40  # between the lines of text
    assert changed[:, SIZE[0] // 2 :].mean() > 0.1 and not changed[:, : SIZE[0] // 2].any()
    hand.app.hide("surface", "mug")
    hand.key("Shift+X")
    assert not app.panes.is_split and app.canvas.eye.viewport == SIZE
    hand.key("Home")
    one = app.canvas.image().astype(int)
    hand.app.hide("surface", "mug")
    hand.front.tick()
    assert (np.abs(app.canvas.image().astype(int) - one).max(axis=2) > 40).any()
    hand.app.hide("surface", "mug")


def test_without_an_object_nothing_is_split(tmp_path: Path) -> None:
    app = application(["sample:mug"], tmp_path)
    app.do("view.split")
    assert not app.panes.is_split and "missing" in app.line()
    app.close()
