"""Verbs that make contacts out of a pose, and that carry groups across surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.contact.axis_generator import AxisGenerator
from contact_core.contact.placement import Root
from contact_core.contact.proximity import patches_of_vertices, touching_vertices
from contact_core.document.document import named
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import Group, Transfer
from contact_core.edit.verbs.painting import PaintingVerbs
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.rig.rig import Rig, forward_kinematics, skin


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
    """Contacts from proximity, and transfer of groups. rigs: by surface."""

    rigs: dict[str, Rig]

    def posed_mesh(self, surface: str) -> TriangleMesh:
        """The surface in the pose that the document holds; at rest without one."""
        pose, rig = self.document.poses.get(surface), self.rigs.get(surface)
        if pose is None:
            return self.mesh(surface)
        if rig is None:
            raise InvalidInput(f"the rig of {surface!r} is not loaded: give it to the session by add_surface.")
        local = rig.rest_local.copy()
        for joint, matrix in zip(pose.joints, pose.local, strict=True):
            local[rig.joint_index(joint)] = matrix
        return self.mesh(surface).with_points(skin(rig, forward_kinematics(rig.parents, local)))

    def touching(
        self, surface: str, other: str, distance: float, *, facing: bool = True, smallest: int = 3
    ) -> list[SurfacePoints]:
        """Vertices of a surface in its pose within `distance` (its own units) of another, part by part.

        What to paint when a coarse pose came first (workflow (e) of the paper). facing: nothing reaches through
        the far wall of a cup. smallest: parts of fewer vertices are left out.
        """
        here, there = self.document.surface(surface), self.document.surface(other)
        ratio = here.meters_per_unit / there.meters_per_unit
        scale = np.diag([ratio, ratio, ratio, 1.0])
        move = np.linalg.inv(there.world_from_surface) @ scale @ here.world_from_surface
        vertices, _ = touching_vertices(
            self.posed_mesh(surface), self.mesh(other), distance * ratio, other_from_posed=move, facing=facing
        )
        mesh = self.mesh(surface)
        return [SurfacePoints.at_vertices(mesh, part) for part in patches_of_vertices(mesh, vertices, smallest)]

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
        """Paint each touching part as a patch: name, name.2 ...; answers the names. InvalidInput for none."""
        parts = self.touching(surface, other, distance, smallest=smallest)
        if not parts:
            raise InvalidInput(f"nothing of {surface!r} lies within {distance:g} of {other!r} in this pose.")
        names: list[str] = []
        commands: list[Command] = []
        taken = dict.fromkeys(self.document.patches)
        for part in parts:
            new = self.document.free_name(name, taken)
            taken[new] = None
            picks = self.default_axis(surface, new, part, generator)
            commands.append(self.painting(new, surface, part, picks, number=len(names)))
            names.append(new)
        self.submit(Macro(f"Paint {name} where it touches", tuple(commands)))
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
        brings them near the target, and each is projected onto the nearest of the surfaces. Answers the copies'
        names by the names copied.
        """
        document = self.document
        members = named(document.groups, group, "group")
        if not onto:
            raise InvalidInput("a group is transferred onto at least one surface.")
        first = self._frame(document.patch(members[0]).surface, self.root(members[0]))
        goal = self._frame(onto[0], self.root_at(onto[0], point, heading, direction))
        turned = replace(goal, normal=-goal.normal) if mirrored else goal
        turn = turned.basis() @ first.basis().T
        taken = dict.fromkeys(document.patches)
        copies, names = [], {}
        for member in members:
            patch = document.patch(member)
            frame = self._frame(patch.surface, self.root(member))
            where = goal.position + turn @ (frame.position - first.position)
            surface, root = self._nearest_root(onto, where, turn @ frame.direction)
            if member == members[0]:
                surface, root = onto[0], self.root_at(onto[0], point, heading, direction)
            names[member] = document.free_name(f"{member}.{surface}", taken)
            taken[names[member]] = None
            copy = replace(patch, name=names[member], surface=surface, placement=root, original=False)
            copies.append(replace(copy, mirrored=patch.mirrored != mirrored))
        copied = Group(name or document.free_name(f"{group}.{onto[0]}", document.groups), tuple(names.values()))
        self.submit(Macro(f"Transfer {group}", (Transfer(tuple(copies)), copied)))
        return names

    def _frame(self, surface: str, root: Root) -> _Frame:
        mesh, record, point = self.mesh(surface), self.document.surface(surface), root.point()
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
            mesh, record = self.mesh(surface), self.document.surface(surface)
            back = np.linalg.inv(record.world_from_surface)
            local = back[:3, :3] @ (where / record.meters_per_unit) + back[:3, 3]
            found = Locator.of(mesh).closest(local[None])
            distance = float(found.distance[0]) * record.meters_per_unit
            if best is None or distance < best[0]:
                heading = direction_to_heading(mesh, found.points, (back[:3, :3] @ direction)[None])
                best = distance, surface, Root.at(found.points, complex(heading[0]))
        assert best is not None
        return best[1], best[2]
