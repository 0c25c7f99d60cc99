"""Verbs that pair, group, name and colour, and that answer questions about patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.area import PatchArea, measure_area
from contact_core.contact.distortion import Distortion, measure_distortion
from contact_core.contact.pairing import correspond
from contact_core.document.document import Color, ContactPair, named
from contact_core.edit.commands import (
    ClearPose,
    Group,
    Pair,
    PlaceSurface,
    Recolor,
    Rename,
    SetExtra,
    SetPose,
    Ungroup,
    Unpair,
)
from contact_core.edit.verbs.editor import Editor
from contact_core.errors import CommandRejected
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose


@dataclass(frozen=True, eq=False)
class PairGeometry:
    """One contact pair as a solver takes it: k points that are to touch k others.

    manipulator_points on manipulator_surface, object_points on object_surface (names); weights: (k,), the point
    weights times the weight of the pair, in square meters.
    """

    pair: ContactPair
    manipulator_surface: str
    object_surface: str
    manipulator_points: SurfacePoints
    object_points: SurfacePoints
    weights: FloatArray


class OrganisingVerbs(Editor):
    """Pair, unpair, group, rename, colour, pose, measure."""

    def pair(self, manipulator: str, target: str, *, name: str | None = None, weight: float = 1.0) -> str:
        """Say that two patches are to touch; answers the name of the pair.

        Patches painted independently need to match in axis coordinates; where they do not, InvalidInput says why.
        """
        if self.document.patch(manipulator).shape != self.document.patch(target).shape:
            correspond(self.document.shape_of(manipulator), self.document.shape_of(target))
        name = name or self.document.free_name(f"{manipulator} - {target}", self.document.pairs)
        self.submit(Pair(ContactPair(name, manipulator, target, weight)))
        return name

    def unpair(self, pair: str) -> int:
        """Dissolve a pair."""
        return self.submit(Unpair(pair))

    def pairs(self) -> tuple[PairGeometry, ...]:
        """Every pair with its points, in the order of the document."""
        return tuple(self.pair_geometry(name) for name in self.document.pairs)

    def pair_geometry(self, name: str) -> PairGeometry:
        """One pair with its points: as many on either side, those that ran off a boundary with weight 0."""
        pair = named(self.document.pairs, name, "pair")
        ends = [self.document.patch(end) for end in (pair.manipulator, pair.object)]
        here, there = (self.reconstruction(end.name) for end in ends)
        shape = self.document.shapes[ends[0].shape]
        other = np.arange(len(shape))
        if ends[0].shape != ends[1].shape:
            other = correspond(shape, self.document.shapes[ends[1].shape])
        fits = ~(here.ran_off | there.ran_off[other])  # (k,)
        weights = shape.weights * shape.meters_per_unit**2 * pair.weight * fits
        return PairGeometry(
            pair, ends[0].surface, ends[1].surface, here.points, there.points[other], weights
        )  # fmt: skip

    def group(self, name: str, patches: Sequence[str]) -> int:
        """Keep patches as one, on whatever surfaces they lie."""
        return self.submit(Group(name, tuple(patches)))

    def ungroup(self, name: str) -> int:
        """Dissolve a group; its patches stay."""
        return self.submit(Ungroup(name))

    def rename(self, patch: str, name: str) -> int:
        """Give a patch another name, everywhere."""
        return self.submit(Rename(patch, name))

    def recolor(self, patches: str | Sequence[str], color: Color) -> int:
        """Colour patches (RGB 0..1)."""
        return self.submit(Recolor((patches,) if isinstance(patches, str) else tuple(patches), color))

    def place_surface(self, surface: str, world_from_surface: Any) -> int:
        """Say where a surface stands in the scene: (4, 4), rigid."""
        return self.submit(PlaceSurface(surface, np.asarray(world_from_surface, dtype=float)))

    def set_pose(self, surface: str, pose: Pose, *, title: str = "Pose") -> int:
        """Put a rig into a pose: the result of a solve, or the animator's own."""
        return self.submit(SetPose(surface, pose, title))

    def clear_pose(self, surface: str) -> int:
        """Put a rig back to rest."""
        return self.submit(ClearPose(surface))

    def set_extra(self, namespace: str, value: Any) -> int:
        """Keep JSON data of a host or a plugin in the document."""
        return self.submit(SetExtra(namespace, value))

    def area(self, patch: str) -> PatchArea:
        """The patch triangulated: area on its surface, boundary loops."""
        positions = self.points(patch).positions(self.mesh_of(patch))
        return measure_area(self.document.shape_of(patch), positions)

    def distortion(self, patch: str, other: str) -> Distortion:
        """How a patch that shares its shape with another is stretched against it."""
        here, there = self.document.patch(patch), self.document.patch(other)
        if here.shape != there.shape:
            raise CommandRejected(f"{patch!r} and {other!r} do not share a shape, so no point answers another.")
        mesh, mesh_there = self.mesh_of(patch), self.mesh_of(other)
        points, points_there = self.points(patch), self.points(other)
        ratio = self.document.surface(there.surface).meters_per_unit
        ratio /= self.document.surface(here.surface).meters_per_unit
        return measure_distortion(
            self.area(patch).triangles,
            points.positions(mesh),
            points.normals(mesh),
            points_there.positions(mesh_there) * ratio,
            points_there.normals(mesh_there),
            mirrored=here.mirrored != there.mirrored,
        )
