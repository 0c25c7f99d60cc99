"""Commands that make, change and remove the shape of patches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.contact.placement import Link
from contact_core.contact.shape import PatchCoordinates, PatchShape
from contact_core.document.document import ContactDocument, Patch
from contact_core.edit.command import BaseCommand
from contact_core.edit.commands.checks import (
    NamedPlacements,
    add_patches,
    check_free,
    check_links,
    place_all,
    without_unused_shapes,
)
from contact_core.edit.commands.timing import without_stray_time
from contact_core.errors import CommandRejected


@dataclass(frozen=True, eq=False)
class Paint(BaseCommand):
    """A new patch with a shape of its own."""

    json_id: ClassVar[str] = "contact.paint"
    patch: Patch
    shape: PatchShape

    def label(self) -> str:
        return f"Paint {self.patch.name}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        check_free(document.shapes, self.patch.shape, "shape")
        return add_patches(document.with_shape(self.patch.shape, self.shape), [self.patch])


@dataclass(frozen=True, eq=False)
class Extend(BaseCommand):
    """More points on a patch and all that share its shape. weights: (n,) of the new points."""

    json_id: ClassVar[str] = "contact.extend"
    patch: str
    coordinates: PatchCoordinates
    weights: FloatArray

    def __post_init__(self) -> None:
        n = len(self.coordinates)
        object.__setattr__(self, "weights", frozen(self.weights, np.float64, (n,), "weights of new points"))

    def label(self) -> str:
        return f"Paint on {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        shape = document.shape_of(self.patch).extended(self.coordinates, self.weights)
        return document.with_shape(document.patch(self.patch).shape, shape)


@dataclass(frozen=True, eq=False)
class Erase(BaseCommand):
    """Points taken from a patch and all that share its shape. points: (k,) rising indices of those to go."""

    json_id: ClassVar[str] = "contact.erase"
    patch: str
    points: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.int64, (None,), "points to erase"))

    def label(self) -> str:
        return f"Erase from {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        shape = document.shape_of(self.patch)
        if len(self.points) and not 0 <= self.points.min() <= self.points.max() < len(shape):
            raise CommandRejected(
                f"{self.patch!r} has the points 0..{len(shape) - 1}, but got {int(self.points.max())} among them."
            )
        keep = np.ones(len(shape), dtype=bool)  # (n,)
        keep[self.points] = False
        if not keep.any():
            raise CommandRejected(f"this would erase every point of {self.patch!r}: remove the patch instead.")
        return document.with_shape(document.patch(self.patch).shape, shape.select(keep))


@dataclass(frozen=True, eq=False)
class Reshape(BaseCommand):
    """A new shape for a patch and all that share it: another axis, other bindings.

    placements: where patches go that the change of axis would move otherwise (partners, children). A deviation
    of a partner stays where the segments are the same, and is forgotten where the axis is another one.
    """

    json_id: ClassVar[str] = "contact.reshape"
    patch: str
    shape: PatchShape
    placements: NamedPlacements
    title: str

    def label(self) -> str:
        return f"{self.title} {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        key = document.patch(self.patch).shape
        old = document.shapes[key].axis
        document = document.with_shape(key, self.shape)
        if not np.array_equal(old.lengths, self.shape.axis.lengths):
            turned = [patch for patch in document.patches.values() if patch.shape == key and patch.turns]
            document = document.with_patches(*(replace(patch, turns=()) for patch in turned))
        document = place_all(document, self.placements)
        check_links(document)
        return document


@dataclass(frozen=True, eq=False)
class Weigh(BaseCommand):
    """New point weights (n,) for a patch and all that share its shape."""

    json_id: ClassVar[str] = "contact.weigh"
    patch: str
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", frozen(self.weights, np.float64, (None,), "weights of a patch"))

    def label(self) -> str:
        return f"Weigh the points of {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        shape = replace(document.shape_of(self.patch), weights=self.weights)
        return document.with_shape(document.patch(self.patch).shape, shape)


@dataclass(frozen=True, eq=False)
class Detach(BaseCommand):
    """A patch gets its shape, deviation included, under a key of its own, and follows its partners no more."""

    json_id: ClassVar[str] = "contact.detach"
    patch: str
    shape: str

    def label(self) -> str:
        return f"Detach {self.patch}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        patch = document.patch(self.patch)
        check_free(document.shapes, self.shape, "shape")
        own = document.shapes[patch.shape].with_axis(document.effective_axis(patch.name))
        document = document.with_shape(self.shape, own)
        alone = replace(patch, shape=self.shape, original=True, turns=(), along=1.0, spread=1.0)
        document = document.with_patches(alone)
        return without_unused_shapes(_with_originals(document))


@dataclass(frozen=True, eq=False)
class Remove(BaseCommand):
    """Patches removed, with their pairs and their places in groups. placements: where their children go."""

    json_id: ClassVar[str] = "contact.remove"
    patches: tuple[str, ...]
    placements: NamedPlacements = ()

    def label(self) -> str:
        return f"Remove {', '.join(self.patches)}"

    def apply(self, document: ContactDocument) -> ContactDocument:
        gone = {document.patch(name).name for name in self.patches}
        document = place_all(document, self.placements)
        for patch in document.patches.values():
            hangs_on = patch.placement.parent if isinstance(patch.placement, Link) else None
            if hangs_on in gone and patch.name not in gone:
                raise CommandRejected(
                    f"{patch.name!r} is a child of {hangs_on!r}: unlink it first, or remove both."
                )
        pairs = [pair.name for pair in document.pairs.values() if {pair.manipulator, pair.object} & gone]
        groups = {
            name: left
            for name, members in document.groups.items()
            if (left := tuple(member for member in members if member not in gone))
        }
        changed = len(groups) != len(document.groups) or any(groups[n] != document.groups[n] for n in groups)
        document = replace(
            document,
            patches=document.patches.without(*gone),
            pairs=document.pairs.without(*pairs) if pairs else document.pairs,
            groups=type(document.groups)(groups) if changed else document.groups,
        )
        return without_stray_time(without_unused_shapes(_with_originals(document)))


def _with_originals(document: ContactDocument) -> ContactDocument:
    """Where the original of a shape went, the first of its partners by name takes over."""
    owned = {patch.shape for patch in document.patches.values() if patch.original}
    heirs: dict[str, Patch] = {}
    for name in sorted(document.patches):
        patch = document.patches[name]
        if patch.shape not in owned:
            heirs.setdefault(patch.shape, patch)
    return (
        document.with_patches(*(replace(patch, original=True) for patch in heirs.values())) if heirs else document
    )
