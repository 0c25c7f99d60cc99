"""Flexion axes: by the palm for fingers, by the joints' own axes where one lies near, towards the axis for claws.

Guessing from the curl of the rest pose was 8 to 76 degrees off on a real hand, the knuckle line 0 to 11 (ADR 0042).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.hands.anatomy import Anatomy, across, unit
from contact_core.hands.description import DigitBone, Segment
from contact_core.hands.digits import bones_of
from contact_core.hands.hubs import Limb

SNAP = np.cos(np.radians(25.0))
Habit = tuple[int, int, float]  # own axes that serve as bone and as flexion axis, and the sign of the latter
NO_HABIT: Habit = (-1, -1, 0.0)
SEGMENTS: tuple[Segment, ...] = ("metacarpal", "proximal", "intermediate", "distal")


def segments(count: int, metacarpal: bool, thumb: bool) -> list[Segment]:
    """Names of a digit's bones from the palm outwards; what there is too much of is intermediate."""
    if thumb:
        return [("metacarpal", "proximal", "distal")[max(0, 3 - count + k)] if k >= count - 3 else "metacarpal"
                for k in range(count)]  # fmt: skip
    if metacarpal:
        return ["metacarpal", *segments(count - 1, False, False)]
    return [SEGMENTS[1 + min(k, 2)] if count <= 3 or k < 2 else ("distal" if k == count - 1 else "intermediate")
            for k in range(count)]  # fmt: skip


def finger_bones(
    anatomy: Anatomy, limb: Limb, closing: FloatArray, names: Sequence[Segment]
) -> tuple[tuple[DigitBone, ...], list[Habit]]:
    """Bones of a digit that closes towards `closing` (3,) in rig space, and the own axes that served."""
    bones, habits = [], []
    for joint, bone, segment in zip(limb.joints, bones_of(anatomy, limb), names, strict=True):
        flexion = np.cross(bone, across(closing, bone))
        own = anatomy.rig.rest_world[joint, :3, :3]
        if anatomy.rig.freedoms[joint].kind == "hinge":
            bones.append(hinge_bone(anatomy, joint, bone, flexion, segment))
            continue
        frame, habit = snapped_frame(own, bone, flexion)
        bones.append(DigitBone(joint, segment, frame, segment != "metacarpal"))
        habits += [habit] if segment != "metacarpal" else []
    return tuple(bones), habits


def hinge_bone(anatomy: Anatomy, joint: int, bone: FloatArray, flexion: FloatArray, segment: Segment) -> DigitBone:
    """A robot's joint: it flexes about its hinge where that is near the flexion axis."""
    own = anatomy.rig.rest_world[joint, :3, :3]
    axis = own @ anatomy.rig.freedoms[joint].frame[:, 0]
    near = float(axis @ unit(flexion))
    if abs(near) < np.cos(np.radians(50.0)) or abs(axis @ bone) > 0.8:
        return DigitBone(joint, segment, orthonormal(own.T @ bone, own.T @ flexion), flexes=False)
    z = own.T @ (axis * np.sign(near))
    return DigitBone(joint, segment, orthonormal_z(own.T @ bone, z))


def thumb_bones(
    anatomy: Anatomy, limb: Limb, target: FloatArray, habit: Habit, names: Sequence[Segment]
) -> tuple[DigitBone, ...]:
    """Bones of a thumb that closes towards the point `target` (3,): about the own axis that served the fingers
    where that closes it, else square to the bone and to the way to the target."""
    if anatomy.rig.freedoms[limb.joints[-1]].kind == "hinge":
        return _hinged_thumb(anatomy, limb, target, names)
    bones = []
    for joint, bone, segment in zip(limb.joints, bones_of(anatomy, limb), names, strict=True):
        own = anatomy.rig.rest_world[joint, :3, :3]
        towards = unit(across(target - anatomy.position[joint], bone))
        frame, _ = snapped_frame(own, bone, np.cross(bone, towards))
        if habit[0] >= 0:
            x, z = snapped(own.T @ bone), np.eye(3)[habit[1]] * habit[2]
            if abs(x @ z) < 0.5 and own @ np.cross(z, x) @ towards > 0.2:
                frame = orthonormal(x, z)
        bones.append(DigitBone(joint, segment, frame))
    return tuple(bones)


def _hinged_thumb(
    anatomy: Anatomy, limb: Limb, target: FloatArray, names: Sequence[Segment]
) -> tuple[DigitBone, ...]:
    """A robot's thumb: the joints parallel to its last hinge bend it, the way that brings the tip to the target."""
    last = limb.joints[-1]
    axis = anatomy.rig.rest_world[last, :3, :3] @ anatomy.rig.freedoms[last].frame[:, 0]
    lever = limb.tip - anatomy.position[last]
    axis = axis if np.cross(axis, lever) @ (target - limb.tip) >= 0 else -axis
    return tuple(
        hinge_bone(anatomy, joint, bone, axis, segment)
        for joint, bone, segment in zip(limb.joints, bones_of(anatomy, limb), names, strict=True)
    )


def common_habit(habits: list[Habit]) -> Habit:
    """The own axes that served more than half of the fingers' joints."""
    if not habits:
        return NO_HABIT
    habit = max(set(habits), key=habits.count)
    return habit if habits.count(habit) > len(habits) // 2 else NO_HABIT


def snapped_frame(own: FloatArray, bone: FloatArray, flexion: FloatArray) -> tuple[FloatArray, Habit]:
    """(3, 3) frame in joint axes from directions in rig space, and the own axes that it took where near."""
    local_bone, local_flexion = own.T @ bone, own.T @ flexion
    square = unit(across(local_flexion, unit(local_bone)))
    x_axis, z_axis = int(np.abs(local_bone).argmax()), int(np.abs(square).argmax())
    near = abs(local_bone[x_axis]) > SNAP and abs(square[z_axis]) > SNAP and x_axis != z_axis
    if not near:
        return orthonormal(local_bone, square), NO_HABIT
    sign = float(np.sign(square[z_axis]))
    x = np.eye(3)[x_axis] * np.sign(local_bone[x_axis])
    return orthonormal(x, np.eye(3)[z_axis] * sign), (x_axis, z_axis, sign)


def snapped(local: FloatArray) -> FloatArray:
    """(3,) a direction in joint axes, or the own axis that lies within 25 degrees of it."""
    axis = int(np.abs(local).argmax())
    return np.eye(3)[axis] * np.sign(local[axis]) if abs(local[axis]) > SNAP else np.asarray(local)


def orthonormal(x: FloatArray, z: FloatArray) -> FloatArray:
    """(3, 3) right-handed columns x, y, z with x kept and z made square to it."""
    x = unit(x)
    z = across(z, x)
    if np.linalg.norm(z) < 1e-9:
        z = across(np.eye(3)[int(np.abs(x).argmin())], x)
    z = unit(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def orthonormal_z(x: FloatArray, z: FloatArray) -> FloatArray:
    """(3, 3) right-handed columns x, y, z with z kept and x made square to it."""
    z = unit(z)
    x = unit(across(x, z))
    return np.stack([x, np.cross(z, x), z], axis=1)
