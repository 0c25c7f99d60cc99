"""The application served: who is refused, what is uploaded, what the browser tells."""

from __future__ import annotations

import http.client
import os
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_viewer.web.browser_events import key_of, pointer_of
from contact_viewer.web.guard import Guard
from contact_viewer.web.stream import changed
from tests.adapters.viewer.served import Served, serving

for _module in ("vtkmodules", "trame", "trame_rca", "trame_vuetify", "aiohttp"):
    pytest.importorskip(_module)


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
    """The page's own pixel is met in its middle, however many pixels of the image it has."""
    event = {"type": "LeftButtonPress", "x": 10, "y": 100, "shiftKey": 1, "controlKey": 0}
    dense = pointer_of(event, 200, 1.5, 2.0)
    assert dense is not None and (dense.x, dense.y) == (21.0, 1.0)
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


# -- what is sent --------------------------------------------------------------------------------------------------


def test_the_rectangle_that_changed_holds_every_change() -> None:
    """Drawn over the image before, it is the image now; its blocks are whole, so that no neighbour is encoded."""
    before = np.random.default_rng(7).integers(0, 255, (100, 150, 4), np.uint8)
    for corner, far in (((0, 0), (1, 1)), ((37, 52), (61, 99)), ((99, 149), (100, 150)), ((0, 0), (100, 150))):
        now = before.copy()
        now[corner[0] : far[0], corner[1] : far[1], :3] ^= 1
        left, top, right, bottom = changed(before, now)
        assert left % 16 == top % 16 == 0
        assert right % 16 == 0 or right == 150
        shown = before.copy()
        shown[top:bottom, left:right] = now[top:bottom, left:right]
        assert np.array_equal(shown, now)
        assert right - left < far[1] - corner[1] + 32 and bottom - top < far[0] - corner[0] + 32
    assert changed(before, before.copy()) == (0, 0, 0, 0)
    assert changed(None, before) == changed(before[:50], before) == (0, 0, 150, 100)
