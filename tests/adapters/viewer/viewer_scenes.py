"""What the tests of the application share: an application without a screen, and a pointer that VTK drives."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.interaction.events import Modifier
from contact_core.plugins.manager import PluginManager
from contact_viewer.application import Application
from contact_viewer.canvas import Canvas
from contact_viewer.gl import off_screen_window
from contact_viewer.window import Front

SIZE = (640, 400)
_SYMBOLS = {"Space": "space", "Enter": "Return", "[": "bracketleft", "]": "bracketright", ".": "period"}


def application(sources: list[str], state: Path, size: tuple[int, int] = SIZE) -> Application:
    """An application on files, drawn by EGL where there is no screen."""
    app = Application(Canvas(off_screen_window(size)), sources, PluginManager(), state_folder=state)
    app.canvas.eye.look_from("front")
    app.see_all()
    app.frame()
    return app


class Sight:
    """Somebody who sees where on the screen things are."""

    def __init__(self, app: Application) -> None:
        self.app = app

    def pixel(self, point: Any) -> Any:
        """(2,) where a world point is on the screen."""
        seen = self.app.canvas.eye.project(np.asarray(point, float)[None])[0]
        assert seen[2] > 0
        return seen[:2]

    def on_joint(self, surface: str, joint: str) -> Any:
        """(2,) a pixel of the skin that a joint carries and that faces the eye."""
        rig, seen = self.app.session.rigs[surface], self.app.interaction.desk.scene.surfaces[surface]
        carried = ((rig.skin_joints == rig.joint_index(joint)) * rig.skin_weights).sum(axis=1) > 0.9
        facing = seen.mesh.vertex_normals @ self.app.canvas.eye.direction < -0.7
        candidates = seen.points[carried & facing]
        middle = candidates.mean(axis=0)
        return self.pixel(candidates[np.linalg.norm(candidates - middle, axis=1).argmin()])

    def on_patch(self, name: str, share: float = 0.5) -> Any:
        """(2,) a pixel of a patch, a share of the way along its axis, aside from it by nothing."""
        shown = self.app.interaction.desk.shown
        seen = self.app.interaction.desk.scene.surfaces[self.app.session.document.patch(name).surface]
        points = seen.positions(shown.axis_points(name))
        return self.pixel(points[round(share * (len(points) - 1))])

    def on_thing(self, surface: str) -> Any:
        """(2,) the pixel of the middle of a thing."""
        points = self.app.interaction.desk.scene.surfaces[surface].points
        return self.pixel(0.5 * (points.min(axis=0) + points.max(axis=0)))


class Hand(Sight):
    """Somebody's hand on mouse and keys: every event goes through a VTK interactor, as in a window."""

    def __init__(self, app: Application) -> None:
        from vtkmodules.vtkRenderingUI import vtkGenericRenderWindowInteractor

        super().__init__(app)
        self._interactor = vtkGenericRenderWindowInteractor()
        self._interactor.SetRenderWindow(app.canvas.window)
        app.canvas.render()
        self.front = Front(app, self._interactor)

    def event(self, name: str, pixel: Any = (0, 0), *held: Modifier, symbol: str = "") -> None:
        """One event of VTK, and a turn of the loop after it."""
        x, y = (int(part) for part in pixel)
        height = self.app.canvas.eye.viewport[1]
        letter = symbol if len(symbol) == 1 else "\0"
        self._interactor.SetEventInformation(
            x, height - 1 - y, "ctrl" in held, "shift" in held, letter, 0, symbol or None
        )
        self._interactor.SetAltKey("alt" in held)
        self._interactor.InvokeEvent(name)
        self.front.events.raise_errors()
        self.front.tick()

    def drag(self, *pixels: Any, button: str = "Left", held: tuple[Modifier, ...] = ()) -> None:
        """Press at the first pixel, over all others, let go at the last."""
        self.event("MouseMoveEvent", pixels[0], *held)
        self.event(f"{button}ButtonPressEvent", pixels[0], *held)
        for pixel in pixels[1:]:
            self.event("MouseMoveEvent", pixel, *held)
        self.event(f"{button}ButtonReleaseEvent", pixels[-1], *held)

    def key(self, chord: str) -> None:
        """A key by its chord: "Ctrl+Z"."""
        *held, name = chord.split("+")
        symbol = _SYMBOLS.get(name, name.lower() if len(name) == 1 else name)
        self.event("KeyPressEvent", (0, 0), *(each.lower() for each in held), symbol=symbol)  # type: ignore[arg-type]

    def wait(self, seconds: float = 60.0) -> None:
        """Until the work beside the window is over."""
        until = time.monotonic() + seconds
        while self.app.interaction.worker.status is not None:
            assert time.monotonic() < until, "the work does not end"
            self.front.tick()
            time.sleep(0.01)
        self.front.tick()
