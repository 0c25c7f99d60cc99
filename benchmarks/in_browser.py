"""From a move of the mouse in a real Chromium to the image that shows it.

Every image of the application says where the pointer was that it was drawn for (`at` in its metadata): the page
keeps when each move came and when each image stood on the screen, so that a move is held against the first image
that has it, and never against one that was under way before.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
IMAGE = "canvas.contact-image[data-drawn]"
_WATCH = """() => {
  const canvas = document.querySelector('canvas.contact-image');
  window.moves = []; window.images = [];
  canvas.addEventListener('drawn', ({detail}) => {
    requestAnimationFrame(() => window.images.push([performance.now(), ...detail.at]));
  });
  window.addEventListener('mousemove', (event) => {
    const box = canvas.getBoundingClientRect();
    window.moves.push([event.timeStamp, event.clientX - box.left, event.clientY - box.top]);
  }, true);
}"""


@dataclass(frozen=True)
class Seen:
    """What a page saw of some moves. latencies (k,): milliseconds from each move that an image was drawn for to
    that image on the screen. moves, images: how many."""

    latencies: np.ndarray
    moves: int
    images: int

    def __str__(self) -> str:
        if not len(self.latencies):
            return f"none of {self.moves} moves seen"
        middle, late = np.percentile(self.latencies, [50, 95])
        return f"{middle:.0f} (95 %: {late:.0f}), {len(self.latencies)} of {self.moves} moves seen"


@contextlib.contextmanager
def watched(files: Sequence[str], size: tuple[int, int], ratio: float = 1.0) -> Iterator[Any]:
    """A page of `contact view` on these files, in a window of that size."""
    from playwright.sync_api import sync_playwright

    folder = Path(tempfile.mkdtemp())
    command = [
        sys.executable,
        *(os.environ.get("SERVE", "-m contact_core.cli").split()),
        "view",
        "--no-browser",
        *files,
    ]
    server = subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env={**os.environ, "CONTACT_STATE": str(folder)}
    )
    assert server.stdout is not None
    found = re.search(r"http\S+", server.stdout.readline())
    assert found is not None
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": size[0], "height": size[1]}, device_scale_factor=ratio)
            page.goto(found[0])
            page.wait_for_selector(IMAGE, timeout=60_000)
            page.wait_for_timeout(1000)
            page.evaluate(_WATCH)
            yield page
            browser.close()
    finally:
        server.terminate()
        server.wait(20)
        shutil.rmtree(folder, ignore_errors=True)


def view_of(page: Any) -> tuple[float, float, float, float]:
    """Left, top, width and height of the view, in pixels of the page."""
    box = page.locator(IMAGE).bounding_box()
    return box["x"], box["y"], box["width"], box["height"]


def seen(page: Any, path: Sequence[tuple[float, float]], apart: float) -> Seen:
    """Move the mouse along pixels of the page, so many milliseconds apart, 0 for as fast as the page takes them."""
    page.evaluate("() => { window.moves.length = 0; window.images.length = 0; }")
    for x, y in path:
        page.mouse.move(x, y)
        if apart:
            page.wait_for_timeout(apart)
    page.wait_for_timeout(400)
    moves, images = np.array(page.evaluate("window.moves")).reshape(-1, 3), page.evaluate("window.images")
    latencies, last = [], -1
    for shown, *at in images:
        if len(at) < 2:
            continue
        same = np.flatnonzero(np.abs(moves[:, 1:] - at).max(axis=1) < 0.01)
        same = same[(same > last) & (moves[same, 0] < shown)]
        if len(same):
            last = int(same[0])
            latencies.append(shown - moves[last, 0])
    return Seen(np.array(latencies), len(moves), len(images))
