"""The paper's curve brush: a spline drawn in screen space, cut into equal steps over the surface, cast by rays."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from contact_builtins.brushes.sampling import radius_of, spacing_of, thinned
from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.contact.brush import BrushGesture, BrushMark, ScreenToRays
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.geometry.raycast import Locator

_ROUNDS = 14  # halvings of the parameter step: 2^-14 of a segment tells a silhouette from a steep slope


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
        controls, project = _drawing(gesture)
        starts = sorted({0, *self.starts, len(controls)})
        strokes = (controls[first:last] for first, last in itertools.pairwise(starts))
        drawn = SurfacePoints.concatenate(_stepped(gesture, stroke, project, step) for stroke in strokes)
        if not len(drawn):
            raise InvalidInput("the curve meets the surface nowhere; draw over it.")
        points = drawn[thinned(gesture.mesh, drawn, 0.5 * step)]  # strokes may cross
        return BrushMark(points, np.ones(len(points)))


def _drawing(gesture: BrushGesture) -> tuple[FloatArray, ScreenToRays | None]:
    """Control points on the screen (c, 2) with their rays, or in space (c, 3) without."""
    if gesture.screen is not None and gesture.rays is not None:
        return frozen(gesture.screen, np.float64, (None, 2), "control points"), gesture.rays
    if not len(gesture.path):
        raise InvalidInput("a curve needs control points on the screen or on the surface, but none came.")
    return gesture.path.positions(gesture.mesh), None


def _stepped(
    gesture: BrushGesture, controls: FloatArray, project: ScreenToRays | None, step: float
) -> SurfacePoints:
    """One stroke's points at equal steps over the surface."""
    curve = _spline(controls)
    t = np.linspace(0.0, 1.0, 8 * len(controls) + 1)
    for _ in range(_ROUNDS):
        hit, at, _ = _projected(gesture, curve(t), project)
        gap = np.linalg.norm(np.diff(at, axis=0), axis=1)
        coarse = (hit[1:] | hit[:-1]) & ~(hit[1:] & hit[:-1] & (gap <= 0.25 * step))
        if not coarse.any():
            break
        t = np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])[coarse]]))
    hit, at, _ = _projected(gesture, curve(t), project)
    gap = np.linalg.norm(np.diff(at, axis=0), axis=1)
    joined = hit[1:] & hit[:-1] & (gap <= step)  # wider than a step after so many halvings: a silhouette
    chosen: list[FloatArray] = []
    for run in _runs(hit, joined):
        length = np.concatenate([[0.0], np.cumsum(gap[run[:-1]])])
        chosen.append(np.interp(np.arange(0.0, length[-1] + 1e-9 * step, step), length, t[run]))
    if not chosen:
        return gesture.path[[]]
    return _projected(gesture, curve(np.concatenate(chosen)), project)[2]


def _spline(controls: FloatArray) -> BSpline:
    """Through the control points (c, d), the parameter running from 0 to 1 with the length of the chords."""
    chords = np.linalg.norm(np.diff(controls, axis=0), axis=1)
    controls = controls[np.concatenate([[True], chords > 0.0])]
    if len(controls) == 1:
        return make_interp_spline([0.0, 1.0], np.repeat(controls, 2, axis=0), k=1)
    t = np.concatenate([[0.0], np.cumsum(chords[chords > 0.0])])
    return make_interp_spline(t / t[-1], controls, k=min(3, len(controls) - 1))


def _projected(
    gesture: BrushGesture, places: FloatArray, project: ScreenToRays | None
) -> tuple[BoolArray, FloatArray, SurfacePoints]:
    """Which of k places meet the surface (k,), where (k, 3; 0 for a miss), and the surface points of those that
    do."""
    locator = Locator.of(gesture.mesh)
    if project is None:
        points = locator.closest(places).points
        return np.ones(len(places), bool), points.positions(gesture.mesh), points
    hits = locator.cast(*project(places))
    at = np.zeros((len(places), 3))
    at[hits.hit] = hits.points().positions(gesture.mesh)
    return hits.hit, at, hits.points()


def _runs(hit: BoolArray, joined: BoolArray) -> list[IntArray]:
    """Indices of unbroken runs of hits; joined: (k - 1,) whether a sample continues in the next."""
    breaks = np.flatnonzero(~joined) + 1
    return [run for run in np.split(np.arange(len(hit)), breaks) if hit[run[0]]]
