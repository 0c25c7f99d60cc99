"""The bones of a rig as segments, and which of them owns a point of its skin."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.raycast import Locator
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


def skin_point(rig: Rig, joint: str, along: float = 0.5, toward: Any = "palm") -> SurfacePoints:
    """One point of the skin at rest: where a ray from a bone leaves it, or its closest where it does not.

    along: where on the bone from the joint to its first child the ray starts, as a fraction. toward: the direction
    (3,) in rig space, or "palm" for the palmar side of the joint's own flexion. Raises InvalidInput for a joint
    that there is not, or that does not tell its palm side.
    """
    j = rig.joint_index(joint)
    children = np.flatnonzero(rig.parents == j)
    head = rig.rest_world[j, :3, 3]
    if len(children):
        bone = rig.rest_world[children[0], :3, 3] - head
    else:  # the last joint goes on as its parent did
        bone = head - rig.rest_world[rig.parents[j], :3, 3] if rig.parents[j] >= 0 else np.zeros(3)
    if isinstance(toward, str):  # the palmar side: second axis of the frame in which the joint flexes
        freedom = rig.freedoms[j]
        if freedom.kind not in ("hinge", "euler"):
            raise InvalidInput(
                f'joint {joint!r} has no flexion that tells its palm side; give toward = [x, y, z], not "palm".'
            )
        toward = (rig.rest_world[j, :3, :3] @ freedom.frame)[:, 1]
    origin, locator = (head + along * bone)[None], Locator.of(rig.surface)
    hit = locator.cast(origin, np.asarray(toward, float)[None])
    return hit.points if hit.found[0] else locator.closest(origin).points
