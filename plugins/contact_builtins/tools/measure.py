"""Measure: how far two places lie apart, straight and over the surface, and how deep one is in another surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.inside import depth_inside
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.interaction.desk import Desk
from contact_core.interaction.events import Pointer
from contact_core.interaction.overlay import ACCENT, NOTHING, AxisLine, Label, Overlay
from contact_core.interaction.seen import Hit
from contact_core.interaction.tool import Gesture


@dataclass(frozen=True)
class Measure:
    """Changes nothing. Lengths are told in millimetres."""

    name: ClassVar[str] = "measure"
    summary: ClassVar[str] = "measure distances, and how deep one surface is in another"
    key: ClassVar[str] = "U"
    hint: ClassVar[str] = "drag from one place to another; rest on a place for its distance to other surfaces"

    def hover(self, desk: Desk, pointer: Pointer) -> Overlay:
        hit = desk.pick(pointer)
        if hit is None:
            return NOTHING
        told = [text for name in desk.scene.surfaces if name != hit.surface and (text := away(desk, hit, name))]
        return Overlay(labels=(Label("\n".join(told), hit.position),)) if told else NOTHING

    def press(self, desk: Desk, pointer: Pointer) -> Gesture | None:
        hit = desk.pick(pointer)
        return None if hit is None else Measuring(desk, hit)


class Measuring(Gesture):
    """From the first place to that under the pointer."""

    def __init__(self, desk: Desk, first: Hit) -> None:
        self.desk, self.first, self.last = desk, first, first

    def move(self, pointer: Pointer) -> None:
        self.last = self.desk.pick(pointer) or self.last

    def overlay(self) -> Overlay:
        both = np.stack([self.first.position, self.last.position])
        label = Label(self.hint(), both.mean(axis=0), ACCENT)
        return Overlay(axes=(AxisLine(both, ACCENT),), labels=(label,))

    def hint(self) -> str:
        straight = float(np.linalg.norm(self.last.position - self.first.position))
        text = f"{self._millimetres(straight):.1f} mm straight"
        if self.first.surface != self.last.surface:
            return text
        seen = self.desk.scene.surfaces[self.first.surface]
        walked = float(log_map(seen.mesh, self.first.point, self.last.point).distance[0])
        return (
            f"{text}, {self._millimetres(walked * seen.scale):.1f} mm over {seen.name}" if walked < np.inf else text
        )

    def _millimetres(self, length: float) -> float:
        return 1e3 * length * self.desk.scene.meters_per_unit


def away(desk: Desk, hit: Hit, other: str) -> str:
    """How far a place is from another surface, or how deep inside it; "" for a surface without faces."""
    seen = desk.scene.surfaces[other]
    if not len(seen.mesh.faces):
        return ""
    at = transform_points(seen.surface, hit.position[None])
    unit = 1e3 * seen.scale * desk.scene.meters_per_unit
    depth = float(depth_inside(at, seen.mesh)[0])
    if depth > 0.0:
        return f"{unit * depth:.1f} mm deep in {other}"
    return f"{unit * float(Locator.of(seen.mesh).closest(at).distance[0]):.1f} mm to {other}"
