"""A first look at many closed hands: how good each seems from its pads alone, and which are not like one
another."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.grasping.closing import ON, TOUCH, Closed
from contact_core.grasping.facts import STRAIGHT, along, enclosure
from contact_core.grasping.hand import Hand, spread_out
from contact_core.grasping.slots import Approaches

AT_REACH, AT_PRICE = 0.08, 6.0  # hand lengths from the place to hold that are free, and what one more costs
FAR = 0.06  # hand lengths: a pad farther away is not on the object
DEEP = 0.012  # hand lengths: skin this much deeper spoils a grasp
SHALLOW = 0.004  # hand lengths that a solve makes good
ALIKE = 0.016  # hand lengths: grasps whose hand sees the object so alike are one
OPPOSED = np.radians(110.0)  # that fingers press from against thumb and palm; less is a hand laid on a thing
SEEN = 160  # points of the hand from which the object is seen
TOUCHING = 0.02  # hand lengths


def first_look(hand: Hand, mesh: TriangleMesh, approaches: Approaches, closed: Closed) -> FloatArray:
    """(N,) the higher the better; -inf where the approach found nothing."""
    used = approaches.used(hand)  # (N, D)
    sideways = np.array([kind == "lateral" for kind in approaches.kinds], bool)
    digit = np.repeat(np.arange(len(hand.bones) - 1), np.diff(hand.bones))  # (B,)
    pads = hand.has_pad[None] & used[:, digit] & ~(sideways[:, None] & (digit == hand.first_finger))  # (N, B)
    count = np.maximum(pads.sum(axis=1), 1)
    distance = np.abs(closed.fits[:, :, 0]) / hand.length
    fit = (np.minimum(distance / FAR, 1.0) * pads).sum(axis=1) / count
    facing = ((1.0 + closed.fits[:, :, 1]) * pads).sum(axis=1) / (2.0 * count)
    touches = (closed.clear < TOUCHING * hand.length) & used
    contact = touches.sum(axis=1) / np.maximum(used.sum(axis=1), 1)
    outwards = -closed.placed[:, None, :3, :3] @ hand.frame[:, 0]  # (N, 1, 3) the object's normal under the palm
    normals = np.concatenate([closed.fits[:, :, 2:5], outwards], axis=1)
    touched = np.concatenate([pads & (distance < 0.5 * FAR), closed.palm[:, None] < TOUCHING * hand.length], axis=1)
    around = np.clip(enclosure(normals, touched.astype(float)), -0.5, 0.5)
    deepest = np.minimum(np.minimum(closed.clear.min(axis=1), closed.palm), closed.rest)
    sunk = np.clip((-deepest / hand.length - SHALLOW) / DEEP, 0.0, 5.0)
    through = np.minimum(bones_crossing(hand, mesh, closed), 4)
    held = np.array([kind in ("power", "hook") for kind in approaches.kinds])
    palm = np.where(held, np.clip((closed.palm / hand.length - 2 * TOUCH) / 0.05, 0.0, 1.0), 0.0)
    value = 1.2 * contact - fit - 0.8 * facing + 0.9 * around - 0.8 * sunk - 0.5 * palm - 0.5 * through
    value = value - 0.35 * uneven(hand, closed.angles, used) - 0.4 * straight(hand, closed.angles, used)
    value = value - np.where((around < -0.1) & ~sideways & (np.array(approaches.kinds) != "hook"), 0.3, 0.0)
    laid = np.clip((OPPOSED - opposed(hand, closed, used, touched)) / (0.5 * np.pi), 0.0, 1.0)
    value = value - 0.8 * np.where(sideways | (np.array(approaches.kinds) == "hook"), 0.0, laid)
    if hand.thumb >= 0:  # where it takes part, it shall touch, and go round a thing with the fingers
        value = value - 0.4 * np.where(used[:, hand.thumb], thumb_along(hand, closed, pads), 0.0)
        value = value - np.where(used[:, hand.thumb] & ~touches[:, hand.thumb], 0.5, 0.0)
    return np.where(np.isfinite(closed.travel), value, -np.inf)


def bones_crossing(hand: Hand, mesh: TriangleMesh, closed: Closed) -> IntArray:
    """(N,) how many bones, metacarpals included, go through the object's surface: what a thin wall hides from
    distances."""
    frames = hand.frames(closed.placed, closed.angles, closed.turns)
    ends = np.einsum("nbij,bej->nbei", frames[:, :, :3, :3], hand.capsules) + frames[:, :, None, :3, 3]
    firsts = frames[:, hand.firsts][:, :, :3, 3]  # (N, D, 3)
    hub = closed.placed @ np.append(hand.rig.rest_world[hand.description.hub, :3, 3], 1.0)
    palm = np.stack([np.broadcast_to(hub[:, None, :3], firsts.shape), firsts], axis=2)
    joined = np.stack([ends[:, :-1, 1], ends[:, 1:, 0]], axis=2)  # across the joints of a digit
    joined = joined[:, np.setdiff1d(np.arange(len(hand.joints) - 1), hand.bones[1:-1] - 1)]
    segments = np.concatenate([ends[:, hand.flexes], palm, joined], axis=1)
    start, way = segments[:, :, 0].reshape(-1, 3), (segments[:, :, 1] - segments[:, :, 0]).reshape(-1, 3)
    real = np.linalg.norm(way, axis=1) > 1e-9 * hand.length
    crossed = np.zeros(len(way), bool)
    crossed[real] = Locator.of(mesh).cast(start[real], way[real], max_distance=1.0).found
    return np.asarray(crossed.reshape(len(closed.placed), -1).sum(axis=1))


def opposed(hand: Hand, closed: Closed, used: BoolArray, touched: BoolArray) -> FloatArray:
    """(N,) radians: `facts.opposition` as pads tell it. used: (N, D); touched: (N, B + 1) which pads are on the
    object, and the palm."""
    bones, n = len(hand.joints), len(closed.placed)
    palm = np.broadcast_to(-closed.placed[:, :3, :3] @ hand.frame[:, 0], (n, 3))[:, None]
    normals = np.concatenate([closed.fits[:, :, 2:5], palm], axis=1)
    thumb = np.zeros(bones + 1, bool)
    thumb[-1] = True
    if hand.thumb >= 0:
        thumb[hand.bones[hand.thumb] : hand.bones[hand.thumb + 1]] = True
    along = np.einsum("nbi,nci->nbc", normals, normals)
    along = np.where((thumb & touched)[:, None, :], along, 1.0).min(axis=2)  # (N, B + 1)
    angles = np.full(used.shape, np.nan)
    for digit in range(used.shape[1]):
        for b in range(hand.bones[digit], hand.bones[digit + 1]):  # the last that touches counts
            if digit != hand.thumb and hand.has_pad[b]:
                here = touched[:, b] & used[:, digit]
                angles[here, digit] = np.arccos(np.clip(along[here, b], -1.0, 1.0))
    none = np.isnan(angles).all(axis=1)
    angles[none] = 0.0
    return np.asarray(np.nanmedian(angles, axis=1))


def thumb_along(hand: Hand, closed: Closed, pads: BoolArray) -> FloatArray:
    """(N,) `facts.along` of the thumb, as pads (N, B) that take part tell it."""
    fingers = np.arange(len(hand.joints)) >= hand.bones[hand.thumb + 1]
    press = pads & fingers & (np.abs(closed.fits[:, :, 0]) < ON * hand.length)  # (N, B)
    last = int(hand.bones[hand.thumb + 1]) - 1
    frames = hand.frames(closed.placed, closed.angles, closed.turns)[:, last, :3, :3]
    return along(closed.fits[:, :, 2:5], press, frames @ np.diff(hand.capsules[last], axis=0)[0])


def uneven(hand: Hand, angles: FloatArray, used: BoolArray) -> FloatArray:
    """(N,) the largest difference in bend of two neighbouring fingers that take part, in right angles."""
    total = np.add.reduceat(np.where(hand.flexes, angles, 0.0), hand.bones[:-1], axis=1)  # (N, D)
    fingers = [d for d in range(total.shape[1]) if d != hand.thumb]
    both = used[:, fingers[1:]] & used[:, fingers[:-1]]
    steps = np.where(both, np.abs(np.diff(total[:, fingers], axis=1)), 0.0)
    return np.asarray(steps.max(axis=1, initial=0.0) / (np.pi / 2.0))


def elsewhere(hand: Hand, closed: Closed, at: FloatArray | None) -> FloatArray:
    """(N,) the price of touching far from the place (3,) that is to be held; nothing where no place is named."""
    if at is None:
        return np.zeros(len(closed.placed))
    touching = hand.has_pad & (np.abs(closed.fits[:, :, 0]) < 0.5 * FAR * hand.length)
    away = np.where(touching, np.linalg.norm(closed.fits[:, :, 5:8] - at, axis=2), np.inf).min(axis=1) / hand.length
    return np.asarray(AT_PRICE * np.clip(away - AT_REACH, 0.0, 1.0))


def straight(hand: Hand, angles: FloatArray, used: BoolArray) -> FloatArray:
    """(N,) the share of the fingers that take part which are hardly bent: a flat hand laid on a thing holds
    nothing."""
    total = np.add.reduceat(np.where(hand.flexes, angles, 0.0), hand.bones[:-1], axis=1)
    fingers = used & (np.arange(total.shape[1]) != hand.thumb)
    return np.asarray(((total < STRAIGHT) & fingers).sum(axis=1) / np.maximum(fingers.sum(axis=1), 1))


def seen_from(hand: Hand, field: DistanceField, placed: FloatArray) -> FloatArray:
    """(N, p) the signed distances of the object from fixed points of the hand: equal grasps of a symmetric object
    see the same."""
    tips = np.array([digit.tip for digit in hand.description.digits])
    points = np.concatenate([hand.tested, tips, tips + 0.12 * hand.length * hand.frame[:, 0]])
    points = points[spread_out(points, SEEN, 0)]
    reach = 0.5 * hand.length
    return np.array([np.clip(field.distances(transform_points(g, points)), -reach, reach) for g in placed])


def distinct(seen: FloatArray, order: IntArray, count: int, length: float, alike: float = ALIKE) -> IntArray:
    """The first `count` of `order` that are not like one already taken."""
    taken: list[int] = []
    for n in order:
        gaps = [float(np.abs(seen[n] - seen[m]).mean()) for m in taken]
        if not gaps or min(gaps) > alike * length:
            taken.append(int(n))
        if len(taken) >= count:
            break
    return np.array(taken, np.int64)
