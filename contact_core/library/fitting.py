"""A carried pose fitted to another object or hand before it is solved: the palm backs out of what it is in, each
digit that takes part curls or opens until it touches, and the thumb looks a little around."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.transform import transform_points
from contact_core.grasping.closing import TOUCH
from contact_core.grasping.hand import STRETCH_PRICE, STRETCHED, Hand, stretches, turn_about
from contact_core.rig.rig import Pose, forward_kinematics
from contact_core.rig.rotations import nearest_rotations

SHARES = np.linspace(-0.7, 0.8, 31)  # of the room of a digit's joints, by which it opens or curls
STIFF = 0.35  # how much a joint that is straight takes part in curling, of one that is bent
LOOKS = np.radians([-24.0, -12.0, 0.0, 12.0, 24.0])  # of the thumb's first joint, about two axes
LOOK_PRICE = 0.03  # hand lengths, for a turn by 24 degrees
OPPOSE = 0.03  # hand lengths that it is worth that the thumb presses against the other digits
TORN, TORN_PRICE = 1.35, 0.3  # skin that is stretched so much spoils a grasp: what more costs
MISSED = 0.1  # hand lengths: a digit that takes part and touches nothing
FAR = 0.06  # hand lengths: pads farther away are not on the object
PALM_REACH = 0.08  # hand lengths that a palm may back out or come nearer


@dataclass(frozen=True, eq=False)
class Fitted:
    """local: (j, 4, 4) the fitted pose, its root in the object's space. misfit: what is amiss, in hand lengths a
    digit: how far pads are from the object, and skin in it."""

    local: FloatArray
    misfit: float


def fitted(
    hand: Hand,
    field: DistanceField,
    local: FloatArray,
    used: BoolArray,
    way: FloatArray,
    palm: bool,
    looks: bool = True,
) -> Fitted:
    """Fit a pose whose root is in the object's space. used: (D,) the digits that take part. way: (3,) unit, out of
    the palm. palm: whether the palm touches. looks: whether the thumb may look around."""
    local = _palm_fitted(hand, field, local, way, palm)
    own = forward_kinematics(hand.rig.parents, local)
    misfit, pressed = 0.0, list[FloatArray]()
    for d in sorted(range(len(hand.digits)), key=lambda d: d == hand.thumb):  # the thumb goes against the others
        thumb = d == hand.thumb and bool(used[d])
        turns = _looks(hand, d, local) if thumb and looks else [(np.eye(3), 0.0)]
        against = np.mean(pressed, axis=0) if thumb and pressed else None
        tried = [_curled(hand, field, own, d, turn, price, bool(used[d]), against) for turn, price in turns]
        best = min(tried, key=lambda each: each[0])
        local = _with(hand, local, d, best[1], best[2])
        misfit += best[0] * bool(used[d])
        if used[d] and best[3] is not None:
            pressed.append(best[3])
    deep = np.maximum(-_clear(hand, field, local), 0.0).sum() / hand.length
    return Fitted(local, misfit / max(int(used.sum()), 1) + float(deep))


def _palm_fitted(hand: Hand, field: DistanceField, local: FloatArray, way: FloatArray, palm: bool) -> FloatArray:
    """Move the hand against `way` until its palm is outside; along it where the palm shall touch and does not."""
    roots, moved = hand.rig.parents < 0, 0.0
    base = local[roots][0] @ np.linalg.inv(hand.rig.rest_local[roots][0])
    points = transform_points(base, hand.tested)
    if not len(points):
        return local
    for _ in range(12):
        gap = float(field.distances(points + moved * way).min()) - TOUCH * hand.length
        if gap >= 0.0 and not (palm and gap > TOUCH * hand.length):
            break
        moved = float(np.clip(moved + 0.8 * gap, -PALM_REACH * hand.length, PALM_REACH * hand.length))
    result = local.copy()
    result[roots, :3, 3] += moved * way
    return result


def _looks(hand: Hand, digit: int, local: FloatArray) -> list[tuple[FloatArray, float]]:
    """Turns of the first bone that bends, with what they cost: how far they go, and how they stretch the skin."""
    bone = [bone for d in hand.digits for bone in d.bones][hand.firsts[digit]]
    x, y = np.eye(3)[:2]
    turns, costs = [], []
    for a, b in itertools.product(LOOKS, LOOKS):
        turns.append(bone.frame @ turn_about(x, a) @ turn_about(y, b) @ bone.frame.T)
        costs.append(LOOK_PRICE * float(np.hypot(a, b)) / np.radians(24.0))
    now = nearest_rotations(local[bone.joint, None, :3, :3])[0]
    from_rest = nearest_rotations(hand.rig.rest_local[bone.joint, None, :3, :3])[0].T @ now
    stretch = stretches(hand.rig, bone.joint, from_rest @ np.array(turns))
    far = STRETCH_PRICE * np.maximum(stretch - STRETCHED, 0.0) + TORN_PRICE * np.maximum(stretch - TORN, 0.0)
    costs = [cost + float(more) for cost, more in zip(costs, far, strict=True)]
    return list(zip(turns, costs, strict=True))


def _bends(hand: Hand, local: FloatArray, digit: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(b,) how far the bones of a digit are bent, how far they may still curl, and how far open."""
    rows = slice(int(hand.bones[digit]), int(hand.bones[digit + 1]))
    now = hand.angles_of(Pose(hand.rig.joints, local))[rows]
    bent = np.clip(now / max(float(now.max(initial=0.0)), 1e-6), 0.0, 1.0)
    weight = (STIFF + (1.0 - STIFF) * bent) * hand.flexes[rows]
    return now, weight * np.maximum(hand.high[rows] - now, 0.0), weight * np.maximum(now - hand.low[rows], 0.0)


def _curled(
    hand: Hand, field: DistanceField, own: FloatArray, digit: int, turn: FloatArray, price: float, touches: bool,
    against: FloatArray | None,
) -> tuple[float, FloatArray, FloatArray, FloatArray | None]:  # fmt: skip
    """What is amiss, the turn, the angles (b,) by which a digit's bones are bent further, and the object's normal
    (3,) where its pads press. against: that of the other digits."""
    local = _local_of(hand, own)
    _, more, less = _bends(hand, local, digit)
    angles = np.where(SHARES[:, None] > 0.0, SHARES[:, None] * more, SHARES[:, None] * less)  # (s, b)
    frames = _frames(hand, own, digit, turn, angles)  # (s, b, 4, 4)
    first, end = hand.probe_starts[digit], hand.probe_starts[digit + 1]
    bones = hand.probe_bones[first:end] - hand.bones[digit]
    points = np.einsum("spij,pj->spi", frames[:, bones][..., :3, :3], hand.probes[first:end])
    points += frames[:, bones][..., :3, 3]
    clear = field.distances(points.reshape(-1, 3)).reshape(len(SHARES), -1).min(axis=1, initial=np.inf)
    s = _where(clear, TOUCH * hand.length, touches)
    off, normal = _pad_misfit(hand, field, frames[s], digit) if touches else (0.0, None)
    if against is not None and normal is not None:
        off += OPPOSE * 0.5 * float(1.0 + normal @ against)
    sunk = max(-float(clear[s]) / hand.length - TOUCH, 0.0)
    missed = MISSED if touches and clear[s] > 2.0 * TOUCH * hand.length else 0.0
    return off + 2.0 * sunk + missed + price, turn, angles[s], normal


def _where(clear: FloatArray, touch: float, touches: bool) -> int:
    """The share with which a digit touches, the nearest to none; none where it needs or finds nothing."""
    start = int(np.abs(SHARES).argmin())
    if clear[start] < -touch:
        free = np.flatnonzero(clear[:start] >= -0.5 * touch)
        return int(free[-1]) if len(free) else int(clear[: start + 1].argmax())
    if touches and clear[start] > touch:
        met = np.flatnonzero(clear[start:] <= touch)
        return start + max(int(met[0]) - (clear[start + met[0]] < -touch), 0) if len(met) else start
    return start


def _pad_misfit(
    hand: Hand, field: DistanceField, frames: FloatArray, digit: int
) -> tuple[float, FloatArray | None]:
    """How far the pads of a digit are from the object and from facing it, in hand lengths a pad, and the object's
    normal (3,) there."""
    rows = np.flatnonzero(hand.has_pad[hand.bones[digit] : hand.bones[digit + 1]])
    if not len(rows):
        return 0.0, None
    b = rows + hand.bones[digit]
    at = np.einsum("bij,bj->bi", frames[rows, :3, :3], hand.pads[b]) + frames[rows, :3, 3]
    normals = np.einsum("bij,bj->bi", frames[rows, :3, :3], hand.pad_normals[b])
    distance, slope = field.sample(at)
    size = np.maximum(np.linalg.norm(slope, axis=1), 1e-9)
    facing = 0.5 * (1.0 + np.einsum("bi,bi->b", normals, slope) / size)
    off = float((np.minimum(np.abs(distance) / hand.length, FAR) + 0.05 * facing).mean())
    return off, np.asarray((slope / size[:, None]).mean(axis=0))


def _frames(hand: Hand, own: FloatArray, digit: int, turn: FloatArray, angles: FloatArray) -> FloatArray:
    """(s, b, 4, 4) object from the bones of a digit, its first bending bone turned, each bent further by (s, b)."""
    first = int(hand.bones[digit])
    result = np.zeros((*angles.shape, 4, 4))
    before, joint_before = None, -1
    for k in range(angles.shape[1]):
        b, joint = first + k, int(hand.joints[first + k])
        bend = np.tile(np.eye(4), (len(angles), 1, 1))
        bend[:, :3, :3] = [turn_about(hand.axes[b], float(angle)) for angle in angles[:, k]]
        if b == hand.firsts[digit]:
            bend[:, :3, :3] = turn @ bend[:, :3, :3]
        step = own[joint] if before is None else np.linalg.inv(own[joint_before]) @ own[joint]
        base = np.broadcast_to(np.eye(4), bend.shape) if before is None else before
        before = result[:, k] = base @ step @ bend
        joint_before = joint
    return result


def _with(hand: Hand, local: FloatArray, digit: int, turn: FloatArray, angles: FloatArray) -> FloatArray:
    """A pose with one digit turned and bent further."""
    result = local.copy()
    for k, angle in enumerate(angles):
        b = int(hand.bones[digit]) + k
        bend = turn_about(hand.axes[b], float(angle))
        bend = turn @ bend if b == hand.firsts[digit] else bend
        result[hand.joints[b], :3, :3] = result[hand.joints[b], :3, :3] @ bend
    return result


def _local_of(hand: Hand, own: FloatArray) -> FloatArray:
    parents = hand.rig.parents
    base = np.where((parents >= 0)[:, None, None], own[parents], np.eye(4))
    return np.asarray(np.linalg.inv(base) @ own)


def _clear(hand: Hand, field: DistanceField, local: FloatArray) -> FloatArray:
    """(D + 1,) the least signed distance of each digit, and of the palm."""
    own = forward_kinematics(hand.rig.parents, local)
    frames = own[hand.joints[hand.probe_bones]]
    points = np.einsum("pij,pj->pi", frames[:, :3, :3], hand.probes) + frames[:, :3, 3]
    distance = field.distances(points)
    result = [distance[a:b].min(initial=1.0) for a, b in itertools.pairwise(hand.probe_starts)]
    roots = hand.rig.parents < 0
    base = local[roots][0] @ np.linalg.inv(hand.rig.rest_local[roots][0])
    palm = field.distances(transform_points(base, hand.tested)).min(initial=1.0) if len(hand.tested) else 1.0
    return np.array([*result, palm])
