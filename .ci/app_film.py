"""Films the application in a real browser: docs/images/app-workflow.gif.

    python .ci/app_film.py [--out FOLDER]

Somebody goes the way of the tutorial (`contact_core.interaction.lesson`) with mouse and keys: paints, draws an
axis, transfers, sees pairs, drags, solves. Needs a Chromium, playwright and Pillow (extras app, dev).
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from contact_core.interaction.events import Key, Pointer
from contact_core.interaction.lesson import STEPS, Lesson
from tests.adapters.viewer.served import CHROMIUM, Page, serving
from tests.adapters.viewer.viewer_scenes import application

SOURCES = ["sample:human_hand", "sample:mug"]
WINDOW = (1280, 800)
FILM = (960, 600)  # of the pictures
COLORS = 200
VIVID = 70  # between the channels of a pixel whose colour tells something
MOST = 3_000_000  # bytes
STEP = 7  # pixels of the mouse between two pictures of a drag
CURSOR = """() => {
  const cursor = document.createElement('div');
  cursor.innerHTML = '<svg width="22" height="30" viewBox="0 0 22 30"><path d="M2 2 L2 23 L7.5 18 L11.5 27 ' +
    'L15 25.5 L11 16.8 L18.5 16.5 Z" fill="white" stroke="black" stroke-width="1.6"/></svg>';
  cursor.style.cssText = 'position:fixed;left:-50px;top:-50px;z-index:99999;pointer-events:none';
  const told = document.createElement('div');
  told.id = 'film-keys';
  told.style.cssText = 'position:fixed;left:34%;top:60px;white-space:nowrap;transform:translateX(-50%);' +
    'z-index:99998;pointer-events:none;font:600 20px sans-serif;color:white;background:rgba(15,17,21,.82);' +
    'border-radius:8px;padding:8px 16px;display:none';
  document.body.append(cursor, told);
  window.addEventListener('mousemove', (event) => {
    cursor.style.left = (event.clientX - 2) + 'px'; cursor.style.top = (event.clientY - 2) + 'px';
  }, true);
}"""


@dataclass
class Film:
    """Pictures of a page, with how long each is seen (ms). The application beside it, `app`, gets every event
    too, and knows where things are."""

    page: Page
    app: Any
    seen: list[tuple[Image.Image, int]] = field(default_factory=list)

    def take(self, milliseconds: int = 90, wait: int = 110) -> None:
        """One more picture, once what was done is drawn."""
        self.page.page.wait_for_timeout(wait)
        shot = (
            Image.open(io.BytesIO(self.page.page.screenshot()))
            .convert("RGB")
            .resize(FILM, Image.Resampling.LANCZOS)
        )
        self.seen.append((shot, milliseconds))

    def say(self, words: str, milliseconds: int = 1100) -> None:
        """Words over the view, for what comes."""
        script = """(words) => { const told = document.getElementById('film-keys');
            told.textContent = words; told.style.display = words ? 'block' : 'none'; }"""
        self.page.page.evaluate(script, words)
        self.take(milliseconds)

    def key(self, chord: str) -> None:
        *held, name = chord.split("+")
        modifiers: Any = frozenset(each.lower() for each in held)
        self.app.handle(Key(name, modifiers))
        self.app.frame()
        plain = name.lower() if len(name) == 1 else name
        self.page.key("+".join([*(each.replace("Ctrl", "Control") for each in held), plain]))

    def drag(self, *pixels: Any, button: str = "left", held: str = "") -> None:
        """Press at the first pixel, let go at the last, with a picture every few pixels between them."""
        path = [np.floor(pixels[0])]
        for pixel in pixels[1:]:
            steps = max(1, round(float(np.linalg.norm(pixel - path[-1])) / STEP))
            path += [np.floor(path[-1] + (pixel - path[-1]) * k / steps) for k in range(1, steps + 1)]
        left, top = self.page.corner()
        mouse = self.page.page.mouse
        modifiers: Any = frozenset({held} - {""})

        def both(kind: Any, pixel: Any) -> None:
            pressed: Any = button if kind != "move" else "none"
            self.app.handle(Pointer(kind, pixel[0] + 0.5, pixel[1] + 0.5, pressed, modifiers))
            self.app.frame()
            mouse.move(left + pixel[0], top + pixel[1])

        if held:
            self.page.page.keyboard.down(held.title())
        both("move", path[0])
        self.take(250)
        both("press", path[0])
        mouse.down(button=button)
        for number, pixel in enumerate(path[1:]):
            both("move", pixel)
            if number % 2 == 0 or len(path) < 12:
                self.take()
        both("release", path[-1])
        mouse.up(button=button)
        if held:
            self.page.page.keyboard.up(held.title())
        self.take(350, wait=350)

    def propose(self, chord: str) -> None:
        """Work beside the window, until what it found is shown."""
        self.key(chord)
        while self.app.interaction.worker.status is not None:
            self.app.frame()
            time.sleep(0.01)
        self.page.until("() => trame.state.get('proposed')")
        self.take(900, wait=700)

    def write(self, path: Path) -> None:
        """As a GIF with the colours of the whole film."""
        some = [
            np.asarray(self.seen[k][0]).reshape(-1, 3) for k in np.linspace(0, len(self.seen) - 1, 12).astype(int)
        ]
        pixels = np.concatenate(some)
        vivid = pixels[
            np.ptp(pixels.astype(int), axis=1) > VIVID
        ]  # few, and what one looks at: they count as a third
        pixels = np.concatenate([pixels, np.resize(vivid, (len(pixels) // 2, 3))])
        rows = len(pixels) // FILM[0]
        palette = Image.fromarray(pixels[: rows * FILM[0]].reshape(rows, FILM[0], 3)).quantize(COLORS)
        frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image, _ in self.seen]
        durations = [each for _, each in self.seen]
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, loop=0, optimize=True)


@contextmanager
def page_of(browser: Any, size: tuple[int, int]) -> Iterator[tuple[Page, Any]]:
    """A page of a server of its own, and the application beside it, both seen from the front."""
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder), *SOURCES) as served:
        page = Page.opened(browser, served.address, size=size)
        app = application(SOURCES, Path(folder) / "twin", page.size())
        page.key("Home")
        app.do("view.home")
        app.frame()
        page.page.evaluate(CURSOR)
        yield page, app
        app.close()
        page.page.close()


def mark(film: Film, lesson: Lesson) -> Any:
    """(k, 2) pixels of what the lesson marks; the view is turned first where that lies on the far side."""
    if lesson.card().far_side:
        width, height = film.page.size()
        corner = np.array([0.9 * width, 0.12 * height])
        film.drag(corner, corner - [310.0, 0.0], button="middle")
    shown = lesson.marked()
    assert shown is not None and not lesson.card().far_side, lesson.card()
    return film.app.canvas.eye.project(shown[0])[:, :2]


def grasp(film: Film) -> Iterator[str]:
    """The way of the tutorial; tells the name of each step when it is over."""
    lesson = Lesson(film.app.interaction)
    film.say("B   paint where the hand touches")
    for key in "B[[":
        film.key(key)
    while STEPS[lesson.number].name == "paint":
        film.drag(*mark(film, lesson), held="shift")
        lesson.follow()
    yield "paint"
    film.say("W   give a contact its axis")
    film.key("W")
    film.drag(*mark(film, lesson))
    lesson.follow()
    yield "axis"
    film.say("T   transfer: press and drag along the axis; both are paired")
    film.key("T")
    while film.app.interaction.selection.surface != "mug":
        film.key("Tab")
    while STEPS[lesson.number].name == "transfer":
        film.drag(*mark(film, lesson))
        lesson.follow()
    yield "transfer"
    lesson.next()
    film.say("Shift+Space   solve: contacts settle, the hand closes")
    film.propose("Shift+Space")
    film.key("Enter")
    film.take(700)
    lesson.follow()
    yield "solve"
    film.say("G   drag a contact; the hand follows")
    film.key("G")
    film.drag(*mark(film, lesson))
    lesson.follow()
    yield "edit"
    film.say("Shift+Space   solve again")
    film.propose("Shift+Space")
    film.key("Enter")
    film.say("", 300)
    yield "again"
    width, height = film.page.size()
    corner = np.array([0.92 * width, 0.12 * height])
    film.drag(corner, corner - [220.0, -10.0], button="middle")
    film.take(2200)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parents[1] / "docs" / "images")
    out = parser.parse_args().out
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        with page_of(browser, WINDOW) as (page, app):
            film = Film(page, app)
            for step in grasp(film):
                sys.stdout.write(f"{step}: {len(film.seen)} pictures, {app.line()}\n")
        film.write(out / "app-workflow.gif")
        browser.close()
    size = (out / "app-workflow.gif").stat().st_size
    sys.stdout.write(f"{len(film.seen)} pictures, {size / 1e6:.2f} MB\n")
    assert size < MOST, "more than a page should load"


if __name__ == "__main__":
    main()
