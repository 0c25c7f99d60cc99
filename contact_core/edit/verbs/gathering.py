"""Verbs that make contacts out of a pose, and that carry groups across surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.placement import Root
from contact_core.document.document import named
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import Group, Transfer
from contact_core.edit.verbs.painting import PaintingVerbs
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction


@dataclass(frozen=True, eq=False)
class _Frame:
    """Where a root is in the world, in meters: position, direction of the axis, outward normal, each (3,)."""

    position: FloatArray
    direction: FloatArray
    normal: FloatArray

    def basis(self) -> FloatArray:
        """(3, 3) columns: direction, normal, their product."""
        side = np.cross(self.direction, self.normal)
        side = side / np.linalg.norm(side)
        return np.column_stack([self.direction, np.cross(side, self.direction), side])


class GatheringVerbs(PaintingVerbs):
    """Contacts from proximity, and transfer of groups."""

    def paint_touching(
        self,
        name: str,
        surface: str,
        other: str,
        distance: float,
        *,
        generator: str | AxisGenerator | None = None,
        smallest: int = 3,
    ) -> tuple[str, ...]:
        """Paint each touching part as a patch: name, name.2 ...; returns the names. InvalidInput for none."""
        parts = self._geometry.touching(surface, other, distance, smallest=smallest)
        if not parts:
            told = self._document.surface(surface).told(distance)
            raise InvalidInput(f"nothing of {surface!r} lies within {told} of {other!r} in this pose.")
        return self._mended([surface], lambda verbs: verbs._paint_parts(name, surface, parts, generator))

    def _paint_parts(
        self, name: str, surface: str, parts: Sequence[SurfacePoints], generator: str | AxisGenerator | None
    ) -> tuple[str, ...]:
        names: list[str] = []
        commands: list[Command] = []
        taken = dict.fromkeys(self._document.patches)
        for part in parts:
            new = self._document.free_name(name, taken)
            taken[new] = None
            carried = self._geometry.on_carrier(surface, part)
            picks = self._default_axis(surface, new, carried, generator)
            commands.append(self._painting(new, surface, carried, picks, number=len(names)))
            names.append(new)
        self._editor.do(Macro(f"Paint {name} where it touches", tuple(commands)))
        return tuple(names)

    def transfer_group(
        self,
        group: str,
        onto: Sequence[str],
        point: SurfacePoints,
        *,
        heading: complex | None = None,
        direction: Any = None,
        name: str | None = None,
        mirrored: bool = True,
    ) -> dict[str, str]:
        """Copy a group part by part onto one or several surfaces, and keep the copies as one group.

        The first patch goes to `point` of onto[0]. The others keep their places relative to it: a rigid motion
        brings them near the target, and each is projected onto the nearest of the surfaces. Returns the copies'
        names by the names copied.
        """
        document = self._document
        members = named(document.groups, group, "group")
        if not onto:
            raise InvalidInput("a group is transferred onto at least one surface.")
        first = self._frame(document.patch(members[0]).surface, self._geometry.root(members[0]))
        goal = self._frame(onto[0], self._geometry.root_at(onto[0], point, heading, direction))
        turned = replace(goal, normal=-goal.normal) if mirrored else goal
        turn = turned.basis() @ first.basis().T
        taken = dict.fromkeys(document.patches)
        copies, names = [], {}
        for member in members:
            patch = document.patch(member)
            frame = self._frame(patch.surface, self._geometry.root(member))
            where = goal.position + turn @ (frame.position - first.position)
            surface, root = self._nearest_root(onto, where, turn @ frame.direction)
            if member == members[0]:
                surface, root = onto[0], self._geometry.root_at(onto[0], point, heading, direction)
            names[member] = document.free_name(f"{member}.{surface}", taken)
            taken[names[member]] = None
            copy = replace(patch, name=names[member], surface=surface, placement=root, original=False)
            copies.append(replace(copy, mirrored=patch.mirrored != mirrored))
        copied = Group(name or document.free_name(f"{group}.{onto[0]}", document.groups), tuple(names.values()))
        self._editor.do(Macro(f"Transfer {group}", (Transfer(tuple(copies)), copied)))
        self._warn_where_crowded(names.values())
        return names

    def _frame(self, surface: str, root: Root) -> _Frame:
        mesh, record, point = self._geometry.carrier(surface), self._document.surface(surface), root.point()
        world, unit = record.world_from_surface, record.meters_per_unit
        direction = heading_to_direction(mesh, point, np.array([root.heading]))[0]
        return _Frame(
            unit * (world[:3, :3] @ point.positions(mesh)[0] + world[:3, 3]),
            world[:3, :3] @ direction,
            world[:3, :3] @ point.normals(mesh)[0],
        )

    def _nearest_root(self, onto: Sequence[str], where: FloatArray, direction: FloatArray) -> tuple[str, Root]:
        """The root nearest to a place in the world (meters) on any of the surfaces, headed as far as it can be."""
        best: tuple[float, str, Root] | None = None
        for surface in onto:
            mesh, record = self._geometry.carrier(surface), self._document.surface(surface)
            back = np.linalg.inv(record.world_from_surface)
            local = back[:3, :3] @ (where / record.meters_per_unit) + back[:3, 3]
            found = Locator.of(mesh).closest(local[None])
            distance = float(found.distance[0]) * record.meters_per_unit
            if best is None or distance < best[0]:
                heading = direction_to_heading(mesh, found.points, (back[:3, :3] @ direction)[None])
                best = distance, surface, Root.at(found.points, complex(heading[0]))
        assert best is not None
        return best[1], best[2]
