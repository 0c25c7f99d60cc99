"""Verbs that change a patch under its points: another axis, other bindings, weights, a shape of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.contact.axis import Axis, draw_axis
from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.linkage import follow_link, link_to
from contact_core.contact.patch import parameterize_patch
from contact_core.contact.placement import Link, Placement, Root
from contact_core.contact.shape import AxisShape
from contact_core.edit.commands import Detach, Reshape, Weigh
from contact_core.edit.verbs.painting import PaintingVerbs
from contact_core.errors import CommandRejected
from contact_core.geometry.surface_point import SurfacePoints


class ReshapingVerbs(PaintingVerbs):
    """Set the axis, bind by hand, weigh, detach."""

    def set_axis(
        self,
        patch: str,
        picks: SurfacePoints | None = None,
        *,
        heading: complex | None = None,
        dense: bool = True,
        generator: str | AxisGenerator | None = None,
    ) -> None:
        """Draw the axis of a patch anew. Its points, its children and its partners stay where they are."""
        surface = self._document.patch(patch).surface
        points = self._geometry.reconstruction(patch).points
        if picks is None:
            picks = self._default_axis(surface, patch, points, generator)
        else:
            heading = None if heading is None else self._geometry.root_at(surface, picks[:1], heading).heading
            picks = self._geometry.on_carrier(surface, picks)
        shape, axis = draw_axis(self._geometry.carrier(surface), picks, heading, dense=dense)
        self._editor.do(self._reshaping(patch, points, shape, axis, "Set the axis of"))

    def bind(self, patch: str, indices: Any, axis_point: int) -> None:
        """Anchor points to an axis point chosen by hand, in place of the closest one."""
        self._check_axis_point(patch, axis_point)
        shape = self._document.shape_of(patch)
        anchors = shape.coordinates.anchors.copy()
        anchors[self._point_indices(patch, indices)] = axis_point
        coordinates = self._measured(patch, self._geometry.reconstruction(patch).points, anchors)
        self._editor.do(Reshape(patch, replace(shape, coordinates=coordinates), (), "Bind points of"))

    def weigh(self, patch: str, weights: Any) -> None:
        """Set the weights (n,) of the points of a patch."""
        self._editor.do(Weigh(patch, weights))

    def detach(self, patch: str) -> None:
        """Give a patch a shape of its own, so that it follows its partners no more."""
        self._editor.do(Detach(patch, self._document.free_name(patch, self._document.shapes)))

    def _reshaping(
        self,
        patch: str,
        points: SurfacePoints,
        shape: AxisShape,
        axis: Axis,
        title: str,
    ) -> Reshape:
        """A new axis under a patch: coordinates anew, and placements that keep everything where it is."""
        source = self._document.patch(patch)
        mesh = self._geometry.carrier_of(patch)
        unit = self._document.unit(patch)
        if source.turns or source.along != 1.0 or source.spread != 1.0:
            raise CommandRejected(
                f"{patch!r} deviates from the shape that it shares: draw the axis on the original, or detach it."
            )
        there = shape.transformed(mirrored=source.mirrored, unit=unit)
        coordinates = parameterize_patch(mesh, axis, points, shape=there)
        drawn = AxisShape(shape.lengths / unit, there.traced_turns)
        old = self._document.shapes[source.shape]
        new = replace(old, axis=drawn, coordinates=coordinates)
        placements: list[tuple[str, Placement]] = []
        roots = {patch: axis.root()} | {
            partner: self._followed(patch, partner, axis) for partner in self._document.partners(patch)
        }
        for name, root in roots.items():
            placements.append((name, self._rooted(name, root)))
            placements.extend(self._children_kept(name, root))
        return Reshape(patch, new, tuple(placements), title)

    def _followed(self, patch: str, partner: str, axis: Axis) -> Root:
        """Where a partner has the new first axis point of a patch: the way there from the old axis, over there."""
        here, there = self._geometry.axis(patch), self._geometry.axis(partner)
        way = link_to(self._geometry.carrier_of(patch), patch, here, axis.points[0], complex(axis.tangents[0]))
        if self._document.patch(patch).mirrored != self._document.patch(partner).mirrored:
            way = way.mirrored()
        ratio = self._document.unit(partner) / self._document.unit(patch)
        point, tangent, _ = follow_link(self._geometry.carrier_of(partner), there, way.scaled(ratio))
        return Root.at(point, tangent)

    def _rooted(self, name: str, root: Root) -> Placement:
        """A placement for a patch whose axis will be another one; a child is then linked by its first point."""
        link = self._document.patch(name).placement
        if not isinstance(link, Link):
            return root
        return self._relinked(name, replace(link, own_point=0), root.point(), root.heading)

    def _children_kept(self, name: str, root: Root) -> list[tuple[str, Placement]]:
        """Links that keep the children of a patch where they are, from the first point of its new axis."""
        kept: list[tuple[str, Placement]] = []
        for child in self._document.children(name):
            link = self._document.patch(child).placement
            assert isinstance(link, Link)
            own = self._geometry.axis(child)
            first = Axis(root.point(), np.array([root.heading]), np.zeros(1))
            kept.append((child, link_to(
                self._geometry.carrier_of(child), name, first, own.points[link.own_point],
                complex(own.tangents[link.own_point]), own_point=link.own_point,
            )))  # fmt: skip
        return kept
