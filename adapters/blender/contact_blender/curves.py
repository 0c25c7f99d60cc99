"""Cubic keys of a whole pose as Blender's own curves, with handles.

A curve between two keys whose handles lie a third of the way to one another is the Hermite curve of their slopes.
Bones that turn by quaternions therefore move exactly as the keys say (Blender normalises what four curves give).
Euler and axis-angle channels take another way between the same keys: they get keys in between, until they are near.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from contact_blender import compat, keying_set, keys, nla
from contact_blender.channels import is_there, near_angles, rotation_channel
from contact_blender.keying_set import ChannelKey
from contact_blender.rig import UNMOVED, read_skeleton
from contact_core.arrays import BoolArray, FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.pose_keys import PoseCurves, PoseKeys, hermite_weights
from contact_core.rig.rig import Rig
from contact_core.scene.reading import conjugate

STEP = 1e-5  # frames to either side of a key, by which slopes of channels are found
NEAR = 2e-4  # radians that a bone may be turned off between keys: half a millimetre over two metres
STILL = 1e-6  # of a scale or (relative) a length, which single precision makes by itself
AUTO, ALIGNED, AUTO_CLAMPED = 1, 3, 4  # kinds of handles
LINEAR, BEZIER = 1, 2  # kinds of interpolation


@dataclass(frozen=True, eq=False)
class BoneCurves:
    """What a bone's channel gets: frames (k,), values and slopes per frame (k, w). places: of w, those that are
    keyed."""

    channel: str
    frames: FloatArray
    values: FloatArray
    slopes: FloatArray
    interpolation: int = BEZIER
    places: tuple[int, ...] = (0, 1, 2, 3)


def write(armature: Any, rig: Rig, pose_keys: PoseKeys, stretch: FloatArray, posed: Collection[str]) -> None:
    """Key the bones that the keys name by curves through them, in place of their keys from the first to the last.

    rig: what the keys are of, whose space is the armature's after a stretch (3, 3). posed: the bones that a solve
    may pose; another is keyed only where it is to be elsewhere than it is. Keys outside, other bones and other
    channels stay as they are. With an active keying set the curves are those of what the set names of these bones;
    what it names beside them, and has no curve yet, is keyed as it is at each of the keys.

    Raises InvalidInput for unknown bones, scale that no channel holds, shifts of connected bones, a keying set that
    has nothing of the bones and times that a tweaked strip has not, before anything is written; and where strips of
    the NLA show something else.
    """
    keys.check_action(armature)
    motion = _Motion(rig, pose_keys, stretch)
    skeleton = read_skeleton(armature)
    bases = {name: np.linalg.inv(local) for name, local in zip(skeleton.joints, skeleton.edit_local, strict=True)}
    named = [name for name in pose_keys.poses[0].joints if name != UNMOVED]
    unknown = [name for name in named if name not in bases]
    if unknown:
        raise InvalidInput(f"{armature.name} has no bone {unknown[0]!r}; are these keys of another rig?")
    bones = armature.pose.bones
    moved = [n for n in named if n in posed or _moves(bones[n], bases[n] @ motion.local(n, motion.frames))]
    found = {name: _curves_of(bones[name], bases[name], motion) for name in moved}
    chosen, held = keying_set.active(by_auto_key=False), list[ChannelKey]()
    if chosen is not None:
        found, held = _chosen(armature, found, keys.named(armature, dict.fromkeys(found, ()), chosen))
    rate = nla.rate(armature, motion.frames)
    for name, curves in found.items():
        for curve in curves:
            _put(armature, name, curve, rate)
    for frame in pose_keys.frames:
        keys.insert_at(armature, held, float(frame))
    nla.check_seen(armature, {float(end): _at(armature, found, end) for end in motion.frames[[0, -1]]})
    keys.show_animation(armature, {name: tuple(c.channel for c in curves) for name, curves in found.items()})
    armature.update_tag(refresh={"OBJECT"})


Found = dict[str, list[BoneCurves]]  # by bone


def _chosen(armature: Any, found: Found, named: list[ChannelKey]) -> tuple[Found, list[ChannelKey]]:
    """Of curves those that a keying set names, and what else it names that has no curve yet."""
    places: dict[str, set[int]] = {}
    for each in named:
        places.setdefault(each.path, set()).update(range(4) if each.index < 0 else (each.index,))
    bones, kept, known = armature.pose.bones, Found(), {curve.data_path for curve in compat.fcurves(armature)}
    for name, curves in found.items():
        paths = [bones[name].path_from_id(curve.channel) for curve in curves]
        known.update(paths)
        kept[name] = [
            replace(curve, places=tuple(sorted(places[path])))
            for path, curve in zip(paths, curves, strict=True)
            if path in places
        ]
    return kept, [each for each in named if each.path not in known]


def _at(armature: Any, found: Found, frame: float) -> dict[tuple[str, int], float]:
    """What curves with a key at a frame say there, but for numbers that drivers set."""
    driven = {(each.data_path, each.array_index) for each in compat.drivers(armature)}
    rows = {
        (armature.pose.bones[name].path_from_id(curve.channel), place): float(values[place])
        for name, curves in found.items()
        for curve in curves
        for values in curve.values[curve.frames == frame]
        for place in curve.places
        if place < len(values)
    }
    return {number: value for number, value in rows.items() if number not in driven}


def _moves(pose_bone: Any, seen: FloatArray) -> bool:
    """Whether a bone is elsewhere now than in any of the bases (k, 4, 4)."""
    return not all(is_there(pose_bone, basis) for basis in seen)


class _Motion:
    """Keys as joint transforms in armature space, at any frame."""

    def __init__(self, rig: Rig, pose_keys: PoseKeys, stretch: FloatArray) -> None:
        self.rig, self.frames = rig, np.array(pose_keys.frames, float)
        self.curves = PoseCurves.of(rig, pose_keys)
        self.unstretch: FloatArray = np.asarray(np.linalg.inv(stretch), np.float64)

    def local(self, joint: str, frames: FloatArray) -> FloatArray:
        """(n, 4, 4) parent_from_joint, in the armature's space."""
        known = self.curves.sampled(frames.tolist())[:, self.rig.joint_index(joint)]
        return conjugate(known, self.unstretch)


def _curves_of(pose_bone: Any, base: FloatArray, motion: _Motion) -> list[BoneCurves]:
    mode, whole = pose_bone.rotation_mode, np.unique([*np.arange(*_whole(motion.frames)), *motion.frames])
    channel, frames = rotation_channel(pose_bone), motion.frames
    before = np.array(getattr(pose_bone, channel), float)
    seen = base @ motion.local(pose_bone.name, whole)
    scales = np.linalg.norm(seen[:, :3, :3], axis=1)
    _check(pose_bone, seen, scales)
    while True:
        values, slopes = _turns(mode, base, pose_bone.name, motion, frames, before)
        if mode == "QUATERNION" or len(frames) == len(whole):
            break
        off = _off(mode, BoneCurves(channel, frames, values, slopes), whole, seen[:, :3, :3] / scales[:, None])
        if off.max() <= NEAR:
            break
        frames = np.unique([*frames, whole[int(off.argmax())]])
    result = [BoneCurves(channel, frames, values, slopes)]
    length, at = float(pose_bone.bone.length), motion.frames
    moved = np.abs(seen[:, :3, 3] - np.array(pose_bone.location)).max()
    if not pose_bone.bone.use_connect and (moved > STILL * length or pose_bone.parent is None):
        places = [(base @ motion.local(pose_bone.name, at + side))[:, :3, 3] for side in (-STEP, 0.0, STEP)]
        result.append(BoneCurves("location", at, places[1], _slopes(motion, at, places)))
    if np.abs(scales - np.array(pose_bone.scale)).max() > STILL:
        sizes = np.linalg.norm((base @ motion.local(pose_bone.name, at))[:, :3, :3], axis=1)
        result.append(BoneCurves("scale", at, sizes, np.zeros_like(sizes), LINEAR))
    return result


def _whole(frames: FloatArray) -> tuple[float, float]:
    return float(np.ceil(frames[0])), float(np.floor(frames[-1])) + 1.0


def _check(pose_bone: Any, basis: FloatArray, scales: FloatArray) -> None:
    turns = basis[:, :3, :3] / np.where(scales > 0.0, scales, 1.0)[:, None, :]
    off = np.abs(turns.swapaxes(1, 2) @ turns - np.eye(3)).max()
    if off > 1e-4 or (np.linalg.det(turns) <= 0.0).any():
        raise InvalidInput(
            f"bone {pose_bone.name!r} cannot take keys with shear or a mirror: it has no such channel."
        )
    shift = float(np.abs(basis[:, :3, 3]).max())
    if pose_bone.bone.use_connect and shift > 1e-4 * float(pose_bone.bone.length):
        raise InvalidInput(
            f"bone {pose_bone.name!r} is connected to its parent and cannot be shifted by {shift:.3g};"
            " disconnect it in Edit Mode or key it by rotation alone."
        )


def _turns(
    mode: str, base: FloatArray, joint: str, motion: _Motion, frames: FloatArray, before: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values (k, w) and slopes (k, w) of a rotation channel; before: (w,) what it shows now."""
    sides = list[FloatArray]()
    for side in (0.0, -STEP, STEP):
        basis = base @ motion.local(joint, frames + side)
        turns = Rotation.from_matrix(basis[:, :3, :3] / np.linalg.norm(basis[:, :3, :3], axis=1)[:, None])
        nearest = sides[0] if sides else np.broadcast_to(before, (len(frames), len(before)))
        sides.append(_values(mode, turns, nearest, chained=not sides))
    return sides[0], _slopes(motion, frames, [sides[1], sides[0], sides[2]])


def _slopes(motion: _Motion, frames: FloatArray, sides: Sequence[FloatArray]) -> FloatArray:
    """(k, w) derivatives per frame, of values STEP before, at and STEP after each key: curves are held beyond."""
    inside_before = np.minimum(frames - motion.frames[0], STEP)[:, None]
    inside_after = np.minimum(motion.frames[-1] - frames, STEP)[:, None]
    return np.asarray((sides[2] - sides[0]) / np.maximum(inside_before + inside_after, 1e-12))


def _values(mode: str, turns: Rotation, nearest: FloatArray, *, chained: bool) -> FloatArray:
    """(k, w) channels of rotations, each near the one before it (chained) or near its own in `nearest`."""
    result = np.empty_like(nearest)
    for row in range(len(result)):
        before = result[row - 1] if chained and row else nearest[row]
        result[row] = near_angles(mode, turns[row], before)
    return result


def _off(mode: str, curve: BoneCurves, frames: FloatArray, wanted: FloatArray) -> FloatArray:
    """(n,) radians between what the curves of a channel show at frames and what is wanted (n, 3, 3)."""
    first = np.clip(np.searchsorted(curve.frames, frames, side="right") - 1, 0, max(len(curve.frames) - 2, 0))
    second = np.minimum(first + 1, len(curve.frames) - 1)
    gap = np.maximum(curve.frames[second] - curve.frames[first], 1e-9)
    a, b, c, d = (w[:, None] for w in hermite_weights((frames - curve.frames[first]) / gap, gap))
    shown = a * curve.values[first] + b * curve.values[second] + c * curve.slopes[first] + d * curve.slopes[second]
    if mode == "AXIS_ANGLE":
        axis = shown[:, 1:] / np.maximum(np.linalg.norm(shown[:, 1:], axis=1, keepdims=True), 1e-12)
        turns = Rotation.from_rotvec(shown[:, :1] * axis)
    else:
        turns = Rotation.from_euler(mode.lower(), shown[:, ["XYZ".index(axis) for axis in mode]])
    return np.asarray((turns * Rotation.from_matrix(wanted).inv()).magnitude())


def _put(armature: Any, bone: str, curve: BoneCurves, rate: float) -> None:
    """Put the keys of a channel into its curves, which are made where there are none and no driver is.

    rate: frames of the action for one of the scene.
    """
    pose_bone = armature.pose.bones[bone]
    path = pose_bone.path_from_id(curve.channel)
    known = {c.array_index for c in compat.fcurves(armature) if c.data_path == path}
    known |= {driver.array_index for driver in compat.drivers(armature) if driver.data_path == path}
    new = set(range(curve.values.shape[1])) & set(curve.places) - known
    for index in new:
        getattr(pose_bone, curve.channel)[index] = float(curve.values[0, index])
    for index in new:
        pose_bone.keyframe_insert(curve.channel, index=index, frame=float(curve.frames[0]), group=bone)
    curve = replace(curve, frames=nla.action_frames(armature, curve.frames), slopes=curve.slopes / rate)
    for found in [each for each in compat.fcurves(armature) if each.data_path == path]:
        index = int(found.array_index)
        if index not in curve.places:
            continue
        values, slopes = curve.values[:, index], curve.slopes[:, index]
        keys.put_keys(found, _joined(keys.keys_of(found), curve, values, slopes))


def _joined(there: dict[str, Any], curve: BoneCurves, values: FloatArray, slopes: FloatArray) -> dict[str, Any]:
    """The keys of a curve with new ones in place of those in their range, as flat arrays by field."""
    old = there["co"].reshape(-1, 2)[:, 0].astype(float)
    first, last = curve.frames[0] - 1e-3, curve.frames[-1] + 1e-3
    before, after = old < first, old > last
    kept = {name: array.copy() for name, array in there.items()}
    for side, row in ((before, np.flatnonzero(before)[-1:]), (after, np.flatnonzero(after)[:1])):
        if side.any():
            _freeze(kept, int(row[0]))
    gap_before = curve.frames[0] - old[before][-1] if before.any() else np.inf
    gap_after = old[after][0] - curve.frames[-1] if after.any() else np.inf
    new = _points(curve, values, slopes, gap_before, gap_after)
    return {
        name: np.concatenate([_rows(kept[name], before), new[name], _rows(kept[name], after)]).astype(array.dtype)
        for name, array in there.items()
    }


def _rows(array: Any, chosen: BoolArray) -> Any:
    return array.reshape(len(chosen), -1)[chosen].ravel() if len(chosen) else array[:0]


def _freeze(fields: dict[str, Any], row: int) -> None:
    """Handles of a neighbour that move by themselves stay where they are, and so does what lies beyond it."""
    for side in ("handle_left_type", "handle_right_type"):
        if fields[side][row] in (AUTO, AUTO_CLAMPED):
            fields[side][row] = ALIGNED


def _points(
    curve: BoneCurves, values: FloatArray, slopes: FloatArray, gap_before: float, gap_after: float
) -> dict[str, Any]:
    """The keys of one curve with their handles, a third of the way to the neighbours along the slopes."""
    frames, inner = curve.frames, np.diff(curve.frames)
    ends = [min(gap_before, inner[0] if len(inner) else 1.0), min(gap_after, inner[-1] if len(inner) else 1.0)]
    if not np.isfinite(ends).all():
        ends = [1.0 if not np.isfinite(end) else end for end in ends]
    left = np.concatenate([[ends[0]], inner]) / 3.0
    right = np.concatenate([inner, [ends[1]]]) / 3.0
    kind = np.full(len(frames), ALIGNED)
    return {
        "co": np.stack([frames, values], axis=1).ravel(),
        "handle_left": np.stack([frames - left, values - left * slopes], axis=1).ravel(),
        "handle_right": np.stack([frames + right, values + right * slopes], axis=1).ravel(),
        "handle_left_type": kind,
        "handle_right_type": kind,
        "interpolation": np.full(len(frames), curve.interpolation),
    }
