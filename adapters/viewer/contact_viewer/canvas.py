"""What is drawn: surfaces with their skins, filled contacts on them, and above all that lines, dots and words.

Everything is overwritten in place, and one `render` shows it. The cost in software OpenGL lies in pixels, lights
and samples (measured: an empty frame 9 ms, a hand 2.5, 69k faces 17; eight samples three times all of it), so there
are two lights, and edges are smoothed only in the frame that stands still. While things move, surfaces that do not
are an image (`standing`).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import Color
from contact_core.interaction.overlay import (
    AxisLine,
    BrushRing,
    Decal,
    Ghost,
    Overlay,
    PairLine,
    SkinHeat,
    StrokeTint,
)
from contact_viewer.actors import (
    CornerTexts,
    DotActors,
    FillActor,
    Line,
    LineActors,
    SurfaceActor,
    WordActors,
)
from contact_viewer.eye import Eye
from contact_viewer.gl import is_software
from contact_viewer.look import DARK, Theme
from contact_viewer.standing import Standing

GHOST = 0.32  # opacity of a surface that one looks through
_LIGHTS = (((-0.45, 0.7, 0.9), 0.82), ((0.6, -0.2, 0.8), 0.40))
_FRAME = 0.026  # seconds that a frame may take while things move
_DETAILS = (1.0, 0.85, 0.7, 0.55)  # of width and height, that are drawn then
_SAMPLES = 8  # for a pixel of a frame that stands still
_HIDDEN = 0.35  # opacity of a line where something lies before it
_SEAM: Color = (0.05, 0.05, 0.06)  # round lines, so that they show on what is light as well
_ARROW = 9.0  # pixels, the head of an arrow
_RING = np.stack([np.cos(np.linspace(0, 2 * np.pi, 49)), np.sin(np.linspace(0, 2 * np.pi, 49))], axis=1)


class Canvas:
    """Draws in a vtkRenderWindow. `eye` is its camera.

    sized: whether `resize` says how large the window is; one on the screen is as large as its user makes it.
    `beside`: another canvas of the same window, which is drawn with this one. `share`: the part of the window's
    width that it draws in.
    """

    beside: Canvas | None = None
    share = (0.0, 1.0)

    def __init__(self, window: Any, *, up: str = "Y", theme: Theme = DARK, sized: bool = True) -> None:
        from vtkmodules.vtkRenderingCore import vtkRenderer

        self.window = window
        self._base, self._above = vtkRenderer(), vtkRenderer()
        window.SetNumberOfLayers(max(2, window.GetNumberOfLayers()))
        window.AddRenderer(self._base)
        self._above.SetLayer(1)
        self._above.InteractiveOff()
        window.AddRenderer(self._above)
        self._above.SetActiveCamera(self._base.GetActiveCamera())
        self._base.SetAutomaticLightCreation(False)
        self._base.SetGradientBackground(True)
        _light(self._base)
        for layer in (self._base, self._above):
            if hasattr(layer, "SetUseOIT"):  # four passes over all pixels, for an order that there is anyway
                layer.SetUseOIT(False)
        self._base.GetCullers().RemoveAllItems()
        self._standing = Standing(window, self._base)
        self.eye = Eye(self._base, up=up)
        self.eye.viewport = self._size = tuple(window.GetSize())
        self._surfaces: dict[str, SurfaceActor] = {}
        self._fills: dict[str, FillActor] = {}
        self._lines = LineActors(self._base, in_front=True)  # where nothing lies before them
        self._hidden = LineActors(self._above)  # and through everything, faintly
        self._dots = DotActors(self._above)
        self._words = WordActors(self._above)
        self._texts: CornerTexts | None = None
        self._software: bool | None = None
        self._overlay = Overlay()
        self._sized = sized
        self._detail = 1.0 if not sized else 0.0
        self._seconds: float | None = None  # of a frame with all of its pixels
        self._stroke_table: tuple[Any, Any] | None = None
        self.theme = theme
        self.set_theme(theme)

    def set_theme(self, theme: Theme) -> None:
        """Other colours behind the scene and of words."""
        self.theme = theme
        self._base.SetBackground(*theme.bottom)
        self._base.SetBackground2(*theme.top)
        self._words.shade, self._words.ink = theme.bottom, theme.ink
        if self._texts is not None:
            self._texts.set_theme(theme)

    def write(self, top: str, bottom: str, middle: str = "") -> None:
        """Lines of text at the top and the bottom, and a table over the middle; for windows without panels."""
        if self._texts is None:
            self._texts = CornerTexts(self._whole_window())
            self._texts.set_theme(self.theme)
        self._texts.write(top, bottom, middle, self._size, self.eye.pixel_ratio)

    def _whole_window(self) -> Any:
        """A renderer over all others, whatever their shares are."""
        from vtkmodules.vtkRenderingCore import vtkRenderer

        renderer = vtkRenderer()
        renderer.SetLayer(2)
        renderer.InteractiveOff()
        self.window.SetNumberOfLayers(3)
        self.window.AddRenderer(renderer)
        return renderer

    # -- what is shown -------------------------------------------------------------------------------------------

    def surface(self, name: str) -> SurfaceActor:
        """The surface of that name, made at the first call."""
        if name not in self._surfaces:
            self._surfaces[name] = SurfaceActor(self._base)
        return self._surfaces[name]

    def keep_surfaces(self, names: Iterable[str]) -> None:
        """Take every surface away but these."""
        for name in set(self._surfaces) - set(names):
            self._surfaces.pop(name).remove()

    def show(self, overlay: Overlay) -> None:
        """Draw an overlay in place of the one before; arrays that are the very same cost nothing."""
        self._overlay, ratio = overlay, self.eye.pixel_ratio * (self._detail or 1.0)
        fills: dict[str, Decal | Ghost] = {decal.patch: decal for decal in overlay.decals if len(decal.triangles)}
        fills |= {f"ghost {k}": ghost for k, ghost in enumerate(overlay.ghosts) if len(ghost.triangles)}
        for name in set(self._fills) - set(fills):
            self._fills.pop(name).remove()
        for name, fill in fills.items():
            if name not in self._fills:
                self._fills[name] = FillActor(self._base)
            self._fills[name].show(fill, ratio)
        self._tint(overlay.tint, {heat.surface: heat for heat in overlay.heats})
        lines = [line for axis in overlay.axes for line in self._axis(axis)]
        seams = [Line(line.points, _SEAM, line.width + 2.0, 0.7) for line in lines]
        pairs = [line for pair in overlay.pair_lines for line in _pair(pair)]
        rings = [_ring(ring) for ring in overlay.rings]
        self._lines.show([*seams, *lines, *rings], ratio)
        self._hidden.show([*(line.faded(_HIDDEN) for line in lines), *pairs, *rings], ratio)
        loose: list[Decal | Ghost] = [decal for decal in overlay.decals if not len(decal.triangles)]
        loose += [ghost for ghost in overlay.ghosts if not len(ghost.triangles)]
        self._dots.show(overlay.handles, loose, ratio)
        self._words.show(overlay.labels, ratio)

    def _axis(self, axis: AxisLine) -> list[Line]:
        """An axis as lines: itself, and the head of its arrow."""
        if len(axis.points) < 2:
            return []
        parts = [axis.points]
        if axis.arrow:
            parts.append(self._arrow(axis.points))
        return [Line(part, axis.color, axis.width) for part in parts]

    def _arrow(self, points: FloatArray) -> FloatArray:
        """(3, 3) the two sides of the head at the end of a line, in the plane that faces the eye."""
        tip = points[-1]
        back = points[:-1] - tip
        size = _ARROW * self.eye.pixel_ratio * self.eye.pixel_size(tip)
        far = np.flatnonzero(np.linalg.norm(back, axis=1) >= size)
        along = back[far[-1]] if len(far) else back[0]
        length = np.linalg.norm(along)
        along = along / length if length else np.zeros(3)
        across = np.cross(along, self.eye.direction)
        return np.stack([tip + size * (along + 0.6 * across), tip, tip + size * (along - 0.6 * across)])

    def _tint(self, tint: StrokeTint | None, heats: Mapping[str, SkinHeat]) -> None:
        """Colour what a stroke has covered, else each skin by its distances, where they are shown."""
        for name, surface in self._surfaces.items():
            if tint is not None and tint.surface == name:
                surface.set_values(np.minimum(tint.distances, 4 * tint.radius), self._table(tint, surface.color))
            elif name in heats:
                surface.set_colors(heats[name].colors)
            else:
                surface.set_values(None)

    def _table(self, tint: StrokeTint, beyond: Color) -> Any:
        """The colour of a stroke up to its radius, and of the surface beyond."""
        from vtkmodules.vtkCommonCore import vtkLookupTable

        key = (tint.color, tint.radius, beyond, tint.erases)
        if self._stroke_table is None or self._stroke_table[0] != key:
            table = vtkLookupTable()
            table.SetNumberOfTableValues(256)
            table.SetTableRange(0.0, 2.0 * tint.radius)
            inside = self.theme.quiet if tint.erases else tint.color
            for k in range(256):
                table.SetTableValue(k, *(inside if k < 128 else beyond), 1.0)
            self._stroke_table = (key, table)
        return self._stroke_table[1]

    # -- drawing -------------------------------------------------------------------------------------------------

    def render(self, *, still: bool = False, quick: bool = False) -> None:
        """Draw one frame. still: with smooth edges, at leisure. quick: things move, so that where the processor
        draws, and slowly, fewer pixels have to do."""
        self._sharpen(smooth=still or self._software is False)
        self._set_detail(self._quick_detail() if quick else 1.0)
        for pane in filter(None, (self, self.beside)):
            pane._words.place(pane.eye, self._detail or 1.0)
            if quick and self._software and pane.share[0] < pane.share[1]:
                pane._standing.use(pane._surfaces)
            else:
                pane._standing.leave(pane._surfaces)
        start = time.perf_counter()
        self.window.Render()
        if self._software is None:  # a window knows once it has drawn
            self._software = is_software(self.window)
        elif quick and self._software:
            whole = (time.perf_counter() - start) / self._detail**2
            self._seconds = whole if self._seconds is None else 0.7 * self._seconds + 0.3 * whole

    def image(self, *, still: bool = False) -> Any:
        """(h, w, 3) uint8 of a new frame, from its top row downwards."""
        return self.rgba(still=still)[..., :3]

    def rgba(self, *, still: bool = False, quick: bool = False) -> Any:
        """(h, w, 4) uint8 of a new frame, as `render` draws it; its last channel says nothing."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        self.render(still=still, quick=quick)
        width, height = self.window.GetSize()
        pixels = vtkUnsignedCharArray()
        self.window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels)
        return np.ascontiguousarray(vtk_to_numpy(pixels).reshape(height, width, 4)[::-1])

    def resize(self, width: int, height: int) -> None:
        """Another size of the view, pixels."""
        self._size = (max(10, width), max(10, height))
        self._detail = 0.0  # unlike any: the next frame sets the size of the window
        self._seconds = None
        for pane in filter(None, (self, self.beside)):
            pane.set_share(*pane.share, self._size)

    def set_share(self, left: float, right: float, size: tuple[int, int]) -> None:
        """Draw in a part of a window of so many pixels: shares of its width; nothing where the two are one."""
        self.share = (left, right)
        ends = [round(part * size[0]) for part in self.share]
        self.eye.viewport = (max(10, ends[1] - ends[0]), size[1])
        for renderer in (self._base, self._above):
            renderer.SetViewport(ends[0] / size[0], 0.0, ends[1] / size[0], 1.0)
            renderer.SetDraw(left < right)

    def _sharpen(self, *, smooth: bool) -> None:
        """Smooth edges: by samples where a graphics card draws, by a filter (FXAA) where the processor does."""
        for pane in filter(None, (self, self.beside)):
            pane._base.SetUseFXAA(smooth and self._software is not False)
        samples = _SAMPLES if smooth and self._software is False else 0
        if self.window.GetMultiSamples() != samples:
            self.window.SetMultiSamples(samples)

    def _quick_detail(self) -> float:
        """How much of width and height is drawn, so that a frame takes about as long as one may."""
        if self._seconds is None or not self._software:
            return 1.0
        if self._standing.is_used and self._seconds * self._detail**2 < 2.0 * _FRAME:
            return self._detail  # another size would cost a new image of what stands
        wanted = (_FRAME / max(self._seconds, 1e-6)) ** 0.5
        return next((step for step in _DETAILS if step <= wanted), _DETAILS[-1])

    def _set_detail(self, detail: float) -> None:
        """Draw so much of width and height; sizes in pixels follow."""
        if detail == self._detail or not self._sized:
            return
        self._detail = detail
        width, height = self._size
        self.window.SetSize(max(8, round(width * detail)), max(8, round(height * detail)))
        for pane in filter(None, (self, self.beside)):
            pane._detail = detail
            pane.show(pane._overlay)

    def close(self) -> None:
        """Let go of what the graphics driver holds."""
        self.window.Finalize()


def _light(renderer: Any) -> None:
    """A key light from the upper left, a weaker one from the right, and a little from the eye: all go with it."""
    from vtkmodules.vtkRenderingCore import vtkLight

    for direction, strength in _LIGHTS:
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*direction)
        light.SetFocalPoint(0, 0, 0)
        light.SetIntensity(strength)
        renderer.AddLight(light)


def _pair(pair: PairLine) -> list[Line]:
    """Which patch meets which: a line between the two, and of a selected pair thin ones between points that are to
    touch."""
    if not pair.selected:
        return [Line(pair.middle, pair.color, 1.5, 0.6)]
    threads = [Line(np.stack(ends), pair.color, 1.0, 0.55) for ends in zip(pair.starts, pair.ends, strict=True)]
    return [Line(pair.middle, pair.color, 2.5, 0.95), *threads]


def _ring(ring: BrushRing) -> Line:
    """The brush as a circle round what it points at."""
    helper = np.eye(3)[int(np.abs(ring.normal).argmin())]
    first = np.cross(ring.normal, helper)
    first = first / max(float(np.linalg.norm(first)), 1e-12)
    around = ring.radius * (_RING @ np.stack([first, np.cross(ring.normal, first)]))  # (49, 3)
    return Line(ring.centre + around, ring.color, 2.0)
