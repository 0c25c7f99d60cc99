"""`contact view [FILES]`: the application, in the browser or in a window of its own."""

from __future__ import annotations

import argparse
import importlib.util


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

        app = Application(Canvas(off_screen_window((1280, 720))), arguments.files, arguments.plugins)
        output = arguments.output

        def ready(address: str) -> None:
            for note in app.notes:
                output.remark(f"contact: {note}")
            output.answer({"address": address}, f"open {address}\n(Ctrl+C ends it; what is not saved comes back.)")
            if not arguments.no_browser:
                _open(address)

        WebApplication(app, ready).run(arguments.port)
        return 0


def _check_extra(*modules: str) -> None:
    from contact_core.errors import MissingExtra

    if any(importlib.util.find_spec(module) is None for module in modules):
        raise MissingExtra("contact view", "app")


def _open(address: str) -> None:
    """Show it: in an app window of a Chromium where there is one, else in the browser."""
    import shutil
    import subprocess
    import webbrowser

    for name in ("chromium", "google-chrome", "chrome", "msedge"):
        found = shutil.which(name)
        if found is not None:
            subprocess.Popen(
                [found, f"--app={address}"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
            return
    webbrowser.open(address)
