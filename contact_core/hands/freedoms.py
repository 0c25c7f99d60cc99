"""Degrees of freedom for rigs that say nothing about them: anatomical for digits, open for the rest.

A digit's angles are measured in the frame that its description gives: x along the bone, y to the palm side and
z = x cross y, the flexion axis, about which a positive turn closes the hand.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.hands.anatomy import Anatomy, unit
from contact_core.hands.describe import describe_hands
from contact_core.hands.description import Digit, HandDescription, HandWords
from contact_core.hands.flexion import orthonormal, snapped
from contact_core.rig.rig import JointFreedom, Rig

# Degrees: twist, spread, flexion from, flexion to.
FINGER_LIMITS = {"proximal": (8, 20, -15, 95), "intermediate": (4, 2, -5, 105), "distal": (4, 2, -8, 80)}
THUMB_LIMITS = {"metacarpal": (35, 45, -30, 50), "proximal": (8, 8, -10, 70), "distal": (5, 2, -15, 85)}
OPEN_PRIOR = (3.0, 1.0, 1.0)  # twist about the bone is dearer than swing
SURE = 0.75  # how hand-like a hub without names has to be for its digits to get limits


def guess_freedoms(rig: Rig, words: Sequence[HandWords] = ()) -> tuple[tuple[JointFreedom, ...], list[str]]:
    """One freedom per joint of a rig that says none (of its `freedoms` only hinges are read), and notes.

    Raises InvalidInput where `words` name joints that are not there.
    """
    anatomy = Anatomy(rig)
    root = _main_root(rig.parents, anatomy.holds_skin)
    hands = [hand for hand in describe_hands(rig, words) if _counts(anatomy, hand, words)]
    anatomical = {j: freedom for hand in hands for digit in hand.digits for j, freedom in _limits_of(digit).items()}
    result = []
    for index in range(len(rig.joints)):
        if index == root:
            result.append(JointFreedom(kind="ball", translates=True))
        elif not anatomy.moves_skin[index]:
            result.append(JointFreedom(kind="fixed"))
        elif index in anatomical:
            result.append(anatomical[index])
        else:
            x = snapped(rig.rest_world[index, :3, :3].T @ _bone(anatomy, index))
            z = np.eye(3)[(int(np.abs(x).argmax()) + 2) % 3]
            result.append(JointFreedom(kind="ball", frame=orthonormal(x, z), prior_weight=np.array(OPEN_PRIOR)))
    return tuple(result), _notes(anatomy, hands, anatomical)


def _counts(anatomy: Anatomy, hand: HandDescription, words: Sequence[HandWords]) -> bool:
    """Whether a hand is told, named, or so hand-like that its digits get limits."""
    told = any(word.hub == anatomy.rig.joints[hand.hub] for word in words)
    named = any(anatomy.names[j] is not None for digit in hand.digits for j in digit.joints)
    return told or named or hand.confidence >= SURE


def _limits_of(digit: Digit) -> dict[int, JointFreedom]:
    table = THUMB_LIMITS if digit.is_thumb else FINGER_LIMITS
    return {
        bone.joint: _limited(bone.frame, table[bone.segment])
        if bone.segment in table
        else JointFreedom(kind="fixed")
        for bone in digit.bones
    }


def _limited(frame: FloatArray, degrees: tuple[float, float, float, float]) -> JointFreedom:
    twist, spread, flex_from, flex_to = np.radians(degrees)
    return JointFreedom(
        kind="euler",
        frame=frame,
        lower=np.array([-twist, -spread, flex_from]),
        upper=np.array([twist, spread, flex_to]),
    )


def _notes(anatomy: Anatomy, hands: list[HandDescription], anatomical: dict[int, JointFreedom]) -> list[str]:
    notes = [note for hand in hands for note in hand.notes]
    if anatomical:
        notes.append(
            f"Limits of {len(anatomical)} digit joints were guessed from the hand's shape; a rig.toml overrides."
        )
    unknown = [
        anatomy.rig.joints[digit.bones[0].joint]
        for hand in hands
        for digit in hand.digits
        if all(anatomy.names[j] is None for j in digit.joints)
    ]
    if unknown:
        notes.append(f"The names of these digits tell no role; their place gave it: {', '.join(unknown)}.")
    still = int((~anatomy.moves_skin).sum())
    if still:
        notes.append(f"{still} joints that move no skin are held still.")
    return notes


def _bone(anatomy: Anatomy, index: int) -> FloatArray:
    """(3,) unit direction to the (mean of the) children; for a leaf, from the parent."""
    rig, here = anatomy.rig, anatomy.position[index]
    children = np.flatnonzero(rig.parents == index)
    if len(children):
        way = anatomy.position[children].mean(axis=0) - here
    elif rig.parents[index] >= 0:
        way = here - anatomy.position[int(rig.parents[index])]
    else:
        way = rig.rest_world[index, :3, 0]
    return unit(way) if np.linalg.norm(way) > 1e-12 else np.asarray(rig.rest_world[index, :3, 0])


def _main_root(parents: IntArray, weighted: BoolArray) -> int:
    """The root above the most joints that move skin."""
    top = np.arange(len(parents))
    for index, parent in enumerate(parents):
        if parent >= 0:
            top[index] = top[parent]
    return int(np.bincount(top, weights=weighted + 1e-6).argmax())
