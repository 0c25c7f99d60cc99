"""Poses at frames, and what lies between them: straight blends, or cubic curves as animation programs draw them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.rig.chart import pose_on
from contact_core.rig.rig import Pose, Rig
from contact_core.rig.rotations import exponential, nearest_rotations


@dataclass(frozen=True, eq=False)
class PoseKeys:
    """Poses at frames, in order. Immutable: `with_key` returns new keys.

    speeds: per key (j, 6) for the j joints that its pose names: how its translation moves (units per frame, in the
    parent's frame) and how it turns (radians per frame, in its own frame). With them the keys are joined by cubic
    curves (Hermite, smooth at the keys), without them by straight blends. Between keys a cubic rotation is the
    normalised Hermite curve of quaternions with aligned signs, as in glTF CUBICSPLINE and in curves of quaternion
    channels; scale and shear are blended straight.
    """

    rig: str
    frames: tuple[float, ...] = ()
    poses: tuple[Pose, ...] = ()
    speeds: tuple[FloatArray, ...] = ()

    def __post_init__(self) -> None:
        if len(self.frames) != len(self.poses) or list(self.frames) != sorted(set(self.frames)):
            raise InvalidInput(
                f"keys need one pose per frame and rising frames, but got {len(self.poses)} poses at"
                f" {list(self.frames)[:6]}."
            )
        if self.speeds:
            if len(self.speeds) != len(self.poses):
                raise InvalidInput(
                    f"cubic keys need speeds at every key, but got {len(self.speeds)} for {len(self.poses)} keys."
                )
            shaped = (
                frozen(speed, np.float64, (len(pose.joints), 6), f"speeds at frame {frame:g}")
                for speed, pose, frame in zip(self.speeds, self.poses, self.frames, strict=True)
            )
            object.__setattr__(self, "speeds", tuple(shaped))

    @property
    def is_cubic(self) -> bool:
        """Whether cubic curves join the keys."""
        return bool(self.speeds)

    def with_key(self, frame: float, pose: Pose) -> PoseKeys:
        """These keys with a pose at a frame, replacing the one that is there.

        Among cubic keys the new one moves as its neighbours suggest (Catmull and Rom 1974) and rests at the ends;
        the speeds of the others stay.
        """
        if not math.isfinite(frame):
            raise InvalidInput(f"a frame is a finite number, but got {frame}.")
        keys = dict(zip(self.frames, self.poses, strict=True)) | {float(frame): pose}
        frames = tuple(sorted(keys))
        poses = tuple(keys[f] for f in frames)
        if not self.is_cubic:
            return PoseKeys(self.rig, frames, poses)
        speeds = dict(zip(self.frames, self.speeds, strict=True)) | {
            float(frame): passing_speeds(frames, poses, frame)
        }
        return PoseKeys(self.rig, frames, poses, tuple(speeds[f] for f in frames))

    def without_key(self, frame: float) -> PoseKeys:
        """These keys without the one at a frame; raises InvalidInput when there is none."""
        if frame not in self.frames:
            raise InvalidInput(f"there is no key at frame {frame:g}; there are {[f'{f:g}' for f in self.frames]}.")
        keep = [i for i, f in enumerate(self.frames) if f != frame]
        speeds = tuple(self.speeds[i] for i in keep) if self.is_cubic else ()
        return PoseKeys(self.rig, tuple(self.frames[i] for i in keep), tuple(self.poses[i] for i in keep), speeds)

    def at(self, rig: Rig, frame: float) -> Pose:
        """The pose at a frame, held beyond the ends; at a key, the key's pose itself."""
        self._check_keys()
        if frame in self.frames:
            return self.poses[self.frames.index(frame)]
        if frame <= self.frames[0] or frame >= self.frames[-1]:
            return self.poses[0 if frame <= self.frames[0] else -1]
        return Pose(rig.joints, self.sampled(rig, [frame])[0])

    def sampled(self, rig: Rig, frames: Sequence[float]) -> FloatArray:
        """(n, j, 4, 4) parent_from_joint of the rig's joints at frames, held beyond the ends."""
        self._check_keys()
        return PoseCurves.of(rig, self).sampled(frames)

    def _check_keys(self) -> None:
        if not self.frames:
            raise InvalidInput(f"{self.rig} has no keys yet; set one first.")


@dataclass(frozen=True, eq=False)
class PoseCurves:
    """Keys as the channels of animation programs: k keys of j joints, in rig order.

    frames: (k,). translations: (k, j, 3). quaternions: (k, j, 4) w, x, y, z, unit, with signs that make neighbours
    close. stretches: (k, j, 3, 3) what stands behind the rotation (the identity without scale or shear).
    translation_slopes, quaternion_slopes: their derivatives per frame; None where blends are straight.
    A handle of a Bezier curve lies a third of the way to the neighbour key along its slope.
    """

    frames: FloatArray
    translations: FloatArray
    quaternions: FloatArray
    stretches: FloatArray
    translation_slopes: FloatArray | None = None
    quaternion_slopes: FloatArray | None = None

    @classmethod
    def of(cls, rig: Rig, keys: PoseKeys) -> PoseCurves:
        """The channels of keys on a rig. Joints that a pose does not name stand at rest."""
        speeds = None
        if keys.is_cubic:
            speeds = np.array([_speeds_on(rig, p, s) for p, s in zip(keys.poses, keys.speeds, strict=True)])
        return cls.joined(keys.frames, np.array([pose_on(rig, pose) for pose in keys.poses]), speeds)

    @classmethod
    def joined(cls, frames: Sequence[float], local: FloatArray, speeds: FloatArray | None) -> PoseCurves:
        """The channels of joint transforms (k, j, 4, 4) with speeds (k, j, 6), or None for straight blends."""
        translations, quaternions, stretches = channels(local)
        at = np.array(frames, float)
        if speeds is None:
            return cls(at, translations, quaternions, stretches)
        return cls(
            at, translations, quaternions, stretches, speeds[..., :3],
            quaternion_slopes(quaternions, speeds[..., 3:]),
        )  # fmt: skip

    def sampled(self, frames: Sequence[float]) -> FloatArray:
        """(n, j, 4, 4) parent_from_joint at frames (n,), held beyond the ends."""
        at = np.clip(np.asarray(frames, float), self.frames[0], self.frames[-1])
        last = max(len(self.frames) - 2, 0)
        first = np.clip(np.searchsorted(self.frames, at, side="right") - 1, 0, last)
        second = np.minimum(first + 1, len(self.frames) - 1)
        gap = np.where(second > first, self.frames[second] - self.frames[first], 1.0)
        share = (at - self.frames[first]) / gap
        stretch = _between(share, self.stretches[first], self.stretches[second])
        if self.translation_slopes is None or self.quaternion_slopes is None:
            moved = _between(share, self.translations[first], self.translations[second])
            turn = _arcs(self.quaternions[first], self.quaternions[second], share)
        else:
            moved = _hermite(share, gap, self.translations, self.translation_slopes, first, second)
            turn = rotations_of(_hermite(share, gap, self.quaternions, self.quaternion_slopes, first, second))
        result = np.zeros((*turn.shape[:2], 4, 4))
        result[..., :3, :3] = turn @ stretch
        result[..., :3, 3] = moved
        result[..., 3, 3] = 1.0
        return result


def channels(local: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Translations (n, j, 3), quaternions (n, j, 4) w, x, y, z with signs aligned over n, and stretches
    (n, j, 3, 3), of joint transforms (n, j, 4, 4)."""
    n, j = local.shape[:2]
    turn = nearest_rotations(local[..., :3, :3].reshape(-1, 3, 3)).reshape(n, j, 3, 3)
    quaternions = np.roll(Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat(), 1, axis=-1).reshape(n, j, 4)
    with_last = np.einsum("nji,nji->nj", quaternions[1:], quaternions[:-1])
    signs = np.cumprod(np.concatenate([np.ones((1, j)), np.where(with_last < 0.0, -1.0, 1.0)]), axis=0)
    stretches = turn.swapaxes(-1, -2) @ local[..., :3, :3]
    return np.array(local[..., :3, 3]), quaternions * signs[..., None], stretches


def quaternion_slopes(quaternions: FloatArray, turning: FloatArray) -> FloatArray:
    """(..., 4) the derivative of quaternions (..., 4) w, x, y, z that turn at (..., 3), each in its own frame:
    q' = q (0, turning) / 2."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    scalar = -(v * turning).sum(axis=-1, keepdims=True)
    return 0.5 * np.concatenate([scalar, w * turning + np.cross(v, turning)], axis=-1)


def turning_of(quaternions: FloatArray, slopes: FloatArray) -> FloatArray:
    """(..., 3) how unit quaternions (..., 4) with these derivatives turn, each in its own frame; what would change
    the length is left out: turning = 2 q* q'."""
    w, v = quaternions[..., :1], quaternions[..., 1:]
    return np.asarray(2.0 * (w * slopes[..., 1:] - slopes[..., :1] * v - np.cross(v, slopes[..., 1:])))


def rotations_of(quaternions: FloatArray) -> FloatArray:
    """(..., 3, 3) of quaternions (..., 4) w, x, y, z of any length but 0."""
    shape = quaternions.shape[:-1]
    return np.asarray(Rotation.from_quat(np.roll(quaternions, -1, axis=-1).reshape(-1, 4)).as_matrix()).reshape(
        *shape, 3, 3
    )


def hermite_weights(share: FloatArray, gap: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(n,) what the first value, the second, the first slope and the second count, at shares of gaps (frames)."""
    s, rest = share, 1.0 - share
    return (1.0 + 2.0 * s) * rest**2, s**2 * (3.0 - 2.0 * s), gap * s * rest**2, -gap * s**2 * rest


def _hermite(
    share: FloatArray, gap: FloatArray, values: FloatArray, slopes: FloatArray, first: IntArray, second: IntArray
) -> FloatArray:
    weights = (weight[:, None, None] for weight in hermite_weights(share, gap))
    parts = (values[first], values[second], slopes[first], slopes[second])
    return np.asarray(sum(weight * part for weight, part in zip(weights, parts, strict=True)))


def _between(share: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    s = share.reshape(-1, *[1] * (first.ndim - 1))
    return np.asarray((1.0 - s) * first + s * second)


def _arcs(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """(n, j, 3, 3) between quaternions (n, j, 4), along the shortest arcs."""
    one, two = rotations_of(first), rotations_of(second)
    between = (one.swapaxes(-1, -2) @ two).reshape(-1, 3, 3)
    vectors = Rotation.from_matrix(between).as_rotvec().reshape(*first.shape[:2], 3)
    partial = exponential((share[:, None, None] * vectors).reshape(-1, 3))[0].reshape(one.shape)
    return np.asarray(one @ partial)


def _speeds_on(rig: Rig, pose: Pose, speeds: FloatArray) -> FloatArray:
    """(j, 6) speeds in the rig's order; joints that the pose does not name rest."""
    if pose.joints == rig.joints:
        return speeds
    result = np.zeros((len(rig.joints), 6))
    result[[rig.joint_index(name) for name in pose.joints]] = speeds
    return result


def passing_speeds(frames: tuple[float, ...], poses: tuple[Pose, ...], frame: float) -> FloatArray:
    """(j, 6) speeds at a key from the poses before and after it, for the joints that all three name."""
    at = frames.index(float(frame))
    pose = poses[at]
    speeds = np.zeros((len(pose.joints), 6))
    if at in (0, len(frames) - 1):
        return speeds
    before, after, time = poses[at - 1], poses[at + 1], frames[at + 1] - frames[at - 1]
    shared = [name for name in pose.joints if name in before.joints and name in after.joints]
    rows = [pose.joints.index(name) for name in shared]
    three = np.array(
        [p.local[[p.joints.index(name) for name in shared]] for p in (before, pose, after)]
    ).reshape(3, -1, 4, 4)  # fmt: skip
    moved, quaternions, _ = channels(three)
    turn = rotations_of(quaternions)
    way = Rotation.from_matrix(turn[2] @ turn[0].swapaxes(-1, -2)).as_rotvec() if rows else np.zeros((0, 3))
    speeds[rows, :3] = (moved[2] - moved[0]) / time
    speeds[rows, 3:] = np.einsum("jba,jb->ja", turn[1], way) / time
    return speeds
