"""Verbs that make and change the shape of patches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.area import measure_area
from contact_core.contact.axis import Axis, draw_axis
from contact_core.contact.linkage import follow_link, link_to
from contact_core.contact.patch import parameterize_patch
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape
from contact_core.document.document import Color, Patch
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import Detach, Erase, Extend, Group, Paint, Remove, Reshape, Weigh
from contact_core.edit.verbs.editor import Editor
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints

PALETTE: tuple[Color, ...] = (  # Okabe and Ito: told apart also by colour-blind eyes
    (0.902, 0.624, 0.0),
    (0.337, 0.706, 0.914),
    (0.0, 0.620, 0.451),
    (0.941, 0.894, 0.259),
    (0.0, 0.447, 0.698),
    (0.835, 0.369, 0.0),
    (0.8, 0.475, 0.655),
)


class PaintingVerbs(Editor):
    """Paint, erase, merge, split, set the axis, bind by hand, weigh."""

    def default_axis(self, surface: str, patch: str, points: SurfacePoints, generator: str | None) -> SurfacePoints:
        """Axis points for a patch that was painted without; a session asks its axis generators."""
        raise InvalidInput(
            f"the patch {patch!r} needs an axis: pass `axis` with one point and a heading, or with more points."
        )

    def paint(
        self,
        patch: str,
        points: SurfacePoints,
        *,
        surface: str | None = None,
        axis: SurfacePoints | None = None,
        heading: complex | None = None,
        dense: bool = True,
        generator: str | None = None,
        strength: Any = None,
        color: Color | None = None,
    ) -> int:
        """Paint points: a new patch, or more points on one that exists (and on all that share its shape).

        A new patch needs `surface`, and an axis: picked points, or one of a generator. strength: (n,) 0..1, a
        brush's falloff, multiplies the default weights. Points painted twice are kept once.
        """
        if patch in self.document.patches:
            return self.submit(self._extension(patch, points, strength))
        if surface is None:
            raise InvalidInput(f"the new patch {patch!r} needs the name of a surface.")
        picks = axis if axis is not None else self.default_axis(surface, patch, points, generator)
        return self.submit(self.painting(patch, surface, points, picks, heading, dense, strength, color))

    def painting(
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
        """The command that paints a new patch; `number` counts those painted with it."""
        shape, placed = self._shape(surface, points, picks, heading, dense, strength)
        color = color or PALETTE[(len(self.document.patches) + number) % len(PALETTE)]
        key = self.document.free_name(patch, self.document.shapes)
        return Paint(Patch(patch, surface, key, placed.root(), color=color), shape)

    def paint_region(
        self, name: str, points: Mapping[str, SurfacePoints], *, axes: Mapping[str, SurfacePoints] | None = None
    ) -> tuple[str, ...]:
        """Paint one region over several surfaces, or over parts of one that are not connected.

        It is split by surface and by connected part; the parts become patches name.1, name.2 ... (or `name`, when
        there is one) and a group `name`. axes: by surface, picked axis points; otherwise a generator's.
        """
        parts = [(s, part) for s, batch in points.items() for part in connected_parts(self.mesh(s), batch)]
        if not parts:
            raise InvalidInput(f"the region {name!r} has no points.")
        commands: list[Command] = []
        names: list[str] = []
        taken = dict.fromkeys(self.document.patches)
        for number, (surface, part) in enumerate(parts, start=1):
            patch = self.document.free_name(name if len(parts) == 1 else f"{name}.{number}", taken)
            taken[patch] = None
            picks = (axes or {}).get(surface)
            if picks is None:
                picks = self.default_axis(surface, patch, part, None)
            commands.append(self.painting(patch, surface, part, picks, number=len(names)))
            names.append(patch)
        if len(parts) > 1:
            commands.append(Group(name, tuple(names)))
        self.submit(Macro(f"Paint {name}", tuple(commands)))
        return tuple(names)

    def erase(
        self, patch: str, indices: Any = None, *, near: SurfacePoints | None = None, radius: float = 0.0
    ) -> int:
        """Erase points by index, or those within `radius` of surface points (straight distance, surface units)."""
        if (indices is None) == (near is None):
            raise InvalidInput("erase needs either indices or points to erase near.")
        if near is not None:
            mesh = self.mesh_of(patch)
            here, there = self.points(patch).positions(mesh), near.positions(mesh)
            distance = np.linalg.norm(here[:, None] - there[None], axis=-1).min(axis=1, initial=np.inf)  # (n,)
            indices = np.flatnonzero(distance <= radius)
        return self.submit(Erase(patch, np.unique(np.asarray(indices, dtype=np.int64))))

    def merge(self, patch: str, others: Sequence[str]) -> int:
        """Join patches of one surface into the first; the others are removed, and their children hang on it."""
        coordinates, weights = [], []
        for other in others:
            if self.document.patch(other).surface != self.document.patch(patch).surface:
                raise CommandRejected(f"{patch!r} and {other!r} lie on different surfaces: group them instead.")
            coordinates.append(self._measured(patch, self.points(other)))
            weights.append(self.document.shape_of(other).weights)
        if not coordinates or patch in others:
            raise CommandRejected(f"merging into {patch!r} needs other patches.")
        commands: list[Command] = [
            Extend(patch, part, weight) for part, weight in zip(coordinates, weights, strict=True)
        ]
        commands.append(self._removal(tuple(others)))
        return self.submit(Macro(f"Merge {', '.join([patch, *others])}", tuple(commands)))

    def split(self, patch: str, indices: Any, name: str) -> int:
        """Take points out of a patch into a new one with the same axis."""
        source = self.document.patch(patch)
        shape = self.document.shapes[source.shape]
        chosen = np.zeros(len(shape), dtype=bool)
        chosen[np.asarray(indices, dtype=np.int64)] = True
        color = PALETTE[len(self.document.patches) % len(PALETTE)]
        key = self.document.free_name(name, self.document.shapes)
        part = replace(source, name=name, shape=key, original=True, color=color)
        return self.submit(
            Macro(
                f"Split {name} off {patch}",
                (Erase(patch, np.flatnonzero(chosen)), Paint(part, shape.select(chosen))),
            )
        )

    def set_axis(
        self,
        patch: str,
        picks: SurfacePoints | None = None,
        *,
        heading: complex | None = None,
        dense: bool = True,
        generator: str | None = None,
    ) -> int:
        """Draw the axis of a patch anew. Its points, its children and its partners stay where they are."""
        surface = self.document.patch(patch).surface
        points = self.points(patch)
        if picks is None:
            picks = self.default_axis(surface, patch, points, generator)
        shape, axis = draw_axis(self.mesh(surface), picks, heading, dense=dense)
        return self.submit(self._reshaping(patch, points, shape, axis, "Set the axis of"))

    def bind(self, patch: str, indices: Any, axis_point: int) -> int:
        """Anchor points to an axis point chosen by hand, in place of the closest one."""
        shape = self.document.shape_of(patch)
        anchors = shape.coordinates.anchors.copy()
        anchors[np.asarray(indices, dtype=np.int64)] = axis_point
        coordinates = self._measured(patch, self.points(patch), anchors)
        return self.submit(Reshape(patch, replace(shape, coordinates=coordinates), (), "Bind points of"))

    def weigh(self, patch: str, weights: Any) -> int:
        """Set the weights (n,) of the points of a patch."""
        return self.submit(Weigh(patch, np.asarray(weights, dtype=float)))

    def remove(self, *patches: str) -> int:
        """Remove patches; what hangs on them stays where it is."""
        return self.submit(self._removal(patches))

    def detach(self, patch: str) -> int:
        """Give a patch a shape of its own, so that it follows its partners no more."""
        return self.submit(Detach(patch, self.document.free_name(patch, self.document.shapes)))

    def _shape(
        self,
        surface: str,
        points: SurfacePoints,
        picks: SurfacePoints,
        heading: complex | None,
        dense: bool,
        strength: Any,
    ) -> tuple[PatchShape, Axis]:
        mesh = self.mesh(surface)
        points, strength = without_doubles(mesh, points, strength)
        axis_shape, axis = draw_axis(mesh, picks, heading, dense=dense)
        coordinates = parameterize_patch(mesh, axis, points)
        bare = PatchShape(
            axis_shape, coordinates, np.ones(len(points)), self.document.surface(surface).meters_per_unit
        )
        shares = measure_area(bare, points.positions(mesh)).shares
        return replace(bare, weights=shares * strength), axis

    def _extension(self, patch: str, points: SurfacePoints, strength: Any) -> Extend:
        here = self.points(patch)
        points, strength = without_doubles(self.mesh_of(patch), points, strength, here)
        if not len(points):
            raise CommandRejected(f"all of these points are on {patch!r} already.")
        coordinates = self._measured(patch, points)
        shape = self.document.shape_of(patch).extended(coordinates, np.ones(len(points)))
        together = SurfacePoints.concatenate([here, points]).positions(self.mesh_of(patch))
        shares = measure_area(shape, together).shares[len(here) :] / self._area_unit(patch)
        return Extend(patch, coordinates, shares * strength)

    def _area_unit(self, patch: str) -> float:
        """Square surface units of the patch's surface per square unit of its shape."""
        return self.derived.unit(self.document, patch) ** 2

    def _measured(self, patch: str, points: SurfacePoints, anchors: Any = None) -> PatchCoordinates:
        """Coordinates of points relative to the axis of a patch as it lies now."""
        return parameterize_patch(
            self.mesh_of(patch),
            self.axis(patch),
            points,
            anchors=anchors,
            shape=self.document.effective_axis(patch),
            mirrored=self.document.patch(patch).mirrored,
            unit=self.derived.unit(self.document, patch),
        )

    def _removal(self, patches: tuple[str, ...]) -> Remove:
        """Remove patches, with roots for the children that stay."""
        children = [c for name in patches for c in self.document.children(name) if c not in patches]
        return Remove(patches, tuple((child, self.root(child)) for child in children))

    def _reshaping(
        self,
        patch: str,
        points: SurfacePoints,
        shape: AxisShape,
        axis: Axis,
        title: str,
    ) -> Reshape:
        """A new axis under a patch: coordinates anew, and placements that keep everything where it is."""
        source = self.document.patch(patch)
        mesh = self.mesh_of(patch)
        unit = self.derived.unit(self.document, patch)
        if source.turns or source.along != 1.0 or source.spread != 1.0:
            raise CommandRejected(
                f"{patch!r} deviates from the shape that it shares: draw the axis on the original, or detach it."
            )
        coordinates = parameterize_patch(mesh, axis, points, mirrored=source.mirrored, unit=unit)
        turns = -shape.turning_angles if source.mirrored else shape.turning_angles
        drawn = AxisShape(shape.lengths / unit, turns)
        old = self.document.shapes[source.shape]
        new = replace(old, axis=drawn, coordinates=coordinates)
        placements: list[tuple[str, Placement]] = []
        roots = {patch: axis.root()} | {
            partner: self._followed(patch, partner, axis) for partner in self.document.partners(patch)
        }
        for name, root in roots.items():
            placements.append((name, self._rooted(name, root)))
            placements.extend(self._children_kept(name, new, root))
        return Reshape(patch, new, tuple(placements), title)

    def _followed(self, patch: str, partner: str, axis: Axis) -> Root:
        """Where a partner has the new first axis point of a patch: the way there from the old axis, over there."""
        here, there = self.axis(patch), self.axis(partner)
        way = link_to(self.mesh_of(patch), patch, here, axis.points[0], complex(axis.tangents[0]))
        if self.document.patch(patch).mirrored != self.document.patch(partner).mirrored:
            way = way.mirrored()
        ratio = self.derived.unit(self.document, partner) / self.derived.unit(self.document, patch)
        point, tangent, _ = follow_link(self.mesh_of(partner), there, way.scaled(ratio))
        return Root.at(point, tangent)

    def _rooted(self, name: str, root: Root) -> Placement:
        """A placement for a patch whose axis will be another one; a linked patch then hangs by its first point."""
        link = self.document.patch(name).placement
        if not isinstance(link, Link):
            return root
        return self.relinked(name, replace(link, own_point=0), root.point(), root.heading)

    def _children_kept(self, name: str, shape: PatchShape, root: Root) -> list[tuple[str, Placement]]:
        """Links that keep the children of a patch where they are, from the first point of its new axis."""
        kept: list[tuple[str, Placement]] = []
        for child in self.document.children(name):
            link = self.document.patch(child).placement
            assert isinstance(link, Link)
            own = self.axis(child)
            first = Axis(root.point(), np.array([root.heading]), np.zeros(1))
            kept.append((child, link_to(
                self.mesh_of(child), name, first, own.points[link.own_point],
                complex(own.tangents[link.own_point]), own_point=link.own_point,
            )))  # fmt: skip
        return kept


def without_doubles(
    mesh: TriangleMesh, points: SurfacePoints, strength: Any = None, known: SurfacePoints | None = None
) -> tuple[SurfacePoints, FloatArray]:
    """The points that are not doubles of one another or of known ones, with their strengths.

    Doubles lie at the same place (1e-9 in barycentrics), whichever of its faces an edge or vertex point names.
    """
    n = len(points)
    given = np.ones(n) if strength is None else np.asarray(strength, dtype=float)
    if given.shape != (n,):
        raise InvalidInput(f"strength needs one number for each of {n} points, but has shape {given.shape}.")
    before = len(known) if known is not None else 0
    together = SurfacePoints.concatenate([known, points]) if known is not None else points
    weights = np.round(together.barycentric * 1e9).astype(np.int64)  # (n, 3)
    corners = np.where(weights > 0, mesh.faces[together.faces], -1)  # (n, 3)
    order = np.argsort(corners, axis=1)
    rows = np.column_stack([np.take_along_axis(part, order, axis=1) for part in (corners, weights)])
    _, first = np.unique(rows, axis=0, return_index=True)
    keep = np.sort(first[first >= before]) - before
    return points[keep], given[keep]


def connected_parts(mesh: TriangleMesh, points: SurfacePoints) -> list[SurfacePoints]:
    """Points split by the connected part of the mesh that they lie on, in order of their first point."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not len(points):
        return []
    edges = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=2 * (len(mesh.points),))
    _, part_of_vertex = connected_components(graph, directed=False)
    part = part_of_vertex[mesh.faces[points.faces, 0]]  # (n,)
    _, first = np.unique(part, return_index=True)
    return [points[np.flatnonzero(part == part[k])] for k in np.sort(first)]
