"""Tracks of points, normals and vertices on the skin of a rig, and what carries normals."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig
from contact_core.rig.track import Track


def point_track(rig: Rig, points: SurfacePoints, first_bone: int = 0) -> Track:
    """The track of points on the skin of a rig; `first_bone` is the column of its first joint."""
    check_points(rig, points)
    corners = rig.bind_points[rig.faces[points.faces].ravel()]
    homogeneous = np.concatenate([corners, np.ones((len(corners), 1))], axis=1)  # (3k, 4)
    return _blend(rig, points, homogeneous, joint_from_bind(rig), first_bone)


def normal_track(rig: Rig, points: SurfacePoints, first_bone: int = 0) -> Track:
    """The track of the rigidly skinned normals at points on the skin.

    Each bone carries the interpolated vertex normal of the bound skin; within 7-17 degrees of the normal of
    the deformed mesh where the skin bends, equal to it elsewhere.
    """
    check_points(rig, points)
    normals = rig.bound_surface.normals_at(rig.faces[points.faces].ravel())  # (3k, 3)
    return _blend(rig, points, normals, outward_carrier(joint_from_bind(rig)), first_bone)


def vertex_track(rig: Rig, vertices: IntArray, first_bone: int = 0) -> Track:
    """The track of skin vertices (k,), exact also for vertices that no face uses."""
    homogeneous = np.concatenate([rig.bind_points[vertices], np.ones((len(vertices), 1))], axis=1)
    rows = np.repeat(np.arange(len(vertices)), rig.skin_joints.shape[1])
    weights = rig.skin_weights[vertices].ravel()
    joints = rig.skin_joints[vertices].ravel()
    return _gather(rows, joints, weights, homogeneous[rows], joint_from_bind(rig), len(vertices), first_bone)


def joint_track(joints: IntArray, local_points: FloatArray, first_bone: int = 0) -> Track:
    """The track of points (k, 3) fixed in the frames of joints (k,)."""
    homogeneous = np.concatenate([local_points, np.ones((len(local_points), 1))], axis=1)
    return Track.gathered(np.arange(len(joints)), np.asarray(joints) + first_bone, homogeneous, len(joints))


def joint_from_bind(rig: Rig) -> FloatArray:
    """(j, 4, 4) takes the bound skin into each joint's frame."""
    return np.asarray(np.linalg.inv(rig.bind_world), np.float64)


def outward_carrier(transforms: FloatArray) -> FloatArray:
    """(j, 3, 3) what carries outward normals under transforms (j, 4, 4): |det| times the inverse transpose.

    Equal to the rotation for rigid transforms; right under shear, and under mirroring by the geometry
    (the outside stays outside, although the winding flips).
    """
    x, y, z = (transforms[:, :3, i] for i in range(3))
    cofactor = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)  # (j, 3, 3)
    sign = np.sign(np.einsum("ja,ja->j", x, cofactor[:, :, 0]))
    return cofactor * sign[:, None, None]


def check_points(rig: Rig, points: SurfacePoints) -> None:
    """Raises InvalidInput for points on faces that the rig's skin does not have."""
    if len(points) and (points.faces.min() < 0 or points.faces.max() >= len(rig.faces)):
        raise InvalidInput(
            f"contacts on {rig.name} must lie on its {len(rig.faces)} faces, but got face"
            f" {int(points.faces.max())}; were they painted on another surface?"
        )


def _blend(rig: Rig, points: SurfacePoints, values: FloatArray, inverse_bind: FloatArray, first_bone: int) -> Track:
    """Rows sum_c barycentric_c sum_k weight_ck (inverse_bind_k @ value_c) of values (3k, width) at face corners."""
    influences = rig.skin_joints.shape[1]
    corners = rig.faces[points.faces].ravel()  # (3k,)
    weights = points.barycentric.ravel()[:, None] * rig.skin_weights[corners]  # (3k, K)
    rows = np.repeat(np.arange(len(points)), 3 * influences)
    spread = np.repeat(values, influences, axis=0)  # (3kK, width)
    joints = rig.skin_joints[corners].ravel()
    return _gather(rows, joints, weights.ravel(), spread, inverse_bind, len(points), first_bone)


def _gather(
    rows: IntArray,
    joints: IntArray,
    weights: FloatArray,
    values: FloatArray,
    inverse_bind: FloatArray,
    count: int,
    first_bone: int,
) -> Track:
    used = weights > 0.0
    rows, joints, weights, values = rows[used], joints[used], weights[used], values[used]
    carried = np.einsum("eab,eb->ea", inverse_bind[joints], values) * weights[:, None]  # (e, width)
    return Track.gathered(rows, joints + first_bone, carried, count)
