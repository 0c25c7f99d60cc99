"""Across a mirror plane: where the other hand of a symmetric manipulator has the same root."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.contact.placement import Root
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction


def reflected(vectors: FloatArray, normal: Any, offset: float = 0.0) -> FloatArray:
    """Points or (with offset 0) directions (k, 3) reflected in the plane of points x with normal . x = offset."""
    n = frozen(normal, np.float64, (3,), "the normal of a mirror plane")
    largest = float(np.abs(n).max())
    length = largest * float(np.linalg.norm(n / (largest or 1.0)))
    if not 0.0 < length < np.inf:
        raise InvalidInput(f"the normal of a mirror plane is a direction, but got {n.tolist()}.")
    n = n / length
    return np.asarray(vectors - 2.0 * np.outer(vectors @ n - offset / length, n))


def mirrored_root(mesh: TriangleMesh, root: Root, normal: Any, offset: float = 0.0) -> tuple[Root, float]:
    """The root on the other side of a mirror plane, and how far its point lay from the surface.

    A patch placed there with its mirror flag turned is the mirror image, exactly so on a symmetric mesh.
    """
    point = root.point()
    direction = heading_to_direction(mesh, point, np.array([root.heading]))  # (1, 3)
    there = Locator.of(mesh).closest(reflected(point.positions(mesh), normal, offset))
    heading = direction_to_heading(mesh, there.points, reflected(direction, normal))
    return Root.at(there.points, complex(heading[0])), float(there.distance[0])
