"""The view in the browser: events queue up, and each frame answers all of them with one image.

Between two frames any number of moves may come (a mouse tells 125 a second, software draws 15 to 30 frames): they
are handled one after the other, which is cheap, then one upload and one image follow, of the rectangle that
changed, and after it what makes the hand follow. While things move images are quick; what stands still is drawn
once more, with smooth edges.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from contact_core.interaction.events import Event, Pointer
from contact_viewer.application import Application
from contact_viewer.web.browser_events import pointer_of

log = logging.getLogger(__name__)
_QUICK, _SHARP = 72, 93  # qualities of JPEG
_REST = 0.25  # seconds without a change, after which a frame stands still
_HELD = 1.0  # the same while something is dragged: a frame with smooth edges would be in the way of the next move
_BLOCK = 16  # pixels of a side that JPEG encodes together
_TURNS = 6  # of the loop, in which the socket is read or written
_FOLLOWING = 0.004  # seconds between looks at the pose that follows a drag
_PLAYING = 0.008  # seconds between looks at which frame of a film is due
_POLL = 0.08  # seconds between looks at work that runs beside the window
_MOST_PIXELS = 2560 * 1600  # of an image: a screen of 4K is drawn a little smaller
_MOST_WAITING = 400  # events; what comes beyond is dropped, moves first


class Stream:
    """An area of trame-rca (an "area adapter") that shows an application.

    changed: told which parts changed, once a frame. A name that trame-rca knows it by is `area_name`; images go out
    under that name with ".image", for a canvas of the page's own.
    """

    def __init__(self, app: Application, name: str, changed: Callable[[frozenset[str]], None]) -> None:
        self.area_name = name
        self._app, self._changed = app, changed
        self._streamer: Any = None
        self._wanted = asyncio.Event()
        self._events: list[Event] = []
        self._pressed: set[str] = set()
        self._scale = 1.0
        self._at: list[float] = []  # where the pointer is in the newest image, the page's pixels; who measures asks
        self._sharp = False
        self._still_at = 0.0  # monotonic seconds
        self._resized = self._whole = True
        self._sent: Any = None  # the pixels that the page shows
        self._task: asyncio.Task[None] | None = None
        self.frames = 0

    # -- what trame-rca calls --------------------------------------------------------------------------------

    def set_streamer(self, streamer: Any) -> None:
        """Who takes images."""
        self._streamer = streamer
        self.wake(redraw=True)

    def update_size(self, _: object, size: Mapping[str, Any]) -> None:
        """The area in the browser has another size."""
        width, height = max(10, int(size.get("w", 300))), max(10, int(size.get("h", 300)))
        ratio = min(max(float(size.get("p", 1) or 1), 0.5), 4.0)
        fitting = min(1.0, (_MOST_PIXELS / (width * height * ratio * ratio)) ** 0.5)
        self._scale = ratio * fitting
        self._app.resize(round(width * self._scale), round(height * self._scale), self._scale)
        self.wake(redraw=True)

    def on_interaction(self, _: object, event: Mapping[str, Any]) -> None:
        """Something happened to the pointer."""
        pointer = pointer_of(event, self._app.canvas.eye.viewport[1], time.monotonic(), self._scale)
        if pointer is not None and self._is_whole(pointer):
            self.put(pointer)

    def reset(self) -> None:
        """A new client: it wants an image."""
        self.wake(redraw=True)

    def let_go(self) -> None:
        """No button is held any more, and what was queued is not for anybody."""
        self._events.clear()
        self._pressed.clear()
        self.wake(redraw=True)

    def video_codecs(self) -> list[dict[str, Any]]:
        """None: images are sent."""
        return []

    def negotiate_video(self, _: object) -> dict[str, str]:
        """Images are sent."""
        return {"error": "not-a-video-stream"}

    # -- frames ----------------------------------------------------------------------------------------------

    def put(self, event: Event) -> None:
        """Queue an event for the next frame."""
        if len(self._events) >= _MOST_WAITING:
            self._events = [
                each for each in self._events if not (isinstance(each, Pointer) and each.kind == "move")
            ]
        if len(self._events) < _MOST_WAITING:
            self._events.append(event)
        self.wake()

    def wake(self, *, redraw: bool = False) -> None:
        """Look whether there is something to draw. redraw: in any case."""
        self._resized |= redraw
        self._wanted.set()

    def start(self) -> None:
        """Draw from now on, in the running loop."""
        self._task = asyncio.get_running_loop().create_task(self._run())

    async def close(self) -> None:
        """Draw no more."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task

    async def _run(self) -> None:
        while True:
            await self._wait()
            try:
                if await self._frame():
                    self._still_at = time.monotonic() + (_HELD if self._app.interaction.is_busy else _REST)
                elif self._rests:
                    self._sharp = await self._send(still=True)
                    await self._drained()
            except Exception as error:  # one bad frame must not end the application; the document is whole
                log.exception("a frame failed")
                self._app.say(f"that failed by a mistake in the program ({error}); the contacts are as they were.")
                await asyncio.sleep(0.2)
            await asyncio.sleep(0)  # events come in while nothing is drawn

    async def _wait(self) -> None:
        """Until something happened; for a while only, where something is due by itself."""
        film = self._app.interaction.film
        working = self._app.interaction.worker.status is not None or film.worker.status is not None
        if film.playback.is_playing:
            seconds: float | None = _PLAYING
        elif self._app.interaction.is_busy and self._app.interaction.is_due:
            seconds = _FOLLOWING
        else:
            rest = None if self._sharp else max(0.0, self._still_at - time.monotonic())
            seconds = min(_POLL, rest or _POLL) if working else rest
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(self._wanted.wait(), seconds)
        await _turns()  # what came while a frame was drawn is read first
        self._wanted.clear()

    @property
    def _rests(self) -> bool:
        """Whether a frame that stands still is due, which delays whatever comes in it."""
        moving = self._events or self._app.interaction.film.playback.is_playing
        return not self._sharp and not moving and time.monotonic() >= self._still_at

    async def _frame(self) -> bool:
        """Handle what came, and draw if anything changed; whether it did."""
        events, self._events = self._events, []
        for event in events:
            self._app.handle(event)
            if isinstance(event, Pointer):
                self._at = [event.x / self._scale - 0.5, event.y / self._scale - 0.5]
        dragged = self._app.interaction.is_busy and bool(events)
        parts = self._app.frame(advance=not dragged)
        redraw, self._resized = self._resized, False
        self._whole |= redraw
        drawn = redraw or bool(parts - {"work", "status"})
        try:
            if drawn:
                self._sharp = False
                await self._send(still=False)
        finally:  # the image first: it is what the hand on the mouse waits for
            await _turns()
            if parts:
                self._changed(parts)
        if dragged and self._app.interaction.advance():
            self.wake()
        await self._drained()
        return drawn or bool(events)

    async def _send(self, *, still: bool) -> bool:
        """Draw and send an image; whether it was sent. One that stands still is not where something came in it."""
        if self._streamer is None:
            return True
        pixels = self._app.canvas.rgba(still=still, quick=not still)
        before = None if still or self._whole else self._sent
        left, top, right, bottom = changed(before, pixels)
        if left == right:
            return True
        quality = _SHARP if still else _QUICK
        loop = asyncio.get_running_loop()
        content = await loop.run_in_executor(None, encoded, pixels[top:bottom, left:right], quality)
        if still and self._events:
            return False
        self._sent, self._whole = pixels, False
        height, width = pixels.shape[:2]
        whole = (right - left, bottom - top) == (width, height)
        self.frames += 1
        meta = {"type": "image/jpeg", "codec": "", "w": width, "h": height, "x": left, "y": top, "whole": whole,
                "st": int(time.time() * 1000), "key": "key", "quality": quality, "at": self._at}  # fmt: skip
        self._streamer.push_content(f"{self.area_name}.image", meta, content)
        return True

    async def _drained(self) -> None:
        """Wait, not long, for the browser to take what was sent: else images pile up and all of them are late."""
        if self._streamer is None:
            return
        monitor = self._streamer.coreServer.network_monitor
        for _ in range(50):
            if monitor.pending <= 1:
                return
            await asyncio.sleep(0.004)

    def _is_whole(self, event: Pointer) -> bool:
        """Whether a release belongs to a press that was seen here."""
        if event.kind == "press":
            self._pressed.add(event.button)
        elif event.kind == "release":
            if event.button not in self._pressed:
                return False
            self._pressed.discard(event.button)
        return True


async def _turns() -> None:
    """Let the loop read and write what is ready."""
    for _ in range(_TURNS):
        await asyncio.sleep(0)


def changed(before: Any, now: Any) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of the rectangle in which two images (h, w, 4) uint8 differ, in whole blocks of
    JPEG; all of the image where sizes differ, (0, 0, 0, 0) where nothing does."""
    height, width = now.shape[:2]
    if before is None or before.shape != now.shape:
        return 0, 0, width, height
    other = before.view(np.uint32)[..., 0] != now.view(np.uint32)[..., 0]  # (h, w)
    rows, columns = np.flatnonzero(other.any(axis=1)), np.flatnonzero(other.any(axis=0))
    if not len(rows):
        return 0, 0, 0, 0
    left, top = int(columns[0]) // _BLOCK * _BLOCK, int(rows[0]) // _BLOCK * _BLOCK
    right, bottom = int(columns[-1]) // _BLOCK * _BLOCK + _BLOCK, int(rows[-1]) // _BLOCK * _BLOCK + _BLOCK
    return left, top, min(right, width), min(bottom, height)


def encoded(pixels: Any, quality: int) -> bytes:
    """JPEG of an image (h, w, 4) whose last channel says nothing."""
    from PIL import Image

    height, width = pixels.shape[:2]
    stream = io.BytesIO()
    image = Image.frombuffer("RGBX", (width, height), np.ascontiguousarray(pixels), "raw", "RGBX", 0, 1)
    image.save(stream, "jpeg", quality=quality, subsampling=0 if quality > 90 else 2)
    return stream.getvalue()
