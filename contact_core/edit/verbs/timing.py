"""Verbs about time: the frame that is shown, keys, spans; and what makes a key of an edit where a track exists."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from typing import Any, Protocol

import numpy as np

from contact_core.contact.placement import Link, Placement, Root
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
    WeightKey,
    address,
    of_address,
)
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.edit.commands import (
    ClearPose,
    ClearTrack,
    Pair,
    PlaceSurface,
    Rotate,
    SetKeys,
    SetPose,
    SetSpans,
    SetTimeline,
    Settle,
    Translate,
)
from contact_core.edit.derived import Derived
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.motion.placement_keys import Interpolation, PlacementKey, PlacementKeys
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose, Rig

EASE = 0.4  # seconds over which a contact fades in and out by default


class TimedEditor(Protocol):
    """What time asks of a session. timed_document: the document with its tracks, of which `document` is a frame."""

    rigs: dict[str, Rig]

    @property
    def timed_document(self) -> ContactDocument: ...

    @property
    def derived(self) -> Derived: ...

    def do(self, command: Command) -> object: ...

    def frame_changed(self, before: ContactDocument) -> None: ...


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
            SetKeys(address(kind, name), self._keys(self.document, kind, name, value, at, interpolation))
        )

    def take(self, surface: str, clip: PoseKeys) -> None:
        """The keys of a clip as pose keys of a surface, in place of what is keyed between its first and its last.

        They are no pins: solving with the weight `follow` keeps to them and mends their contacts. Joints that the
        rig does not have are refused, those that the clip does not name rest.
        """
        rig = named(self._editor.rigs, surface, "rig")
        track = self.track("pose", surface)
        keys = []
        for row, (frame, pose) in enumerate(zip(clip.frames, clip.poses, strict=True)):
            whole = _completed(pose, surface, frame, None, rig)
            speeds = None
            if clip.is_cubic:
                speeds = np.zeros((len(whole.joints), 6))
                speeds[[whole.joints.index(joint) for joint in pose.joints]] = clip.speeds[row]
            keys.append(PoseKey(frame, whole, speeds, "smooth" if clip.is_cubic else "linear", CAPTURED))
        if not keys:
            raise InvalidInput("the clip has no keys.")
        there = track.frames if track is not None else ()
        gone = tuple(frame for frame in there if keys[0].frame <= frame <= keys[-1].frame)
        self._editor.do(SetKeys(address("pose", surface), tuple(keys), gone, "Take a clip as"))

    def remove_key(self, kind: TrackKind, name: str, frame: float | None = None) -> None:
        """Take out the key at a frame, the one shown by default. Without its last key a track ends."""
        at = self.frame if frame is None else float(frame)
        track = self._known(kind, name)
        if track.key_at(at) is None:
            near = ", ".join(f"{each:g}" for each in sorted(track.frames, key=lambda each: abs(each - at))[:5])
            raise CommandRejected(f"there is no key at frame {at:g} of the {kind} of {name!r}; near it: {near}.")
        self._editor.do(SetKeys(address(kind, name), self._without(track, name, at), (at,), "Remove a key of"))

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
        self._editor.do(Macro(clear.label(), (clear, _held(shown, kind, name))))

    # --- spans --------------------------------------------------------------------------------------------------

    def hold(
        self, pair: str, on: float, off: float, *, ease_in: float | None = None, ease_out: float | None = None
    ) -> None:
        """A pair holds from one frame to another, in place of its spans that overlap this one.

        ease_in, ease_out: frames over which it fades in before, and out after; by default 0.4 seconds.
        """
        ramp = EASE * self.settings.frames_per_second
        new = Span(
            float(on), float(off), ramp if ease_in is None else ease_in, ramp if ease_out is None else ease_out
        )
        others = [span for span in self.spans(pair) if span.off < new.on or new.off < span.on]
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

    # --- edits at a frame ---------------------------------------------------------------------------------------

    def keyed(self, command: Command) -> Command:
        """The command that does at the frame shown what a command does without time: keys where tracks exist."""
        document = self.document
        return command if not document.tracks else self._keyed(command, document)

    def _keyed(self, command: Command, document: ContactDocument) -> Command:
        if isinstance(command, Macro):
            parts = []
            for part in command.commands:
                parts.append(self._keyed(part, document))
                document = apply_command(parts[-1], document)
            return Macro(command.title, tuple(parts))
        if isinstance(command, (Translate, Rotate)):
            return self._key_of(document, "placement", command.patch, command.placement, command)
        if isinstance(command, SetPose):
            return self._key_of(document, "pose", command.surface, command.pose, command)
        if isinstance(command, PlaceSurface):
            return self._key_of(document, "place", command.surface, command.world_from_surface, command)
        if isinstance(command, Pair):
            return self._paired(document, command)
        if isinstance(command, Settle):
            return self._settled(document, command)
        if isinstance(command, ClearPose) and address("pose", command.surface) in document.tracks:
            raise CommandRejected(f"the pose of {command.surface!r} has keys: clear them, or key its rest pose.")
        return command

    def _key_of(
        self, document: ContactDocument, kind: TrackKind, name: str, value: Any, command: Command
    ) -> Command:
        where = address(kind, name)
        if where not in document.tracks:
            return command
        return SetKeys(where, self._keys(document, kind, name, value, self.frame), (), command.label() + ": key")

    def _paired(self, document: ContactDocument, command: Pair) -> Command:
        pair = command.pair
        key = self._key_of(document, "weight", pair.name, pair.weight, command)
        if key is command:
            return command
        base = document.pairs[pair.name].weight
        return Macro(command.label(), (Pair(replace(pair, weight=base)), key))

    def _settled(self, document: ContactDocument, command: Settle) -> Command:
        keys: list[Command] = []
        for name, placement in command.placements:
            if address("placement", name) in document.tracks:
                keys.append(self._key_of(document, "placement", name, placement, command))
        for name, pose in command.poses.items():
            if address("pose", name) in document.tracks:
                keys.append(self._key_of(document, "pose", name, pose, command))
        if not keys:
            return command
        keyed = {key.track for key in keys if isinstance(key, SetKeys)}
        left = replace(
            command,
            placements=tuple(p for p in command.placements if address("placement", p[0]) not in keyed),
            poses=command.poses.without(*(n for n in command.poses if address("pose", n) in keyed)),
        )
        parts = (left, *keys) if left.placements or left.poses else tuple(keys)
        return Macro(command.label(), parts)

    # --- making keys --------------------------------------------------------------------------------------------

    def _known(self, kind: TrackKind, name: str) -> Track:
        return named(self.document.tracks, address(kind, name), "track")

    def _keys(
        self,
        document: ContactDocument,
        kind: TrackKind,
        name: str,
        value: Any,
        frame: float,
        interpolation: Interpolation | None = None,
    ) -> tuple[Key, ...]:
        """The keys to put so that a thing has a value at a frame."""
        of_address(address(kind, name))  # raises for a kind that there is not
        track = document.tracks.get(address(kind, name))
        if interpolation is None:
            before = [key for key in (track.keys if track else ()) if key.frame <= frame]
            interpolation = before[-1].interpolation if before else "smooth"
        if kind == "placement":
            return self._placement_keys(document, name, value, frame, interpolation, track)
        if kind == "weight":
            return (WeightKey(frame, float(value), interpolation),)
        if kind == "place":
            return (PlaceKey(frame, np.asarray(value, float), interpolation),)
        pose = _completed(value, name, frame, track, self._editor.rigs.get(name))
        return (PoseKey(frame, pose, None, interpolation),)

    def _placement_keys(
        self,
        document: ContactDocument,
        name: str,
        value: Placement,
        frame: float,
        interpolation: Interpolation,
        track: Track | None,
    ) -> tuple[Key, ...]:
        """The new key with its way, and the one before it with its new way."""
        if isinstance(value, Link):
            raise CommandRejected(f"{name!r} is a child and moves with its parent: unlink it before it gets keys.")
        surface = document.surface(document.patch(name).surface)
        mesh, digest = self._editor.derived.carrier(document, surface.name), surface.carrier_digest
        root = value if isinstance(value, Root) else self._editor.derived.walked(mesh, digest, value)
        if track is None:
            return PlacementKeys.of(mesh, [(frame, root, interpolation)]).keys
        old = track.of(PlacementKey)
        new = PlacementKeys(old).with_key(mesh, frame, root, interpolation).keys
        return tuple(key for key in new if key not in old)

    def _without(self, track: Track, name: str, frame: float) -> tuple[Key, ...]:
        """The keys to put when one is taken out: a placement key before it gets a new way."""
        if not isinstance(track.keys[0], PlacementKey) or len(track.keys) == 1:
            return ()
        old = track.of(PlacementKey)
        mesh = self._editor.derived.carrier(self.document, self.document.patch(name).surface)
        new = PlacementKeys(old).without_key(mesh, frame).keys
        return tuple(key for key in new if key not in old)


def value_of(document: ContactDocument, kind: TrackKind, name: str, rigs: dict[str, Rig]) -> Any:
    """What a document without time has: a placement, a pose, a place (4, 4) or a weight. Raises CommandRejected."""
    if kind == "placement":
        return document.patch(name).placement
    if kind == "weight":
        return named(document.pairs, name, "pair").weight
    surface = document.surface(name)
    if kind == "place":
        return surface.world_from_surface
    if name in document.poses:
        return document.poses[name]
    if name not in rigs:
        raise CommandRejected(f"{name!r} has no rig that is loaded, and no pose yet: give the pose to key.")
    return Pose.rest(rigs[name])


def _held(document: ContactDocument, kind: TrackKind, name: str) -> Command:
    """What makes the value of a document without time hold throughout."""
    if kind == "placement":
        return Translate(name, document.patch(name).placement)
    if kind == "weight":
        return Pair(document.pairs[name])
    if kind == "place":
        return PlaceSurface(name, document.surface(name).world_from_surface)
    return SetPose(name, document.poses[name])


def _completed(pose: Pose, name: str, frame: float, track: Track | None, rig: Rig | None) -> Pose:
    """A pose in the joints that the track has, or that the rig has at its first key."""
    if track is not None:
        base = track.pose_at(frame)
    elif rig is not None:
        base = Pose.rest(rig)
    else:
        return pose
    strangers = [joint for joint in pose.joints if joint not in base.joints]
    if strangers:
        raise CommandRejected(f"the keys of {name!r} know no joint {strangers[0]!r}; they have {base.joints[:6]}.")
    local = base.local.copy()
    local[[base.joints.index(joint) for joint in pose.joints]] = pose.local
    return Pose(base.joints, local)


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
