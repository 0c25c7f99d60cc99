"""Hierarchy: a child is linked to its parent by a geodesic between two of their axis points.

The connected axes act as one axis with branches (paper, Hierarchical Composition): the link stores the geodesic's
angles relative to the parent's tangent, and the child's tangent relative to the geodesic's end.
"""

from __future__ import annotations

import numpy as np

from contact_core.contact.axis import Axis
from contact_core.contact.placement import Link, Root, Walk
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains


def link_to(
    mesh: TriangleMesh,
    parent: str,
    parent_axis: Axis,
    point: SurfacePoints,
    tangent: complex,
    *,
    parent_point: int = 0,
    own_point: int = 0,
) -> Link:
    """The link from a parent's axis point to one surface point where the child's axis has `tangent`.

    Raises InvalidInput when the two are not connected or the parent has no such axis point.
    """
    if not 0 <= parent_point < len(parent_axis):
        raise InvalidInput(f"the axis of {parent!r} has {len(parent_axis)} points, but got point {parent_point}.")
    log = log_map(mesh, parent_axis.points[parent_point], point)
    if log.anchor[0] < 0:
        raise InvalidInput(f"the child is not connected to {parent!r} over the surface.")
    base = complex(parent_axis.tangents[parent_point])
    if log.distance[0] == 0.0:  # one on the other: the link has no direction of its own
        return Link(parent, 0.0, (0.0,), (), float(np.angle(tangent / base)), parent_point, own_point)
    first = complex(log.first_leg[0])
    return Link(
        parent,
        float(np.angle(first / base)),
        (abs(first), *log.lengths.tolist()),
        tuple(log.turning_angles.tolist()),
        float(np.angle(tangent / complex(log.headings[0]))),
        parent_point,
        own_point,
    )


def follow_link(mesh: TriangleMesh, parent_axis: Axis, link: Link) -> tuple[SurfacePoints, complex, float]:
    """Where a link leads: the child's axis point, its tangent there, and the length that a boundary cut off."""
    base = complex(parent_axis.tangents[link.parent_point])
    start = parent_axis.points[link.parent_point]
    if sum(link.lengths) == 0.0:
        return start, base * complex(np.exp(1j * (link.direction + link.heading))), 0.0
    first = link.lengths[0] * base * np.exp(1j * link.direction)
    rest = np.array(link.lengths[1:])
    trace = trace_chains(mesh, start, np.array([first]), np.array([0, len(rest)]), np.array(link.turns), rest)
    tangent = complex(trace.headings[0]) * complex(np.exp(1j * link.heading))
    return trace.points, tangent, float(trace.remaining[0])


def follow_walk(mesh: TriangleMesh, walk: Walk) -> Root:
    """Where a walk ends."""
    start, first = walk.start, walk.start.heading * complex(np.exp(1j * walk.direction))
    if sum(walk.lengths) == 0.0:
        return start.heading_to(first * complex(np.exp(1j * walk.heading)))
    rest = np.array(walk.lengths[1:])
    offsets = np.array([0, len(rest)])
    trace = trace_chains(
        mesh, start.point(), np.array([walk.lengths[0] * first]), offsets, np.array(walk.turns), rest
    )
    return Root.at(trace.points, complex(trace.headings[0]) * complex(np.exp(1j * walk.heading)))
