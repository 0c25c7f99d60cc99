"""Which side of a hand is the thumb's, by the bones alone: names differ from rig to rig."""

from __future__ import annotations

import numpy as np

from contact_builtins.axes.along_bone import owning_bone
from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.contact.axis_generator import AxisRequest

_CLEAR = 0.1  # the thumb reaches less far than the next digit, by this part of the longest reach at least


def towards_thumb(request: AxisRequest) -> FloatArray | None:
    """(3,) from the other digits' tips to the thumb's, across the way of the hand, surface units; None where no
    digit is like a thumb.

    Digits are the three chains of bones or more that part at a joint on the way from the patch's bone to the root;
    the thumb is the one that reaches least far the way all of them go. A distance along a direction is the same on
    a mirrored hand, so the answer is mirrored with the hand.
    """
    bone = owning_bone(request)
    if bone is None or request.bones is None:
        return None
    heads, tails = request.bones[:, 0], request.bones[:, 1]  # (b, 3)
    near = 1e-6 * max(float(np.ptp(request.bones.reshape(-1, 3), axis=0).max()), 1e-300)
    joint, is_head = tails[bone], False
    for _ in range(len(heads) + 1):
        tips = _tips(joint, heads, tails, near)
        if len(tips) >= 3:
            return _from_others_to_thumb(tips - joint)
        if not is_head:  # first the digits that part at the bone's end, as from the palm's; then up the tree
            joint, is_head = heads[bone], True
            continue
        above = np.flatnonzero(_at(tails, joint, near) & ~_at(heads, joint, near))
        if not len(above):
            return None
        bone = int(above[0])
        joint = heads[bone]
    return None


def _from_others_to_thumb(reaches: FloatArray) -> FloatArray | None:
    """The answer for digits (k, 3) from the joint where they part to their tips."""
    forward = reaches.sum(axis=0) / max(float(np.linalg.norm(reaches.sum(axis=0))), 1e-300)
    along = reaches @ forward  # (k,)
    thumb, second = np.argsort(along)[:2]
    if along[second] - along[thumb] < _CLEAR * along.max():
        return None
    towards = reaches[thumb] - np.delete(reaches, thumb, axis=0).mean(axis=0)
    return np.asarray(towards - forward * float(towards @ forward))


def _tips(joint: FloatArray, heads: FloatArray, tails: FloatArray, near: float) -> FloatArray:
    """(k, 3) the farthest ends of the chains of two bones or more that start at a joint."""
    tips = []
    for first in np.flatnonzero(_at(heads, joint, near) & ~_at(tails, joint, near)):
        chain = _below(int(first), heads, tails, near)
        if len(chain) >= 2:
            tips.append(tails[chain[np.argmax(np.linalg.norm(tails[chain] - joint, axis=1))]])
    return np.array(tips).reshape(-1, 3)


def _below(first: int, heads: FloatArray, tails: FloatArray, near: float) -> IntArray:
    """A bone and all that hang on it."""
    found = [first]
    for bone in found:  # grows while it is walked
        found += [int(k) for k in np.flatnonzero(_at(heads, tails[bone], near)) if int(k) not in found]
    return np.array(found)


def _at(points: FloatArray, joint: FloatArray, near: float) -> BoolArray:
    return np.asarray(np.linalg.norm(points - joint, axis=1) <= near)
