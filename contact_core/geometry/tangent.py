"""Directions on a surface: between vectors in space and headings, unit complex numbers in a point's tangent frame.

Conventions: see `tangent_kernels`. A rotation by `angle` (radians, counter-clockwise seen from outside) of a
heading is a multiplication by exp(i angle).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology
from contact_core.geometry.tracing import require_on_surface


def direction_to_heading(mesh: TriangleMesh, points: SurfacePoints, directions: Any) -> ComplexArray:
    """Headings (k,) nearest to directions in space (k, 3), not zero, at surface points (k).

    On an edge or a vertex each direction goes to the face beside the point that it agrees with best; a direction
    that lies in a face keeps its angle there exactly. Raises InvalidInput.
    """
    from contact_core.geometry.direction_kernels import headings_of_directions

    wanted = frozen(directions, np.float64, (len(points), 3), "directions")
    if not wanted.any(axis=1).all():
        raise InvalidInput(f"directions must not be zero, but number {int(np.argmin(wanted.any(axis=1)))} is.")
    topology = Topology.of(mesh)
    require_on_surface(topology, points, "points")
    headings = np.empty(len(points), np.complex128)
    blocked = headings_of_directions(
        mesh.points, mesh.faces, points.arrays, wanted,
        headings.view(np.float64).reshape(-1, 2), topology.halfedges,
    )  # fmt: skip
    if blocked >= 0:
        raise topology.refuse_halfedge(blocked, "a tangent frame")
    headings.setflags(write=False)
    return headings


def heading_to_direction(mesh: TriangleMesh, points: SurfacePoints, headings: Any) -> FloatArray:
    """Unit directions in space (k, 3) in which walks along headings (k,) leave surface points (k).

    At an edge or a vertex the direction lies in the face that the walk enters. Raises InvalidInput.
    """
    from contact_core.geometry.direction_kernels import directions_of_headings

    wanted = frozen(np.asarray(headings, np.complex128), np.complex128, (len(points),), "headings")
    topology = Topology.of(mesh)
    require_on_surface(topology, points, "points")
    directions = np.empty((len(points), 3))
    blocked = directions_of_headings(
        mesh.points, mesh.faces, points.arrays, wanted.view(np.float64).reshape(-1, 2),
        directions, topology.halfedges,
    )  # fmt: skip
    if blocked >= 0:
        raise topology.refuse_halfedge(blocked, "a tangent frame")
    directions.setflags(write=False)
    return directions
