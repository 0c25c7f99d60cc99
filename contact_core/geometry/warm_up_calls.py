"""One small call of every geodesic kernel, with the array types that real calls have."""

from __future__ import annotations

import numpy as np

from contact_core.geometry.exact_geodesics import exact_geodesic
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.geometry.topology import Topology


def call_every_kernel() -> None:
    """Compile, or load, what topology, tracing, log map and tangent frames need."""
    # the last point doubles its neighbour
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0], [0, 1, 0]])
    mesh = TriangleMesh(points, [[0, 1, 2], [0, 2, 3], [3, 2, 4]])
    Topology.of(mesh)
    ends = SurfacePoints([0, 1], [[0.2, 0.5, 0.3], [0.3, 0.3, 0.4]])
    path = exact_geodesic(mesh, ends[0], ends[1])
    headings = np.array([path.heading, path.ending_heading])
    direction_to_heading(mesh, ends, heading_to_direction(mesh, ends, headings))
