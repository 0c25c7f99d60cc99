"""Commands about time: the range and rate of the film, keys, and spans in which pairs hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

from contact_core.document.document import ContactDocument, named
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.time_checks import owners, span_inconsistencies, track_inconsistencies
from contact_core.document.timeline import FILM, Key, Span, Timeline, Track, of_address
from contact_core.edit.command import BaseCommand, Command
from contact_core.errors import CommandRejected


@dataclass(frozen=True, eq=False)
class SetTimeline(BaseCommand):
    """The range and the rate of the film; keys and spans stay at their frames."""

    json_id: ClassVar[str] = "timeline.set"
    timeline: Timeline

    def label(self) -> str:
        return f"Frames {self.timeline.first:g} to {self.timeline.last:g}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        return replace(document, timelines=document.timelines.with_item(FILM, self.timeline))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, SetTimeline) else None


@dataclass(frozen=True, eq=False)
class SetKeys(BaseCommand):
    """Keys put into a track, in place of those at their frames, and keys taken out.

    track: its address; a track begins with its first key and ends with its last. keys: all of its kind; a placement
    key before a new one comes along, with its new way. gone: frames, absent ones are no error.
    """

    json_id: ClassVar[str] = "timeline.keys"
    track: str
    keys: tuple[Key, ...] = ()
    gone: tuple[float, ...] = ()
    title: str = "Key"

    def label(self) -> str:
        return f"{self.title} the {self.track.replace('/', ' of ', 1)}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        of_address(self.track)
        known = document.tracks.get(self.track)
        frames = [key.frame for key in self.keys]
        if len(set(frames)) != len(frames):
            raise CommandRejected(f"one key a frame was expected, but got frames {frames[:6]}.")
        if known is None:
            track = Track(tuple(sorted(self.keys, key=lambda key: key.frame))) if self.keys else None
        else:
            track = known.edited(self.keys, self.gone)
        if track is None:
            if known is None:
                raise CommandRejected(f"there is no track {self.track!r} to take keys out of.")
            return replace(document, tracks=document.tracks.without(self.track))
        for trouble in track_inconsistencies(document, self.track, track):
            raise CommandRejected(trouble)
        return replace(document, tracks=document.tracks.with_item(self.track, track))

    def merge(self, later: Command) -> Command | None:
        same = isinstance(later, SetKeys) and (later.track, later.gone) == (self.track, self.gone)
        frames = {key.frame for key in self.keys}
        covers = same and isinstance(later, SetKeys) and frames <= {key.frame for key in later.keys}
        return later if covers and self.keys else None


@dataclass(frozen=True, eq=False)
class ClearTrack(BaseCommand):
    """A track removed: the value of the document itself holds again."""

    json_id: ClassVar[str] = "timeline.clear"
    track: str

    def label(self) -> str:
        return f"Clear the keys of the {self.track.replace('/', ' of ', 1)}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        named(document.tracks, self.track, "track")
        return replace(document, tracks=document.tracks.without(self.track))


@dataclass(frozen=True, eq=False)
class SetSpans(BaseCommand):
    """When a pair holds, in order; none: always."""

    json_id: ClassVar[str] = "timeline.spans"
    pair: str
    spans: tuple[Span, ...]

    def label(self) -> str:
        return f"Set when {self.pair} holds"

    def apply(self, document: ContactDocument) -> ContactDocument:
        named(document.pairs, self.pair, "pair")
        if not self.spans:
            return replace(document, spans=document.spans.without(self.pair))
        for trouble in span_inconsistencies(document, self.pair, self.spans):
            raise CommandRejected(trouble)
        return replace(document, spans=document.spans.with_item(self.pair, self.spans))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, SetSpans) and later.pair == self.pair else None


def without_stray_time(document: ContactDocument) -> ContactDocument:
    """Tracks and spans of what has left the document are dropped."""
    named_by = ((where, *of_address(where)) for where in document.tracks)
    strays = [where for where, kind, name in named_by if name not in owners(document, kind)]
    gone = [pair for pair in document.spans if pair not in document.pairs]
    if not strays and not gone:
        return document
    return replace(document, tracks=document.tracks.without(*strays), spans=document.spans.without(*gone))


def with_tracks_renamed(
    document: ContactDocument, kinds: tuple[str, ...], new: Callable[[str], str]
) -> ContactDocument:
    """Tracks of kinds under the new names of what they are of."""
    if not document.tracks:
        return document
    renamed = {}
    for where, track in document.tracks.items():
        kind, name = of_address(where)
        renamed[f"{kind}/{new(name)}" if kind in kinds else where] = track
    return replace(document, tracks=FrozenMap(renamed))
