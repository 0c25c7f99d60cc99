"""Commands that move patches and bend their axes. All hold the result, so a drag merges into its last position."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from contact_core.contact.placement import Link, Placement, Root
from contact_core.document.document import ContactDocument, Patch
from contact_core.document.frozen_map import FrozenMap
from contact_core.document.timeline import address
from contact_core.edit.command import BaseCommand, Command
from contact_core.edit.commands.checks import NamedPlacements, add_patches, check_placement
from contact_core.edit.commands.surfaces import SetPose
from contact_core.errors import CommandRejected
from contact_core.rig.rig import Pose


@dataclass(frozen=True, eq=False)
class _Place(BaseCommand):
    """A patch at a new placement of the same kind; later ones replace earlier ones."""

    patch: str
    placement: Placement

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        old, new = patch.placement, self.placement
        if isinstance(old, Link) != isinstance(new, Link):
            raise CommandRejected(f"moving {self.patch!r} neither links nor unlinks it: use link and unlink.")
        if isinstance(old, Link) and isinstance(new, Link) and old.parent != new.parent:
            raise CommandRejected(f"moving {self.patch!r} does not change its parent: use link.")
        check_placement(document, patch, new)
        return document.with_patches(replace(patch, placement=new))

    def merge(self, later: Command) -> Command | None:
        same = isinstance(later, _Place) and (later.json_id, later.patch) == (self.json_id, self.patch)
        return later if same else None


@dataclass(frozen=True, eq=False)
class Translate(_Place):
    """A patch moved along the surface."""

    json_id: ClassVar[str] = "contact.translate"

    def label(self) -> str:
        return f"Translate {self.patch}"


@dataclass(frozen=True, eq=False)
class Rotate(_Place):
    """A patch turned about a point of its axis."""

    json_id: ClassVar[str] = "contact.rotate"

    def label(self) -> str:
        return f"Rotate {self.patch}"


@dataclass(frozen=True, eq=False)
class Bend(BaseCommand):
    """The turning angle (radians) at an interior axis point, as drawn before mirroring.

    On an original the shape changes, and its partners follow. On a transferred patch its own deviation changes.
    """

    json_id: ClassVar[str] = "contact.bend"
    patch: str
    point: int
    angle: float

    def label(self) -> str:
        return f"Bend {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        shape = document.shapes[patch.shape]
        shape.axis.check_bend(self.point)
        if not math.isfinite(self.angle):
            raise CommandRejected(f"a turning angle is a finite number, but got {self.angle}.")
        if patch.original:
            own = dict(patch.turns).get(self.point, 0.0)
            return document.with_shape(patch.shape, shape.with_axis(shape.axis.bent(self.point, self.angle - own)))
        turn = self.angle - float(shape.axis.turning_angles[self.point - 1])
        turns = dict(patch.turns) | {self.point: turn}
        return document.with_patches(replace(patch, turns=tuple(sorted(turns.items()))))

    def merge(self, later: Command) -> Command | None:
        same = isinstance(later, Bend) and (later.patch, later.point) == (self.patch, self.point)
        return later if same else None


@dataclass(frozen=True, eq=False)
class Scale(BaseCommand):
    """The factors along and across the axis that a patch ends up with; whose they are goes as for Bend."""

    json_id: ClassVar[str] = "contact.scale"
    patch: str
    along: float
    spread: float

    def label(self) -> str:
        return f"Scale {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        shape = document.shapes[patch.shape]
        if not (0.0 < self.along < math.inf and 0.0 < self.spread < math.inf):
            raise CommandRejected(f"along and spread are positive factors, but got {self.along} and {self.spread}.")
        if patch.original:
            axis = replace(shape.axis, along=self.along / patch.along, spread=self.spread / patch.spread)
            return document.with_shape(patch.shape, shape.with_axis(axis))
        own = replace(patch, along=self.along / shape.axis.along, spread=self.spread / shape.axis.spread)
        return document.with_patches(own)

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, Scale) and later.patch == self.patch else None


@dataclass(frozen=True, eq=False)
class Mirror(BaseCommand):
    """A patch as the mirror image of its shape, or not, about its axis' first direction."""

    json_id: ClassVar[str] = "contact.mirror"
    patch: str
    mirrored: bool

    def label(self) -> str:
        return f"Mirror {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        return document.with_patches(replace(document.patch(self.patch), mirrored=self.mirrored))

    def merge(self, later: Command) -> Command | None:
        return later if isinstance(later, Mirror) and later.patch == self.patch else None


@dataclass(frozen=True, eq=False)
class Transfer(BaseCommand):
    """New patches that share the shapes of patches that exist: one patch, a whole tree, a symmetric copy."""

    json_id: ClassVar[str] = "contact.transfer"
    patches: tuple[Patch, ...]

    def label(self) -> str:
        return f"Transfer {', '.join(patch.name for patch in self.patches)}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        for patch in self.patches:
            if patch.original:
                raise CommandRejected(f"{patch.name!r} is a copy, so it cannot be the original of its shape.")
        return add_patches(document, self.patches)


@dataclass(frozen=True, eq=False)
class Settle(BaseCommand):
    """Contacts moved and rigs posed together: what a proposal becomes when it is accepted.

    placements: of patches, of the same kind as before. poses: by surface.
    """

    json_id: ClassVar[str] = "contact.settle"
    placements: NamedPlacements
    poses: FrozenMap[Pose]
    title: str = "Settle contacts"

    def label(self) -> str:
        return self.title

    def apply(self, document: ContactDocument) -> ContactDocument:
        for name, placement in self.placements:
            document = Translate(name, placement).apply(document)
        for surface, pose in self.poses.items():
            document = SetPose(surface, pose).apply(document)
        return document


@dataclass(frozen=True, eq=False)
class LinkPatch(BaseCommand):
    """A patch made the child of another."""

    json_id: ClassVar[str] = "contact.link"
    patch: str
    link: Link

    def label(self) -> str:
        return f"Link {self.patch} to {self.link.parent}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        check_placement(document, patch, self.link)
        if address("placement", self.patch) in document.tracks:
            raise CommandRejected(f"{self.patch!r} has keys of its own place: clear them before it is linked.")
        return document.with_patches(replace(patch, placement=self.link))


@dataclass(frozen=True, eq=False)
class Unlink(BaseCommand):
    """A patch taken off its parent, to a root of its own."""

    json_id: ClassVar[str] = "contact.unlink"
    patch: str
    root: Root

    def label(self) -> str:
        return f"Unlink {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        if not isinstance(patch.placement, Link):
            raise CommandRejected(f"{self.patch!r} is the child of no patch.")
        check_placement(document, patch, self.root)
        return document.with_patches(replace(patch, placement=self.root))
