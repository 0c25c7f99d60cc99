"""Bend a patch at its handles, scale it along and across its axis, weigh it."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.tools.drag import Drag, axis_handles, patch_under, root_handle, shown_handles
from contact_builtins.tools.move import heading_to
from contact_core.errors import CommandRejected
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import NOTHING, Overlay
from contact_core.interaction.tool import Gesture
from contact_core.settings import HasSettings, setting


@dataclass(frozen=True)
class Bend:
    """What is grabbed turns about the last handle before it. Axes are dense, a point at every edge of the mesh: the
    bend is spread over the points round the handle, half way to its neighbours, so that the patch curves."""

    name: ClassVar[str] = "bend"
    summary: ClassVar[str] = "bend a patch at the handles of its axis"
    key: ClassVar[str] = "D"
    hint: ClassVar[str] = "drag the part of a patch that shall turn"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return shown_handles(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        active = desk.selection.patch
        if active is not None:
            handles = axis_handles(desk, active)
            taken = desk.handle_at(pointer, [handle for _, handle in handles])
            if taken is not None:
                point = next(point for point, handle in handles if handle is taken)
                return Bending(desk, pointer, active, point, desk.shown.axis_points(active)[point])
        found = patch_under(desk, pointer)
        if found is None:
            return None
        patch, hit = found
        desk.take(patch)
        seen = desk.scene.surfaces[hit.surface]
        away = np.linalg.norm(seen.positions(desk.shown.axis_points(patch)) - hit.position, axis=1)
        return Bending(desk, pointer, patch, int(away.argmin()), hit.point)


class Bending(Drag):
    """grabbed: the axis point nearest to `held`, where the patch is taken hold of."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, grabbed: int, held: SurfacePoints) -> None:
        super().__init__(desk, pointer)
        self.patch, self.surface, self.angle = patch, desk.document.patch(patch).surface, 0.0
        last = desk.document.shape_of(patch).axis.point_count - 1
        if last < 2:
            raise CommandRejected(
                f"the axis of {patch!r} has no point between its ends to bend at: draw a longer one."
            )
        pivot, self.shares = spread_over([point for point, _ in axis_handles(desk, patch)], grabbed, last)
        self.mesh, axis = desk.shown.carrier_of(patch), desk.shown.axis(patch)
        self.pivot = axis.points[pivot]
        first = heading_to(self.mesh, self.pivot, desk.shown.on_carrier(self.surface, held))
        self.first = first or complex(axis.tangents[pivot])

    def drag(self, pointer: Pointer) -> None:
        hit = self.hit(pointer, self.surface)
        if hit is None:
            return
        heading = heading_to(self.mesh, self.pivot, self.desk.shown.on_carrier(self.surface, hit.point))
        if heading is None:
            return
        self.angle = cmath.phase(heading / self.first)
        draft = self.desk.draft()
        for point, share in self.shares:
            draft.patches.bend(self.patch, point, share * self.angle)
        self.desk.preview(f"Bend {self.patch}", draft)

    def overlay(self) -> Overlay:
        return shown_handles(self.desk)

    def hint(self) -> str:
        return f"{math.degrees(self.angle):.0f} degrees"


def spread_over(handles: list[int], grabbed: int, last: int) -> tuple[int, list[tuple[int, float]]]:
    """The axis point about which what is grabbed turns, the last handle before it, and interior points with their
    shares of the bend, which sum to 1. handles: axis points, rising from 0 to `last`; last >= 2."""
    number = max(sum(point < grabbed for point in handles) - 1, 0)
    before, pivot, after = handles[max(number - 1, 0)], handles[number], handles[number + 1]
    first = min(max((before + pivot + 1) // 2, 1), last - 1)
    end = min(max((pivot + after) // 2, first), last - 1)
    return pivot, [(point, 1.0 / (end - first + 1)) for point in range(first, end + 1)]


@dataclass(frozen=True)
class Scale(HasSettings):
    """The pointer's distance on the screen from the root, against that at the press, is the factor."""

    name: ClassVar[str] = "scale"
    summary: ClassVar[str] = "scale a patch along and across its axis"
    key: ClassVar[str] = "S"
    hint: ClassVar[str] = "drag away from the root; Shift along the axis only, Ctrl across it only"
    most: float = setting(
        8.0, low=1.0, high=100.0, help="the largest factor of one drag, and one over the smallest"
    )

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return shown_handles(desk)

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = patch_under(desk, pointer)
        if found is None:
            return None
        desk.take(found[0])
        return Scaling(desk, pointer, found[0], self.most)


class Scaling(Drag):
    """most: the largest factor."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, most: float) -> None:
        super().__init__(desk, pointer)
        self.patch, self.most, self.factor = patch, most, 1.0
        handle = root_handle(desk, patch)
        assert handle is not None  # it was picked on its surface
        self.root = desk.view.project(handle.position[None])[0, :2]
        self.first = max(float(np.linalg.norm(pointer.pixel - self.root)), 12.0 * desk.view.pixel_ratio)

    def drag(self, pointer: Pointer) -> None:
        away = float(np.linalg.norm(pointer.pixel - self.root))
        self.factor = min(max(away / self.first, 1.0 / self.most), self.most)
        axis = self.desk.stroke.document.effective_axis(self.patch)
        along = None if pointer.holds("ctrl") else self.factor * axis.along
        spread = None if pointer.holds("shift") and along is not None else self.factor * axis.spread
        self.desk.stroke.patches.scale(self.patch, along=along, spread=spread)

    def hint(self) -> str:
        return f"{100 * self.factor:.0f} %"


@dataclass(frozen=True)
class Weigh(HasSettings):
    """To the right a patch counts more in a solve, to the left less."""

    name: ClassVar[str] = "weigh"
    summary: ClassVar[str] = "drag a patch sideways to make it count more or less"
    key: ClassVar[str] = "H"
    hint: ClassVar[str] = "drag to the right for more weight, to the left for less"
    doubling: float = setting(120.0, above=0.0, unit="pixels", help="how far a drag goes to double the weight")

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        return NOTHING

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        found = patch_under(desk, pointer)
        if found is None:
            return None
        desk.take(found[0])
        return Weighing(desk, pointer, found[0], self.doubling)


class Weighing(Drag):
    """doubling: pixels of a plain screen."""

    def __init__(self, desk: Desk, pointer: Pointer, patch: str, doubling: float) -> None:
        super().__init__(desk, pointer)
        self.patch, self.doubling, self.factor = patch, doubling * desk.view.pixel_ratio, 1.0
        self.weights = desk.document.shape_of(patch).weights

    def drag(self, pointer: Pointer) -> None:
        self.factor = 2.0 ** min(max((pointer.x - self.start.x) / self.doubling, -10.0), 10.0)
        self.desk.stroke.patches.weigh(self.patch, self.factor * self.weights)

    def hint(self) -> str:
        return f"weight times {self.factor:.2g}"
