"""The contact models that the paper compares with its own, small references from their papers' words.

One log map from a single point (Lakshmipathy et al. 2022), and the boundary alone, traced as a closed chain
(Lakshmipathy et al. 2021). Both start where the axis model puts the same points, so that only the model differs.
"""

from __future__ import annotations

import numpy as np

from contact_core.contact.area import measure_area
from contact_core.contact.axis import Axis, draw_axis, reconstruct_axis
from contact_core.contact.linkage import follow_link, link_to
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains


def single_point(
    mesh: TriangleMesh, points: SurfacePoints, axis: Axis, target: TriangleMesh, placed: Axis
) -> SurfacePoints:
    """n points by one log map from the middle of their axis, traced, mirrored, from where `placed` has it."""
    middle, n = len(axis) // 2, len(points)
    log = log_map(mesh, axis.points[middle], points)
    legs = np.conj(log.first_leg / axis.tangents[middle]) * placed.tangents[middle]
    starts = placed.points[np.full(n, middle)]
    return trace_chains(target, starts, legs, log.offsets, -log.turning_angles, log.lengths).points


def boundary_alone(
    mesh: TriangleMesh, points: SurfacePoints, axis: Axis, shape: PatchShape, target: TriangleMesh, placed: Axis
) -> tuple[Axis, float]:
    """The boundary loop of a patch as a chain of lengths and turns, traced, mirrored, on the target; and its
    length.

    It starts where `placed` puts its first point. On a curved target it does not close: last and first point of
    what is returned should be one, and are not.
    """
    loop = max(measure_area(shape, points.positions(mesh)).boundary, key=len)
    chain, drawn = draw_axis(mesh, points[[*loop, loop[0]]], dense=False)
    way = link_to(mesh, "axis", axis, drawn.points[0], complex(drawn.tangents[0]))
    point, tangent, _ = follow_link(target, placed, way.mirrored())
    return reconstruct_axis(target, chain.transformed(mirrored=True), Root.at(point, tangent)), chain.length
