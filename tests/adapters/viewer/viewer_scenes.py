"""What the tests of the application share: a small scene, an application without a screen, a driven pointer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contact_core.interaction.events import Key, Modifier, Pointer
from contact_core.plugins.manager import PluginManager
from contact_viewer.application import Application
from contact_viewer.canvas import Canvas
from contact_viewer.gl import off_screen_window

SIZE = (640, 400)


def application(sources: list[str], state: Path, size: tuple[int, int] = SIZE) -> Application:
    """An application on files, drawn by EGL where there is no screen."""
    app = Application(Canvas(off_screen_window(size)), sources, PluginManager(), state_folder=state)
    app.frame()
    return app


def pixel_of(app: Application, point: Any) -> tuple[float, float]:
    """Where a world point (3,) is on the screen."""
    x, y, depth = app.canvas.eye.project(np.asarray(point)[None])[0]
    assert depth > 0
    return float(x), float(y)


def drag(app: Application, path: Any, button: Any = "left", modifiers: frozenset[Modifier] = frozenset()) -> None:
    """Press at the first pixel of a path (k, 2), move along it, release at its end; a frame after each move."""
    (x, y), *rest = path
    app.handle(Pointer("move", x, y, modifiers=modifiers))
    app.handle(Pointer("press", x, y, button, modifiers))
    for at in rest:
        app.handle(Pointer("move", *at, modifiers=modifiers))
        app.frame()
    app.handle(Pointer("release", *path[-1], button, modifiers))
    app.frame()


def type_key(app: Application, name: str, *modifiers: Modifier) -> None:
    """A key goes down."""
    app.handle(Key(name, frozenset(modifiers)))
    app.frame()
