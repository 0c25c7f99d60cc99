"""What a pointer passes over: strokes sampled on the screen, cut where they jump over a silhouette.

Between two positions that a pointer reported it moved over the screen, not through the surface. So rays are cast
along the line on the screen, closer and closer together until neighbours meet the surface within a step; what stays
wider after many halvings is a silhouette, and there the stroke is cut. Every brush that draws on the screen goes
through here. Rays meet the surface where the artist sees it (`BrushGesture.seen`); the points are the rest mesh's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.contact.brush import BrushGesture, Screen
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints

_ROUNDS = 14  # halvings of the parameter step: 2^-14 of a sample tells a silhouette from a steep slope
_DENSEST = 4096  # samples between two positions before any halving
_SPARSEST = 8


@dataclass(frozen=True, eq=False)
class Met:
    """What k rays met. hit: (k,). points: of the surface (any point for a miss). at: (k, 6) positions on the rest
    mesh, and as seen; 0 for a miss."""

    hit: BoolArray
    points: SurfacePoints
    at: FloatArray

    def merged(self, other: Met, order: IntArray) -> Met:
        """Both together, in an order of their rows."""
        return Met(
            np.concatenate([self.hit, other.hit])[order],
            SurfacePoints.concatenate([self.points, other.points])[order],
            np.concatenate([self.at, other.at])[order],
        )


@dataclass(frozen=True, eq=False)
class Run:
    """An unbroken part of a stroke. t: (k,) rising parameters. points: what is met there. gaps: (k - 1,) how far
    neighbours lie apart in space on the rest mesh, surface units."""

    t: FloatArray
    points: SurfacePoints
    gaps: FloatArray


def met(gesture: BrushGesture, screen: FloatArray) -> Met:
    """What the rays through screen positions (k, 2) meet first; what a surface in `before` hides is a miss.

    Raises InvalidInput for a gesture without rays.
    """
    if gesture.rays is None:
        raise InvalidInput("a stroke on the screen needs the callable that makes rays of positions, but got none.")
    origins, directions = gesture.rays(screen)
    seen = gesture.seen or gesture.mesh
    hits = Locator.of(seen).cast(origins, directions)
    hit = hits.found
    for other in gesture.before:
        hides = other if isinstance(other, Screen) else Screen(other, np.eye(4))
        hit = hit & (hits.distance <= hides.distances(origins, directions))
    points = SurfacePoints(
        np.where(hit, hits.points.faces, 0), np.where(hit[:, None], hits.points.barycentric, [1.0, 0.0, 0.0])
    )
    at = np.concatenate([points.positions(gesture.mesh), points.positions(seen)], axis=1)
    return Met(hit, points, np.where(hit[:, None], at, 0.0))


def unbroken(meet: Callable[[FloatArray], Met], t: FloatArray, *, step: float, jump: float) -> list[Run]:
    """The parts of a curve over which a surface is met without a jump.

    meet: what is met at parameters (k,). t: (k,) rising parameters to begin with, halved until neighbours meet the
    surface within `step`, or one of them misses it, `_ROUNDS` times. Neighbours still farther apart than `jump`, on
    the rest mesh or as seen, lie on two sides of a silhouette.
    """
    here = meet(t)
    for _ in range(_ROUNDS):
        apart = np.maximum(*_gaps(here))
        coarse = (here.hit[1:] | here.hit[:-1]) & ~(here.hit[1:] & here.hit[:-1] & (apart <= step))
        if not coarse.any():
            break
        between = 0.5 * (t[1:] + t[:-1])[coarse]
        order = np.argsort(np.concatenate([t, between]), kind="stable")
        t, here = np.concatenate([t, between])[order], here.merged(meet(between), order)
    at_rest, as_seen = _gaps(here)
    joined = here.hit[1:] & here.hit[:-1] & (np.maximum(at_rest, as_seen) <= jump)
    runs = np.split(np.arange(len(t)), np.flatnonzero(~joined) + 1)
    return [Run(t[run], here.points[run], at_rest[run[:-1]]) for run in runs if here.hit[run[0]]]


def strokes(gesture: BrushGesture, step: float, *, jump: float | None = None, closed: bool = False) -> list[Run]:
    """The unbroken parts of a gesture's line over the screen; parameters count its positions.

    step: at most about how far points of a part lie apart, surface units. jump: what counts as a silhouette, by
    default `step`. Raises InvalidInput for a gesture that is not drawn on the screen.
    """
    if gesture.screen is None or gesture.rays is None:
        raise InvalidInput("a stroke on the screen needs screen positions and rays, but they did not come.")
    screen = frozen(gesture.screen, np.float64, (None, 2), "screen positions")
    if not len(screen):
        return []
    corners = np.concatenate([screen, screen[:1]]) if closed else screen
    number = np.arange(len(corners), dtype=float)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    count = np.clip(np.ceil(length), _SPARSEST, _DENSEST).astype(int)
    t = np.concatenate([[0.0], *(k + np.arange(1, n + 1) / n for k, n in enumerate(count))])

    def place(t: FloatArray) -> FloatArray:
        return np.stack([np.interp(t, number, corners[:, axis]) for axis in (0, 1)], axis=-1)

    return unbroken(lambda t: met(gesture, place(t)), t, step=step, jump=step if jump is None else jump)


def gestures_along(gesture: BrushGesture, step: float) -> tuple[BrushGesture, ...]:
    """A gesture drawn on the screen as one gesture for each unbroken part, for brushes that work from a path alone.

    The path of each is dense (`step`, surface units), and its screen positions are those of the pointer with the
    ends where it was cut. Pass them all to `Session.brush`: they are one step. Brushes that come with the product
    take the gesture as it is, and cut it themselves.
    """
    result = []
    for run in strokes(gesture, step):
        screen = np.asarray(gesture.screen, dtype=float)
        number = np.arange(len(screen), dtype=float)
        inside = number[(number > run.t[0]) & (number < run.t[-1])]
        stops = np.unique(np.concatenate([run.t[:1], inside, run.t[-1:]]))
        places = np.stack([np.interp(stops, number, screen[:, axis]) for axis in (0, 1)], axis=-1)
        result.append(replace(gesture, path=run.points, screen=places))
    return tuple(result)


def _gaps(here: Met) -> tuple[FloatArray, FloatArray]:
    """(k - 1,) how far neighbours lie apart, on the rest mesh and as seen."""
    apart = np.diff(here.at, axis=0)
    return np.linalg.norm(apart[:, :3], axis=1), np.linalg.norm(apart[:, 3:], axis=1)
