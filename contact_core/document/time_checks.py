"""What has to be true of the tracks and spans of a document; sentences on what is not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contact_core.contact.placement import Link
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import FILM, KINDS, Span, Track, check_spans, of_address
from contact_core.errors import InvalidInput
from contact_core.motion.placement_keys import PlacementKey


def time_inconsistencies(document: ContactDocument) -> Iterator[str]:
    """Of the timeline, and of all tracks and spans."""
    yield from (
        f"there is one timeline, {FILM!r}, but got {name!r}." for name in document.timelines if name != FILM
    )
    for where, track in document.tracks.items():
        yield from track_inconsistencies(document, where, track)
    for pair, spans in document.spans.items():
        yield from span_inconsistencies(document, pair, spans)


def owners(document: ContactDocument, kind: str) -> Mapping[str, object]:
    """By name, what has tracks of a kind."""
    owners: dict[str, Mapping[str, object]] = {"placement": document.patches, "weight": document.pairs}
    return owners.get(kind, document.surfaces)


def track_inconsistencies(document: ContactDocument, where: str, track: Track) -> Iterator[str]:
    """Of one track, as it would be in the document."""
    try:
        kind, name = of_address(where)
    except InvalidInput as error:
        yield str(error)
        return
    if name not in owners(document, kind):
        yield f"the track {where!r} is of {name!r}, which does not exist."
        return
    if not isinstance(track.keys[0], KINDS[kind]):
        yield f"the track {where!r} has keys of the kind {type(track.keys[0]).__name__}."
        return
    if kind == "pose" and document.surfaces[name].rig is None:
        yield f"{name!r} has no rig, so it has no pose over time."
    if kind == "placement":
        yield from _placement_inconsistencies(document, name, track)


def _placement_inconsistencies(document: ContactDocument, name: str, track: Track) -> Iterator[str]:
    patch = document.patches[name]
    surface = document.surfaces.get(patch.surface)
    if isinstance(patch.placement, Link):
        yield (
            f"patch {name!r} is a child of {patch.placement.parent!r} and moves with it, so it has no keys of its"
            " own place: unlink it, or clear its keys, first."
        )
    for key in track.of(PlacementKey):
        if surface is not None and key.root.face >= surface.carrier_faces:
            yield (
                f"patch {name!r} is rooted in face {key.root.face} of {surface.carrier_faces} at frame"
                f" {key.frame:g}: its keys belong to another mesh."
            )
            return


def span_inconsistencies(document: ContactDocument, pair: str, spans: tuple[Span, ...]) -> Iterator[str]:
    """Of the spans of one pair."""
    if pair not in document.pairs:
        yield f"spans name the pair {pair!r}, which does not exist."
    if not spans:
        yield f"{pair!r} is listed among the spans, but has none."
    try:
        check_spans(spans, pair)
    except InvalidInput as error:
        yield str(error)
