"""A timeline as shapes: what a front end draws that has frames along its width, and no widgets of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.timeline import of_address
from contact_core.interaction.film import LEVELS, Bar, FilmView, KeyKind

HEIGHT = 0.36  # half the height of a bar, in lanes
RAMP, HELD, UNMEASURED = 0.45, 0.95, 0.75  # how opaque
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

    triangles: (n, 3, 2), colors: (n, 4) of bars and their ramps. keys: (k, 2) the middles of key marks, key_colors:
    (k, 4), hollow: (k,) those that are drawn as an outline.
    """

    lanes: tuple[str, ...]
    triangles: FloatArray
    colors: FloatArray
    keys: FloatArray
    key_colors: FloatArray
    hollow: tuple[bool, ...]


def shapes_of(view: FilmView) -> FilmShapes:
    """Bars of pairs above, tracks of keys below; ramps as slopes, what holds tinted by contact error."""
    tracks = tuple(dict.fromkeys(mark.track for mark in view.keys))[::-1]
    pairs = tuple(dict.fromkeys(bar.pair for bar in view.bars))[::-1]
    lane_of = {name: place for place, name in enumerate((*tracks, *(f"pair/{pair}" for pair in pairs)))}
    pieces = [piece for bar in view.bars for piece in _pieces(bar, lane_of[f"pair/{bar.pair}"] + 0.5)]
    return FilmShapes(
        lanes=(*(_words(track) for track in tracks), *pairs),
        triangles=np.array([triangle for triangle, _ in pieces]).reshape(-1, 3, 2),
        colors=np.array([color for _, color in pieces]).reshape(-1, 4),
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


def _words(track: str) -> str:
    kind, name = of_address(track)
    return f"{kind} of {name}"
