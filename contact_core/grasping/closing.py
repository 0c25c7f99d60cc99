"""Closing a hand at many placements at once: what `hand_kernels` computes, with its arrays made and named."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.kernel_arrays import Grid
from contact_core.grasping.hand import Hand

TOUCH = 0.004  # of the hand's length: nearer than this is touching
ON = 0.03  # hand lengths: pads of fingers that are nearer press, and say where the thumb goes
FOUND = 0.02  # hand lengths: a digit that is farther from the object found nothing
OPPOSE = 0.06  # hand lengths that it is worth that the thumb's side of the object is not the fingers'
ALONG = 0.15  # hand lengths that it is worth that the thumb goes round what the fingers go round, not along it


@dataclass(frozen=True, eq=False)
class Closed:
    """Hands as they closed, N of them. placed: (N, 4, 4) object_from_rig. angles: (N, B). turns: (N, D, 3, 3) of
    each digit's first bone that bends, before it bends.

    fits: (N, B, 8) of the pad below each bone: distance to the object, cosine between its normal and the object's
    outward one, that normal (3), its position (3). clear: (N, D) least signed distance of each digit. rest: (N,)
    that of skin beside palm and digits, palm: (N,) of the palm's. travel: (N,) how far the approach went, inf
    where it found nothing.
    """

    placed: FloatArray
    angles: FloatArray
    turns: FloatArray
    fits: FloatArray
    clear: FloatArray
    rest: FloatArray
    palm: FloatArray
    travel: FloatArray

    def __getitem__(self, rows: IntArray) -> Closed:
        return Closed(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def close_hands(
    hand: Hand,
    field: DistanceField,
    placed: FloatArray,
    ways: FloatArray,
    bars: FloatArray | None = None,
    curls: FloatArray | None = None,
    limits: FloatArray | None = None,
    oppose: float = OPPOSE,
    along: float = ALONG,
) -> Closed:
    """Approach and close at each of `placed` (N, 4, 4) object_from_rig, rigid, in surface units that hand and
    object share.

    ways: (N, 3) unit direction of each approach in the object's space, zero to stay. bars: (N, 7) middle, axis and
    radius of the round bar on which fingers close in place of the whole object, radius 0 for the object.
    curls: (N,) how far digits are bent before they close, of their limits. limits: (N, D) how far at most.
    """
    from contact_core.grasping import hand_kernels as kernels

    n, bones, digits = len(placed), len(hand.joints), len(hand.bones) - 1
    begins = kernels.Placed(
        np.ascontiguousarray(placed[:, :3, :], np.float64),
        np.ascontiguousarray(ways, np.float64),
        np.zeros((n, 7)) if bars is None else np.ascontiguousarray(bars, np.float64),
        np.zeros(n) if curls is None else np.ascontiguousarray(curls, np.float64),
        np.ones((n, digits)) if limits is None else np.ascontiguousarray(limits, np.float64),
    )
    found = kernels.Found(
        np.zeros((n, bones)), np.tile(np.eye(3), (n, digits, 1, 1)), np.zeros((n, bones, 8)), np.zeros((n, digits)),
        np.zeros(n), np.zeros(n), np.zeros(n),
    )  # fmt: skip
    kernels.close_all(
        begins, *_groups(hand), Grid(field.values, field.origin, float(field.spacing)),
        kernels.Rules(float(hand.length), TOUCH * hand.length, ON, float(oppose), float(along)),
        *_working_memory(bones, digits), found,
    )  # fmt: skip
    whole = np.tile(np.eye(4), (n, 1, 1))
    whole[:, :3, :] = begins.frames
    return Closed(whole, hand.coupled(found.angles), *found[1:])


def _groups(hand: Hand) -> tuple[Any, Any, Any]:
    """The hand as kernels take it."""
    from contact_core.grasping.closing_kernels import Chains, Skin
    from contact_core.grasping.hand_kernels import Starts

    starts = Starts(
        hand.starts, hand.start_counts, hand.start_angles, hand.start_prices, hand.looks, hand.look_frame,
        hand.look_low, hand.look_high,
    )  # fmt: skip
    chains, skin = ((getattr(hand, name) for name in group._fields) for group in (Chains, Skin))
    return Chains(*chains), Skin(*skin), starts


def _working_memory(bones: int, digits: int) -> tuple[Any, Any]:
    from contact_core.grasping.closing_kernels import State
    from contact_core.grasping.hand_kernels import Best

    state = State(
        turns=np.zeros((bones, 3, 3)), angles=np.zeros(bones), frames=np.zeros((bones, 3, 4)),
        ends=np.zeros((bones, 2, 3)), ceiling=np.zeros(bones), moves=np.zeros(bones, bool),
        going=np.zeros(bones, bool), done=np.zeros(digits, bool), mean=np.zeros(3), normals=np.zeros((3, 3)),
        fit=np.zeros(8), whole=np.zeros(7),
    )  # fmt: skip
    return state, Best(np.zeros(bones), np.eye(3), np.zeros(3), np.zeros(3))


def relaxed(hand: Hand, closed: Closed) -> Closed:
    """The same hands, where fingers that found nothing are bent no farther than those that touch are on average:
    they open again on the way on which they closed."""
    touches = closed.clear < FOUND * hand.length
    turned = np.add.reduceat(np.where(hand.flexes, closed.angles, 0.0), hand.bones[:-1], axis=1)  # (N, D)
    fingers = np.arange(touches.shape[1]) != hand.thumb
    holding = touches & fingers
    mean = (turned * holding).sum(axis=1) / np.maximum(holding.sum(axis=1), 1)
    share = np.clip(mean[:, None] / np.maximum(turned, 1e-9), 0.0, 1.0)
    share = np.where(touches | ~fingers | ~holding.any(axis=1)[:, None], 1.0, share)
    angles = closed.angles * np.where(hand.flexes, np.repeat(share, np.diff(hand.bones), axis=1), 1.0)
    return replace(closed, angles=hand.coupled(angles))
