"""The heat map: how far each place of a skin is from the objects, or how deep in one, as colours of its vertices.

Blue is far, white touches, orange is deep: told apart also by those who see no red or green.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.document import Color
from contact_core.errors import CommandRejected
from contact_core.geometry.inside import depth_inside
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.interaction.overlay import Overlay, SkinHeat
from contact_core.interaction.seen import SeenScene, SeenSurface

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk

DEEP, FAR = 0.005, 0.02  # metres where the colours end
_STOPS = (-DEEP, -0.5 * DEEP, 0.0, 0.25 * FAR, FAR)  # metres, depth below zero
_RAMP: tuple[Color, ...] = (
    (0.70, 0.25, 0.02),
    (0.96, 0.56, 0.16),
    (0.97, 0.97, 0.95),
    (0.55, 0.75, 0.90),
    (0.10, 0.28, 0.55),
)


@dataclass(frozen=True)
class LegendStop:
    """One colour of the legend, and what it means."""

    color: Color
    text: str


LEGEND = (
    LegendStop(_RAMP[0], f"{1e3 * DEEP:g} mm deep or more"),
    LegendStop(_RAMP[1], f"{500 * DEEP:g} mm deep"),
    LegendStop(_RAMP[2], "touches"),
    LegendStop(_RAMP[3], f"{250 * FAR:g} mm away"),
    LegendStop(_RAMP[4], f"{1e3 * FAR:g} mm away or more"),
)


class HeatMap:
    """Colours every skin of a desk's scene by the objects of it: rigged surfaces by those without a rig."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._made_of: SeenScene | None = None
        self._overlay = Overlay()

    def check(self) -> None:
        """Raises CommandRejected where there is no skin, or nothing that it could touch."""
        skins, things = _parted(self._desk)
        if not skins or not things:
            missing = "object" if skins else "hand"
            raise CommandRejected(f"there is no {missing} here to measure distances with: open one.")

    def overlay(self, *, fresh: bool) -> Overlay:
        """The colours. fresh: measure anew where something has moved; else those from before."""
        if self._made_of is None or (fresh and self._made_of is not self._desk.scene):
            self._made_of = self._desk.scene
            self._overlay = Overlay(heats=self._measured())
        return self._overlay

    def _measured(self) -> tuple[SkinHeat, ...]:
        skins, things = _parted(self._desk)
        if not things:
            return ()
        meters = self._desk.scene.meters_per_unit
        found = ((skin.name, meters * distances_to(skin.points, things)) for skin in skins)
        return tuple(SkinHeat(name, distances, colors_of(distances)) for name, distances in found)


def distances_to(points: FloatArray, solids: tuple[SeenSurface, ...]) -> FloatArray:
    """(n,) of world points (n, 3): the distance to the nearest surface, below zero how deep in the solid that they
    are deepest in. World units; inside as `geometry.inside.depth_inside` has it."""
    near, deep = np.full(len(points), np.inf), np.zeros(len(points))
    for solid in solids:
        local = transform_points(solid.surface, points)
        near = np.minimum(near, solid.scale * Locator.of(solid.mesh).closest(local).distance)
        deep = np.maximum(deep, solid.scale * depth_inside(local, solid.mesh))
    return np.where(deep > 0.0, -deep, near)


def colors_of(distances: FloatArray) -> FloatArray:
    """(n, 3) RGB of distances (n,) in metres, depth below zero."""
    return np.stack([np.interp(distances, _STOPS, channel) for channel in np.transpose(_RAMP)], axis=1)


def legend_text() -> str:
    """The legend in words, for front ends that write lines."""
    names = ("orange", "", "white", "", "blue")
    return "skin: " + ", ".join(f"{name} {stop.text}" for name, stop in zip(names, LEGEND, strict=True) if name)


def _parted(desk: Desk) -> tuple[tuple[SeenSurface, ...], tuple[SeenSurface, ...]]:
    """Skins and things that are seen and have faces."""
    seen = [each for each in desk.scene.surfaces.values() if len(each.mesh.faces)]
    rigs = desk.session.rigs
    return tuple(s for s in seen if s.name in rigs), tuple(s for s in seen if s.name not in rigs)
