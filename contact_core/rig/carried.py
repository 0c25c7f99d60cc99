"""Another surface on the same skeleton: weights carried over from the skin at its closest points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.rig.rig import Rig


def carried(rig: Rig, mesh: TriangleMesh) -> Rig:
    """The rig with a mesh near its rest surface as its skin, in the same joints.

    Each point takes the weights of the closest point of the skin, blended over the corners of its face, as many as
    the skin has. It is bound so that the rest pose gives the mesh exactly.
    """
    feet = Locator.of(rig.surface).closest(mesh.points).points
    corners = rig.faces[feet.faces]  # (n, 3)
    joints = rig.skin_joints[corners].reshape(len(mesh.points), -1)  # (n, 3 K)
    weights = (feet.barycentric[:, :, None] * rig.skin_weights[corners]).reshape(joints.shape)
    joints, weights = _strongest(joints, weights, rig.skin_joints.shape[1])
    moves = (rig.rest_world @ np.linalg.inv(rig.bind_world))[:, :3]  # (j, 3, 4)
    blend = np.einsum("nk,nkij->nij", weights, moves[joints])  # (n, 3, 4)
    bound = np.linalg.solve(blend[:, :, :3], (mesh.points - blend[:, :, 3])[..., None])[..., 0]
    return replace(rig, bind_points=bound, faces=mesh.faces, skin_joints=joints, skin_weights=weights)


def _strongest(joints: IntArray, weights: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """(n, count) the strongest influences out of (n, k) that may name a joint several times; they sum to 1."""
    order = np.argsort(joints, axis=1, kind="stable")
    joints, weights = np.take_along_axis(joints, order, 1), np.take_along_axis(weights, order, 1)
    for column in range(joints.shape[1] - 1):  # each joint's sum goes to its last column
        same = joints[:, column] == joints[:, column + 1]
        weights[:, column + 1] += np.where(same, weights[:, column], 0.0)
        weights[:, column] = np.where(same, 0.0, weights[:, column])
    first = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    joints, weights = np.take_along_axis(joints, first, 1), np.take_along_axis(weights, first, 1)
    return joints, weights / weights.sum(axis=1, keepdims=True)
