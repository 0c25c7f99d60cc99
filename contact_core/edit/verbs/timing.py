"""Verbs about time: the frame that is shown, keys, spans; and what makes a key of an edit where a track exists."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from typing import Any, Literal

import numpy as np

from contact_core.document.document import ContactDocument, named
from contact_core.document.staleness import motion_source
from contact_core.document.timeline import (
    CAPTURED,
    Key,
    PlaceKey,
    PoseKey,
    Span,
    Timeline,
    Track,
    TrackKind,
    address,
)
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import (
    ClearTrack,
    SetKeys,
    SetSpans,
    SetTimeline,
)
from contact_core.edit.verbs.keying import Keying, TimedEditor, completed, held, value_of
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.motion.placement_keys import Interpolation, PlacementKey, PlacementKeys
from contact_core.rig.pose_keys import PoseCurves, PoseKeys
from contact_core.solve.body import Hold

SpanPart = Literal["on", "off", "ease_in", "ease_out", "all"]
EASE = 0.4  # seconds over which a contact fades in and out by default


class Film:
    """The film of a session: `session.timeline.key("pose", "hand")`, `.hold("grip", 20, 60)`, `.go(35)`.

    Tracks are named by what they are of: "placement" and a patch, "pose" or "place" and a surface, "weight" and a
    pair. Going to a frame is no edit; an edit at a frame is a key wherever a track exists.
    """

    def __init__(self, editor: TimedEditor) -> None:
        self._editor = editor
        self._frame: float | None = None
        self._shown: tuple[ContactDocument, float, ContactDocument] | None = None

    # --- reading ------------------------------------------------------------------------------------------------

    @property
    def document(self) -> ContactDocument:
        """The document with its tracks and spans."""
        return self._editor.timed_document

    @property
    def settings(self) -> Timeline:
        """The range and the rate."""
        return self.document.timeline

    @property
    def frame(self) -> float:
        """The frame that is shown: the first until `go`."""
        return self.settings.first if self._frame is None else self._frame

    def at(self, frame: float) -> ContactDocument:
        """The document at a frame, without time."""
        return self.document.at(frame)

    def shown(self, document: ContactDocument) -> ContactDocument:
        """A document at the frame that is shown; the same object for as long as both stay."""
        if not document.is_timed:
            return document
        frame = document.timeline.first if self._frame is None else self._frame
        if self._shown is None or self._shown[0] is not document or self._shown[1] != frame:
            self._shown = document, frame, document.at(frame)
        return self._shown[2]

    def track(self, kind: TrackKind, name: str) -> Track | None:
        """The keys of a thing, None where its value holds throughout."""
        return self.document.tracks.get(address(kind, name))

    def spans(self, pair: str) -> tuple[Span, ...]:
        """When a pair holds; none: always."""
        return self.document.spans.get(pair, ())

    def stale(self, surface: str) -> tuple[float, ...]:
        """Frames of solved keys near which something has changed since: they are to be solved again."""
        track = self.track("pose", surface)
        if track is None:
            return ()
        document, keys = self.document, track.of(PoseKey)
        return tuple(
            key.frame
            for key in keys
            if key.source not in ("", CAPTURED) and key.source != motion_source(document, key.frame)
        )

    # --- the film -----------------------------------------------------------------------------------------------

    def go(self, frame: float) -> None:
        """Show another frame. No edit: nothing is committed, and nothing is lost."""
        if not np.isfinite(frame):
            raise InvalidInput(f"a frame is a finite number, but got {frame}.")
        before = self.shown(self.document)
        self._frame = float(frame)
        self._editor.frame_changed(before)

    def window(self, frame: float | None = None, seconds: float = 2.0) -> tuple[float, ...]:
        """The frames round one, by default that which is shown, within the range: what a key that was dragged there
        changes, as `solve(frames=...)` takes them."""
        at = self.frame if frame is None else float(frame)
        reach = 0.5 * seconds * self.settings.frames_per_second
        return tuple(each for each in self.settings.frames() if at - reach <= each <= at + reach)

    def set(
        self,
        first: float | None = None,
        last: float | None = None,
        rate: float | Fraction | tuple[int, int] | None = None,
    ) -> None:
        """The range and the frames per second; what is None stays. 23.976 and its like are fractions of 1001."""
        now = self.settings
        start = now.first if first is None else float(first)
        end = max(now.last, start) if last is None else float(last)
        self._editor.do(SetTimeline(Timeline(now.rate if rate is None else _fraction(rate), start, end)))

    # --- keys ---------------------------------------------------------------------------------------------------

    def key(
        self,
        kind: TrackKind,
        name: str,
        value: Any = None,
        *,
        frame: float | None = None,
        interpolation: Interpolation | None = None,
    ) -> None:
        """Set a key of a placement (Root), a pose (Pose), a place (4, 4) or a weight, at a frame.

        value: by default what the document has there. frame: by default the one that is shown. interpolation: up to
        the next key; by default that of the key that is there or before, else smooth.
        """
        at = self.frame if frame is None else float(frame)
        value = value_of(self.document.at(at), kind, name, self._editor.rigs) if value is None else value
        self._editor.do(
            SetKeys(
                address(kind, name), Keying(self._editor, at).keys(self.document, kind, name, value, interpolation)
            )
        )

    def take(self, surface: str, clip: PoseKeys) -> None:
        """The keys of a clip as keys of a surface, in place of what is keyed between its first and its last: as
        poses of a rig, and where an object stands.

        Poses are no pins: solving with the weight `follow` keeps to them and mends their contacts. Joints that the
        rig does not have are refused, those that the clip does not name rest; so is what an object does but move.
        """
        if not clip.frames:
            raise InvalidInput("the clip has no keys.")
        kind: TrackKind = "pose" if surface in self._editor.rigs else "place"
        keys = self._poses_of(surface, clip) if kind == "pose" else self._places_of(surface, clip)
        track = self.track(kind, surface)
        there = track.frames if track is not None else ()
        gone = tuple(frame for frame in there if keys[0].frame <= frame <= keys[-1].frame)
        self._editor.do(SetKeys(address(kind, surface), keys, gone, "Take a clip as"))

    def _poses_of(self, surface: str, clip: PoseKeys) -> tuple[Key, ...]:
        rig, keys = self._editor.rigs[surface], []
        for row, (frame, pose) in enumerate(zip(clip.frames, clip.poses, strict=True)):
            whole = completed(pose, surface, frame, None, rig)
            speeds = None
            if clip.is_cubic:
                speeds = np.zeros((len(whole.joints), 6))
                speeds[[whole.joints.index(joint) for joint in pose.joints]] = clip.speeds[row]
            keys.append(PoseKey(frame, whole, speeds, "smooth" if clip.is_cubic else "linear", CAPTURED))
        return tuple(keys)

    def _places_of(self, surface: str, clip: PoseKeys) -> tuple[Key, ...]:
        """Straight keys; a cubic clip gives one at every whole frame, for keys of places hold no speeds."""
        self.document.surface(surface)
        if any(len(pose.joints) != 1 for pose in clip.poses):
            raise InvalidInput(
                f"{surface!r} has no rig: its clip is one joint, but got {clip.poses[0].joints[:3]}."
            )
        frames, local = list(clip.frames), np.array([pose.local for pose in clip.poses])
        if clip.is_cubic:
            curves = PoseCurves.joined(clip.frames, local, np.array(clip.speeds))
            whole = range(math.ceil(frames[0]), math.floor(frames[-1]) + 1)
            frames = sorted({*frames, *map(float, whole)})
            local = curves.sampled(frames)
        return tuple(PlaceKey(at, place, "linear") for at, place in zip(frames, local[:, 0], strict=True))

    def remove_key(self, kind: TrackKind, name: str, frame: float | None = None) -> None:
        """Take out the key at a frame, the one shown by default. Without its last key a track ends."""
        at = self.frame if frame is None else float(frame)
        track = self._known(kind, name)
        if track.key_at(at) is None:
            near = ", ".join(f"{each:g}" for each in sorted(track.frames, key=lambda each: abs(each - at))[:5])
            raise CommandRejected(f"there is no key at frame {at:g} of the {kind} of {name!r}; near it: {near}.")
        self._editor.do(
            SetKeys(address(kind, name), Keying(self._editor, at).without(track, name), (at,), "Remove a key of")
        )

    def move_key(self, kind: TrackKind, name: str, frame: float, to: float) -> None:
        """Take a key from a frame to another one, in place of what is there."""
        key = self._known(kind, name).key_at(frame)
        if key is None:
            raise CommandRejected(f"there is no key at frame {frame:g} of the {kind} of {name!r}.")
        gone = (float(frame),)
        if not isinstance(key, PlacementKey):
            moved: tuple[Key, ...] = (replace(key, frame=float(to)),)
        else:
            known = self._known(kind, name).of(PlacementKey)
            others = [(k.frame, k.root, k.interpolation) for k in known if k is not key and k.frame != to]
            mesh = self._editor.derived.carrier(self.document, self.document.patch(name).surface)
            moved = PlacementKeys.of(mesh, [*others, (float(to), key.root, key.interpolation)]).keys
        self._editor.do(SetKeys(address(kind, name), moved, gone, "Move a key of"))

    def clear(self, kind: TrackKind, name: str) -> None:
        """Remove all keys of a thing; the value that is shown now holds throughout."""
        self._known(kind, name)
        shown = self.shown(self.document)
        clear = ClearTrack(address(kind, name))
        self._editor.do(Macro(clear.label(), (clear, held(shown, kind, name))))

    # --- spans --------------------------------------------------------------------------------------------------

    def hold(
        self,
        pair: str,
        on: float,
        off: float,
        *,
        ease_in: float | None = None,
        ease_out: float | None = None,
        hold: Hold = "both",
    ) -> None:
        """A pair holds from one frame to another, in place of its spans that overlap this one.

        ease_in, ease_out: frames over which it fades in before, and out after; by default 0.4 seconds. hold: what
        holds: the "point", which may turn, the "direction", at any distance, or "both".
        """
        ramp = EASE * self.settings.frames_per_second
        new = Span(
            float(on),
            float(off),
            ramp if ease_in is None else ease_in,
            ramp if ease_out is None else ease_out,
            hold,
        )
        others = [span for span in self.spans(pair) if span.off < new.on or new.off < span.on]
        self.set_spans(pair, (*others, new))

    def move_span(self, pair: str, frame: float, part: SpanPart, to: float) -> None:
        """Drag a part of the span that a frame is in (its ramps count) to another frame, as one step.

        part: "on" and "off" are its ends, "ease_in" and "ease_out" where its ramps begin and end, "all" the whole
        of it, by as much as the frame is moved. An end stops at the other one. Raises CommandRejected where no span
        is, and where it would reach into another.
        """
        old = next((s for s in self.spans(pair) if s.on - s.ease_in <= frame <= s.off + s.ease_out), None)
        if old is None:
            raise CommandRejected(f"no span of {pair!r} goes over frame {frame:g}.")
        others = [span for span in self.spans(pair) if span is not old]
        low = max((span.off for span in others if span.off < old.on), default=-np.inf)
        high = min((span.on for span in others if span.on > old.off), default=np.inf)
        new = moved_span(old, part, float(to), float(to) - float(frame))
        if not (low < new.on and new.off < high):
            raise CommandRejected(f"there the span of {pair!r} would reach into another one.")
        self.set_spans(pair, (*others, new))

    def release(self, pair: str, frame: float | None = None) -> None:
        """Take out the span that a frame is in, the frame shown by default. Without spans a pair holds always."""
        at = self.frame if frame is None else float(frame)
        left = tuple(span for span in self.spans(pair) if not span.on <= at <= span.off)
        if len(left) == len(self.spans(pair)):
            raise CommandRejected(f"no span of {pair!r} goes over frame {at:g}.")
        self.set_spans(pair, left)

    def set_spans(self, pair: str, spans: Iterable[Span]) -> None:
        """All spans of a pair; none: it holds always."""
        self._editor.do(SetSpans(pair, tuple(sorted(spans, key=lambda span: span.on))))

    def keyed(self, command: Command) -> Command:
        """The command that does at the frame shown what a command does without time: keys where tracks exist."""
        document = self.document
        return command if not document.tracks else Keying(self._editor, self.frame).command(command, document)

    # --- inside -------------------------------------------------------------------------------------------------

    def _known(self, kind: TrackKind, name: str) -> Track:
        return named(self.document.tracks, address(kind, name), "track")


def moved_span(span: Span, part: SpanPart, to: float, by: float) -> Span:
    """A span with a part of it at a frame; the whole of it moves by so many frames."""
    if part == "on":
        return replace(span, on=min(to, span.off))
    if part == "off":
        return replace(span, off=max(to, span.on))
    if part == "ease_in":
        return replace(span, ease_in=max(span.on - to, 0.0))
    if part == "ease_out":
        return replace(span, ease_out=max(to - span.off, 0.0))
    if part == "all":
        return replace(span, on=span.on + by, off=span.off + by)
    raise InvalidInput(f"a span has the parts on, off, ease_in, ease_out and all, but got {part!r}.")


def _fraction(rate: float | Fraction | tuple[int, int]) -> tuple[int, int]:
    """24 -> 24/1, 23.976 -> 24000/1001. Raises InvalidInput."""
    if isinstance(rate, tuple):
        return rate
    if not isinstance(rate, Fraction):
        if not (np.isfinite(rate) and rate > 0.0):
            raise InvalidInput(f"a rate is a positive number of frames per second, but got {rate}.")
        video = Fraction(round(rate * 1001 / 1000) * 1000, 1001)
        rate = video if 0.0 < abs(float(video) - rate) < 2e-3 or float(video) == rate else Fraction(rate)
        rate = rate.limit_denominator(1001)
    return rate.numerator, rate.denominator
