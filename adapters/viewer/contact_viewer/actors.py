"""What is drawn with: surfaces, fills, lines, dots and words, each made once and overwritten in place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.document.document import Color
from contact_core.interaction.overlay import (
    Decal,
    Ghost,
    Handle,
    Label,
)
from contact_viewer.buffers import Normals, Polygons
from contact_viewer.eye import Eye
from contact_viewer.look import Theme, darker


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points (n, 3), world. width: pixels of a plain screen."""

    points: FloatArray
    color: Color
    width: float = 2.0
    opacity: float = 1.0

    def faded(self, by: float) -> Line:
        """The same, more of it shining through."""
        return replace(self, opacity=self.opacity * by)


class SurfaceActor:
    """One surface: points and normals by `set_shape`, how it looks by `set_look`."""

    def __init__(self, renderer: Any) -> None:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        self._renderer, self._polygons = renderer, Polygons()
        self._mapper = vtkPolyDataMapper()
        self._mapper.SetInputData(self._polygons.data)
        self._mapper.ScalarVisibilityOff()
        self._actor = vtkActor()
        self._actor.SetMapper(self._mapper)
        look = self._actor.GetProperty()
        look.SetInterpolationToPhong()
        look.SetAmbient(0.20)
        look.SetDiffuse(0.86)
        look.SetSpecular(0.10)
        look.SetSpecularPower(22)
        self._faces: Any = None
        self._points: Any = None
        self._normals: Normals
        self.color: Color = (0.7, 0.7, 0.7)
        self._place: FloatArray = np.eye(4)
        self._visible, self._veiled = True, False
        renderer.AddActor(self._actor)

    @property
    def prop(self) -> Any:
        """What a renderer draws of it."""
        return self._actor

    @property
    def state(self) -> object:
        """Something that is equal for as long as it looks the same from one place."""
        look, mapper = self._actor.GetProperty(), self._mapper
        table = mapper.GetLookupTable() if mapper.GetScalarVisibility() else None
        smooth = mapper.GetInterpolateScalarsBeforeMapping()
        return (
            self._polygons.data.GetMTime(),
            look.GetMTime(),
            table,
            smooth,
            self._place.tobytes(),
            self._visible,
        )

    @property
    def is_solid(self) -> bool:
        """Whether it is seen, and nothing through it."""
        return self._visible and self._actor.GetProperty().GetOpacity() >= 1.0

    def veil(self, veiled: bool) -> None:
        """Whether something else shows it for now."""
        self._veiled = veiled
        self._actor.SetVisibility(self._visible and not veiled)

    def set_shape(self, points: FloatArray, faces: IntArray) -> None:
        """Points (n, 3) and faces (m, 3), surface space; the very same arrays as before cost nothing."""
        if faces is not self._faces:
            self._faces, self._normals = faces, Normals(faces, len(points))
            self._polygons.set_faces(faces)
        if points is not self._points:
            self._points = points
            self._polygons.set_points(points)
            self._polygons.set_normals(self._normals.at(points))

    def set_place(self, world_from_surface: FloatArray) -> None:
        """Where it stands (4, 4)."""
        if not np.array_equal(world_from_surface, self._place):
            self._place = np.array(world_from_surface, float)
            self._actor.SetUserMatrix(_matrix(self._place))

    def set_look(self, color: Color, *, opacity: float = 1.0, visible: bool = True) -> None:
        """Its colour, and how much of what is behind shows through."""
        self.color = color
        look = self._actor.GetProperty()
        look.SetColor(*color)
        look.SetOpacity(opacity)
        look.SetBackfaceCulling(opacity < 1.0)  # one layer of a ghost: nothing has to be sorted
        self._visible = visible
        self.veil(self._veiled)

    def set_values(self, values: FloatArray | None, table: Any = None) -> None:
        """Colour each point by a number (n,) and a vtkLookupTable; None: its one colour again."""
        self._mapper.SetScalarVisibility(values is not None)
        if values is None:
            return
        self._polygons.set_values(values)
        self._mapper.SetLookupTable(table)
        self._mapper.UseLookupTableScalarRangeOn()
        self._mapper.InterpolateScalarsBeforeMappingOn()  # a sharp rim also across large faces

    def set_colors(self, colors: FloatArray) -> None:
        """Colour each point by itself (n, 3), until `set_values`."""
        self._polygons.set_colors(np.concatenate([colors, np.ones((len(colors), 1))], axis=1), of="points")
        self._mapper.InterpolateScalarsBeforeMappingOff()
        self._mapper.SetScalarVisibility(True)

    def remove(self) -> None:
        """Draw it no more."""
        self._renderer.RemoveActor(self._actor)


class FillActor:
    """One contact: filled triangles that win over the surface beneath, and their rim."""

    def __init__(self, renderer: Any) -> None:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        self._renderer = renderer
        self._shown: Decal | Ghost | None = None
        self._ratio = 0.0
        self._ends: IntArray = np.zeros((0, 2), np.int64)
        self._normals: Normals
        self._face, self._rim = Polygons(), Polygons()
        self._actors = []
        for polygons in (self._face, self._rim):
            mapper = vtkPolyDataMapper()
            mapper.SetInputData(polygons.data)
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.ScalarVisibilityOff()
            actor = vtkActor()
            actor.SetMapper(mapper)
            renderer.AddActor(actor)
            self._actors.append(actor)
        face, rim = (actor.GetProperty() for actor in self._actors)
        face.SetAmbient(0.42)
        face.SetDiffuse(0.66)
        face.SetSpecular(0.04)
        face.SetInterpolationToGouraud()
        rim.LightingOff()

    def show(self, fill: Decal | Ghost, ratio: float) -> None:
        """Draw another shape or look."""
        if fill is self._shown and ratio == self._ratio:
            return
        before, self._shown, self._ratio = self._shown, fill, ratio
        if before is None or before.triangles is not fill.triangles:
            self._normals = Normals(fill.triangles, len(fill.points))
            self._face.set_faces(fill.triangles)
            self._ends = _rim(fill.triangles)
            self._rim.set_lines(np.full(len(self._ends), 2))
        self._face.set_points(fill.points)
        self._face.set_normals(self._normals.at(fill.points))
        self._rim.set_points(fill.points[self._ends.ravel()])
        self._order(in_front=isinstance(fill, Decal) or fill.surface is None)
        chosen = isinstance(fill, Decal) and fill.selected
        face, rim = (actor.GetProperty() for actor in self._actors)
        face.SetColor(*fill.color)
        face.SetOpacity(fill.opacity)
        rim.SetColor(*((1.0, 1.0, 1.0) if chosen else darker(fill.color)))
        rim.SetLineWidth((2.6 if chosen else 1.6) * ratio)

    def _order(self, *, in_front: bool) -> None:
        """Win over a surface in the same place, or be hidden by it."""
        sign = -1.0 if in_front else 1.0
        for actor, units in zip(self._actors, (60.0, 110.0), strict=True):
            mapper = actor.GetMapper()
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(sign * 2.5, sign * units)
            mapper.SetRelativeCoincidentTopologyLineOffsetParameters(sign * 2.5, sign * units)

    def remove(self) -> None:
        """Draw it no more."""
        for actor in self._actors:
            self._renderer.RemoveActor(actor)


class LineActors:
    """All lines of one width are one actor. in_front: on a surface they win over it."""

    def __init__(self, renderer: Any, *, in_front: bool = False) -> None:
        self._renderer, self._in_front = renderer, in_front
        self._of_width: dict[float, tuple[Polygons, Any]] = {}

    def show(self, lines: Sequence[Line], ratio: float) -> None:
        """Draw these and no others."""
        groups: dict[float, list[Line]] = {}
        for line in lines:
            groups.setdefault(line.width, []).append(line)
        for width in set(self._of_width) - set(groups):
            self._renderer.RemoveActor(self._of_width.pop(width)[1])
        for width in sorted(groups, reverse=True):
            group = groups[width]
            if width not in self._of_width:
                self._of_width[width] = _unlit(self._renderer, -200.0 if self._in_front else 0.0)
            polygons, actor = self._of_width[width]
            polygons.set_points(np.concatenate([line.points for line in group]))
            polygons.set_lines(np.array([len(line.points) for line in group]))
            polygons.set_colors(np.array([(*line.color, line.opacity) for line in group]), of="cells")
            actor.GetProperty().SetLineWidth(width * ratio)


class DotActors:
    """All dots of one radius are one actor."""

    def __init__(self, renderer: Any) -> None:
        self._renderer = renderer
        self._of_radius: dict[float, tuple[Polygons, Any]] = {}

    def show(self, handles: Sequence[Handle], loose: Sequence[Decal | Ghost], ratio: float) -> None:
        """Draw these handles, each on a darker disk so that it shows on its own colour, and patches whose points
        span no triangle."""
        groups: dict[float, list[tuple[FloatArray, Color]]] = {}
        for handle in handles:
            groups.setdefault(handle.radius - 0.5, []).append((handle.position, darker(handle.color, 0.25)))
            groups.setdefault(handle.radius - 2.0, []).append((handle.position, handle.color))
        for each in loose:
            groups.setdefault(3.0, []).extend((point, each.color) for point in each.points)
        for radius in set(self._of_radius) - set(groups):
            self._renderer.RemoveActor(self._of_radius.pop(radius)[1])
        for radius in sorted(groups, reverse=True):
            if radius not in self._of_radius:
                self._of_radius[radius] = _unlit(self._renderer, 30.0 * radius - 600.0)  # the smaller in front
            polygons, actor = self._of_radius[radius]
            polygons.set_points(np.array([point for point, _ in groups[radius]], float).reshape(-1, 3))
            polygons.set_dots(len(groups[radius]))
            polygons.set_colors(np.array([(*color, 1.0) for _, color in groups[radius]]), of="points")
            actor.GetProperty().SetPointSize(2 * radius * ratio)


class WordActors:
    """Texts, of which as many actors are kept as were ever shown at once."""

    def __init__(self, renderer: Any) -> None:
        self._renderer = renderer
        self._actors: list[Any] = []
        self._words: Sequence[Label] = ()
        self.shade: Color = (0.0, 0.0, 0.0)
        self.ink: Color = (1.0, 1.0, 1.0)

    def show(self, words: Sequence[Label], ratio: float) -> None:
        """Draw these and no others."""
        from vtkmodules.vtkRenderingCore import vtkTextActor

        self._words = words
        while len(self._actors) < len(words):
            self._actors.append(vtkTextActor())
            self._renderer.AddViewProp(self._actors[-1])
        for place, actor in enumerate(self._actors):
            actor.SetVisibility(place < len(words))
            if place < len(words):
                actor.SetInput(words[place].text)
                look = actor.GetTextProperty()
                look.SetFontFamilyToArial()
                look.SetFontSize(round(13 * ratio))
                look.SetColor(*self.ink)  # contacts have dark colours, too
                look.SetBackgroundColor(*self.shade)
                look.SetBackgroundOpacity(0.62)
                look.SetVerticalJustificationToCentered()

    def place(self, eye: Eye, detail: float) -> None:
        """Put them where their points are now. detail: pixels that are drawn for one of the view."""
        if not self._words:
            return
        height = eye.viewport[1]
        for actor, (x, y, depth) in zip(
            self._actors, eye.project([word.position for word in self._words]), strict=False
        ):
            actor.SetVisibility(bool(depth > 0))
            actor.SetPosition(detail * (float(x) + 9 * eye.pixel_ratio), detail * (height - float(y)))


class CornerTexts:
    """Text at the top left, the bottom left and over the middle."""

    def __init__(self, renderer: Any) -> None:
        from vtkmodules.vtkRenderingCore import vtkTextActor

        self._actors = [vtkTextActor() for _ in range(3)]
        for actor in self._actors:
            actor.SetVisibility(False)
            renderer.AddViewProp(actor)
        self._actors[2].GetTextProperty().SetFontFamilyToCourier()

    def set_theme(self, theme: Theme) -> None:
        """Colours of letters and of what is behind them."""
        for actor, opacity in zip(self._actors, (0.5, 0.7, 0.92), strict=True):
            look = actor.GetTextProperty()
            look.SetColor(*theme.ink)
            look.SetBackgroundColor(*theme.bottom)
            look.SetBackgroundOpacity(opacity)

    def write(self, top: str, bottom: str, middle: str, size: tuple[int, int], ratio: float) -> None:
        """Put texts up in a window of so many pixels; an empty one takes its own away."""
        width, height = size
        margin = 12 * ratio
        letters = max(map(len, middle.splitlines()), default=0)
        left = max(margin, width / 2 - 0.3 * letters * 13 * ratio)  # a letter of Courier is 0.6 wide
        places = ((margin, height - margin), (margin, margin), (left, height / 2))
        for actor, text, (x, y), letter in zip(
            self._actors, (top, bottom, middle), places, (14, 14, 13), strict=True
        ):
            actor.SetVisibility(bool(text))
            actor.SetInput(text)
            actor.SetPosition(x, y)
            look = actor.GetTextProperty()
            look.SetFontSize(round(letter * ratio))
            look.SetVerticalJustification(2 if actor is self._actors[0] else 1 if actor is self._actors[2] else 0)


def _unlit(renderer: Any, units: float = 0.0) -> tuple[Polygons, Any]:
    """An actor that shows colours as they are, with what it draws. units: how much it wins over a surface."""
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    polygons, mapper, actor = Polygons(), vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(polygons.data)
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-2.5, units)
    mapper.SetRelativeCoincidentTopologyPointOffsetParameter(units)
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.LightingOff()
    if hasattr(look, "SetPoint2DShapeToRound"):  # VTK 9.4; before that dots are squares
        look.SetPoint2DShapeToRound()
    renderer.AddActor(actor)
    return polygons, actor


def _matrix(values: FloatArray) -> Any:
    from vtkmodules.vtkCommonMath import vtkMatrix4x4

    matrix = vtkMatrix4x4()
    matrix.DeepCopy(np.asarray(values, float).ravel().tolist())
    return matrix


def _rim(triangles: IntArray) -> IntArray:
    """(e, 2) the edges that one triangle alone has."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(edges[first[count == 1]])
