"""The application served: who is refused, what is uploaded, and a real browser that paints, saves and reloads."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from contact_viewer.web.browser_events import key_of, pointer_of
from contact_viewer.web.guard import Guard

for _module in ("vtkmodules", "trame", "trame_rca", "trame_vuetify", "aiohttp"):
    pytest.importorskip(_module)

STARTS_WITHIN = 60  # seconds
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


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


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("served"), "sample:human_hand", "sample:mug") as made:
        yield made


def answer(
    served: Served, path: str, headers: dict[str, str] | None = None, body: bytes | None = None
) -> tuple[int, str]:
    """Status and text of a request to the server, with the headers as they are given."""
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=20)
    try:
        connection.request("GET" if body is None else "POST", path, body=body, headers=headers or {})
        response = connection.getresponse()
        return response.status, response.read().decode(errors="replace")
    finally:
        connection.close()


def upgrade(served: Served, path: str, headers: dict[str, str]) -> int:
    """Status of a request to open a web socket: 101 where it opens."""
    asked = {
        "Host": f"127.0.0.1:{served.port}",
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        **headers,
    }
    lines = "".join(f"{name}: {value}\r\n" for name, value in asked.items())
    with socket.create_connection(("127.0.0.1", served.port), timeout=20) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
        return int(connection.recv(64).split()[1])


# -- who is refused ------------------------------------------------------------------------------------------------


def test_without_the_key_nothing_is_told(served: Served) -> None:
    for path in ("/", "/index.html", "/download/scene.glb", "/?secret=wrong", "/?secret="):
        status, text = answer(served, path)
        assert status == 403 and "key is missing" in text
    assert upgrade(served, "/ws", {}) == 403
    assert upgrade(served, "/ws?secret=wslink-secret", {}) == 403  # trame's own default


def test_with_the_key_the_page_comes_and_is_remembered_by_a_cookie(served: Served) -> None:
    with urllib.request.urlopen(served.address, timeout=20) as response:
        cookie = response.headers["Set-Cookie"]
        assert response.status == 200 and "HttpOnly" in cookie and "SameSite=Strict" in cookie
        assert response.headers["X-Frame-Options"] == "DENY"
    assert answer(served, "/index.html", {"Cookie": cookie.split(";")[0]})[0] == 302  # to the same with the key
    assert upgrade(served, "/ws", {"Cookie": cookie.split(";")[0]}) == 101


def test_foreign_pages_are_refused_even_with_the_key(served: Served) -> None:
    """A page of another origin, and a name of another owner that resolves to this machine (DNS rebinding)."""
    for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "https://127.0.0.1"}):
        assert answer(served, f"/?secret={served.key}", headers)[0] == 403
        assert upgrade(served, f"/ws?secret={served.key}", headers) == 403
    for host in ("evil.example", f"evil.example:{served.port}", "192.168.0.1", ""):
        assert answer(served, f"/?secret={served.key}", {"Host": host})[0] == 403
    mine = f"http://127.0.0.1:{served.port}"
    assert upgrade(served, f"/ws?secret={served.key}", {"Origin": mine}) == 101


def test_it_listens_on_this_machine_alone(served: Served) -> None:
    """No other address of this machine answers."""
    other = {each[4][0] for each in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}
    for address in other:
        with pytest.raises(OSError), socket.create_connection((address, served.port), timeout=2):
            pass


def test_each_start_has_a_key_of_its_own() -> None:
    keys = {Guard().key for _ in range(50)}
    assert len(keys) == 50 and all(len(key) >= 32 for key in keys)


def test_the_secret_of_the_socket_is_the_key(served: Served) -> None:
    """Past the door, the protocol itself still asks: a hello with another secret gets no state."""
    import asyncio

    import aiohttp
    import msgpack
    from wslink.chunking import UnChunker, generate_chunks

    async def hello(secret: str) -> Any:
        async with aiohttp.ClientSession() as session:
            url = f"ws://127.0.0.1:{served.port}/ws?secret={served.key}"
            async with session.ws_connect(url, origin=f"http://127.0.0.1:{served.port}") as socket_:
                call: dict[str, Any] = {
                    "wslink": "1.0",
                    "id": "system:c0:0",
                    "method": "wslink.hello",
                    "kwargs": {},
                }
                call["args"] = [{"secret": secret}]
                for chunk in generate_chunks(msgpack.packb(call), 0):
                    await socket_.send_bytes(chunk)
                reply = await socket_.receive(timeout=20)
                return UnChunker().process_chunk(reply.data)

    assert "error" in asyncio.run(hello("wslink-secret"))
    assert "error" not in asyncio.run(hello(served.key))


# -- uploads and downloads -----------------------------------------------------------------------------------------


def test_uploads_are_named_bounded_and_refused_in_words(served: Served) -> None:
    for name, says in (("x.exe", "nothing that can be opened"), ("", "without a name"), ("bad.glb", "bad.glb")):
        status, text = answer(served, f"/upload?secret={served.key}&name={name}", body=b"not a mesh")
        assert says in text and "Traceback" not in text, (status, text)
    status, _ = answer(served, f"/upload?secret={served.key}&name=../../escape.obj", body=b"v 0 0 0\n")
    assert not list(served.folder.rglob("escape.obj"))
    status, text = answer(served, "/upload?name=x.obj", body=b"v 0 0 0\n")
    assert status == 403


def test_the_scene_is_downloaded(served: Served) -> None:
    status, _ = answer(served, f"/download/scene.glb?secret={served.key}")
    assert status == 200
    status, text = answer(served, f"/download/scene.exe?secret={served.key}")
    assert status == 400 and "nothing here writes .exe" in text


def test_a_port_that_is_taken_is_a_sentence(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        command = [sys.executable, "-m", "contact_core.cli", "view", "--no-browser", "--port", port, "sample:mug"]
        environment = {**os.environ, "CONTACT_STATE": str(tmp_path)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2 and port in done.stderr and "Traceback" not in done.stderr


# -- what the browser tells ----------------------------------------------------------------------------------------


def test_pointer_events_count_from_the_top_left() -> None:
    event = {"type": "LeftButtonPress", "x": 10, "y": 99, "shiftKey": 1, "controlKey": 0}
    pointer = pointer_of(event, 100, 1.5)
    assert pointer is not None
    assert (pointer.kind, pointer.button, pointer.x, pointer.y) == ("press", "left", 10.5, 0.5)
    assert pointer.modifiers == {"shift"} and pointer.time == 1.5
    for strange in ({}, {"type": "Pinch"}, {"type": "MouseMove"}, {"type": "MouseMove", "x": float("nan"), "y": 0}):
        assert pointer_of(strange, 100, 0.0) is None


def test_keys_come_as_they_are_engraved() -> None:
    chords = {
        "z": ({"key": "z", "ctrl": True}, "Ctrl+Z"),
        "left": ({"key": "ArrowLeft"}, "Left"),
        "space": ({"key": " ", "shift": True}, "Shift+Space"),
    }
    for event, chord in chords.values():
        key = key_of(event, 0.0)
        assert key is not None and key.chord == chord
    assert key_of({"key": "Dead"}, 0.0) is None and key_of({}, 0.0) is None


# -- a real browser ------------------------------------------------------------------------------------------------

IMAGE = "img.image-display-area"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A headless Chromium of this system, without the limit of memory that the tests have: it reserves more."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright (extra dev) drives the browser")
    if CHROMIUM is None:
        pytest.skip("there is no Chromium here: apt-get install chromium")
    with api.sync_playwright() as playwright:
        program = tmp_path_factory.mktemp("browser") / "chromium"
        program.write_text(f'#!/bin/sh\nulimit -S -v unlimited\nexec {CHROMIUM} "$@"\n')
        program.chmod(0o755)
        made = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield made
        made.close()


@dataclass
class Page:
    """The application as somebody sees it in a browser."""

    page: Any
    errors: list[str]
    first_line: str = ""

    @classmethod
    def opened(cls, browser: Any, address: str, scale: float = 1.0) -> Page:
        page = browser.new_page(viewport={"width": 1000, "height": 640}, device_scale_factor=scale)
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
        """Wait for a condition in the page."""
        self.page.wait_for_function(condition, timeout=30_000, polling=50)

    def state(self, name: str) -> Any:
        return self.page.evaluate(f"() => trame.state.get('{name}')")

    def key(self, chord: str) -> None:
        self.page.keyboard.press(chord)

    def patches(self) -> list[str]:
        return [row["name"] for row in self.state("tree") if row["kind"] == "patch"]

    def until_patches(self, count: int) -> None:
        self.until(f"() => trame.state.get('tree').filter((row) => row.kind === 'patch').length === {count}")

    def at(self, x: float, y: float) -> tuple[float, float]:
        """A position in the view, by its share of width and height."""
        box = self.page.locator(IMAGE).bounding_box()
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    def drag(self, *path: tuple[float, float]) -> None:
        """Press at the first place, over all others, let go at the last; no faster than a hand."""
        mouse = self.page.mouse
        mouse.move(*self.at(*path[0]))
        mouse.down()
        for x, y in path[1:]:
            self.page.wait_for_timeout(30)
            mouse.move(*self.at(x, y))
        self.page.wait_for_timeout(30)
        mouse.up()


@pytest.mark.slow
def test_a_browser_paints_undoes_saves_and_reloads(browser: Any, tmp_path: Path) -> None:
    with serving(tmp_path, "sample:baseball") as served:
        page = Page.opened(browser, served.address)
        page.key("b")
        page.until("() => trame.state.get('tools').find((tool) => tool.active).id === 'tool.paint'")
        stroke = ((0.5, 0.5), (0.53, 0.52), (0.56, 0.5))
        page.drag(*stroke)
        page.until_patches(1)
        assert page.state("undo_name").startswith("Paint")
        page.key("Control+z")
        page.until_patches(0)
        page.key("Control+Shift+Z")
        page.until_patches(1)
        page.key("Control+s")
        page.until("() => trame.state.get('line').includes('saved')")
        (saved,) = tmp_path.glob("*.contactscene")
        (name,) = page.patches()
        page.page.reload()
        page.page.wait_for_selector(IMAGE, timeout=30_000)
        page.until_patches(1)  # the server goes on, and the page with it
        assert page.errors == []
        page.page.close()
    with serving(tmp_path, str(saved)) as served:
        page = Page.opened(browser, served.address)
        assert page.patches() == [name]
        page.page.close()


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
def test_a_dense_screen_is_drawn_and_picked_densely(browser: Any, served: Served) -> None:
    """At two device pixels per pixel the image has twice as many, and a click meets what is under it."""
    page = Page.opened(browser, served.address, scale=2.0)
    page.until(
        f"() => document.querySelector('{IMAGE}').naturalWidth > 1.8 * document.querySelector('{IMAGE}').width"
    )
    page.key("b")
    page.drag((0.3, 0.75), (0.32, 0.73))  # the palm
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
