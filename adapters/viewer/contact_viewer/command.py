"""`contact view [FILES]`: the application, in the browser or in a window of its own."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path


class ViewCommand:
    name = "view"
    summary = "edit contacts and poses with mouse and keys, in the browser or in a window"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "files",
            nargs="*",
            metavar="FILE",
            help="meshes and rigs, a document with its meshes, a scene, the folder of a result, or sample:NAME;"
            " without any, the built-in hand and mug",
        )
        where = parser.add_mutually_exclusive_group()
        where.add_argument("--window", action="store_true", help="a plain window instead of the browser")
        where.add_argument(
            "--port", type=int, default=0, metavar="N", help="of the server; any that is free by default"
        )
        parser.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")

    def run(self, arguments: argparse.Namespace) -> int:
        _check_extra(
            "vtkmodules", *(() if arguments.window else ("trame", "trame_rca", "trame_vuetify", "aiohttp"))
        )
        if arguments.window:
            from contact_viewer.window import run_window

            run_window(arguments.files, arguments.plugins)
            return 0
        from contact_viewer.application import Application
        from contact_viewer.canvas import Canvas
        from contact_viewer.gl import off_screen_window
        from contact_viewer.web.server import WebApplication

        app = Application(Canvas(off_screen_window((1280, 720))), arguments.files, arguments.plugins, beside=True)
        output = arguments.output

        with ExitStack() as stack:

            def ready(address: str) -> None:
                for note in app.notes:
                    output.remark(f"contact: {note}")
                ending = "(Ctrl+C ends it; what is not saved comes back.)"
                output.answer({"address": address}, f"open {address}\n{ending}")
                if not arguments.no_browser:
                    stack.enter_context(_way_in(address))()

            WebApplication(app, ready).run(arguments.port)
        return 0


def _check_extra(*modules: str) -> None:
    from contact_core.errors import MissingExtra

    if any(importlib.util.find_spec(module) is None for module in modules):
        raise MissingExtra("contact view", "app")


@contextmanager
def _way_in(address: str) -> Iterator[Callable[[], None]]:
    """A function that shows the address: in an app window of a Chromium where there is one, else in the browser.

    The address holds the key, and what is on a command line everybody on the machine can read: so the browser is
    given a file that only this user can, and that goes on to the address.
    """
    import html
    import shutil
    import subprocess
    import tempfile
    import webbrowser

    with tempfile.TemporaryDirectory(prefix="contact-view-") as folder:  # only its owner may look into it
        page = Path(folder) / "open.html"
        page.write_text(f'<meta http-equiv="refresh" content="0;url={html.escape(address)}">', encoding="utf-8")
        names = ("chromium", "google-chrome", "chrome", "msedge")
        found = next(filter(None, map(shutil.which, names)), None)

        def show() -> None:
            if found is None:
                webbrowser.open(page.as_uri())
                return
            quiet = subprocess.DEVNULL
            subprocess.Popen([found, f"--app={page.as_uri()}"], stdout=quiet, stderr=quiet, start_new_session=True)

        yield show
