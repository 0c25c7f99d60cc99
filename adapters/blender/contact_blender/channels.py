"""Pose bones' channels (location, rotation in the bone's mode, scale) as matrices and back, without a depsgraph.

A bone's `matrix_basis` is translation @ rotation @ scale. It is computed here in double precision: Blender's own
matrix carries single precision noise, which would count as scale. Writing `PoseBone.matrix` instead needs the
parents evaluated in between, and a loop over a finger is then wrong by a whole joint.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput

ROTATION_CHANNEL = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
CHANNELS = ("location", "rotation_quaternion", "rotation_axis_angle", "rotation_euler", "scale")
_ALIKE = 2e-6  # of a basis' entries, and of the length of its bone
_NOTHING = 1e-6  # a change of a scale or of a length (relative) that single precision makes by itself


def rotation_channel(pose_bone: Any) -> str:
    """The channel that a bone's rotation mode uses."""
    return ROTATION_CHANNEL.get(pose_bone.rotation_mode, "rotation_euler")


def read_basis(pose_bone: Any) -> FloatArray:
    """(4, 4) what the bone's channels make of it in its rest frame. A connected bone's location does nothing."""
    basis = np.eye(4)
    basis[:3, :3] = _read_rotation(pose_bone) * np.array(pose_bone.scale, float)
    if not pose_bone.bone.use_connect:
        basis[:3, 3] = pose_bone.location
    return basis


def write_basis(pose_bone: Any, basis: FloatArray) -> tuple[str, ...]:
    """Set the bone's channels to a basis (4, 4); the names of the channels that a key must hold.

    Rotation always; location and scale where they change. Angles stay near those of before, so that curves do
    not jump by a whole turn. Raises InvalidInput on shear, a mirror, and a shift of a connected bone.
    """
    scale = np.linalg.norm(basis[:3, :3], axis=0)  # (3,)
    rotation = basis[:3, :3] / np.where(scale > 0.0, scale, 1.0)
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-4 or np.linalg.det(rotation) <= 0.0:
        raise InvalidInput(
            f"bone {pose_bone.name!r} cannot take a pose with shear or a mirror: it has no such channel."
        )
    shift = np.abs(basis[:3, 3] - read_basis(pose_bone)[:3, 3]).max()
    length = float(pose_bone.bone.length)
    if pose_bone.bone.use_connect and shift > 1e-4 * length:
        raise InvalidInput(
            f"bone {pose_bone.name!r} is connected to its parent and cannot be shifted by {shift:.3g};"
            " disconnect it in Edit Mode or pose it by rotation alone."
        )
    written = [_write_rotation(pose_bone, Rotation.from_matrix(rotation))]
    if not pose_bone.bone.use_connect and (shift > _NOTHING * length or pose_bone.parent is None):
        pose_bone.location = basis[:3, 3].tolist()
        written.append("location")
    if np.abs(scale - np.array(pose_bone.scale)).max() > _NOTHING:
        pose_bone.scale = scale.tolist()
        written.append("scale")
    return tuple(written)


def is_there(pose_bone: Any, basis: FloatArray) -> bool:
    """Whether a bone's channels say this basis (4, 4) already, to single precision."""
    size = np.where(np.arange(4) == 3, max(1.0, float(pose_bone.bone.length)), 1.0)  # (4,) columns
    return bool((np.abs(basis - np.array(pose_bone.matrix_basis)) <= _ALIKE * size).all())


def snapshot(pose_bone: Any) -> Callable[[Any], None]:
    """What puts all channels of a bone back bit for bit, given the bone anew."""
    values = {channel: tuple(getattr(pose_bone, channel)) for channel in CHANNELS}
    mode = pose_bone.rotation_mode

    def restore(again: Any) -> None:
        again.rotation_mode = mode
        for channel, value in values.items():
            setattr(again, channel, value)

    return restore


def _read_rotation(pose_bone: Any) -> FloatArray:
    """(3, 3) of the channel that counts."""
    mode = pose_bone.rotation_mode
    if mode == "QUATERNION":
        w, x, y, z = pose_bone.rotation_quaternion
        return np.eye(3) if w == x == y == z == 0.0 else Rotation.from_quat([x, y, z, w]).as_matrix()
    if mode == "AXIS_ANGLE":
        angle, *axis = pose_bone.rotation_axis_angle
        length = float(np.linalg.norm(axis))
        return Rotation.from_rotvec(np.array(axis) * (angle / length if length else 0.0)).as_matrix()
    places = ["XYZ".index(axis) for axis in mode]
    return Rotation.from_euler(mode.lower(), np.array(pose_bone.rotation_euler)[places]).as_matrix()


def _write_rotation(pose_bone: Any, rotation: Rotation) -> str:
    """Set the rotation in the bone's mode; the channel's name."""
    channel = rotation_channel(pose_bone)
    before = np.array(getattr(pose_bone, channel), float)
    setattr(pose_bone, channel, near_angles(pose_bone.rotation_mode, rotation, before).tolist())
    return channel


def near_angles(mode: str, rotation: Rotation, before: FloatArray) -> FloatArray:
    """(w,) a rotation as the channel of a mode has it, by the numbers nearest to those of before (w,)."""
    if mode == "QUATERNION":
        wxyz = rotation.as_quat()[[3, 0, 1, 2]]
        return np.asarray(-wxyz if wxyz @ before < 0.0 else wxyz)
    if mode == "AXIS_ANGLE":
        vector = rotation.as_rotvec()
        angle = float(np.linalg.norm(vector))
        axis = vector / angle if angle > 0.0 else np.array([0.0, 1.0, 0.0])
        sign = -1.0 if axis @ before[1:] < 0.0 else 1.0
        turns = round((before[0] - sign * angle) / (2.0 * np.pi))
        return np.array([sign * angle + 2.0 * np.pi * turns, *(sign * axis)])
    places = ["XYZ".index(axis) for axis in mode]
    angles = np.empty(3)
    with warnings.catch_warnings():  # in gimbal lock any split of the two turns is right
        warnings.simplefilter("ignore", UserWarning)
        angles[places] = _near(rotation.as_euler(mode.lower()), before[places])
    return angles


def _near(angles: FloatArray, before: FloatArray) -> FloatArray:
    """(3,) the same rotation by the Euler angles nearest to those of before: the other triple, and whole turns."""
    first, second, third = angles
    triples = np.array([angles, [first + np.pi, np.pi - second, third + np.pi]])  # (2, 3)
    triples += 2.0 * np.pi * np.round((before - triples) / (2.0 * np.pi))
    return triples[np.abs(triples - before).sum(axis=1).argmin()]
