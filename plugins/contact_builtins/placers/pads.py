"""Pads: patches of a posed hand as a placer sees them, and how one is laid onto a point of the object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_builtins.placers.hand_pose import HandPose
from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.geometry.tracing import trace_geodesic
from contact_core.plugins.slots import PatchPlacement, PlacementRequest


@dataclass(frozen=True, eq=False)
class Pad:
    """A patch on the posed skin, object space. centre: (3,) middle of its axis. normal: (3,) outward.
    direction: (3,) from the axis' first point to its last. to_root: length of the axis before the middle."""

    centre: FloatArray
    normal: FloatArray
    direction: FloatArray
    to_root: float


def pads_of(request: PlacementRequest, hand: HandPose) -> dict[str, Pad]:
    """The pads of a hand by patch name."""
    skin, rest = hand.skin(), request.rig.surface
    scale = float(np.cbrt(abs(np.linalg.det(request.object_from_rig[:3, :3]))))
    return {name: _pad(axis, skin, rest, scale) for name, axis in request.patch_axes.items()}


def _pad(axis: SurfacePoints, skin: TriangleMesh, rest: TriangleMesh, scale: float) -> Pad:
    line, normals, flat = axis.positions(skin), axis.normals(skin), axis.positions(rest)
    steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)  # lengths on the surface that the axis was drawn on
    along = np.concatenate([[0.0], np.cumsum(steps)])  # (a,)
    middle = 0.5 * along[-1]
    centre = np.array([np.interp(middle, along, line[:, k]) for k in range(3)])
    normal = np.array([np.interp(middle, along, normals[:, k]) for k in range(3)])
    direction = line[-1] - line[0]
    return Pad(centre, _unit(normal), _unit(direction), scale * float(middle))


def place_pad(mesh: TriangleMesh, pad: Pad, at: SurfacePoints) -> PatchPlacement:
    """Lay a pad's middle on a point `at` (one) of the object, its axis along the pad's projected direction.

    The patch is rooted at the axis' first point, so the root is found by walking back from the middle.
    """
    normal = mesh.face_normals[at.faces[0]]
    direction = pad.direction - (pad.direction @ normal) * normal
    if np.linalg.norm(direction) < 1e-6:  # the pad stands upright on the surface: any direction will do
        direction = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    heading = direction_to_heading(mesh, at, _unit(direction)[None])  # (1,) complex
    back = trace_geodesic(mesh, at, -heading * pad.to_root)
    return PatchPlacement(back.points, heading_to_direction(mesh, back.points, -back.headings)[0])


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-300))
