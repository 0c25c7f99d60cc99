"""A timeline as shapes: what a front end draws that has frames along its width, and no widgets of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.timeline import of_address
from contact_core.interaction.film import LEVELS, Bar, Curve, FilmView, KeyKind

HEIGHT = 0.36  # half the height of a bar, in lanes
RAMP, HELD, UNMEASURED = 0.45, 0.95, 0.75  # how opaque
LIMIT = (0.6, 0.6, 0.6, 0.7)
KEY_COLORS: dict[KeyKind, tuple[float, float, float, float]] = {
    "authored": (*LEVELS[1], 1.0),
    "solved": (*LEVELS[0], 1.0),
    "stale": (*LEVELS[2], 1.0),
    "clip": (0.62, 0.62, 0.62, 1.0),
    "value": (0.42, 0.65, 0.95, 1.0),
}


@dataclass(frozen=True, eq=False)
class FilmShapes:
    """Places are (frame, lane): lane 0 is the undermost, and a lane is 1 high. lanes: names, from below.

    triangles: (n, 3, 2), colors: (n, 4) of bars and their ramps. segments: (m, 2, 2), segment_colors: (m, 4) of
    curves and their limits. keys: (k, 2) the middles of key marks, key_colors: (k, 4), hollow: (k,) those that are
    drawn as an outline.
    """

    lanes: tuple[str, ...]
    triangles: FloatArray
    colors: FloatArray
    segments: FloatArray
    segment_colors: FloatArray
    keys: FloatArray
    key_colors: FloatArray
    hollow: tuple[bool, ...]


def shapes_of(view: FilmView) -> FilmShapes:
    """From below: tracks of keys, bars of pairs, curves. Ramps are slopes, what holds is tinted by contact error;
    curves are red where they go beyond their limit, which is a line."""
    tracks = tuple(dict.fromkeys(mark.track for mark in view.keys))[::-1]
    pairs = tuple(dict.fromkeys(bar.pair for bar in view.bars))[::-1]
    lane_of = {name: place for place, name in enumerate((*tracks, *(f"pair/{pair}" for pair in pairs)))}
    drawn = [curve for curve in view.curves if curve.worst is not None][::-1]
    lines = [line for place, curve in enumerate(drawn) for line in _lines(curve, len(lane_of) + place)]
    pieces = [piece for bar in view.bars for piece in _pieces(bar, lane_of[f"pair/{bar.pair}"] + 0.5)]
    return FilmShapes(
        lanes=(*(_words(track) for track in tracks), *pairs, *(_told(curve) for curve in drawn)),
        triangles=np.array([triangle for triangle, _ in pieces]).reshape(-1, 3, 2),
        colors=np.array([color for _, color in pieces]).reshape(-1, 4),
        segments=np.array([ends for ends, _ in lines]).reshape(-1, 2, 2),
        segment_colors=np.array([color for _, color in lines]).reshape(-1, 4),
        keys=np.array([(mark.frame, lane_of[mark.track] + 0.5) for mark in view.keys]).reshape(-1, 2),
        key_colors=np.array([KEY_COLORS[mark.kind] for mark in view.keys]).reshape(-1, 4),
        hollow=tuple(mark.kind == "stale" for mark in view.keys),
    )


Piece = tuple[Sequence[tuple[float, float]], tuple[float, ...]]


def _pieces(bar: Bar, middle: float) -> list[Piece]:
    """Triangles of a bar: up the ramp, along what holds, down the ramp."""
    low, high = middle - HEIGHT, middle + HEIGHT
    faint = (*bar.color, RAMP)
    found: list[Piece] = []
    if bar.ease_in > 0.0:
        found.append((((bar.on - bar.ease_in, low), (bar.on, low), (bar.on, high)), faint))
    held = [(first, last, (*LEVELS[level], HELD)) for first, last, level in bar.levels]
    for first, last, color in held or [(bar.on, bar.off, (*bar.color, UNMEASURED))]:
        corners = (first, low), (last, low), (last, high), (first, high)
        found += [(corners[:3], color), ((corners[0], corners[2], corners[3]), color)]
    if bar.ease_out > 0.0:
        found.append((((bar.off, low), (bar.off + bar.ease_out, low), (bar.off, high)), faint))
    return found


def _lines(curve: Curve, lane: int) -> list[Piece]:
    """Segments of a curve within its lane, gaps where nothing is, and of its limit."""
    top = max(float(np.nanmax(curve.values)), curve.limit) / (2.0 * HEIGHT)
    floor = lane + 0.5 - HEIGHT
    heights = floor + curve.values / top
    limit = floor + curve.limit / top
    found: list[Piece] = [(((curve.frames[0], limit), (curve.frames[-1], limit)), LIMIT)]
    for row in range(len(heights) - 1):
        if np.isfinite(heights[row : row + 2]).all():
            ends = (curve.frames[row], heights[row]), (curve.frames[row + 1], heights[row + 1])
            beyond = float(curve.values[row : row + 2].max()) > curve.limit
            found.append((ends, (*LEVELS[2 if beyond else 0], 1.0)))
    return found


def _told(curve: Curve) -> str:
    worst = float(np.nanmax(curve.values))
    return f"{curve.name}: {worst:.3g} {curve.unit} at {curve.worst:g}, limit {curve.limit:.3g}"


def _words(track: str) -> str:
    kind, name = of_address(track)
    return f"{kind} of {name}"
