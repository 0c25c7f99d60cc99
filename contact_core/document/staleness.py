"""What a solved key was solved from: a digest by which it is known when it is stale."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from contact_core.arrays import digest
from contact_core.document.codec import to_json
from contact_core.document.document import ContactDocument
from contact_core.document.timeline import PoseKey, Track

T = TypeVar("T")
REACH = 1.0  # seconds to either side of a key within which a change makes it stale


def motion_source(document: ContactDocument, frame: float) -> str:
    """The digest (32 hex digits) of all that a pose at a frame is solved from: contacts, shapes, surfaces, and the
    keys and spans within a second of it. Solved keys, names of groups and data of others are not among it."""
    near = REACH * document.timeline.frames_per_second
    low, high = frame - near, frame + near
    parts: list[Any] = [
        document.timeline.rate,
        [(p.name, p.surface, p.shape, p.mirrored, p.turns, p.along, p.spread) for p in _in_order(document.patches)],
        [to_json(p.placement) for p in _in_order(document.patches)],
        [
            (key, s.axis.digest, s.coordinates.digest, digest(s.weights))
            for key, s in sorted(document.shapes.items(), key=_name)
        ],
        [to_json(pair) for pair in _in_order(document.pairs)],
        [
            (s.name, s.digest, s.meters_per_unit, s.world_from_surface.tolist())
            for s in _in_order(document.surfaces)
        ],
    ]
    for where, track in sorted(document.tracks.items(), key=_name):
        keys = [to_json(key) for key in _near(track, low, high)]
        parts += [[where, keys]] if keys else []
    for pair, spans in sorted(document.spans.items(), key=_name):
        reached = [s for s in spans if s.on - s.ease_in <= high and low <= s.off + s.ease_out]
        parts.append([pair, [to_json(span) for span in reached]])
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


def _name(item: tuple[str, Any]) -> str:
    return item[0]


def _in_order(items: Mapping[str, T]) -> list[T]:
    """By name: a document that was saved and opened again lists its parts in another order."""
    return [items[name] for name in sorted(items)]


def _near(track: Track, low: float, high: float) -> list[Any]:
    """The keys between two frames, and the next one on either side, which say how it goes there; of poses, those
    that a person made."""
    if isinstance(track.keys[0], PoseKey):
        pins = (key for key in track.of(PoseKey) if key.is_authored and low <= key.frame <= high)
        return [replace(key, speeds=None) for key in pins]
    keys = track.keys
    before = [key for key in keys if key.frame < low][-1:]
    after = [key for key in keys if key.frame > high][:1]
    return [*before, *(key for key in keys if low <= key.frame <= high), *after]
