"""Where the tutorial's strokes go, on the built-in hand (`sample:human_hand`) and mug (`sample:mug`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.rig.rig import Rig

_PALM = (0.0, 0.0, 1.0)  # where the palm looks
_ASIDE = -0.0045  # metres to the left of the thumb's bones, where its pad is
_WALL = 0.041  # metres, the outer radius of the mug


@dataclass(frozen=True)
class Mark:
    """A line to drag along. Its places are brought to the skin against `toward`, a unit direction (3,) in the space
    of the surface, from `off` metres outside.

    joints: places along the bones between these joints, from a share `start` of the first bone on. wall: places by
    angle (degrees from the mug's handle towards the palm) and height (metres). aside: metres along x.
    """

    joints: tuple[str, ...] = ()
    start: float = 0.4
    aside: float = 0.0
    wall: tuple[tuple[float, float], ...] = ()
    off: float = 0.05

    @property
    def on_hand(self) -> bool:
        """Whether it lies on the hand."""
        return bool(self.joints)

    @property
    def toward(self) -> FloatArray:
        """Unit (3,), from which side the skin is met."""
        if self.on_hand:
            return np.array(_PALM)
        angles = np.radians([angle for angle, _ in self.wall])
        return _round(float(angles.mean()))

    def places(self, rig: Rig | None) -> FloatArray | None:
        """(k, 3) in the space of the surface; None where a rig has no such joints."""
        if not self.on_hand:
            return np.array([_WALL * _round(np.radians(angle)) + [0.0, height, 0.0] for angle, height in self.wall])
        if rig is None or not set(self.joints) <= set(rig.joints):
            return None
        ends = [np.asarray(rig.rest_world[rig.joint_index(name), :3, 3]) for name in self.joints]
        ends[0] = ends[0] + self.start * (ends[1] - ends[0])
        path = [*ends[:-1], *(ends[-2] + share * (ends[-1] - ends[-2]) for share in (0.1, 0.5, 0.9))]
        shares = np.arange(0.0, len(path) - 1 + 1e-9, 0.25)  # close enough for a line that stays on the skin
        axes = [np.interp(shares, np.arange(len(path)), coordinate) for coordinate in np.array(path).T]
        return np.stack(axes, axis=1) + np.array([self.aside, 0.0, 0.0])


def _round(angle: float) -> FloatArray:
    return np.array([np.cos(angle), 0.0, np.sin(angle)])


def _finger(name: str) -> Mark:
    return Mark((f"{name}_intermediate", f"{name}_distal", f"{name}_tip"))


def _across(angle: float, height: float, by: float) -> Mark:
    """Over the mug's wall, level."""
    return Mark(wall=tuple((angle + share * by, height) for share in np.linspace(0.0, 1.0, 13)))


def along_wall(place: FloatArray, by: float) -> Mark:
    """From a place (3,) of the mug's wall on, level. by: degrees."""
    return _across(float(np.degrees(np.arctan2(place[2], place[0]))), float(place[1]), by)


THUMB = 2  # of the strokes that are painted
EDIT = 8.0  # degrees by which its contact is moved
MARKS: Mapping[str, tuple[Mark, ...]] = {
    "paint": (
        _finger("middle"),
        _finger("ring"),
        Mark(("thumb_distal", "thumb_tip"), start=0.1, aside=_ASIDE),
        _finger("index"),
    ),
    "axis": (_finger("index"),),
    "transfer": (
        _across(84.0, 0.054, -20.0),
        _across(90.0, 0.033, -20.0),
        _across(254.0, 0.070, 16.0),
        _across(92.0, 0.085, -20.0),
    ),
}
