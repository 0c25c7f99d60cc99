"""The application in a real browser: every operation by its mouse and keys, and what the document says of it.

A twin of the application gets the same events without a browser: whatever lies between mouse and document, the two
documents are the same after every gesture, and so are the pictures.
"""

from __future__ import annotations

import io
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.document.document import ContactDocument
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.schema import document_to_json
from contact_core.interaction.events import Key, Pointer
from contact_core.solve.warm_up import warm_up

pytest.importorskip("vtkmodules")
pytest.importorskip("trame_rca")
pytest.importorskip("trame_vuetify")
pytest.importorskip("PIL")

from contact_viewer import panel
from contact_viewer.files import open_files
from contact_viewer.recovery import Recovery
from tests.adapters.viewer.served import CHROMIUM, IMAGE, Page, Served, serving
from tests.adapters.viewer.viewer_scenes import Sight, application

BOOK = (
    "".join(  # three pages that share their spine
        f"v {x} {y} {z}\n" for x, z in ((0, 0), (0.06, 0), (-0.03, 0.05), (-0.03, -0.05)) for y in (0, 0.08)
    )
    + "f 1 2 4 3\nf 1 2 6 5\nf 1 2 8 7\n"
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A headless Chromium of this system, without the limit of memory that the tests have: it reserves more."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright (extra dev) drives the browser")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here: apt-get install chromium")
    warm_up()
    with api.sync_playwright() as playwright:
        program = tmp_path_factory.mktemp("browser") / "chromium"
        program.write_text(f'#!/bin/sh\nulimit -S -v unlimited\nexec {CHROMIUM} "$@"\n')
        program.chmod(0o755)
        made = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield made
        made.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("served"), "sample:baseball") as made:
        yield made


@dataclass
class Twins:
    """Somebody at the browser, who looks at the twin to see where things are; both get every event.

    script: what was done, and after each gesture the document.
    """

    page: Page
    served: Served
    sources: list[str]
    sight: Sight
    script: list[tuple[str, ContactDocument]] = field(default_factory=list)

    def key(self, chord: str) -> None:
        *held, name = chord.split("+")
        self.sight.app.handle(Key(name, frozenset(each.lower() for each in held)))  # type: ignore[misc]
        self.sight.app.frame()
        plain = name.lower() if len(name) == 1 else name
        self.page.key("+".join([*(each.replace("Ctrl", "Control") for each in held), plain]))

    def drag(self, *pixels: Any, held: str = "") -> None:
        """Press at the first pixel, over all others, let go at the last."""
        whole = [np.floor(np.asarray(pixel, float)) for pixel in pixels]
        modifiers: Any = frozenset({held} - {""})

        def twin(kind: Any, pixel: Any, button: Any = "none") -> None:
            self.sight.app.handle(Pointer(kind, pixel[0] + 0.5, pixel[1] + 0.5, button, modifiers))
            self.sight.app.frame()

        twin("move", whole[0])
        twin("press", whole[0], "left")
        for pixel in whole[1:]:
            twin("move", pixel)
        twin("release", whole[-1], "left")
        if held:
            self.page.page.keyboard.down(held.title())
        self.page.drag_pixels(*whole)
        if held:
            self.page.page.keyboard.up(held.title())

    def does(self, key: str, title: str, *pixels: Any, held: str = "") -> ContactDocument:
        """A tool and a gesture: one step of that name, which is the same step in the browser."""
        if key:
            self.key(key)
        revision = self.sight.app.session.revision
        self.drag(*pixels, held=held)
        app = self.sight.app
        assert app.session.revision == revision + 1, (title, app.line(), app.refusal())
        assert app.undo_name().startswith(title)
        return self.agree(title)

    def agree(self, title: str) -> ContactDocument:
        """Wait for the step in the browser, and hold it against the twin's: contacts to the last bit, poses by how
        far pairs are apart, since other frames take the hand other ways."""
        self.page.until(f"() => trame.state.get('undo_name') === {json.dumps(self.sight.app.undo_name())}")
        kept = Recovery(self.sources, self.served.folder / "state").found()
        wanted = self.sight.app.session.document
        assert kept is not None
        assert contacts(kept) == contacts(wanted), title
        assert set(kept.poses) == set(wanted.poses)
        assert self.gaps(kept) == pytest.approx(self.gaps(wanted), abs=1e-3)
        self.script.append((title, kept))
        return kept

    def gaps(self, document: ContactDocument) -> list[float]:
        """How far the pairs are apart in a document's poses, metres."""
        desk, session = self.sight.app.interaction.desk, self.sight.app.session
        scene = desk.scene.following(document, session.derived.known_meshes, session.rigs)
        return [each.gap for each in panel.residuals(session, scene, document)]

    def pictures(self) -> tuple[Any, Any]:
        """The image that the page shows once it stands still, and what the twin draws: (h, w, 3) each, 0 to 1."""
        from PIL import Image

        self.page.page.mouse.move(2, 2)  # no brush, no handle under the pointer
        self.sight.app.handle(Pointer("leave", 0.0, 0.0))
        self.page.page.wait_for_timeout(800)
        self.sight.app.frame()
        seen = np.asarray(Image.open(io.BytesIO(self.page.image())).convert("RGB"), float)
        return seen / 255.0, self.sight.app.canvas.image(still=True) / 255.0


def contacts(document: ContactDocument) -> Any:
    """A document without its poses, as JSON."""
    return document_to_json(replace(document, poses=FrozenMap()))


def by(pixel: Any, right: float, down: float) -> Any:
    """(2,) a pixel so far from another."""
    return np.asarray(pixel) + np.array([right, down])


@pytest.mark.slow
def test_the_whole_road_on_the_real_hand_and_bunny(browser: Any, assets: Path, tmp_path: Path) -> None:
    """Paint, transfer, move, turn, bend, link, solve, undo, save, reload: event script, document, picture."""
    files = ["rigs/webxr_generic_hand_left.glb", "objects/stanford_bunny_35k.obj"]
    sources = [str(assets / each) for each in files]
    with serving(tmp_path, *sources) as served:
        page = Page.opened(browser, served.address)
        app = application(sources, tmp_path / "twin", page.size())
        sight = Sight(app)
        twins = Twins(page, served, sources, sight)
        twins.key("Home")
        hand, bunny = app.session.document.surfaces
        start = sight.on_joint(hand, "index-finger-phalanx-intermediate")
        twins.does("B", "Paint", start, by(start, 1, 6), by(start, 2, 12))
        middle = sight.on_thing(bunny)
        twins.does("T", "Transfer", middle, by(middle, 8, -8), by(middle, 16, -20))
        (copy,) = [patch.name for patch in app.session.document.patches.values() if patch.surface == bunny]
        assert app.session.document.pairs and hand in app.session.document.poses
        while app.interaction.selection.surface != bunny:  # through the hand, which lies over it
            twins.key("Tab")
        for key, title, share, path in (
            ("G", "Translate", 0.5, ((8, 6), (15, 15))),
            ("R", "Rotate", 0.9, ((8, 6), (15, 15))),
            ("D", "Bend", 0.9, ((-8, 6), (-15, 8))),
        ):
            at = sight.on_patch(copy, share)
            twins.does(key, title, at, *(by(at, *step) for step in path))
        beside = sight.on_patch(copy, 0.0)
        twins.does("B", "Paint", by(beside, -40, 40), by(beside, -30, 50), held="shift")
        second = list(app.session.document.patches)[-1]
        twins.does("K", "Link", sight.on_patch(second), sight.on_patch(copy))
        before = app.session.document.poses[hand]
        twins.key("Space")
        page.until("() => trame.state.get('proposed')")
        while app.interaction.worker.status is not None:
            app.frame()
            time.sleep(0.01)
        twins.key("Enter")
        solved = twins.agree("Solve")
        assert np.abs(solved.poses[hand].local - before.local).max() > 1e-4
        twins.key("Ctrl+Z")
        twins.agree("Undo")
        twins.key("Ctrl+Shift+Z")
        twins.agree("Redo")
        twins.key("Shift+R")  # the hand at rest: what is drawn is then the same
        twins.agree("Rest pose")
        seen, drawn = twins.pictures()
        assert seen.shape == drawn.shape
        assert np.abs(seen - drawn).mean() < 0.01 and (np.abs(seen - drawn).max(axis=2) > 0.25).mean() < 0.005
        page.key("Control+s")
        page.until("() => trame.state.get('line').includes('saved')")
        patches = page.patches()
        page.page.reload()
        page.page.wait_for_selector(IMAGE, timeout=30_000)
        page.until_patches(len(patches))  # the server goes on, and the page with it
        assert page.patches() == patches == list(app.session.document.patches) and page.errors == []
        page.page.close()
        (saved,) = tmp_path.glob("*.contactscene")
    with open_files([str(saved)], app.plugins) as again:
        assert document_to_json(again.document) == document_to_json(twins.script[-1][1])
    app.close()


@pytest.mark.slow
def test_a_killed_server_loses_no_stroke(browser: Any, tmp_path: Path) -> None:
    with serving(tmp_path, "sample:baseball") as served:
        page = Page.opened(browser, served.address)
        page.key("b")
        page.drag((0.5, 0.5), (0.54, 0.53))
        page.until_patches(1)
        served.process.kill()
        page.page.close()
    with serving(tmp_path, "sample:baseball") as served:
        page = Page.opened(browser, served.address)
        assert len(page.patches()) == 1 and "is back" in page.first_line
        page.page.close()


@pytest.mark.slow
def test_a_page_that_is_closed_in_a_stroke_leaves_what_was_done_before(browser: Any, tmp_path: Path) -> None:
    """The stroke is put back, the next page goes on, a killed server too, and no log has a traceback."""
    with serving(tmp_path, "sample:baseball") as served:
        page = Page.opened(browser, served.address)
        page.key("b")
        page.drag((0.5, 0.5), (0.54, 0.53))
        page.until_patches(1)
        (left, top), (width, height), mouse = page.corner(), page.size(), page.page.mouse
        mouse.move(left + 0.4 * width, top + 0.5 * height)
        mouse.down()
        mouse.move(left + 0.42 * width, top + 0.5 * height)
        page.page.close()
        second = Page.opened(browser, served.address)
        second.until_patches(1)
        second.key("b")
        second.page.keyboard.down("Shift")
        second.drag((0.45, 0.4), (0.47, 0.42))
        second.page.keyboard.up("Shift")
        second.until_patches(2)
        second.page.close()
        served.process.kill()
        assert served.process.stderr is not None
        log = served.process.stderr.read()
        assert "Traceback" not in log, log
    with serving(tmp_path, "sample:baseball") as served:
        page = Page.opened(browser, served.address)
        assert len(page.patches()) == 2
        page.page.close()


@pytest.mark.slow
def test_a_dense_screen_is_drawn_and_picked_densely(browser: Any, served: Served) -> None:
    """At two device pixels per pixel the image has twice as many, and a click meets what is under it."""
    page = Page.opened(browser, served.address, scale=2.0)
    page.until(
        f"() => document.querySelector('{IMAGE}').width > 1.8 * document.querySelector('{IMAGE}').clientWidth"
    )
    page.key("b")
    page.drag((0.5, 0.5), (0.52, 0.49))
    page.until_patches(1)
    page.page.locator('.contact-row:has-text("contact")').click()
    page.until("() => trame.state.get('tree').some((row) => row.kind === 'patch' && row.selected)")
    page.key("Control+z")
    page.until_patches(0)
    page.page.locator("button[title='Keys (?)']").click()
    page.page.wait_for_selector("text=Redo", timeout=10_000)
    page.key("Escape")
    page.until("() => !trame.state.get('help_wanted')")
    assert page.errors == []
    page.page.close()


@pytest.mark.slow
def test_trouble_is_a_sentence_in_the_page(browser: Any, served: Served) -> None:
    """A file that is cut off, a solve without pairs; and a thing that is no closed surface is painted on."""
    (served.folder / "cut.glb").write_bytes(b"glTF\x02\x00\x00\x00\x00\x10\x00\x00")
    (served.folder / "book.obj").write_text(BOOK)
    page = Page.opened(browser, served.address)

    def bring(name: str, says: str) -> None:
        page.page.locator("button[title='Open (Ctrl+O)']").click()
        page.page.locator(".v-dialog input[type=text]").first.fill(str(served.folder / name))
        page.page.locator("button:has-text('Add to the scene')").click()
        page.until(f"() => trame.state.get('line').includes({json.dumps(says)})")

    before = page.state("tree")
    bring("cut.glb", "damaged")
    assert page.state("tree") == before
    page.key("Space")
    page.until("() => trame.state.get('refusal').includes('no pair yet')")
    bring("book.obj", "book stands beside the rest now.")
    page.key("Home")
    page.page.locator(".contact-row:has-text('book')").click()
    page.key("b")
    page.drag((0.80, 0.5), (0.82, 0.5), (0.84, 0.5))
    page.until_patches(1)
    for _ in range(2):
        page.key("Control+z")
    page.until(f"() => trame.state.get('tree').length === {len(before)}")
    assert page.errors == []
    page.page.close()


@pytest.mark.slow
def test_suggestions_are_looked_for_stopped_chosen_and_undone(browser: Any, tmp_path: Path) -> None:
    """Shift+G: progress, Cancel, which keeps what was found; another by Down, kept by the button, taken back."""
    with serving(tmp_path, "sample:human_hand", "sample:mug") as made:
        page = Page.opened(browser, made.address, size=(1280, 720))
        before = page.state("tree")
        page.key("Shift+G")
        page.until("() => trame.state.get('work') && trame.state.get('work').title === 'Suggest'")
        # the words beside it change all the time, so the button is never at rest
        page.page.locator("button:has-text('Cancel')").dispatch_event("click")
        page.until("() => !trame.state.get('work')")
        assert page.state("tree") == before and not page.state("proposed"), page.state("line")
        page.key("Shift+G")
        page.until("() => / of [2-9]/.test(trame.state.get('line')) && trame.state.get('work')")
        bar = page.page.locator(".v-app-bar").bounding_box()
        for button in page.page.locator(".v-app-bar button").all():  # nothing is cut off
            box = button.bounding_box()
            assert box is None or box["x"] + box["width"] <= bar["x"] + bar["width"], button.get_attribute("title")
        page.page.locator("button:has-text('Cancel')").dispatch_event("click")
        page.until("() => !trame.state.get('work')")
        assert "grasp 1 of" in page.state("line")
        page.key("ArrowDown")
        page.until("() => trame.state.get('line').includes('grasp 2 of')")
        page.page.locator("button:has-text('Keep')").click()
        page.until("() => !trame.state.get('proposed')")
        kept = len(page.state("tree"))
        assert kept > len(before)
        page.key("Control+z")
        page.until(f"() => trame.state.get('tree').length === {len(before)}")
        page.key("Control+y")
        page.until(f"() => trame.state.get('tree').length === {kept}")
        assert page.errors == []
        page.page.close()


@pytest.mark.slow
def test_keys_in_a_field_of_text_are_text(browser: Any, served: Served) -> None:
    page = Page.opened(browser, served.address)
    second = Page.opened(browser, served.address)
    second.until("() => trame.state.get('pages') === 2")  # and both say so
    second.page.close()
    page.until("() => trame.state.get('pages') === 1")
    before = page.state("tools")
    page.page.locator("button[title='Open (Ctrl+O)']").click()
    field = page.page.locator(".v-dialog input[type=text]").first
    field.click()
    page.page.keyboard.type("bgt none.glb")
    page.page.wait_for_timeout(200)
    assert page.state("tools") == before
    page.page.locator("button:has-text('Add to the scene')").click()
    page.until("() => trame.state.get('line').includes('none.glb')")
    assert page.errors == []
    page.page.close()


@pytest.mark.slow
def test_a_lock_in_the_tree_and_the_legend_of_the_heat_map(browser: Any, tmp_path: Path) -> None:
    """A click on the lock keeps the brush away in a sentence, a second lets it paint; the legend has its units."""
    with serving(tmp_path, "sample:human_hand", "sample:baseball") as made:
        page = Page.opened(browser, made.address, size=(1300, 760))
        page.key("Shift+h")
        page.page.wait_for_selector(".contact-legend >> text=20 mm away or more", timeout=10_000)
        page.key("Shift+h")
        page.until("() => !trame.state.get('heat')")
        page.page.locator("button:has-text('Heat')").click()
        page.until("() => trame.state.get('heat')")
        lock = page.page.locator('.contact-row:has-text("baseball") i[title^="Lock"]')
        lock.click()
        page.until("() => trame.state.get('tree').some((row) => row.name === 'baseball' && row.locked)")
        page.page.locator('.contact-row:has-text("baseball")').click()
        page.key("b")
        where = (0.738, 0.72)  # the ball, seen from the front
        page.drag(where, (where[0] + 0.01, where[1]))
        page.until("() => trame.state.get('refusal').includes('locked')")
        page.until_patches(0)
        page.page.locator('.contact-row:has-text("baseball") i[title^="Unlock"]').click()
        page.until("() => !trame.state.get('tree').some((row) => row.locked)")
        page.drag(where, (where[0] + 0.01, where[1]))
        page.until_patches(1)
        assert page.errors == []
        page.page.close()


@pytest.mark.slow
def test_two_rows_of_the_tree_are_paired_by_the_button(browser: Any, tmp_path: Path) -> None:
    """It comes when two patches are selected, and goes once they meet."""
    with serving(tmp_path, "sample:human_hand", "sample:baseball") as made:
        page = Page.opened(browser, made.address, size=(1300, 760))
        page.key("b")
        page.drag((0.738, 0.72), (0.745, 0.72), (0.74, 0.71))
        page.until_patches(1)
        page.drag((0.38, 0.1), (0.375, 0.12), (0.38, 0.11))
        page.until_patches(2)
        rows, button = page.page.locator(".contact-row:has(input[type=color])"), "button[title^='Pair the two']"
        rows.nth(0).click()
        page.until(
            "() => trame.state.get('tree').filter((row) => row.kind === 'patch' && row.selected).length === 1"
        )
        assert page.page.locator(button).count() == 0
        rows.nth(1).click(modifiers=["Shift"])
        page.page.locator(button).click(timeout=10_000)
        page.until("() => trame.state.get('tree').filter((row) => row.pair).length === 2")
        page.page.wait_for_selector(button, state="detached", timeout=10_000)
        assert page.errors == []
        page.page.close()
