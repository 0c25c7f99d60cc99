"""Move a patch over its surface, grabbed anywhere; turn it about its root."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from contact_builtins.tools.drag import Drag, patch_under, root_handle, shown_handles
from contact_core.contact.axis import Axis
from contact_core.contact.linkage import follow_link, link_to
from contact_core.contact.placement import Root
from contact_core.contact.transfer import transported
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.errors import CommandRejected
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import Overlay
from contact_core.interaction.tool import Gesture
from contact_core.settings import HasSettings, setting


@dataclass(frozen=True)
class Move:
    """The point that was grabbed follows the pointer along the shortest geodesic, and the patch stays parallel to
    itself along that way (paper, 3.3.1)."""

    name: ClassVar[str] = "move"
    summary: ClassVar[str] = "drag a patch over its surface, grabbed anywhere on it"
    key: ClassVar[str] = "G"
    hint: ClassVar[str] = "drag a patch, or its root"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return shown_handles(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        active = desk.selection.patch
        handle = None if active is None else root_handle(desk, active)
        if active is not None and handle is not None and desk.handle_at(pointer, [handle]) is not None:
            return Moving(desk, pointer, active, None)
        found = patch_under(desk, pointer)
        if found is None:
            return None
        patch, hit = found
        desk.take(patch)
        return Moving(desk, pointer, patch, hit.point)


class Moving(Drag):
    """grabbed: where the patch is held; None: at its root."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, grabbed: SurfacePoints | None) -> None:
        super().__init__(desk, pointer)
        self.patch, self.surface = patch, desk.document.patch(patch).surface
        self.grip = None
        if grabbed is not None:
            held = desk.shown.on_carrier(self.surface, grabbed)
            self.grip = Grip(desk.shown.carrier_of(patch), desk.shown.root(patch), held)

    def drag(self, pointer: Pointer) -> None:
        hit = self.hit(pointer, self.surface)
        if hit is None:
            return
        if self.grip is None:
            self.desk.stroke.patches.translate(self.patch, hit.point)
        else:
            root = self.grip.moved_to(self.desk.shown.on_carrier(self.surface, hit.point))
            point, way = as_seen(self.desk.shown, self.surface, root)
            self.desk.stroke.patches.place(self.patch, point, **way)


class Grip:
    """A root held at another point of the surface: the geodesic from there to the root goes along, unchanged."""

    def __init__(self, mesh: TriangleMesh, root: Root, held: SurfacePoints) -> None:
        self.mesh, self.held = mesh, Root.at(held, 1.0)
        self.way = link_to(mesh, "grip", _axis(self.held), root.point(), root.heading)

    def moved_to(self, to: SurfacePoints) -> Root:
        """The root when the point that is held comes to another one. Raises CommandRejected where the surface ends
        before the root is reached."""
        point, tangent, cut = follow_link(self.mesh, _axis(transported(self.mesh, self.held, to)), self.way)
        if cut > 0.0:
            raise CommandRejected("held there, the patch would start off the surface.")
        return Root.at(point, tangent)


def _axis(root: Root) -> Axis:
    return Axis(root.point(), np.array([root.heading]), np.zeros(1))


@dataclass(frozen=True)
class Turn(HasSettings):
    """The heading from the root to the pointer, against that at the press, is the angle."""

    name: ClassVar[str] = "turn"
    summary: ClassVar[str] = "turn a patch about its root"
    key: ClassVar[str] = "R"
    hint: ClassVar[str] = "drag a patch round its root; Shift turns in steps"
    step: float = setting(15.0, above=0.0, high=180.0, unit="degrees", help="steps while Shift is held")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return shown_handles(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = patch_under(desk, pointer)
        if found is None:
            return None
        patch, hit = found
        desk.take(patch)
        return Turning(desk, pointer, patch, hit.point, math.radians(self.step))


class Turning(Drag):
    """step: radians while Shift is held."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, grabbed: SurfacePoints, step: float) -> None:
        super().__init__(desk, pointer)
        self.patch, self.surface, self.step = patch, desk.document.patch(patch).surface, step
        self.mesh, self.root, self.angle = desk.shown.carrier_of(patch), desk.shown.root(patch), 0.0
        held = desk.shown.on_carrier(self.surface, grabbed)
        self.first = heading_to(self.mesh, self.root.point(), held) or self.root.heading

    def drag(self, pointer: Pointer) -> None:
        hit = self.hit(pointer, self.surface)
        if hit is None:
            return
        heading = heading_to(self.mesh, self.root.point(), self.desk.shown.on_carrier(self.surface, hit.point))
        if heading is None:
            return
        angle = cmath.phase(heading / self.first)
        self.angle = self.step * round(angle / self.step) if pointer.holds("shift") else angle
        self.desk.stroke.patches.rotate(self.patch, self.angle)

    def overlay(self) -> Overlay:
        return shown_handles(self.desk)

    def hint(self) -> str:
        return f"{math.degrees(self.angle):.0f} degrees"


def as_seen(shown: DocumentGeometry, surface: str, root: Root) -> tuple[SurfacePoints, dict[str, Any]]:
    """A root as verbs take it: a point of the mesh that is seen, with a heading there; with a direction in space
    where contacts run on a proxy."""
    if shown.carrier(surface) is shown.mesh(surface):
        return root.point(), {"heading": root.heading}
    direction = heading_to_direction(shown.carrier(surface), root.point(), np.array([root.heading]))[0]
    return shown.seen(surface, root.point()), {"direction": direction}


def heading_to(mesh: TriangleMesh, start: SurfacePoints, end: SurfacePoints) -> complex | None:
    """The unit heading in which the shortest geodesic leaves `start` for `end`; None where they are one place or
    not connected."""
    log = log_map(mesh, start, end, seek=True)
    leg = complex(log.coordinates[0])
    return leg / abs(leg) if log.anchor[0] >= 0 and abs(leg) > 1e-12 * mesh.bounding_box_diagonal else None
