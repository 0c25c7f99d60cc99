"""The verb of brushes: gestures in, one undo step out, which holds the points and knows nothing of the brush."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.arrays import BoolArray
from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.brush import Brush, BrushGesture, BrushMark
from contact_core.document.document import Color
from contact_core.edit.verbs.painting import PaintingVerbs
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.settings import configured


class BrushVerbs(PaintingVerbs):
    """Paint and erase with brushes."""

    def brush(
        self,
        brush: str | Brush,
        patch: str,
        *gestures: BrushGesture,
        surface: str | None = None,
        at: Any = None,
        radius: float = 0.0,
        spacing: float = 0.0,
        axis: SurfacePoints | None = None,
        generator: str | AxisGenerator | None = None,
        color: Color | None = None,
        **settings: Any,
    ) -> None:
        """Paint a patch with a brush, or erase from it where the brush erases; all gestures are one step.

        brush: a name, or the brush itself. surface, axis, generator, color: of a new patch, as for `paint`. Erased
        is what lies nearer to a point of a mark, over the surface, than the mark's points lie apart. at: in place
        of gestures, where the brush passes: surface points, or positions (k, 3) in surface space that are moved to
        the closest points of the surface. radius, spacing: of that gesture, in surface units; 0 leaves it to
        the brush. settings: the brush's own, such as falloff="smooth".
        """
        if isinstance(brush, str):
            tool = self._editor.makers.brush(brush, **settings)
        else:
            tool = configured(brush, settings, f"the brush {brush.name!r}")
        where = self._document.patches[patch].surface if patch in self._document.patches else surface
        if where is None:
            raise InvalidInput(f"the new patch {patch!r} needs the name of a surface.")
        if at is not None:
            gestures += (self._gesture(where, at, radius, spacing),)
        if not gestures:
            raise InvalidInput(f"the brush {tool.name!r} needs a gesture or several, but got none.")
        mesh = self._geometry.mesh(where)
        if any(gesture.mesh.digest != mesh.digest for gesture in gestures):
            raise InvalidInput(f"a gesture for {patch!r} was made over another mesh than that of {where!r}.")
        picked = gestures
        self._mended([where], lambda verbs: verbs._stroke(tool, patch, where, picked, axis, generator, color))

    def _stroke(
        self,
        tool: Brush,
        patch: str,
        where: str,
        gestures: tuple[BrushGesture, ...],
        axis: SurfacePoints | None,
        generator: str | AxisGenerator | None,
        color: Color | None,
    ) -> None:
        gestures = tuple(self._carried_gesture(where, gesture) for gesture in gestures)
        marks = [tool.mark(gesture) for gesture in gestures]
        if tool.erases:
            here = self._geometry.reconstruction(patch).points
            under = [_covered(here, mark, gesture) for mark, gesture in zip(marks, gestures, strict=True)]
            indices = np.flatnonzero(np.any(under, axis=0))
            if not len(indices):
                raise CommandRejected(f"no point of {patch!r} lies under the brush {tool.name!r}.")
            self.erase(patch, indices)
            return
        points = SurfacePoints.concatenate([mark.points for mark in marks])
        strength = np.concatenate([mark.strength for mark in marks])  # (n,)
        self._geometry.check_points(where, points, on_carrier=True)
        picks = None if axis is None else self._geometry.on_carrier(where, axis)
        self._paint_on_carrier(patch, where, points, picks, generator=generator, strength=strength, color=color)

    def _carried_gesture(self, surface: str, gesture: BrushGesture) -> BrushGesture:
        """A gesture over a surface as one over the mesh that its contacts run on."""
        found = self._editor.derived.map(self._document, surface)
        if found is None:
            return gesture
        seen = None if gesture.seen is None else self._geometry.posed_carrier(surface, gesture.seen)
        path = found.to_proxy(gesture.path) if len(gesture.path) else gesture.path
        return replace(gesture, mesh=found.proxy, path=path, seen=seen)

    def _gesture(self, surface: str, at: Any, radius: float, spacing: float) -> BrushGesture:
        mesh = self._geometry.mesh(surface)
        if not isinstance(at, SurfacePoints):
            at = Locator.of(mesh).closest(np.asarray(at, float).reshape(-1, 3)).points
        self._geometry.check_points(surface, at)
        return BrushGesture(mesh, at, radius=radius, spacing=spacing)


def _covered(points: SurfacePoints, mark: BrushMark, gesture: BrushGesture) -> BoolArray:
    """(n,) which points lie under a mark: its points stand for the area between them, so its widest gap, but no
    more than the brush's radius, is how far each of them reaches."""
    from scipy.spatial import cKDTree

    if not len(mark.points):
        return np.zeros(len(points), bool)
    reach = gesture.radius or gesture.spacing
    if len(mark.points) > 1:
        at = mark.points.positions(gesture.mesh)
        gap = float(cKDTree(at).query(at, k=2)[0][:, 1].max())
        reach = min(gap, gesture.radius or gap)
    return np.asarray(log_map(gesture.mesh, mark.points, points, max_distance=reach).distance <= reach)
