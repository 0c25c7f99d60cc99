"""A running `contact view`, and somebody before it in a real browser."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

STARTS_WITHIN = 60  # seconds
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
IMAGE = "canvas.contact-image[data-drawn]"


@dataclass(frozen=True)
class Served:
    """A running server. folder: where it was started, and where it saves."""

    address: str
    process: subprocess.Popen[str]
    folder: Path

    @property
    def port(self) -> int:
        port = urlsplit(self.address).port
        assert port is not None
        return port

    @property
    def key(self) -> str:
        return parse_qs(urlsplit(self.address).query)["secret"][0]


@contextlib.contextmanager
def serving(folder: Path, *files: str) -> Iterator[Served]:
    """`contact view` in a process of its own, on any free port."""
    command = [sys.executable, "-m", "contact_core.cli", "view", "--no-browser", "--json", *files]
    environment = {**os.environ, "CONTACT_STATE": str(folder / "state"), "PYTHONUNBUFFERED": "1"}
    environment.pop("DISPLAY", None)
    process = subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield Served(_address(process), process, folder)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM if sys.platform != "win32" else signal.SIGABRT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def _address(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None and process.stderr is not None
    text, until = "", time.monotonic() + STARTS_WITHIN
    while time.monotonic() < until:
        text += process.stdout.readline()
        if "}" in text:
            return str(json.loads(text)["address"])
        if process.poll() is not None:
            break
    raise AssertionError(f"no address: {text} {process.stderr.read()}")


@dataclass
class Page:
    """The application as somebody sees it in a browser."""

    page: Any
    errors: list[str]
    first_line: str = ""

    @classmethod
    def opened(cls, browser: Any, address: str, scale: float = 1.0, size: tuple[int, int] = (1000, 640)) -> Page:
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, device_scale_factor=scale)
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        page.wait_for_selector(IMAGE, timeout=30_000)
        made = cls(page, errors)
        made.until("() => trame.state.get('tools').length > 3")
        made.first_line = made.state("line")
        made.key("1")
        made.page.wait_for_timeout(400)
        return made

    def until(self, condition: str) -> None:
        """Wait for a condition in the page: long, on a busy machine where kernels are compiled the first time."""
        self.page.wait_for_function(condition, timeout=60_000, polling=50)

    def state(self, name: str) -> Any:
        return self.page.evaluate(f"() => trame.state.get('{name}')")

    def key(self, chord: str) -> None:
        self.page.keyboard.press(chord)

    def patches(self) -> list[str]:
        return [row["name"] for row in self.state("tree") if row["kind"] == "patch"]

    def until_patches(self, count: int) -> None:
        self.until(f"() => trame.state.get('tree').filter((row) => row.kind === 'patch').length === {count}")

    def size(self) -> tuple[int, int]:
        """Width and height of the view, in pixels of the page."""
        box = self.page.locator(IMAGE).bounding_box()
        return round(box["width"]), round(box["height"])

    def corner(self) -> tuple[float, float]:
        """Where the view's upper left corner is in the page."""
        box = self.page.locator(IMAGE).bounding_box()
        return box["x"], box["y"]

    def image(self) -> bytes:
        """The image that is shown, as a PNG."""
        script = f"""async () => {{
            const canvas = document.querySelector('{IMAGE}');
            const blob = await new Promise((done) => canvas.toBlob(done, 'image/png'));
            return Array.from(new Uint8Array(await blob.arrayBuffer()));
        }}"""
        return bytes(self.page.evaluate(script))

    def drag(self, *path: tuple[float, float]) -> None:
        """Press at the first place, over all others, let go at the last: shares of the view's width and height."""
        width, height = self.size()
        self.drag_pixels(*((x * width, y * height) for x, y in path))

    def drag_pixels(self, *path: tuple[float, float]) -> None:
        """The same by pixels of the view; no faster than a hand, and every move arrives."""
        (left, top), mouse = self.corner(), self.page.mouse
        places = [(left + x, top + y) for x, y in path]
        mouse.move(*places[0])
        mouse.down()
        for place in places[1:]:
            self._arrive()
            mouse.move(*place)
        self._arrive()
        mouse.up()

    def _arrive(self) -> None:
        """Wait until the server has every event so far: the browser makes one of two moves in a frame of its own,
        and an answer says that what was sent before it is there."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        self._answer()

    def _answer(self) -> None:
        """Ask the server something that changes nothing."""
        self.page.evaluate("() => trame.trigger('key', [{}])")
