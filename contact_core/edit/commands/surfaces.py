"""Commands about surfaces and the poses of rigs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.contact.shape import PatchShape
from contact_core.document.document import ContactDocument, Surface, named
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.time_checks import time_inconsistencies
from contact_core.document.timeline import Track
from contact_core.edit.command import BaseCommand, Command
from contact_core.edit.commands.checks import NamedPlacements, check_free, check_links, place_all
from contact_core.edit.commands.timing import with_tracks_renamed, without_stray_time
from contact_core.errors import CommandRejected
from contact_core.rig.rig import Pose


@dataclass(frozen=True, eq=False)
class AddSurface(BaseCommand):
    """A surface that contact may lie on."""

    json_id: ClassVar[str] = "surface.add"
    surface: Surface

    def label(self) -> str:
        return f"Add {self.surface.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        check_free(document.surfaces, self.surface.name, "surface")
        return replace(document, surfaces=document.surfaces.with_item(self.surface.name, self.surface))


@dataclass(frozen=True, eq=False)
class RemoveSurface(BaseCommand):
    """A surface forgotten, with its pose. Refused while patches lie on it."""

    json_id: ClassVar[str] = "surface.remove"
    surface: str

    def label(self) -> str:
        return f"Remove {self.surface}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        document.surface(self.surface)
        on_it = [patch.name for patch in document.patches.values() if patch.surface == self.surface]
        if on_it:
            raise CommandRejected(f"{self.surface!r} holds the patches {', '.join(on_it[:5])}: remove them first.")
        left = replace(
            document,
            surfaces=document.surfaces.without(self.surface),
            poses=document.poses.without(self.surface),
        )
        return without_stray_time(left)


@dataclass(frozen=True, eq=False)
class RenameSurface(BaseCommand):
    """A new name for a surface, everywhere it is named."""

    json_id: ClassVar[str] = "surface.rename"
    surface: str
    name: str

    def label(self) -> str:
        return f"Rename {self.surface} to {self.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        old = document.surface(self.surface)
        check_free(document.surfaces, self.name, "surface")
        surfaces = {
            (self.name if name == old.name else name): (replace(s, name=self.name) if name == old.name else s)
            for name, s in document.surfaces.items()
        }
        poses = {(self.name if name == old.name else name): pose for name, pose in document.poses.items()}
        moved = [patch for patch in document.patches.values() if patch.surface == old.name]
        document = replace(document, surfaces=FrozenMap(surfaces), poses=FrozenMap(poses))
        document = with_tracks_renamed(
            document, ("pose", "place"), lambda name: self.name if name == old.name else name
        )
        return document.with_patches(*(replace(patch, surface=self.name) for patch in moved))


@dataclass(frozen=True, eq=False)
class PlaceSurface(BaseCommand):
    """Where a surface stands in the scene: world_from_surface (4, 4), rigid."""

    json_id: ClassVar[str] = "surface.place"
    surface: str
    world_from_surface: FloatArray

    def __post_init__(self) -> None:
        matrix = frozen(self.world_from_surface, np.float64, (4, 4), "world_from_surface")
        object.__setattr__(self, "world_from_surface", matrix)

    def label(self) -> str:
        return f"Move {self.surface}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        moved = replace(document.surface(self.surface), world_from_surface=self.world_from_surface)
        return replace(document, surfaces=document.surfaces.with_item(self.surface, moved))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, PlaceSurface) and later.surface == self.surface else None


@dataclass(frozen=True, eq=False)
class RebindSurface(BaseCommand):
    """A surface becomes another mesh, or gets another proxy; shapes and placements hold what was projected onto it.

    surface: the new record under the old name. shapes: by key, those drawn anew. placements: new roots and links.
    tracks: by address, keys of places on it with their new roots and ways.
    """

    json_id: ClassVar[str] = "surface.rebind"
    surface: Surface
    shapes: FrozenMap[PatchShape]
    placements: NamedPlacements
    tracks: FrozenMap[Track] = field(default_factory=FrozenMap)

    def label(self) -> str:
        return f"Rebind {self.surface.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        document.surface(self.surface.name)
        for key in self.shapes:
            named(document.shapes, key, "shape")
        document = replace(
            document,
            surfaces=document.surfaces.with_item(self.surface.name, self.surface),
            shapes=document.shapes.updated(self.shapes),
            tracks=document.tracks.updated(self.tracks),
        )
        document = place_all(document, self.placements)
        for patch in document.patches.values():
            face = getattr(patch.placement, "face", 0)
            if patch.surface == self.surface.name and face >= self.surface.carrier_faces:
                raise CommandRejected(f"the root of {patch.name!r} is not on the new {self.surface.name!r}.")
        check_links(document)
        for trouble in time_inconsistencies(document):
            raise CommandRejected(trouble)
        return document


@dataclass(frozen=True, eq=False)
class SetPose(BaseCommand):
    """The pose that the rig of a surface is in: the result of a solve, or the animator's own."""

    json_id: ClassVar[str] = "pose.set"
    surface: str
    pose: Pose
    title: str = "Pose"

    def label(self) -> str:
        return f"{self.title} {self.surface}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        if document.surface(self.surface).rig is None:
            raise CommandRejected(f"{self.surface!r} has no rig, so it has no pose.")
        if len(set(self.pose.joints)) != len(self.pose.joints):
            raise CommandRejected("a pose names each joint once.")
        return replace(document, poses=document.poses.with_item(self.surface, self.pose))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, SetPose) and later.surface == self.surface else None


@dataclass(frozen=True, eq=False)
class ClearPose(BaseCommand):
    """Back to the rest pose."""

    json_id: ClassVar[str] = "pose.clear"
    surface: str

    def label(self) -> str:
        return f"Rest {self.surface}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        named(document.poses, self.surface, "pose")
        return replace(document, poses=document.poses.without(self.surface))
