"""Brushes that pick existing vertices: by a radius, or those that the host has selected."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from contact_builtins.brushes.sampling import radius_of, stroke_line
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, log_map


class VertexBrush:
    """The paper's brush for dense meshes. On coarse ones the disk brush makes points of its own."""

    name = "vertices"
    summary = "the mesh's vertices within a radius of the stroke, over the surface"
    erases = False

    def mark(self, gesture: BrushGesture) -> BrushMark:
        radius = radius_of(gesture)
        line = stroke_line(gesture, 0.25 * radius)
        used = gesture.mesh.used_points
        at = line.positions(gesture.mesh)
        box = ((gesture.mesh.points[used] - at.min(axis=0)) >= -radius).all(axis=1)
        box &= ((gesture.mesh.points[used] - at.max(axis=0)) <= radius).all(axis=1)
        near = used[box]
        near = near[cKDTree(at).query(gesture.mesh.points[near])[0] <= radius] if len(near) else near
        points = SurfacePoints.at_vertices(gesture.mesh, near)
        reached = log_map(gesture.mesh, line, points, max_distance=radius).distance <= radius
        if not reached.any():
            raise InvalidInput(
                f"no vertex lies within {radius:.3g} of the stroke; enlarge the radius, or take the disk brush."
            )
        return BrushMark(points[reached], np.ones(int(reached.sum())))


class SelectionBrush:
    """What the host has selected (a Blender selection or vertex group, a USD GeomSubset) is the gesture's path."""

    name = "selection"
    summary = "exactly the points that the host has selected, each once"
    erases = False

    def mark(self, gesture: BrushGesture) -> BrushMark:
        if not len(gesture.path):
            raise InvalidInput("nothing is selected; select vertices in the host first.")
        points = stroke_line(gesture, np.inf)
        return BrushMark(points, np.ones(len(points)))
