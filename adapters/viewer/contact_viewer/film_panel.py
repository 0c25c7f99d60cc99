"""The film as a page draws it: places in percent of the range, colours, and paths of curves."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.timeline import of_address
from contact_core.errors import InvalidInput
from contact_core.interaction.film import LEVELS as COLORS
from contact_core.interaction.film import Bar, Curve, FilmView
from contact_core.session import Session
from contact_viewer.look import hexed

LEVELS = tuple(hexed(color) for color in COLORS)  # good, fair, bad: as in the panel of residuals
HEADROOM = 1.15  # of a curve, over what is larger: its top or its limit


def film_state(view: FilmView) -> dict[str, Any]:
    """All of a timeline as plain values."""
    place = _Place(view)
    return {
        "first": view.first,
        "last": view.last,
        "frame": view.frame,
        "rate": round(view.rate, 3),
        "at": place.percent(view.frame),
        "measured": view.measured,
        "bars": [_bar(bar, place) for bar in view.bars],
        "lanes": _lanes(view, place),
        "curves": [_curve(curve, place) for curve in view.curves],
        "keys": [mark["frame"] for lane in _lanes(view, place) for mark in lane["keys"] if lane["kind"] == "pose"],
    }


def drag(session: Session, what: str, name: str, frame: float, part: Any, to: float) -> None:
    """Let go of what was dragged, a part of a span of a pair or a key of a track: one step. The verbs check
    what the page says. Raises ContactError."""
    if what == "span":
        session.timeline.move_span(name, frame, part, to)
    elif what == "key":
        address: tuple[Any, str] = of_address(name)
        session.timeline.move_key(*address, frame, to)
    else:
        raise InvalidInput(f"spans and keys can be dragged, but got {what!r}.")


class _Place:
    def __init__(self, view: FilmView) -> None:
        self.first, self.length = view.first, max(view.last - view.first, 1e-9)

    def percent(self, frame: float) -> float:
        """Of the width."""
        return round(100.0 * (frame - self.first) / self.length, 3)


def _bar(bar: Bar, place: _Place) -> dict[str, Any]:
    low, high = bar.on - bar.ease_in, bar.off + bar.ease_out
    width = max(high - low, 1e-9)
    return {
        "key": f"{bar.pair}/{bar.index}",
        "pair": bar.pair,
        "lane": bar.pair,
        "fixed": bar.index < 0,
        "left": place.percent(low),
        "width": round(place.percent(high) - place.percent(low), 3),
        "in": round(100.0 * bar.ease_in / width, 3),
        "out": round(100.0 * bar.ease_out / width, 3),
        "middle": 0.5 * (bar.on + bar.off),
        "color": hexed(bar.color),
        "tint": _tint(bar),
        "words": f"{bar.pair} holds from {bar.on:g} to {bar.off:g}",
    }


def _tint(bar: Bar) -> str:
    """A gradient over the span itself: what was measured by level, its own colour elsewhere."""
    if not bar.levels:
        return hexed(bar.color)
    length = max(bar.off - bar.on, 1e-9)
    stops = []
    for first, last, level in bar.levels:
        ends = (100.0 * (first - bar.on) / length, 100.0 * (last - bar.on) / length)
        stops.append(f"{LEVELS[level]} {ends[0]:.2f}% {ends[1]:.2f}%")
    return f"linear-gradient(to right, {', '.join(stops)})" if bar.off > bar.on else LEVELS[bar.levels[0][2]]


def _lanes(view: FilmView, place: _Place) -> list[dict[str, Any]]:
    """A row for each track that has keys."""
    lanes: dict[str, list[dict[str, Any]]] = {}
    for mark in view.keys:
        lanes.setdefault(mark.track, []).append(
            {
                "frame": mark.frame,
                "at": place.percent(mark.frame),
                "kind": mark.kind,
                "words": f"{_SAID[mark.kind]} at frame {mark.frame:g}",
            }
        )
    found = []
    for track, keys in lanes.items():
        kind, name = of_address(track)
        found.append({"track": track, "kind": kind, "words": f"{kind} of {name}", "keys": keys})
    return found


_SAID = {
    "authored": "key that you made",
    "solved": "solved key",
    "stale": "stale key: something near it has changed since it was solved",
    "clip": "key of a clip",
    "value": "key",
}


def _curve(curve: Curve, place: _Place) -> dict[str, Any]:
    """A path in a box of 100 by 100."""
    known = curve.values[np.isfinite(curve.values)]
    top = HEADROOM * max(float(known.max(initial=0.0)), curve.limit, 1e-12)
    worst = "" if curve.worst is None else f"{float(known.max()):.3g} {curve.unit} at {curve.worst:g}"
    return {
        "name": curve.name,
        "path": _path(curve.frames, curve.values / top, place),
        "limit": round(100.0 * (1.0 - curve.limit / top), 2),
        "worst": curve.worst,
        "above": bool(len(known) and float(known.max()) > curve.limit),
        "pair": curve.pair,
        "words": ", ".join(each for each in (worst, curve.pair) if each) or "nothing to measure",
        "limit_words": f"limit {curve.limit:.3g} {curve.unit}",
    }


def _path(frames: FloatArray, heights: FloatArray, place: _Place) -> str:
    """SVG: lines over what is there, gaps where nothing is."""
    parts, down = [], False
    for frame, height in zip(frames, heights, strict=True):
        if np.isnan(height):
            down = False
            continue
        parts.append(f"{'L' if down else 'M'}{place.percent(float(frame)):g} {100.0 * (1.0 - float(height)):.2f}")
        down = True
    return "".join(parts)
