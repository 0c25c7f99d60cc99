"""Verbs that paint: points put on patches and taken off, patches joined, split and removed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.area import measure_area
from contact_core.contact.axis import Axis, draw_axis
from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.patch import parameterize_patch
from contact_core.contact.placement import Link, Placement
from contact_core.contact.point_sets import connected_parts, without_doubles
from contact_core.contact.shape import PatchShape
from contact_core.document.document import Color, Patch
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import Erase, Extend, Group, Paint, Remove
from contact_core.edit.verbs.group import VerbGroup
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints

_SEVEN: tuple[Color, ...] = (  # Okabe and Ito: told apart also by colour-blind eyes
    (0.902, 0.624, 0.0),
    (0.337, 0.706, 0.914),
    (0.0, 0.620, 0.451),
    (0.941, 0.894, 0.259),
    (0.0, 0.447, 0.698),
    (0.835, 0.369, 0.0),
    (0.8, 0.475, 0.655),
)
PALETTE: tuple[Color, ...] = (*_SEVEN, *((0.55 * r, 0.55 * g, 0.55 * b) for r, g, b in _SEVEN))  # then darker ones


class PaintingVerbs(VerbGroup):
    """Paint, erase, merge, split, remove."""

    def paint(
        self,
        patch: str,
        points: SurfacePoints,
        *,
        surface: str | None = None,
        axis: SurfacePoints | None = None,
        heading: complex | None = None,
        dense: bool = True,
        generator: str | AxisGenerator | None = None,
        strength: Any = None,
        color: Color | None = None,
    ) -> None:
        """Paint points: a new patch, or more points on one that exists (and on all that share its shape).

        A new patch needs `surface`, and an axis: picked points, or one of a generator: its name, or one made with
        settings (`plugins.make`). strength: (n,) 0..1, a brush's falloff, multiplies the default weights. Points
        painted twice are kept once.
        """
        where = self._document.patches[patch].surface if patch in self._document.patches else surface
        if where is None:
            raise InvalidInput(f"the new patch {patch!r} needs the name of a surface.")

        def act(verbs: PaintingVerbs) -> None:
            geometry = verbs._geometry
            carried = geometry.on_carrier(where, points)
            picks = None if axis is None else geometry.on_carrier(where, axis)
            turned = heading
            if axis is not None and heading is not None:
                turned = geometry.root_at(where, axis[:1], heading).heading
            verbs._paint_on_carrier(patch, where, carried, picks, turned, dense, generator, strength, color)

        self._mended([where], act)

    def _paint_on_carrier(
        self,
        patch: str,
        surface: str,
        points: SurfacePoints,
        picks: SurfacePoints | None,
        heading: complex | None = None,
        dense: bool = True,
        generator: str | AxisGenerator | None = None,
        strength: Any = None,
        color: Color | None = None,
    ) -> None:
        """The same with points and picks on the mesh that contacts of the surface run on."""
        if patch in self._document.patches:
            self._editor.do(self._extension(patch, points, strength))
            return
        picks = self._default_axis(surface, patch, points, generator) if picks is None else picks
        self._editor.do(self._painting(patch, surface, points, picks, heading, dense, strength, color))

    def _painting(
        self,
        patch: str,
        surface: str,
        points: SurfacePoints,
        picks: SurfacePoints,
        heading: complex | None = None,
        dense: bool = True,
        strength: Any = None,
        color: Color | None = None,
        *,
        number: int = 0,
    ) -> Paint:
        """The command that paints a new patch; `number` counts those painted with it. points, picks: on the mesh
        that contacts of the surface run on."""
        shape, placed = self._shape(surface, points, picks, heading, dense, strength)
        color = color or PALETTE[(len(self._document.patches) + number) % len(PALETTE)]
        key = self._document.free_name(patch, self._document.shapes)
        return Paint(Patch(patch, surface, key, placed.root(), color=color), shape)

    def paint_region(
        self, name: str, points: Mapping[str, SurfacePoints], *, axes: Mapping[str, SurfacePoints] | None = None
    ) -> tuple[str, ...]:
        """Paint one region over several surfaces, or over parts of one that are not connected.

        It is split by surface and by connected part; the parts become patches name.1, name.2 ... (or `name`, when
        there is one) and a group `name`. axes: by surface, picked axis points; otherwise a generator's.
        """
        if not points:
            raise InvalidInput(f"the region {name!r} has no points.")
        return self._mended(points, lambda verbs: verbs._paint_region(name, points, axes or {}))

    def _paint_region(
        self, name: str, points: Mapping[str, SurfacePoints], axes: Mapping[str, SurfacePoints]
    ) -> tuple[str, ...]:
        geometry = self._geometry
        carried = {surface: geometry.on_carrier(surface, batch) for surface, batch in points.items()}
        parts = [(s, part) for s, batch in carried.items() for part in connected_parts(geometry.carrier(s), batch)]
        if len(parts) > 1 and name in self._document.groups:
            raise CommandRejected(f"there is a group {name!r} already.")
        commands: list[Command] = []
        names: list[str] = []
        taken = dict.fromkeys(self._document.patches)
        for number, (surface, part) in enumerate(parts, start=1):
            patch = self._document.free_name(name if len(parts) == 1 else f"{name}.{number}", taken)
            taken[patch] = None
            given = axes.get(surface)
            if given is None:
                picks = self._default_axis(surface, patch, part)
            else:
                picks = geometry.on_carrier(surface, given)
            commands.append(self._painting(patch, surface, part, picks, number=len(names)))
            names.append(patch)
        if len(parts) > 1:
            commands.append(Group(name, tuple(names)))
        self._editor.do(Macro(f"Paint {name}", tuple(commands)))
        return tuple(names)

    def erase(
        self, patch: str, indices: Any = None, *, near: SurfacePoints | None = None, radius: float = 0.0
    ) -> None:
        """Erase points by index, or those within `radius` of surface points (straight distance, surface units)."""
        if (indices is None) == (near is None):
            raise InvalidInput("erase needs either indices or points to erase near.")
        if near is not None:
            self._geometry.check_points(self._document.patch(patch).surface, near)
            mesh = self._geometry.mesh_of(patch)
            here = self._geometry.points(patch).positions(mesh)
            indices = np.flatnonzero(nearest(here, near.positions(mesh)) <= radius)
            if not len(indices):
                told = self._document.surface(self._document.patch(patch).surface).told(radius)
                raise CommandRejected(f"no point of {patch!r} lies within {told} of there.")
        self._editor.do(Erase(patch, self._point_indices(patch, indices)))

    def merge(self, patch: str, others: Sequence[str]) -> None:
        """Join patches of one surface into the first. The others are removed, and their children become children of
        the first, where they are. A place that several of them hold is kept once."""
        if not others or patch in others or len(set(others)) != len(others):
            raise CommandRejected(f"merging into {patch!r} needs other patches, each once.")
        document, mesh = self._document, self._geometry.carrier_of(patch)
        commands: list[Command] = []
        known = self._geometry.reconstruction(patch).points
        for other in others:
            if document.patch(other).surface != document.patch(patch).surface:
                raise CommandRejected(f"{patch!r} and {other!r} lie on different surfaces: group them instead.")
            shape = document.shape_of(other)
            area_unit = (shape.meters_per_unit / document.shape_of(patch).meters_per_unit) ** 2
            there = self._geometry.reconstruction(other).points
            points, weights = without_doubles(mesh, there, shape.weights * area_unit, known)
            if len(points):
                commands.append(Extend(patch, self._measured(patch, points), weights))
            known = SurfacePoints.concatenate([known, points])
        commands.append(Remove(tuple(others), tuple(self._adopted(patch, others))))
        self._editor.do(Macro(f"Merge {', '.join([patch, *others])}", tuple(commands)))

    def split(self, patch: str, indices: Any, name: str) -> None:
        """Take points out of a patch into a new one with the same axis."""
        source = self._document.patch(patch)
        shape = self._document.shapes[source.shape]
        taken = self._point_indices(patch, indices)
        if len(taken) == len(shape):
            raise CommandRejected(f"splitting takes some points of {patch!r}, but got all: rename it instead.")
        chosen = np.zeros(len(shape), dtype=bool)
        chosen[taken] = True
        color = PALETTE[len(self._document.patches) % len(PALETTE)]
        key = self._document.free_name(name, self._document.shapes)
        part = replace(source, name=name, shape=key, original=True, color=color)
        self._editor.do(
            Macro(f"Split {name} off {patch}", (Erase(patch, taken), Paint(part, shape.select(chosen))))
        )

    def remove(self, *patches: str) -> None:
        """Remove patches; their children stay where they are."""
        self._editor.do(self._removal(patches))

    def _default_axis(
        self,
        surface: str,
        patch: str,
        points: SurfacePoints,
        generator: str | AxisGenerator | None = None,
    ) -> SurfacePoints:
        """Axis points for a patch that was painted without any; they and its points are on the mesh that contacts
        run on."""
        return self._editor.makers.axis(self._geometry, surface, patch, points, generator)

    def _shape(
        self,
        surface: str,
        points: SurfacePoints,
        picks: SurfacePoints,
        heading: complex | None,
        dense: bool,
        strength: Any,
    ) -> tuple[PatchShape, Axis]:
        mesh = self._geometry.carrier(surface)
        self._geometry.check_points(surface, points, on_carrier=True)
        self._geometry.check_points(surface, picks, on_carrier=True)
        points, strength = without_doubles(mesh, points, strength)
        axis_shape, axis = draw_axis(mesh, picks, heading, dense=dense)
        coordinates = parameterize_patch(mesh, axis, points, engine=self._editor.derived.engine)
        bare = PatchShape(
            axis_shape, coordinates, np.ones(len(points)), self._document.surface(surface).meters_per_unit
        )
        shares = measure_area(bare, points.positions(mesh)).shares
        return replace(bare, weights=shares * strength), axis

    def _extension(self, patch: str, points: SurfacePoints, strength: Any) -> Extend:
        here = self._geometry.reconstruction(patch).points
        points, strength = without_doubles(self._geometry.carrier_of(patch), points, strength, here)
        if not len(points):
            raise CommandRejected(f"all of these points are on {patch!r} already.")
        coordinates = self._measured(patch, points)
        shape = self._document.shape_of(patch).extended(coordinates, np.ones(len(points)))
        together = SurfacePoints.concatenate([here, points]).positions(self._geometry.carrier_of(patch))
        shares = measure_area(shape, together).shares[len(here) :] / self._area_unit(patch)
        return Extend(patch, coordinates, shares * strength)

    def _area_unit(self, patch: str) -> float:
        """Square surface units of the patch's surface per square unit of its shape."""
        return self._document.unit(patch) ** 2

    def _removal(self, patches: tuple[str, ...]) -> Remove:
        """Remove patches, with roots for the children that stay."""
        children = [c for name in patches for c in self._document.children(name) if c not in patches]
        return Remove(patches, tuple((child, self._geometry.root(child)) for child in children))

    def _adopted(self, patch: str, others: Sequence[str]) -> Iterator[tuple[str, Placement]]:
        """Where the children of patches go that are merged into one: they become children of it by its first point,
        unless it is a child of theirs, which it was not before."""
        above = {patch, *self._document.ancestors(patch)}
        children = [c for other in others for c in self._document.children(other) if c not in others]
        for child in sorted(children, key=lambda name: name not in above):  # roots first: no cycle on the way
            if child in above:
                yield child, self._geometry.root(child)
                continue
            link = self._document.patch(child).placement
            assert isinstance(link, Link)
            own, point = self._geometry.axis(child), link.own_point
            yield (
                child,
                self._relinked(
                    child,
                    replace(link, parent=patch, parent_point=0),
                    own.points[point],
                    complex(own.tangents[point]),
                ),
            )


def nearest(points: FloatArray, others: FloatArray) -> FloatArray:
    """(n,) the straight distance from each of n points to the closest of others (k, 3), k >= 1."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(points)[0])
