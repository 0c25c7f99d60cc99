"""Verbs that move patches and bend their axes."""

from __future__ import annotations

import cmath
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from contact_core.contact.axis import root_from_point
from contact_core.contact.linkage import link_to
from contact_core.contact.mirror import mirrored_root
from contact_core.contact.placement import Link, Root
from contact_core.contact.transfer import transported
from contact_core.document.document import Patch
from contact_core.edit.command import Command, apply_command
from contact_core.edit.commands import Bend, LinkPatch, Mirror, Rotate, Scale, Transfer, Translate, Unlink
from contact_core.edit.verbs.group import VerbGroup
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology


class PlacingVerbs(VerbGroup):
    """Translate, rotate, bend, scale, mirror, transfer, link."""

    def translate(self, patch: str, to: SurfacePoints) -> None:
        """Move a patch so that its first axis point comes to one surface point, kept parallel along the way."""
        surface = self._document.patch(patch).surface

        def act(verbs: PlacingVerbs) -> None:
            geometry = verbs._geometry
            carried = geometry.on_carrier(surface, to)
            root = transported(geometry.carrier_of(patch), geometry.root(patch), carried)
            verbs._do_where_it_can_walk(Translate(patch, verbs._placement_at(patch, root)), [patch])

        self._mended([surface], act)

    def place(
        self, patch: str, point: SurfacePoints, *, heading: complex | None = None, direction: Any = None
    ) -> None:
        """Move a patch to a surface point with a given heading, or a direction (3,) in surface space."""
        surface = self._document.patch(patch).surface

        def act(verbs: PlacingVerbs) -> None:
            root = verbs._geometry.root_at(surface, point, heading, direction)
            verbs._do_where_it_can_walk(Translate(patch, verbs._placement_at(patch, root)), [patch])

        self._mended([surface], act)

    def put(self, patch: str, root: Root) -> None:
        """Move a patch to a root as `geometry.root` gives it: on the mesh that contacts run on (`carrier_of`)."""
        self._geometry.check_points(self._document.patch(patch).surface, root.point(), on_carrier=True)
        self._do_where_it_can_walk(Translate(patch, self._placement_at(patch, root)), [patch])

    def _do_where_it_can_walk(self, command: Command, patches: Iterable[str]) -> None:
        """Do what places patches; on a surface that is broken somewhere they are traced first.

        Raises NotManifold where they cannot be.
        """
        after = apply_command(command, self._document)
        for patch in patches:
            if not Topology.of(self._editor.derived.carrier(after, after.patch(patch).surface)).is_manifold:
                self._editor.derived.patch(after, patch)
        self._editor.do(command)

    def rotate(self, patch: str, angle: float, *, about: int = 0) -> None:
        """Turn a patch by `angle` (radians, counter-clockwise seen from outside) about one of its axis points."""
        turn = cmath.exp(1j * angle)
        link = self._document.patch(patch).placement
        if isinstance(link, Link) and link.own_point == about:
            self._editor.do(Rotate(patch, replace(link, heading=link.heading + angle)))
            return
        if about == 0:
            root = self._geometry.root(patch)
            self._editor.do(Rotate(patch, self._placement_at(patch, root.heading_to(root.heading * turn))))
            return
        axis = self._geometry.axis(patch)
        self._check_axis_point(patch, about)
        root, cut = root_from_point(
            self._geometry.carrier_of(patch),
            self._document.surface_axis(patch),
            about,
            axis.points[about],
            complex(axis.tangents[about]) * turn,
        )
        if cut > 0.0:
            raise CommandRejected(f"turned about point {about}, the axis of {patch!r} would start off the surface.")
        self._editor.do(Rotate(patch, self._placement_at(patch, root)))

    def bend(self, patch: str, point: int, angle: float) -> None:
        """Turn the part of a patch from an interior axis point on by `angle` (radians, counter-clockwise here)."""
        axis = self._document.effective_axis(patch)
        axis.check_bend(point)
        sign = -1.0 if self._document.patch(patch).mirrored else 1.0
        self._editor.do(Bend(patch, point, float(axis.turning_angles[point - 1]) + sign * angle))

    def scale(self, patch: str, *, along: float | None = None, spread: float | None = None) -> None:
        """Set the factors along the axis and across it (1: as painted); None leaves a factor as it is.

        Raises InvalidInput for a size at which the patch cannot be traced.
        """
        axis = self._document.effective_axis(patch)
        along, spread = axis.along if along is None else along, axis.spread if spread is None else spread
        command = Scale(patch, along, spread)
        scaled = apply_command(command, self._document)
        self._editor.derived.patch(scaled, patch)  # kept, so drawing it traces nothing again
        self._editor.do(command)

    def mirror(self, patch: str, mirrored: bool | None = None) -> None:
        """Turn a patch into its mirror image about its first direction, or back."""
        now = self._document.patch(patch).mirrored
        self._editor.do(Mirror(patch, not now if mirrored is None else mirrored))

    def transfer(
        self,
        patch: str,
        surface: str,
        point: SurfacePoints,
        *,
        heading: complex | None = None,
        direction: Any = None,
        name: str | None = None,
        mirrored: bool = True,
    ) -> str:
        """Copy a patch onto a surface at a point; returns the name of the copy, which shares the shape.

        mirrored: as the mirror image of the patch, as contact wants it. Onto the same surface say False.
        """
        return self.transfer_tree(
            patch, surface, point, heading=heading, direction=direction,
            names=None if name is None else {patch: name}, mirrored=mirrored, descendants=False,
        )[patch]  # fmt: skip

    def transfer_tree(
        self,
        patch: str,
        surface: str,
        point: SurfacePoints,
        *,
        heading: complex | None = None,
        direction: Any = None,
        names: dict[str, str] | None = None,
        mirrored: bool = True,
        descendants: bool = True,
    ) -> dict[str, str]:
        """Copy a patch and all its descendants, in one go; returns the copies' names by the names copied.

        Where parts that were apart land on one another, a warning in the log says which
        (`geometry.crowded` measures it).
        """

        def act(verbs: PlacingVerbs) -> dict[str, str]:
            root = verbs._geometry.root_at(surface, point, heading, direction)
            return verbs._copied_tree(patch, surface, root, names or {}, mirrored, descendants)

        return self._mended([surface], act)

    def _copied_tree(
        self, patch: str, surface: str, root: Root, names: dict[str, str], mirrored: bool, descendants: bool
    ) -> dict[str, str]:
        document = self._document
        target = document.surface(surface)
        units = document.surface(document.patch(patch).surface).meters_per_unit / target.meters_per_unit
        copies: dict[str, Patch] = {}
        taken = dict.fromkeys(document.patches)
        for name in (patch, *(document.descendants(patch) if descendants else ())):
            source = document.patch(name)
            wanted = names.get(name)
            new = wanted or document.free_name(f"{name}.{surface}", taken)
            taken[new] = None
            copies[name] = replace(
                source,
                name=new,
                surface=surface,
                placement=root if name == patch else _copied_link(source, copies, mirrored, units),
                original=False,
                mirrored=source.mirrored != mirrored,
                turns=source.turns if not source.original else (),
                along=source.along if not source.original else 1.0,
                spread=source.spread if not source.original else 1.0,
            )
        copied = [copy.name for copy in copies.values()]
        self._do_where_it_can_walk(Transfer(tuple(copies.values())), copied)
        self._warn_where_crowded(copied)
        return {name: copy.name for name, copy in copies.items()}

    def symmetric_copy(
        self, patch: str, *, normal: Any = (1.0, 0.0, 0.0), offset: float = 0.0, name: str | None = None
    ) -> str:
        """Copy a patch across a mirror plane of its surface (points x with normal . x = offset)."""
        surface = self._document.patch(patch).surface
        root, _ = mirrored_root(self._geometry.carrier(surface), self._geometry.root(patch), normal, offset)
        return self._copied_tree(patch, surface, root, {} if name is None else {patch: name}, True, False)[patch]

    def link(self, child: str, parent: str, *, parent_point: int = 0, own_point: int = 0) -> None:
        """Make a patch the child of another, by the geodesic between two axis points, where both are now."""
        for name in (child, parent):
            self._document.patch(name)
        if child == parent or child in self._document.ancestors(parent):
            raise CommandRejected(f"{child!r} cannot be a child of {parent!r}, which descends from it.")
        if self._document.patch(child).surface != self._document.patch(parent).surface:
            raise CommandRejected(f"{child!r} and {parent!r} lie on different surfaces; a link is a path on one.")
        axis = self._geometry.axis(child)
        self._check_axis_point(child, own_point)
        link = link_to(
            self._geometry.carrier_of(child),
            parent,
            self._geometry.axis(parent),
            axis.points[own_point],
            complex(axis.tangents[own_point]),
            parent_point=parent_point,
            own_point=own_point,
        )
        self._editor.do(LinkPatch(child, link))

    def unlink(self, child: str) -> None:
        """Take a patch off its parent; it stays where it is."""
        self._editor.do(Unlink(child, self._geometry.root(child)))


def _copied_link(source: Patch, copies: dict[str, Patch], mirrored: bool, units: float) -> Root | Link:
    """The link of a copied child: to its parent's copy, mirrored with it, in the target's units."""
    link = source.placement
    if not isinstance(link, Link):
        raise InvalidInput(f"{source.name!r} is the child of no patch.")
    link = replace(link, parent=copies[link.parent].name).scaled(units)
    return link.mirrored() if mirrored else link
