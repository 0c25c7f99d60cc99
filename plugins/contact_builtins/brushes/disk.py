"""The disk brush and the eraser: everything within a radius of the stroke, measured over the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

import numpy as np

from contact_builtins.brushes.sampling import radius_of, spacing_of, spread, stroke_line
from contact_core.arrays import FloatArray
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.settings import HasSettings, setting

Falloff: TypeAlias = Literal["none", "linear", "smooth"]


@dataclass(frozen=True)
class DiskBrush(HasSettings):
    """Even points with a spacing of their own, whatever the mesh's density."""

    name: ClassVar[str] = "disk"
    summary: ClassVar[str] = "even points within a radius of the stroke, over the surface"
    erases: ClassVar[bool] = False
    falloff: Falloff = setting("none", help="how the strength falls from the stroke to the radius")

    def mark(self, gesture: BrushGesture) -> BrushMark:
        radius = radius_of(gesture)
        line = stroke_line(gesture, 0.25 * radius)
        points, distance = spread(gesture.mesh, line, radius, spacing_of(gesture, radius), gesture.seed)
        return BrushMark(points, _strength(distance / radius, self.falloff))


class Eraser(DiskBrush):
    """The same marks; what they cover is taken away."""

    name: ClassVar[str] = "eraser"
    summary: ClassVar[str] = "takes away what lies within a radius of the stroke"
    erases: ClassVar[bool] = True


def _strength(part: FloatArray, falloff: Falloff) -> FloatArray:
    """(n,) 1 on the stroke; part: (n,) 0 on the stroke, 1 at the radius."""
    rest = 1.0 - np.clip(part, 0.0, 1.0)
    if falloff == "none":
        return np.ones_like(rest)
    if falloff == "linear":
        return rest
    return np.asarray(rest * rest * (3.0 - 2.0 * rest))
