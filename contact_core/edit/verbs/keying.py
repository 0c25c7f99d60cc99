"""What makes a key of an edit at a frame, where a track exists."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from contact_core.contact.placement import Link, Placement, Root
from contact_core.document.document import ContactDocument, named
from contact_core.document.timeline import (
    Key,
    PlaceKey,
    PoseKey,
    Track,
    TrackKind,
    WeightKey,
    address,
    of_address,
)
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.edit.commands import ClearPose, Pair, PlaceSurface, Rotate, SetKeys, SetPose, Settle, Translate
from contact_core.edit.derived import Derived
from contact_core.errors import CommandRejected
from contact_core.motion.placement_keys import Interpolation, PlacementKey, PlacementKeys
from contact_core.rig.rig import Pose, Rig


class TimedEditor(Protocol):
    """What time asks of a session. timed_document: the document with its tracks, of which `document` is a frame."""

    rigs: dict[str, Rig]

    @property
    def timed_document(self) -> ContactDocument: ...

    @property
    def derived(self) -> Derived: ...

    def do(self, command: Command) -> object: ...

    def frame_changed(self, before: ContactDocument) -> None: ...


class Keying:
    """Makes keys at one frame of an editor's document."""

    def __init__(self, editor: TimedEditor, frame: float) -> None:
        self._editor, self.frame = editor, frame

    def command(self, command: Command, document: ContactDocument) -> Command:
        if isinstance(command, Macro):
            parts = []
            for part in command.commands:
                parts.append(self.command(part, document))
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
        return SetKeys(where, self.keys(document, kind, name, value), (), command.label() + ": key")

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

    def keys(
        self,
        document: ContactDocument,
        kind: TrackKind,
        name: str,
        value: Any,
        interpolation: Interpolation | None = None,
    ) -> tuple[Key, ...]:
        """The keys to put so that a thing has a value at the frame."""
        frame = self.frame
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
        pose = completed(value, name, frame, track, self._editor.rigs.get(name))
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

    def without(self, track: Track, name: str) -> tuple[Key, ...]:
        """The keys to put when the one at the frame is taken out: a placement key before it gets a new way."""
        if not isinstance(track.keys[0], PlacementKey) or len(track.keys) == 1:
            return ()
        old = track.of(PlacementKey)
        document = self._editor.timed_document
        mesh = self._editor.derived.carrier(document, document.patch(name).surface)
        new = PlacementKeys(old).without_key(mesh, self.frame).keys
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


def held(document: ContactDocument, kind: TrackKind, name: str) -> Command:
    """What makes the value of a document without time hold throughout."""
    if kind == "placement":
        return Translate(name, document.patch(name).placement)
    if kind == "weight":
        return Pair(document.pairs[name])
    if kind == "place":
        return PlaceSurface(name, document.surface(name).world_from_surface)
    return SetPose(name, document.poses[name])


def completed(pose: Pose, name: str, frame: float, track: Track | None, rig: Rig | None) -> Pose:
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
