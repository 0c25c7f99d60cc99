"""What of a surface is inside solids: depth and area, by generalised winding number."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator


class Sunk(NamedTuple):
    """How a surface is sunk into solids. depths: (n,) of each vertex, 0 outside. deepest: the largest. share: of
    the area, a third of each face to each of its corners."""

    depths: FloatArray
    deepest: float
    share: float

    @classmethod
    def of(cls, surface: TriangleMesh, depths: FloatArray) -> Sunk:
        """Out of the depths (n,) of its vertices."""
        area = np.zeros(len(depths))
        np.add.at(area, surface.faces.ravel(), np.repeat(surface.face_areas / 3.0, 3))
        inside = float(area[depths > 0].sum() / max(area.sum(), 1e-300))
        return cls(depths, float(depths.max(initial=0.0)), inside)


def depth_inside(points: FloatArray, solid: TriangleMesh) -> FloatArray:
    """(n,) distance to the surface for points inside a solid by generalised winding number > 0.5, else 0."""
    used = solid.points[solid.used_points]
    near = ((points >= used.min(axis=0)) & (points <= used.max(axis=0))).all(axis=1)
    depth = np.zeros(len(points))
    locator = Locator.of(solid)
    inside = np.flatnonzero(near)
    inside = inside[locator.winding_number(points[inside]) > 0.5] if len(inside) else inside
    if len(inside):
        depth[inside] = locator.closest(points[inside]).distance
    return depth
