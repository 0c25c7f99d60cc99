"""`contact view --window`: the same application in a plain window of VTK, with keys and a line of status."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from contact_core.errors import FileRefused, InvalidInput
from contact_core.interaction.actions import GROUPS
from contact_core.interaction.heat import legend_text
from contact_core.plugins.manager import PluginManager
from contact_viewer import panel
from contact_viewer.application import Application
from contact_viewer.canvas import Canvas
from contact_viewer.gl import has_screen, screen_window
from contact_viewer.prompt import Prompt, paths
from contact_viewer.vtk_events import VtkEvents

_SIZE = (1280, 800)
_TICK = 12  # milliseconds between looks at what is due
_REST = 15  # ticks without a change, after which a frame stands still
_COLUMN = 27  # rows of the help


class Front:
    """An application behind a VTK interactor. `tick` draws if anything changed."""

    def __init__(self, app: Application, interactor: Any) -> None:
        self.app = app
        self.events = VtkEvents(interactor, app.handle, self._typed, self._dropped)
        self.prompt: Prompt | None = None
        self._interactor = interactor
        self._quiet = 0

    def tick(self) -> bool:
        """One turn of the loop: handle what is due and draw; whether something was drawn."""
        app = self.app
        resized = app.resize(*self._interactor.GetRenderWindow().GetSize())
        self._ask()
        parts = app.frame()
        if parts or resized:
            self._quiet = 0
            self._show_texts()
            app.canvas.render()
            return True
        self._quiet += 1
        if self._quiet == _REST:
            app.canvas.render(still=True)
        return self._quiet == _REST

    def run(self) -> None:
        """Until the window is closed. Raises what an event raised."""
        self._interactor.Initialize()
        self._interactor.AddObserver("TimerEvent", self._on_timer)
        self._interactor.CreateRepeatingTimer(_TICK)
        self._interactor.Start()
        self.events.raise_errors()

    def _on_timer(self, *_: object) -> None:
        try:
            self.tick()
        except BaseException as error:
            self.events.errors.append(error)
        if self.events.errors:
            self._interactor.TerminateApp()

    def _ask(self) -> None:
        """What the artist is to name is typed: a plain window has no dialogs."""
        wanted, self.app.wants = self.app.wants, None
        app, here = self.app, f"{Path.cwd()}{os.sep}"
        if wanted == "open":
            self.prompt = Prompt("Open, with ; between several", lambda text: app.bring(_each(text)), paths, here)
        elif wanted == "export":
            write = Prompt("Write a scene, glb or usda", lambda text: app.write(Path(_each(text)[0])), paths)
            self.prompt = replace(write, text=str(self._export_path()))
        elif wanted == "library":
            self.prompt = Prompt(
                "A grasp of the library, or + and a name to save this one",
                self._take_grasp,
                app.shelves.names,
            )

    def _take_grasp(self, text: str) -> None:
        if text.startswith("+"):
            name, _, tags = text[1:].partition(",")
            self.app.shelves.save(name, tags)
        else:
            self.app.shelves.apply_best(text)

    def _typed(self, key: str, letter: str) -> bool:
        """A key for the prompt, where there is one."""
        prompt = self.prompt
        if prompt is None:
            return False

        def take() -> None:
            self.prompt = None  # what is done with the text may ask for more
            if prompt.take(key, letter):
                self.prompt = prompt

        self.app.attempt(take)
        self.app.drawer.stale = True
        return True

    def _dropped(self, names: list[str]) -> None:
        self.app.attempt(lambda: self.app.bring(names))

    def _export_path(self) -> Path:
        opened = getattr(self.app.session.host, "path", None)
        return (opened or Path.cwd() / "contacts").with_suffix(".glb")

    def _show_texts(self) -> None:
        app = self.app
        head = panel.report(app.meets, app.interaction.desk.document)["head"]
        undo = app.undo_name()
        top = [app.title, head if app.meets else panel.next_step(app.session, app.interaction)]
        top += [f"undo: {undo}"] if undo else []
        top += [legend_text()] if app.interaction.settings.heat else []
        line = " · ".join(part for part in (app.line(), app.refusal()) if part)
        if app.guide.lesson is not None:
            top = [wrapped(app.guide.text())]
        help_ = help_text(app) if app.help_wanted else ""
        app.canvas.write(" · ".join(top), line, self.prompt.shown() if self.prompt is not None else help_)


def _each(text: str) -> list[str]:
    """The files of a text, with ; between them. Raises InvalidInput for none."""
    named = [str(Path(each.strip()).expanduser()) if not each.strip().startswith("sample:") else each.strip()
             for each in text.split(";") if each.strip()]  # fmt: skip
    if not named:
        raise InvalidInput("name a file to open.")
    return named


def wrapped(text: str, width: int = 84) -> str:
    """Text in lines of at most so many letters."""
    return "\n".join("\n".join(textwrap.wrap(line, width)) for line in text.splitlines())


def help_text(app: Application) -> str:
    """The table of keys in columns."""
    table = sorted((each for each in app.table() if each.keys), key=lambda each: GROUPS.index(each.group))
    rows = [f"{', '.join(each.keys):<20.20} {each.label:<23.23}" for each in table]
    columns = [rows[k : k + _COLUMN] for k in range(0, len(rows), _COLUMN)]
    return "\n".join(
        "  ".join(column[k] if k < len(column) else " " * 44 for column in columns).rstrip()
        for k in range(len(columns[0]) if columns else 0)
    )


def run_window(sources: Sequence[str], plugins: PluginManager) -> None:
    """Open a window on files, until it is closed. Raises FileRefused, also where there is no screen."""
    if not has_screen():
        raise FileRefused("there is no screen here (DISPLAY is not set): leave --window out, and open the address.")
    from vtkmodules.vtkRenderingCore import vtkRenderWindowInteractor

    window = screen_window(_SIZE, "contact")
    interactor = vtkRenderWindowInteractor()
    interactor.SetRenderWindow(window)
    app = Application(Canvas(window, sized=False), sources, plugins)
    try:
        Front(app, interactor).run()
    finally:
        app.close()
