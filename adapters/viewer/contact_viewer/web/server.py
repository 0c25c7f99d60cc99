"""`contact view` in a browser: trame on 127.0.0.1, one artist, one document."""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from contact_core.errors import ContactError, FileRefused, InvalidInput
from contact_core.interaction.actions import GROUPS
from contact_core.plugins.registry import FORMATS, SAMPLES
from contact_viewer import panel
from contact_viewer.application import Application
from contact_viewer.film_panel import film_state
from contact_viewer.look import THEMES
from contact_viewer.web import quiet
from contact_viewer.web.browser_events import key_of
from contact_viewer.web.guard import HOST, Guard
from contact_viewer.web.page import build, icon_of
from contact_viewer.web.stream import Stream

MAX_UPLOAD = 512 << 20  # bytes of one file
_PANELS_EVERY = 0.2  # seconds, while something is dragged
_GROUP_NAMES = {"tool": "Tools", "edit": "Edit", "selection": "Selection", "pose": "Pose", "film": "Film",
                "show": "Show", "file": "File", "view": "View"}  # fmt: skip


class WebApplication:
    """Serves an application. ready: called with the address once it can be opened."""

    def __init__(self, app: Application, ready: Callable[[str], None] = lambda address: None) -> None:
        self.app, self.guard = app, Guard()
        self._ready = ready
        self._uploads = tempfile.TemporaryDirectory(prefix="contact-uploads-")
        self._told_at = 0.0
        self._pages = 0
        self._help_told = False
        self._saved_told = 0
        self._pending: set[str] = set()
        self._server = _new_server(self.guard)
        self.stream: Stream | None = None
        self._server.controller.on_server_bind.add(self._bind)
        self._server.controller.on_server_ready.add(self._start)
        self._server.controller.on_client_connected.add(self._greet)
        self._listen()
        self._initial()
        build(self._server, "contact_view")

    def run(self, port: int = 0) -> None:
        """Serve until interrupted. port: 0 for any that is free. Raises FileRefused for one that is taken."""
        try:
            _check_port(port)
            self._server.start(
                port=port, host=HOST, open_browser=False, show_connection_info=False, timeout=0, exec_mode="main"
            )
        finally:
            self.app.close()
            self._uploads.cleanup()

    # -- serving -------------------------------------------------------------------------------------------------

    def _bind(self, wslink_server: Any) -> None:
        from aiohttp import web

        self.guard.protect(wslink_server.app)

        async def count(request: Any, handler: Any) -> Any:
            """How many pages are open: each holds one web socket."""
            if request.path != "/ws":
                return await handler(request)
            self._pages += 1
            try:
                return await handler(request)
            finally:
                self._pages -= 1
                self._lost()
                self._tell()

        wslink_server.app.middlewares.append(web.middleware(count))
        wslink_server.app.add_routes(
            [
                web.post("/upload", self._upload),
                web.get("/download/{name}", self._download),
                web.get("/grasp/{shelf}/{name}", self._picture),
            ]
        )

    def _start(self, **_: Any) -> None:
        self.stream = Stream(self.app, "contact_view", self._changed)
        self._server.controller.rc_area_register(self.stream)
        self.stream.start()
        self._ready(self.guard.address(self._server.port))

    def _greet(self, *_: Any, **__: Any) -> None:
        """A page was opened, or opened again: it wants everything."""
        self.app.help_wanted = self._help_told = False
        with self._server.state as state:
            state.update({"open_wanted": False, "export_wanted": False, "help_wanted": False})
        self._tell(everything=True)
        if self.stream is not None:
            self.stream.wake(redraw=True)

    def _lost(self) -> None:
        """A page went away, in the middle of a drag perhaps: nobody will let go any more."""
        self.app.interaction.cancel()
        if self.stream is not None:
            self.stream.let_go()

    async def _upload(self, request: Any) -> Any:
        from aiohttp import web

        try:
            path = await self._received(request)
            self.app.notes.clear()
            self.app.bring([str(path)])
            answer = web.Response(text=" ".join(self.app.notes) or f"{path.name} is open.")
        except ContactError as error:
            answer = web.Response(status=400, text=str(error))
        if self.stream is not None:
            self.stream.wake(redraw=True)
        return answer

    async def _received(self, request: Any) -> Path:
        """The file that a request brings, in a folder of this start. Raises FileRefused."""
        name = Path(request.query.get("name", "")).name
        suffixes = {s for kind in self.app.plugins.offers(FORMATS).values() for s in kind.suffixes}
        known = suffixes | {".json", ".contactscene", ".bin", ".mtl", ".png", ".jpg"}
        if Path(name).suffix.lower() not in known:
            raise FileRefused(f"{name or 'a file without a name'} is nothing that can be opened here.")
        path = Path(self._uploads.name) / name
        size = 0
        with path.open("wb") as file:
            async for chunk in request.content.iter_chunked(1 << 16):
                size += len(chunk)
                if size > MAX_UPLOAD:
                    break
                file.write(chunk)
        if size > MAX_UPLOAD:
            path.unlink()
            raise FileRefused(
                f"{name} is larger than the {MAX_UPLOAD >> 20} MB that are taken: open it by its path."
            )
        return path

    async def _download(self, request: Any) -> Any:
        from aiohttp import web

        name = Path(request.match_info["name"]).name
        path = Path(self._uploads.name) / f"download-{time.monotonic_ns()}{Path(name).suffix}"
        try:
            self.app.write_copy(path)
        except ContactError as error:
            return web.Response(status=400, text=str(error))
        data = path.read_bytes()
        path.unlink()
        return web.Response(body=data, headers={"Content-Disposition": f'attachment; filename="{name}"'})

    async def _picture(self, request: Any) -> Any:
        """The thumbnail of a grasp of the library."""
        from aiohttp import web

        try:
            data = self.app.shelves.picture(request.match_info["shelf"], request.match_info["name"])
        except ContactError as error:
            return web.Response(status=404, text=str(error))
        if data is None:
            return web.Response(status=404, text="this grasp has no picture.")
        return web.Response(body=data, content_type="image/png")

    # -- what the page tells -------------------------------------------------------------------------------------

    def _listen(self) -> None:
        trigger, app = self._server.trigger, self.app

        def told(name: str) -> Callable[[Callable[..., object]], Callable[..., None]]:
            def wrap(act: Callable[..., object]) -> Callable[..., None]:
                def run(*arguments: Any) -> None:
                    if name != "key":  # which may be none of ours
                        app.interaction.forgive()
                    app.attempt(lambda: act(*arguments))
                    if self.stream is not None:
                        self.stream.wake()

                trigger(name)(run)
                return run

            return wrap

        @told("key")
        def key(event: dict[str, Any]) -> None:
            found = key_of(event, time.monotonic())
            if found is not None and self.stream is not None:
                self.stream.put(found)

        told("act")(self._act)
        told("choose")(lambda kind, name, more: app.select(kind, name, more=bool(more)))
        told("hide")(app.hide)
        told("lock")(app.lock)
        told("rename")(lambda patch, name: app.rename(str(patch), str(name).strip()))
        told("recolor")(lambda patch, color: app.recolor(str(patch), str(color)))
        told("set")(lambda slot, name, item, value: panel.set_setting(app.interaction, slot, name, item, value))
        told("card")(lambda which: app.turn_card(str(which)))
        told("go_to")(lambda frame: app.go_to(float(frame)))
        told("film_drag")(
            lambda what, name, frame, part, to: app.drag_film(what, str(name), float(frame), str(part), float(to))
        )
        told("film_loop")(lambda loop: app.play_loop(bool(loop)))
        told("show_worst")(app.show_worst)
        told("choose_pair")(lambda pair: app.choose_pair(str(pair)))
        told("film_end")(lambda last: app.session.timeline.set(last=float(last)))
        told("open")(self._open)
        told("grasp")(lambda shelf, name: app.shelves.apply(str(shelf), str(name)))
        told("save_grasp")(lambda name, tags: app.shelves.save(str(name), str(tags or "")))
        told("write")(lambda path: app.write(_path(path)))
        told("uploaded")(lambda text, fine: app.say(str(text)))
        self._server.state.change("theme")(self._theme)
        self._server.state.change("film_open")(self._film_opened)
        self._server.state.change("help_wanted")(self._help_turned)
        self._server.state.change("library_wanted")(self._library_turned)

    def _act(self, action: str) -> None:
        state = self._server.state
        if action == "file.open":
            state.open_wanted = True
        elif action == "file.export":
            state.export_wanted = True
        elif action == "file.library":
            state.library_wanted = not state.library_wanted
        else:
            self.app.do(action)

    def _open(self, text: str, add: bool) -> None:
        sources = [each.strip() for each in str(text).split(";") if each.strip()]
        if not sources:
            raise InvalidInput("name a file to open.")
        if add:
            self.app.add(sources)
        else:
            self.app.open(sources)

    def _help_turned(self, help_wanted: bool, **_: Any) -> None:
        self.app.help_wanted = self._help_told = bool(help_wanted)

    def _library_turned(self, library_wanted: bool, **_: Any) -> None:
        if library_wanted:  # read anew each time: others write into it
            self.app.attempt(self._show_shelves)

    def _show_shelves(self) -> None:
        self._server.state.shelves = self.app.shelves.rows()

    def _film_opened(self, film_open: bool, **_: Any) -> None:
        self.app.film_open = bool(film_open)
        if self.stream is not None:
            self.stream.wake()

    def _theme(self, theme: str, **_: Any) -> None:
        if theme in THEMES:
            self.app.set_theme(theme)
            if self.stream is not None:
                self.stream.wake(redraw=True)

    # -- what the page shows -------------------------------------------------------------------------------------

    def _initial(self) -> None:
        state = self._server.state
        state.trame__title = "contact"
        state.update(
            {"theme": "dark", "open_wanted": False, "export_wanted": False, "help_wanted": False, "open_path": "",
             "library_wanted": False, "library_word": "", "grasp_name": "", "grasp_tags": "", "shelves": [],
             "film_open": False,
             "export_path": "", "renaming": "", "samples": sorted(self.app.plugins.offers(SAMPLES))}
        )  # fmt: skip
        self._tell(everything=True)

    def _changed(self, parts: frozenset[str]) -> None:
        """Once a frame: tell the page what changed, the panels a few times a second while something is dragged."""
        self._pending |= parts
        now = time.monotonic()
        if self.app.interaction.is_busy and now - self._told_at < _PANELS_EVERY:
            return
        self._told_at = now
        self._tell()

    def _tell(self, *, everything: bool = False) -> None:
        app, state = self.app, self._server.state
        pending, self._pending = self._pending, set()
        status = app.interaction.status
        told: dict[str, Any] = {
            "title": app.title,
            "pages": self._pages,
            "line": app.line(),
            "refusal": app.refusal(),
            "work": None if status.work is None else
            {"title": status.work.title, "text": status.work.text, "fraction": status.work.fraction},
            "proposed": status.proposed,
            "suggested": len(app.interaction.proposing.suggestions),
            "undo_name": app.undo_name(),
            "redo_name": app.redo_name(),
            "split": app.panes.is_split,
        }  # fmt: skip
        if app.shelves.saved != self._saved_told:
            self._saved_told = app.shelves.saved
            self._show_shelves()
        if app.help_wanted != self._help_told:  # else a dialog that is just being closed would open again
            told["help_wanted"] = self._help_told = app.help_wanted
        if app.wants == "library":
            told |= {"library_wanted": not state.library_wanted, "shelves": app.shelves.rows()}
            app.wants = None
        elif app.wants is not None:
            told[f"{app.wants}_wanted"], app.wants = True, None
        if everything or pending & {"document", "selection", "status", "camera"}:
            told["card"] = app.guide.card()
        if everything or pending & {"document", "selection", "surfaces", "visibility", "status"}:
            told["tree"] = app.tree()
            told["report"] = panel.report(app.meets, app.interaction.desk.document)
            taught = app.guide.lesson is not None
            told["next_step"] = "" if taught else panel.next_step(app.session, app.interaction)
        if everything or pending & {"document", "surfaces", "film"}:
            told["film"] = self._film()
        if everything or pending & {"tool", "settings", "visibility"}:
            told["tools"] = self._tools()
            told["settings"] = panel.settings(app.interaction)
            settings = app.interaction.settings
            told |= {"live": settings.live, "xray": settings.xray, "isolate": settings.isolate}
            told |= {"heat": settings.heat, "legend": panel.legend() if settings.heat else []}
        if everything:
            told["help_groups"] = self._help()
        with state:
            for name, value in told.items():
                if state[name] != value:
                    state[name] = value

    def _film(self) -> dict[str, Any]:
        film = self.app.interaction.film
        playing = {"playing": film.playback.is_playing, "loop": film.playback.loop, "onion": film.onion}
        return film_state(film.view()) | playing

    def _tools(self) -> list[dict[str, Any]]:
        active = f"tool.{self.app.interaction.tool}"
        return [
            {
                "id": each.id,
                "label": each.label,
                "key": each.keys[0] if each.keys else "",
                "help": each.help,
                "icon": icon_of(each.id.removeprefix("tool.")),
                "active": each.id == active,
            }
            for each in self.app.table()
            if each.group == "tool"
        ]

    def _help(self) -> list[dict[str, Any]]:
        groups = []
        for group in GROUPS:
            entries = [
                {"id": each.id, "keys": ", ".join(each.keys), "label": each.label, "help": each.help}
                for each in self.app.table()
                if each.group == group and each.keys
            ]
            groups.append({"name": _GROUP_NAMES[group], "entries": entries})
        return groups


def _new_server(guard: Guard) -> Any:
    """A trame server that knows our key, and reads no command line: that is ours."""
    os.environ["TRAME_ARGS"] = ""
    quiet.install()
    from trame.app import get_server

    server = get_server(f"contact-{guard.key[:8]}", client_type="vue3")
    server.cli.set_defaults(authKey=guard.key, host=HOST)
    return server


def _check_port(port: int) -> None:
    """Raises FileRefused where a port cannot be bound."""
    import socket

    if not 0 <= port < 65536:
        raise InvalidInput(f"a port is a number from 0 to 65535, but got {port}.")
    with contextlib.closing(socket.socket()) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((HOST, port))
        except OSError as error:
            raise FileRefused(
                f"port {port} cannot be used ({error.strerror}): choose another with --port."
            ) from error


def _path(text: object) -> Path:
    """Raises InvalidInput for no name."""
    name = str(text or "").strip()
    if not name:
        raise InvalidInput("name a file to write.")
    return Path(name).expanduser()
