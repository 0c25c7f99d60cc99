"""The bones of a rig as segments, and which of them owns a point of its skin."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Rig


def bone_segments(parents: IntArray, world: FloatArray) -> FloatArray:
    """(b, 2, 3) segments from each joint's parent to the joint, in the order of the joints that have one."""
    child = np.flatnonzero(parents >= 0)
    return np.stack([world[parents[child], :3, 3], world[child, :3, 3]], axis=1)


def bones_of(rig: Rig, points: SurfacePoints) -> tuple[FloatArray, IntArray]:
    """Bones (b, 2, 3) of a rig at rest, and the bone that owns each of the points (n,), -1 for none.

    A bone runs from a joint to its first child; the skin of a joint belongs to that bone, and the skin of a last
    joint to the bone that ends there.
    """
    child = np.flatnonzero(rig.parents >= 0)
    bone_of_joint = np.full(len(rig.joints), -1)
    for bone in reversed(range(len(child))):
        bone_of_joint[rig.parents[child[bone]]] = bone
    for joint, parent in enumerate(rig.parents):
        if bone_of_joint[joint] < 0 and parent >= 0:
            bone_of_joint[joint] = bone_of_joint[parent]
    corners = rig.faces[points.faces]  # (n, 3)
    strength = np.zeros((len(points), len(rig.joints)))
    for corner in range(3):
        weights = points.barycentric[:, corner, None] * rig.skin_weights[corners[:, corner]]  # (n, K)
        np.add.at(strength, (np.arange(len(points))[:, None], rig.skin_joints[corners[:, corner]]), weights)
    return bone_segments(rig.parents, rig.rest_world), bone_of_joint[strength.argmax(axis=1)]
