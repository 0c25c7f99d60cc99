"""The paper's curve brush: a spline drawn in screen space, cut into equal steps over the surface, cast by rays."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from contact_builtins.brushes.sampling import radius_of, spacing_of, thinned
from contact_core.arrays import FloatArray, frozen
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.contact.pointer import Met, met, unbroken
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.geometry.raycast import Locator

Meet = Callable[[FloatArray], Met]  # places on the screen (k, 2) or in space (k, 3) -> what is met there


@dataclass(frozen=True)
class CurveBrush:
    """A cubic B-spline through the control points. The step between points is in surface units; where the curve
    leaves the surface, or jumps over a silhouette, it is cut. starts: indices of control points at which further
    strokes begin.

    Without screen positions the spline goes through the path in space and drops onto the surface."""

    name: ClassVar[str] = "curve"
    summary: ClassVar[str] = "equal steps along a spline drawn in screen space (the paper's)"
    erases: ClassVar[bool] = False
    starts: tuple[int, ...] = ()

    def mark(self, gesture: BrushGesture) -> BrushMark:
        step = spacing_of(gesture, radius_of(gesture))
        controls, meet = _drawing(gesture)
        starts = sorted({0, *self.starts, len(controls)})
        strokes = (controls[first:last] for first, last in itertools.pairwise(starts))
        drawn = SurfacePoints.concatenate(_stepped(stroke, meet, step) for stroke in strokes)
        if not len(drawn):
            raise InvalidInput("the curve meets the surface nowhere; draw over it.")
        points = drawn[thinned(gesture.mesh, drawn, 0.5 * step)]  # strokes may cross
        return BrushMark(points, np.ones(len(points)))


def _drawing(gesture: BrushGesture) -> tuple[FloatArray, Meet]:
    """Control points on the screen (c, 2) and what their rays meet; or in space (c, 3) and what they drop onto."""
    if gesture.screen is not None and gesture.rays is not None:
        controls = frozen(gesture.screen, np.float64, (None, 2), "control points")
        return controls, lambda places: met(gesture, places)
    if not len(gesture.path):
        raise InvalidInput("a curve needs control points on the screen or on the surface, but got none.")
    return gesture.path.positions(gesture.mesh), lambda places: _dropped(gesture, places)


def _stepped(controls: FloatArray, meet: Meet, step: float) -> SurfacePoints:
    """One stroke's points at equal steps over the surface."""
    curve = _spline(controls)
    t = np.linspace(0.0, 1.0, 8 * len(controls) + 1)
    chosen: list[FloatArray] = []
    for run in unbroken(lambda t: meet(curve(t)), t, step=0.25 * step, jump=step):
        length = np.concatenate([[0.0], np.cumsum(run.gaps)])
        chosen.append(np.interp(np.arange(0.0, length[-1] + 1e-9 * step, step), length, run.t))
    if not chosen:
        return SurfacePoints.concatenate([])
    found = meet(curve(np.concatenate(chosen)))
    return found.points[found.hit]


def _spline(controls: FloatArray) -> BSpline:
    """Through the control points (c, d), the parameter running from 0 to 1 with the length of the chords."""
    chords = np.linalg.norm(np.diff(controls, axis=0), axis=1)
    controls = controls[np.concatenate([[True], chords > 0.0])]
    if len(controls) == 1:
        return make_interp_spline([0.0, 1.0], np.repeat(controls, 2, axis=0), k=1)
    t = np.concatenate([[0.0], np.cumsum(chords[chords > 0.0])])
    return make_interp_spline(t / t[-1], controls, k=min(3, len(controls) - 1))


def _dropped(gesture: BrushGesture, places: FloatArray) -> Met:
    """The closest points of the surface to places (k, 3)."""
    points = Locator.of(gesture.mesh).closest(places).points
    at = points.positions(gesture.mesh)
    return Met(np.ones(len(places), bool), points, np.concatenate([at, at], axis=1))
