"""A pose carried from hand to hand: by the roles of digits, and bone by bone in the frames that a hand's
description gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.grasping.hand import Hand
from contact_core.hands.description import Digit, DigitBone, Segment
from contact_core.library.record import Grasp, SavedBone, SavedDigit
from contact_core.rig.chart import Chart
from contact_core.rig.rig import Pose, forward_kinematics
from contact_core.rig.rotations import nearest_rotations

MIRROR = np.array([1.0, 1.0, -1.0])  # across the palm, and so of turns about flexion axes: see `mirrored`


@dataclass(frozen=True, eq=False)
class Carried:
    """A hand in the pose of a grasp. local: (j, 4, 4), its root anywhere. used: (D,) which digits take part.
    missing: roles of digits of the grasp that this hand lacks; followed: those of digits that the grasp lacks, by
    the role of the one that they do as."""

    local: FloatArray
    used: BoolArray
    missing: tuple[str, ...]
    followed: dict[str, str]


def is_other_side(grasp: Grasp, hand: Hand) -> bool:
    """Whether one is a left hand and the other a right one."""
    return {grasp.hand.side, hand.description.side} == {"left", "right"}


def is_own_rig(grasp: Grasp, hand: Hand) -> bool:
    """Whether a hand has the very joints that the grasp was made with."""
    return set(grasp.hand.pose.joints) == set(hand.rig.joints)


def mirrored(turn: FloatArray) -> FloatArray:
    """(..., 3, 3) a turn between frames of bones, for the other hand: x and y reflected across the palm, and z,
    which is their product, turned over."""
    return np.asarray(MIRROR[:, None] * turn * MIRROR)


def palm_in_rig(hand: Hand, own: FloatArray) -> FloatArray:
    """(4, 4) rigid, rig space from the palm's frame. own: (j, 4, 4) world_from_joint within the rig."""
    move = own[hand.description.hub] @ np.linalg.inv(hand.rig.rest_world[hand.description.hub])
    frame = np.eye(4)
    frame[:3, :3] = nearest_rotations(move[None, :3, :3])[0] @ hand.frame
    frame[:3, 3] = move[:3, :3] @ hand.description.palm.point + move[:3, 3]
    return frame


def bone_frames(hand: Hand, digit: Digit, own: FloatArray) -> FloatArray:
    """(b, 3, 3) the frames of a digit's bones in rig space."""
    joints = [bone.joint for bone in digit.bones]
    frames = np.array([bone.frame for bone in digit.bones])
    return np.asarray(nearest_rotations(own[joints][:, :3, :3]) @ frames)


def steps(first: FloatArray, frames: FloatArray) -> FloatArray:
    """(b, 3, 3) each frame in that of the one before, the first in `first`."""
    before = np.concatenate([first[None], frames[:-1]])
    return np.asarray(before.transpose(0, 2, 1) @ frames)


def carried(grasp: Grasp, hand: Hand) -> Carried:
    """The pose of a grasp on a hand. Bones of a digit that bend are turned to the palm as those of the same role
    and segment are; bones that do not bend, as far from their rest. Joints that limits hold stop there, but for
    the grasp's own rig: what was posed there can be."""
    rig, own_rig = hand.rig, is_own_rig(grasp, hand)
    local = _start(grasp, hand) if own_rig else rig.rest_local.copy()
    saved = {digit.role: digit for digit in grasp.hand.digits}
    doing, followed = {}, {}
    for digit in hand.digits:
        source = saved.get(digit.role) or _alike(saved, hand, digit)
        if source is not None:
            doing[digit.role] = source
            if source.role != digit.role:
                followed[digit.role] = source.role
    flip = is_other_side(grasp, hand)
    for digit in hand.digits:
        if digit.role in doing:
            _turn(hand, digit, doing[digit.role], local, flip)
    used = np.array([digit.role in doing and doing[digit.role].touches for digit in hand.digits])
    if not own_rig:
        local = _within_limits(hand, local)
    missing = tuple(role for role in saved if role not in {digit.role for digit in hand.digits})
    return Carried(local, used, missing, followed)


def placed_at(hand: Hand, local: FloatArray, rig_from_palm: FloatArray) -> FloatArray:
    """(j, 4, 4) the same pose with the rig's root moved so that its palm is where it is wanted, in rig space."""
    now = palm_in_rig(hand, forward_kinematics(hand.rig.parents, local))
    result = local.copy()
    roots = hand.rig.parents < 0
    result[roots] = rig_from_palm @ np.linalg.inv(now) @ result[roots]
    return result


def _start(grasp: Grasp, hand: Hand) -> FloatArray:
    order = [grasp.hand.pose.joints.index(name) for name in hand.rig.joints]
    return grasp.hand.pose.local[order].copy()


def _alike(saved: dict[str, SavedDigit], hand: Hand, digit: Digit) -> SavedDigit | None:
    """What a digit does that the grasp has not: as the last finger before it that it has, from the thumb on."""
    if digit.is_thumb:
        return None
    order = [other.role for other in hand.digits if not other.is_thumb]
    before = [saved[role] for role in order[: order.index(digit.role)] if role in saved]
    fingers = [other for role, other in saved.items() if role != "thumb"]
    return before[-1] if before else (fingers[-1] if fingers else None)


def _turn(hand: Hand, digit: Digit, source: SavedDigit, local: FloatArray, flip: bool) -> None:
    """Turn the joints of one digit in place."""
    rig = hand.rig
    own = forward_kinematics(rig.parents, local)
    palm = palm_in_rig(hand, own)[:3, :3]
    rest = steps(hand.frame, bone_frames(hand, digit, rig.rest_world))
    aims = _aims(source, flip)
    before = palm
    for bone, at_rest in zip(digit.bones, rest, strict=True):
        wanted = _wanted(bone, source, aims, before, at_rest, palm, flip)
        parent = int(rig.parents[bone.joint])
        base = nearest_rotations(own[parent][None, :3, :3])[0] if parent >= 0 else np.eye(3)
        size = np.linalg.norm(local[bone.joint, :3, :3], axis=0)
        local[bone.joint, :3, :3] = base.T @ wanted @ bone.frame.T * size
        own = forward_kinematics(rig.parents, local)
        before = wanted


def _aims(source: SavedDigit, flip: bool) -> dict[Segment, FloatArray]:
    """By segment (3, 3), the frames of a saved digit's bending bones in the palm's."""
    frame: FloatArray = np.eye(3)
    aims = dict[Segment, FloatArray]()
    for bone in source.bones:
        frame = frame @ (mirrored(bone.turn) if flip else bone.turn)
        if bone.flexes:
            aims[bone.segment] = frame
    return aims


def _wanted(
    bone: DigitBone, source: SavedDigit, aims: dict[Segment, FloatArray], before: FloatArray, at_rest: FloatArray,
    palm: FloatArray, flip: bool,
) -> FloatArray:  # fmt: skip
    """(3, 3) the frame that a bone is to have in rig space."""
    if bone.flexes and bone.segment in aims:
        return palm @ aims[bone.segment]
    other: SavedBone | None = next((b for b in source.bones if b.segment == bone.segment and not b.flexes), None)
    if bone.flexes or other is None:
        return before @ at_rest
    away = other.rest.T @ other.turn
    return before @ at_rest @ (mirrored(away) if flip else away)


def _within_limits(hand: Hand, local: FloatArray) -> FloatArray:
    """What the freedoms of the rig can express of a pose, within their limits."""
    chart = Chart(hand.rig)
    theta, _ = chart.theta_of(Pose(hand.rig.joints, local))
    inner = ~chart.is_root
    theta[inner] = np.clip(theta[inner], chart.lower[inner], chart.upper[inner])
    return chart.local(theta)
