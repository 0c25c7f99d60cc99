"""The timeline of the application: what the page is told, and dragging in a real browser."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_core.errors import InvalidInput
from contact_core.film.clip import read_clips
from contact_core.interaction.interaction import Interaction

pytest.importorskip("vtkmodules")
pytest.importorskip("trame_rca")
pytest.importorskip("trame_vuetify")
pytest.importorskip("PIL")

from contact_viewer.files import export
from contact_viewer.film_panel import drag, film_state
from tests.adapters.viewer.served import Page, serving
from tests.adapters.viewer.test_viewer_browser import browser  # noqa: F401 - a fixture

sys.path.insert(0, str(Path(__file__).parents[2] / "core" / "motion"))
from test_film import ARM, BALL, assets, film  # type: ignore[import-not-found]


def scene(path: Path) -> Path:
    """A film in a file."""
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    with contact.Session(host=host, objects=None) as session:
        film(session)
        session.accept(session.solve(frames=session.timeline.settings.frames()))
        session.save(path)
    return path


@pytest.fixture
def hand() -> Iterator[Interaction]:
    session = contact.new(**assets(), discover=False)
    film(session)
    interaction = Interaction(session)
    yield interaction
    interaction.close()


def test_places_are_shares_of_the_range(hand: Interaction) -> None:
    told = film_state(hand.film.view())
    (bar,) = told["bars"]
    assert told["at"] == pytest.approx(100 * 20 / 24, abs=1e-2)
    assert bar["left"] == pytest.approx(100 * 2 / 24, abs=1e-2) and bar["width"] == pytest.approx(
        100 * 22 / 24, abs=1e-2
    )
    assert bar["in"] == pytest.approx(100 * 6 / 22, abs=1e-2) and not bar["fixed"]
    lane = next(lane for lane in told["lanes"] if lane["track"] == f"place/{BALL}")
    assert [key["at"] for key in lane["keys"]] == [0.0, pytest.approx(100 * 20 / 24, abs=1e-2)]


def test_curves_stay_in_their_box_and_break_where_nothing_is(hand: Interaction) -> None:
    assert hand.film.measure() and hand.film.worker.wait(60.0) and hand.film.poll()
    told = film_state(hand.film.view())
    for curve in told["curves"]:
        heights = [float(step.split(" ")[1]) for step in curve["path"].replace("M", "L").split("L")[1:]]
        assert heights and min(heights) >= 0.0 and max(heights) <= 100.0 and 0.0 <= curve["limit"] <= 100.0
        assert curve["path"].count("M") == 1
    error = told["curves"][0]
    assert float(error["path"][1:].split(" ")[0]) == pytest.approx(100 * 8 / 24, abs=1e-2)  # from where it holds
    assert "gradient" in told["bars"][0]["tint"] and error["pair"] == "touch"


def test_what_was_dragged_is_one_step(hand: Interaction) -> None:
    session, steps = hand.session, len(hand.session.history.steps)
    drag(session, "span", "touch", 14.0, "on", 10.0)
    drag(session, "key", f"place/{BALL}", 20.0, "key", 22.0)
    assert len(session.history.steps) == steps + 2
    assert session.timeline.spans("touch")[0].on == 10.0
    assert session.timeline.track("place", BALL).frames == (0.0, 22.0)
    with pytest.raises(InvalidInput, match="dragged"):
        drag(session, "curve", "touch", 0.0, "on", 1.0)


@pytest.mark.parametrize("suffix", [".glb", ".usda"])
def test_an_export_is_the_film(tmp_path: Path, suffix: str) -> None:
    if suffix == ".usda":
        pytest.importorskip("pxr")
    with contact.new(**assets()) as session:
        film(session)
        export(session, tmp_path / f"film{suffix}")
        (clip,) = read_clips(tmp_path / f"film{suffix}", session.plugins)
        moving = next(keys for keys in clip.keys if keys.rig == BALL)
        assert len(moving.frames) == 25 and clip.rate == 24.0
        away = session.scene_at(20.0).surface(BALL).world_from_surface[:3, 3]
        np.testing.assert_allclose(moving.poses[20].local[0, :3, 3], away, atol=1e-5)


def test_in_a_browser(browser: Any, tmp_path: Path) -> None:  # noqa: F811 - the fixture
    with serving(tmp_path, str(scene(tmp_path / "film.contactscene"))) as served:
        page = Page.opened(browser, served.address)
        page.page.click('[title^="Timeline:"]')
        page.until("() => trame.state.get('film').measured && trame.state.get('film').curves.length === 4")
        lane = page.page.locator(".film-lane.bars").first.bounding_box()
        grip = page.page.locator(".film-bar .grip.off").first.bounding_box()
        mouse, x, y = page.page.mouse, grip["x"] + grip["width"] / 2, grip["y"] + grip["height"] / 2
        mouse.move(x, y)
        mouse.down()
        mouse.move(x - 3 * lane["width"] / 24, y, steps=5)
        mouse.up()
        page.until("() => trame.state.get('film').bars[0].words.includes('from 8 to 17')")
        assert page.state("undo_name").startswith("Set when touch holds")
        page.key("Control+z")
        page.until("() => trame.state.get('film').bars[0].words.includes('from 8 to 20')")
        mouse.click(
            lane["x"] + lane["width"] * 6 / 24, page.page.locator(".film-lane").first.bounding_box()["y"] + 8
        )
        page.until("() => trame.state.get('film').frame === 6")  # a click on a curve goes there
        page.key("Shift+ArrowRight")
        page.until("() => trame.state.get('film').playing && trame.state.get('film').frame !== 6")
        page.key("Escape")
        page.until("() => !trame.state.get('film').playing")
        kinds = {
            key["kind"]
            for lane in page.state("film")["lanes"]
            if lane["track"] == f"pose/{ARM}"
            for key in lane["keys"]
        }
        assert kinds == {"solved"} and not page.errors and not page.state("refusal")
