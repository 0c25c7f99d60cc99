"""The host of the viewer: a scene in memory, and a camera that looks at it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.interaction.overlay import AxisLine, Decal, Overlay
from contact_core.scene.camera import camera_of
from contact_core.scene.host import SceneSpace
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import MemoryScene
from contact_core.scene.picture import Picture
from contact_viewer.canvas import Canvas
from contact_viewer.gl import off_screen_window

_SIZE = (1280, 720)
_NO_TRIANGLES = np.zeros((0, 3), np.int64)


class ViewerHost(MemoryHost):
    """A memory host with a canvas of VTK: what is shown is drawn, and picked through its camera.

    path: a file to open; with a scene: where that is saved. It draws off the screen until an application gives it
    the canvas that an artist sees.
    """

    name = "viewer"
    summary = "a scene of mesh and rig files, as the viewer opens them"
    _canvas: Canvas | None = None

    def __init__(
        self,
        path: Path | str | None = None,
        *,
        scene: MemoryScene | None = None,
        space: SceneSpace | None = None,
    ) -> None:
        super().__init__(path if scene is None else None, scene=scene, space=space)
        self.path = None if path is None else Path(path)

    @property
    def path(self) -> Path | None:
        """The file that `save` without a path writes."""
        return self._path

    @path.setter
    def path(self, path: Path | None) -> None:
        self._path = path

    @property
    def canvas(self) -> Canvas:
        """What it draws on; one of its own is made at the first call."""
        if self._canvas is None:
            self._canvas = Canvas(off_screen_window(_SIZE), up=self.space().up_axis)
        return self._canvas

    @canvas.setter
    def canvas(self, canvas: Canvas) -> None:
        self._canvas = canvas

    @property
    def viewport(self) -> tuple[int, int]:  # type: ignore[override]  # that of the window, which an artist resizes
        """Width and height, pixels."""
        return self.canvas.eye.viewport

    def show(self, picture: Picture | None) -> None:
        """Draw a picture, seen from where it says. Only what is drawn changes, never the scene."""
        super().show(picture)
        shown = () if picture is None else picture.meshes
        for place, item in enumerate(shown):
            surface = self.canvas.surface(f"picture {place}")
            surface.set_shape(item.mesh.points, item.mesh.faces)
            surface.set_look(item.color, opacity=item.opacity)
        self.canvas.keep_surfaces(f"picture {place}" for place in range(len(shown)))
        self.canvas.show(Overlay() if picture is None else _overlay(picture))
        if picture is not None:
            width, height = self.viewport
            camera = camera_of(picture, width / height)
            self.canvas.eye.look_from_point(camera.eye, camera.centre)

    def rays(self, pixels: Any) -> tuple[FloatArray, FloatArray]:
        return self.canvas.eye.rays(pixels)


def _overlay(picture: Picture) -> Overlay:
    """Points and lines of a picture."""
    dots = [
        Decal(f"points {place}", "", np.asarray(points), _NO_TRIANGLES, color)
        for place, (points, color) in enumerate(picture.points)
    ]
    lines = [AxisLine(ends, color) for segments, color in picture.lines for ends in segments]
    return Overlay(tuple(dots), tuple(lines))
