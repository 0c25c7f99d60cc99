"""The palm's plane, and on which side of it the palm is: several witnesses vote."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.hands.anatomy import Anatomy, across, unit
from contact_core.hands.digits import bones_of, in_order, knuckle, knuckle_line, root_point
from contact_core.hands.hubs import Limb
from contact_core.hands.names import chain_role
from contact_core.rig.rotations import exponential

BENT = np.radians(40.0)  # how far digits are bent to see where they go


@dataclass(frozen=True, eq=False)
class PalmFrame:
    """fingers, normal, from_thumb: (3,) unit and square to one another; from_thumb: from the thumb's side across.
    certainty: 0 to 1, how far the witnesses agree on the normal's sign. ordered: the fingers from
    the thumb's side on."""

    fingers: FloatArray
    normal: FloatArray
    from_thumb: FloatArray
    certainty: float
    ordered: list[Limb]

    @property
    def handedness(self) -> float:
        """+1 for a right hand, -1 for a left one."""
        return float(np.sign(np.cross(self.fingers, self.from_thumb) @ self.normal))


def palm_frame(
    anatomy: Anatomy, hub: int, fingers: list[Limb], thumb: Limb | None, told: FloatArray | None
) -> PalmFrame:
    """The frame of a hand whose fingers stand in a row. told: the palm's normal where the author said it."""
    place = [knuckle(anatomy, hub, limb) for limb in fingers]
    knuckles = np.array([anatomy.position[f.joints[k]] for f, k in zip(fingers, place, strict=True)])
    proximal = np.array([bones_of(anatomy, f)[k] for f, k in zip(fingers, place, strict=True)])
    forward = unit(proximal.sum(axis=0))
    palm = knuckles.mean(axis=0) - root_point(anatomy, hub)
    size = float(np.mean([np.linalg.norm(f.tip - k) for f, k in zip(fingers, knuckles, strict=True)]))
    if np.linalg.norm(palm) > 0.4 * size and unit(palm) @ forward > 0.5:
        forward = unit(unit(palm) + forward)
    line = _hinge_line(anatomy, fingers, forward)
    middle = knuckles.mean(axis=0)
    if line is None and len(fingers) == 1 and thumb is not None:  # a mitten
        line = unit(across(fingers[0].tip - thumb.tip, forward))
    elif line is None:
        line = knuckle_line(knuckles, forward)
    if thumb is not None:
        at = 0.5 * (anatomy.position[thumb.joints[0]] + thumb.tip)
        if abs((at - middle) @ line) > 1e-6 * size:
            line = line * -np.sign((at - middle) @ line)
    normal = np.cross(forward, line)
    votes = _votes(anatomy, fingers, thumb, normal, middle, size)
    total = float(np.sum(votes)) if told is None else 3.0 * float(np.sign(told @ normal))
    certainty = min(1.0, abs(total) / max(float(np.abs(votes).sum()), 1e-12)) if told is None else 1.0
    normal = normal if total >= 0 else -normal
    ordered = in_order(anatomy, fingers, line)
    return PalmFrame(forward, normal, line, certainty, ordered)


def _hinge_line(anatomy: Anatomy, fingers: list[Limb], forward: FloatArray) -> FloatArray | None:
    """The common direction of the fingers' hinges, where a robot has them: most joints of a finger bend it."""
    axes = [
        anatomy.rig.rest_world[j, :3, :3] @ anatomy.rig.freedoms[j].frame[:, 0]
        for f in fingers
        for j in f.joints
        if anatomy.rig.freedoms[j].kind == "hinge"
    ]
    if len(axes) < len(fingers):
        return None
    table = np.array(axes)
    _, vectors = np.linalg.eigh(table.T @ table)
    return unit(across(vectors[:, -1], forward))


def _votes(
    anatomy: Anatomy,
    fingers: list[Limb],
    thumb: Limb | None,
    normal: FloatArray,
    middle: FloatArray,
    size: float,
) -> FloatArray:
    """Votes for `normal` (positive) or against it: curl, tips nearing the thumb, flesh, limits, thumb, names."""
    votes = []
    for finger in fingers:
        bones = bones_of(anatomy, finger)
        chord = unit(finger.tip - anatomy.position[finger.joints[0]])
        votes.append(2.0 * float((bones[-1] - bones[0]) @ normal) / len(fingers))
        axis = unit(np.cross(chord, across(normal, chord)))
        if thumb is not None:
            there, back = (np.linalg.norm(bent_tip(anatomy, finger, axis * s) - thumb.tip) for s in (BENT, -BENT))
            votes.append(3.0 * float(back - there) / size / len(fingers))
        votes.append(_flesh(anatomy, finger, normal) / len(fingers))
        votes.append(3.0 * _room(anatomy, finger, axis) / len(fingers))
    if thumb is not None:
        plane = float((0.5 * (anatomy.position[thumb.joints[-1]] + thumb.tip) - middle) @ normal) / size
        votes.append(1.5 * float(np.clip(plane, -0.5, 0.5)))
        side = chain_role([anatomy.names[j] for f in (*fingers, thumb) for j in f.joints])[1]
        votes.append({"right": 0.5, "left": -0.5, "": 0.0}[side])
    return np.array(votes)


def bent_tip(anatomy: Anatomy, limb: Limb, turn: FloatArray) -> FloatArray:
    """(3,) where a digit's tip goes when every joint turns by the rotation vector `turn` (3,), in rig space."""
    rotation = exponential(turn[None])[0][0]
    tip = limb.tip
    for joint in reversed(limb.joints):
        here = anatomy.position[joint]
        tip = here + rotation @ (tip - here)
    return np.asarray(tip)


def _flesh(anatomy: Anatomy, limb: Limb, normal: FloatArray) -> float:
    """How much farther the skin stands off the bones on the normal's side: joints lie near the back of a finger."""
    last = limb.joints[-1]
    skin = anatomy.vertices([last] + ([limb.tip_joint] if limb.tip_joint >= 0 else []))
    if len(skin) < 4:
        return 0.0
    height = (skin - anatomy.position[last]) @ normal
    if height.min() >= 0 or height.max() <= 0:  # the skin is not round the bone
        return 0.0
    return float(np.clip((height.max() + height.min()) / max(float(np.ptp(height)), 1e-12), -1, 1))


def _room(anatomy: Anatomy, limb: Limb, axis: FloatArray) -> float:
    """-1 to 1: which way limited hinges of a digit have more room, as a turn about `axis` (3,)."""
    total = 0.0
    for joint in limb.joints:
        freedom = anatomy.rig.freedoms[joint]
        if freedom.kind != "hinge" or freedom.lower is None or freedom.upper is None:
            continue
        low, high = float(freedom.lower[0]), float(freedom.upper[0])
        if np.isfinite([low, high]).all() and high > low:
            own = anatomy.rig.rest_world[joint, :3, :3] @ freedom.frame[:, 0]
            total += float(own @ axis) * (high + low) / (high - low)
    return total / max(len(limb.joints), 1)
