"""One view, or two beside each other: the hands at the left, everything else at the right, each with a camera."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from contact_core.interaction.events import Pointer
from contact_viewer.canvas import Canvas
from contact_viewer.eye import Eye
from contact_viewer.look import Theme

_LEFT, _RIGHT, _WHOLE, _NONE = (0.0, 0.5), (0.5, 1.0), (0.0, 1.0), (1.0, 1.0)


class Panes:
    """The canvases of a window. canvas: the only one, or that at the left. active: where the pointer was last."""

    def __init__(self, canvas: Canvas) -> None:
        self.canvas = self.active = canvas
        self._size = canvas.eye.viewport

    @property
    def all(self) -> tuple[Canvas, ...]:
        """Those that are seen, from the left."""
        return (self.canvas, self.canvas.beside) if self.canvas.beside and self.is_split else (self.canvas,)

    @property
    def is_split(self) -> bool:
        """Whether there are two."""
        return self.canvas.share == _LEFT

    def split(self, left: Collection[str], right: Collection[str]) -> None:
        """Two views, which show these surfaces alone; both look as the one did."""
        if self.canvas.beside is None:
            self.canvas.beside = Canvas(self.canvas.window, theme=self.canvas.theme, sized=False)
        here, there = self.canvas, self.canvas.beside
        there.set_theme(here.theme)
        there.eye.pixel_ratio, there.eye.up = here.eye.pixel_ratio, here.eye.up
        there.eye.look_along(here.eye)
        for pane, share in ((here, _LEFT), (there, _RIGHT)):
            pane.set_share(*share, self._size)
        self.show(left, right)

    def show(self, left: Collection[str], right: Collection[str]) -> None:
        """What the two views show."""
        for pane, shown in zip(self.all, (left, right), strict=True):
            pane.eye.surfaces = frozenset(shown)

    def join(self) -> None:
        """One view again."""
        self.canvas.eye.surfaces, self.active = None, self.canvas
        self.canvas.set_share(*_WHOLE, self._size)
        if self.canvas.beside is not None:
            self.canvas.beside.keep_surfaces(())
            self.canvas.beside.set_share(*_NONE, self._size)

    def resize(self, width: int, height: int, ratio: float | None = None) -> bool:
        """Another size of the window, pixels, and as many of them for one of the screen; whether it is another."""
        if (width, height) == self._size and ratio in (None, self.canvas.eye.pixel_ratio):
            return False
        self._size = (max(10, width), max(10, height))
        for pane in filter(None, (self.canvas, self.canvas.beside)):
            pane.eye.pixel_ratio = ratio or pane.eye.pixel_ratio
        self.canvas.resize(width, height)
        return True

    def set_theme(self, theme: Theme) -> None:
        """Other colours, of all."""
        for pane in filter(None, (self.canvas, self.canvas.beside)):
            pane.set_theme(theme)

    def of(self, surface: str) -> Canvas:
        """The one that shows a surface."""
        return next((pane for pane in self.all if pane.eye.shows(surface)), self.canvas)

    def local(self, event: Pointer, *, stays: bool) -> tuple[Pointer, Eye]:
        """An event with its pixel in the view that it is for: that under the pointer, or where the last was."""
        if not self.is_split:
            return event, self.canvas.eye
        if not stays:
            self.active = self.all[event.x >= 0.5 * self._size[0]]
        return replace(event, x=event.x - round(self.active.share[0] * self._size[0])), self.active.eye
