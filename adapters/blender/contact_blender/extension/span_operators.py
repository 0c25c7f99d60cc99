"""Operators on spans, when a pair holds: `bpy.ops.contact.span_add` and its like, at the frame that is shown."""

from __future__ import annotations

from typing import Any

from bpy.props import EnumProperty, FloatProperty, StringProperty

from contact_blender.extension import film, frames
from contact_blender.extension.declaring import operator

PAIR = StringProperty(name="Pair", description="A pair; empty: the active one of the panel")
ENDS = (
    ("on", "Start", "It holds from the frame that is shown"),
    ("off", "End", "It holds up to the frame that is shown"),
)
HOLDS = (
    ("both", "Both", "The place, and the way it faces"),
    ("point", "Point", "The place alone: it may turn"),
    ("direction", "Direction", "The way it faces, at any distance"),
)
CURVES = tuple(
    (name, name.capitalize(), said)
    for name, said in (
        ("contact error", "How far apart a pair is while it holds"),
        ("skate", "How fast a pair slips while it holds"),
        ("acceleration", "Of any joint"),
        ("penetration", "How deep skin is"),
    )
)
EASE = -1.0  # the default ramp of the core


def _frames(name: str, said: str, default: float, low: float = 0.0) -> Any:
    return FloatProperty(name=name, description=said, default=default, min=low)


@operator(
    "span_add",
    "Hold from Here",
    "pair",
    pair=PAIR,
    frames=_frames("Frames", "How long it holds", 12.0),
    ease_in=_frames("Ease in", "Frames over which it fades in before; -1: 0.4 seconds", EASE, EASE),
    ease_out=_frames("Ease out", "Frames over which it fades out after; -1: 0.4 seconds", EASE, EASE),
    hold=EnumProperty(items=HOLDS, name="Hold", description="What holds", default="both"),
)
def span_add(session: Any, context: Any, given: Any) -> str:
    """Let a pair hold from the frame that is shown; in place of spans that overlap."""
    pair, at = _pair_of(session, context, given.pair), session.timeline.frame
    eases = [None if value < 0.0 else value for value in (given.ease_in, given.ease_out)]
    with session.macro(f"Hold {pair}"):
        frames.give_range(session)
        session.timeline.hold(pair, at, at + given.frames, ease_in=eases[0], ease_out=eases[1], hold=given.hold)
    film.redraw()
    return f"{pair} holds from frame {at:g} to {at + given.frames:g}."


@operator(
    "span_move",
    "Move Span",
    "pair",
    pair=PAIR,
    frames=FloatProperty(name="Frames", description="How far; negative: earlier", default=1.0),
)
def span_move(session: Any, context: Any, given: Any) -> str:
    """Move the span at the frame that is shown, or the nearest one, by some frames."""
    pair = _pair_of(session, context, given.pair)
    inside = _middle(session, pair)
    session.timeline.move_span(pair, inside, "all", inside + given.frames)
    film.redraw()
    return f"The span of {pair} was moved by {given.frames:g} frames."


@operator(
    "span_trim",
    "Trim Span to Here",
    "pair",
    pair=PAIR,
    end=EnumProperty(items=ENDS, name="End", description="Which of its ends", default="off"),
)
def span_trim(session: Any, context: Any, given: Any) -> str:
    """Let the span at the frame that is shown, or the nearest one, start or end there: shorter or longer."""
    pair, at = _pair_of(session, context, given.pair), session.timeline.frame
    session.timeline.move_span(pair, _middle(session, pair), given.end, at)
    film.redraw()
    return f"{pair} holds {'from' if given.end == 'on' else 'up to'} frame {at:g}."


@operator(
    "span_ease",
    "Ease Span",
    "pair",
    pair=PAIR,
    ease_in=_frames("Ease in", "Frames over which it fades in before", 10.0),
    ease_out=_frames("Ease out", "Frames over which it fades out after", 10.0),
)
def span_ease(session: Any, context: Any, given: Any) -> str:
    """Say over how many frames the span at the frame that is shown, or the nearest one, fades in and out."""
    pair = _pair_of(session, context, given.pair)
    span, inside = _nearest(session, pair), _middle(session, pair)
    with session.macro(f"Ease {pair}"):
        session.timeline.move_span(pair, inside, "ease_in", span.on - given.ease_in)
        session.timeline.move_span(pair, inside, "ease_out", span.off + given.ease_out)
    film.redraw()
    return f"{pair} fades in over {given.ease_in:g} frames and out over {given.ease_out:g}."


@operator("span_remove", "Remove Span", "pair", pair=PAIR)
def span_remove(session: Any, context: Any, given: Any) -> str:
    """Remove the span at the frame that is shown; a pair without spans holds throughout."""
    pair = _pair_of(session, context, given.pair)
    session.timeline.release(pair)
    film.redraw()
    return f"The span of {pair} was removed."


@operator("film_measure", "Measure Contacts over Time", "pair")
def film_measure(session: Any, context: Any, given: Any) -> str:
    """Measure the contacts at every frame: the bars of the timeline are green, yellow or red by it."""
    with session.macro("Measure the film"):
        frames.give_range(session)
    return film.measure(session)


@operator(
    "film_worst",
    "Go to the Worst Frame",
    "pair",
    curve=EnumProperty(items=CURVES, name="Curve", description="What is worst there", default="contact error"),
)
def film_worst(session: Any, context: Any, given: Any) -> str:
    """Go to the frame at which what was measured is worst."""
    return film.show_worst(session, given.curve)


def _pair_of(session: Any, context: Any, name: str) -> str:
    """The pair of this name; without one the active pair of the panel. Raises InvalidInput."""
    from contact_core.errors import InvalidInput

    chosen = name or str(context.window_manager.contact.pair)
    if chosen in session.document.pairs:
        return chosen
    raise InvalidInput(f"there is no pair {chosen!r}; there are: {', '.join(session.document.pairs) or 'none'}.")


def _nearest(session: Any, pair: str) -> Any:
    """The span at the frame that is shown, else the one whose ends are nearest. Raises InvalidInput."""
    from contact_core.errors import InvalidInput

    at, spans = session.timeline.frame, session.timeline.spans(pair)
    if not spans:
        raise InvalidInput(f"{pair!r} has no span yet, it holds throughout: add one at a frame first.")
    return min(spans, key=lambda span: max(span.on - at, at - span.off, 0.0))


def _middle(session: Any, pair: str) -> float:
    span = _nearest(session, pair)
    return float(0.5 * (span.on + span.off))
