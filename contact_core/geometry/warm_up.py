"""Compile every geodesic kernel, or load it, before somebody waits for it."""

from __future__ import annotations

import time

import numpy as np

from contact_core.geometry.exact_geodesics import exact_geodesic
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.sound import sound_polygons
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.geometry.thinning import first_of_each, meeting, spacing_of
from contact_core.geometry.topology import Topology
from contact_core.geometry.triangulate import triangulate


def warm_up() -> float:
    """One small call of every kernel, with the array types that real calls have; returns the seconds it took."""
    start = time.perf_counter()
    # the last point doubles its neighbour
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0], [0, 1, 0]])
    mesh = TriangleMesh(points, [[0, 1, 2], [0, 2, 3], [3, 2, 4]])
    Topology.of(mesh)
    ends = SurfacePoints([0, 1], [[0.2, 0.5, 0.3], [0.3, 0.3, 0.4]])
    path = exact_geodesic(mesh, ends[0], ends[1])
    headings = np.array([path.heading, path.ending_heading])
    direction_to_heading(mesh, ends, heading_to_direction(mesh, ends, headings))
    first_of_each(points, 0.1)
    sound_polygons(points, [3, 3, 3], mesh.faces.ravel())
    triangulate([5], [0, 1, 2, 3, 4], points)
    meeting(mesh.points, mesh.points, 0.1, spacing_of(mesh.points, 2))
    return time.perf_counter() - start
