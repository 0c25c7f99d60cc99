"""The disk brush and the eraser: everything within a radius of the stroke, measured over the surface."""

from __future__ import annotations

import numpy as np

from contact_builtins.brushes.sampling import radius_of, spacing_of, spread, stroke_line
from contact_core.arrays import FloatArray
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.errors import InvalidInput

FALLOFFS = ("none", "linear", "smooth")


class DiskBrush:
    """Even points with a spacing of their own, whatever the mesh's density. Option `falloff`: none (default),
    linear or smooth, from the stroke to the radius."""

    name = "disk"
    summary = "even points within a radius of the stroke, over the surface"
    erases = False

    def mark(self, gesture: BrushGesture) -> BrushMark:
        radius = radius_of(gesture)
        line = stroke_line(gesture, 0.25 * radius)
        points, distance = spread(gesture.mesh, line, radius, spacing_of(gesture, radius), gesture.seed)
        return BrushMark(points, _strength(distance / radius, gesture.options.get("falloff", "none")))


class Eraser(DiskBrush):
    """The same marks; what they cover is taken away."""

    name = "eraser"
    summary = "takes away what lies within a radius of the stroke"
    erases = True


def _strength(part: FloatArray, falloff: object) -> FloatArray:
    """(n,) 1 on the stroke; part: (n,) 0 on the stroke, 1 at the radius."""
    rest = 1.0 - np.clip(part, 0.0, 1.0)
    if falloff == "none":
        return np.ones_like(rest)
    if falloff == "linear":
        return rest
    if falloff == "smooth":
        return np.asarray(rest * rest * (3.0 - 2.0 * rest))
    raise InvalidInput(f"a falloff is one of {', '.join(FALLOFFS)}, but {falloff!r} came.")
