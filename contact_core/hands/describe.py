"""`describe_hand`: what a hand is, from geometry, weights and hierarchy first, and from names second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.hands.anatomy import Anatomy, across, unit
from contact_core.hands.description import Digit, HandDescription, HandWords, Palm
from contact_core.hands.digits import bones_of, has_metacarpal, knuckle, roles, root_point, roundness, thumb_of
from contact_core.hands.flexion import Habit, common_habit, finger_bones, segments, thumb_bones
from contact_core.hands.hubs import Hub, Limb, hub_at, hubs_of
from contact_core.hands.names import Side, chain_role
from contact_core.hands.pads import pads_of, palm_point
from contact_core.hands.palms import BENT, PalmFrame, bent_tip, palm_frame
from contact_core.rig.rig import Rig

ROUND = 0.35  # digits whose bases are rounder than this, and none of them a thumb, stand round an axis
SURE = 0.25  # below this certainty the palm's side is asked for


def describe_hand(rig: Rig, words: Sequence[HandWords] = ()) -> HandDescription:
    """The most hand-like hand of a rig. Raises InvalidInput where no joint has digits."""
    hands = describe_hands(rig, words)
    if not hands:
        raise InvalidInput(
            f"no joint of {rig.name} has chains below it that are like digits; name the joint where they part with"
            ' [[hand]] hub = "..." in rig.toml.'
        )
    return hands[0]


def describe_hands(rig: Rig, words: Sequence[HandWords] = ()) -> tuple[HandDescription, ...]:
    """All hands of a rig, the most hand-like first; those that `words` name come before others.

    Raises InvalidInput where `words` name a joint that is not there, or at which no two digits part.
    """
    anatomy = Anatomy(rig)
    told = [(hub_told(anatomy, word), word) for word in words]
    taken = {hub.joint for hub, _ in told}
    found = [(hub, None) for hub in hubs_of(anatomy) if hub.joint not in taken]
    return tuple(_described(anatomy, hub, word) for hub, word in (*told, *found))


def hub_told(anatomy: Anatomy, words: HandWords) -> Hub:
    """The hub that a rig's author names. Raises InvalidInput."""
    hub = hub_at(anatomy, anatomy.rig.joint_index(words.hub))
    if hub is None:
        raise InvalidInput(f"fewer than two chains of joints part at {words.hub!r}, so it is no hub of a hand.")
    return hub


def _described(anatomy: Anatomy, hub: Hub, words: HandWords | None) -> HandDescription:
    at, notes = thumb_of(anatomy, hub, words)
    thumb = hub.limbs[at] if at >= 0 else None
    fingers = [limb for k, limb in enumerate(hub.limbs) if k != at]
    bases = np.array([anatomy.position[limb.joints[0]] for limb in fingers])
    tips = np.array([limb.tip for limb in fingers])
    forward = unit(np.sum([bones_of(anatomy, limb)[0] for limb in fingers], axis=0))
    claw = thumb is None and (len(fingers) == 2 or roundness(np.concatenate([bases, tips]), forward) > ROUND)
    if claw or (len(fingers) < 2 and thumb is None):
        return _claw(anatomy, hub, words, notes)
    frame = palm_frame(anatomy, hub.joint, fingers, thumb, np.array(words.palm) if words and words.palm else None)
    return _hand(anatomy, hub, frame, thumb, words, notes)


def _hand(
    anatomy: Anatomy, hub: Hub, frame: PalmFrame, thumb: Limb | None, words: HandWords | None, notes: list[str]
) -> HandDescription:
    """A hand whose fingers stand in a row."""
    names = roles(anatomy, frame.ordered, words)
    digits, habits = list[Digit](), list[Habit]()
    knuckles = []
    for role, limb in zip(names, frame.ordered, strict=True):
        parts = segments(len(limb.joints), has_metacarpal(anatomy, hub.joint, limb), False)
        bones, own = finger_bones(anatomy, limb, frame.normal, parts)
        digits.append(Digit(role, bones, limb.tip, limb.tip_joint))
        habits += own
        knuckles.append(anatomy.position[limb.joints[knuckle(anatomy, hub.joint, limb)]])
    middle = np.mean(knuckles, axis=0)
    opposition = None
    if thumb is not None:
        bent = [bent_tip(anatomy, f, BENT * _closing_axis(anatomy, f, frame.normal)) for f in frame.ordered]
        target = np.mean(bent, axis=0)
        parts = segments(len(thumb.joints), True, True)
        bones = thumb_bones(anatomy, thumb, target, common_habit(habits), parts)
        digits.insert(0, Digit("thumb", bones, thumb.tip, thumb.tip_joint))
        opposition = unit(np.mean([f.tip for f in frame.ordered], axis=0) - thumb.tip)
    width = float(np.ptp(np.array(knuckles) @ frame.from_thumb))
    width = max(width, 0.3 * float(np.mean([np.linalg.norm(f.tip - middle) for f in frame.ordered])))
    start = root_point(anatomy, hub.joint)
    if (middle - start) @ frame.fingers < 0.3 * width:  # a robot's base: the palm is behind the knuckles
        start = middle - 1.2 * width * frame.fingers
    inside = 0.65 * middle + 0.35 * start
    palm = Palm(palm_point(anatomy, inside, frame.normal), frame.normal, frame.fingers)
    side, more = _side(anatomy, hub, frame, thumb, words)
    if frame.certainty < SURE:
        more.append(_ask(anatomy, hub, "on which side the palm is", "palm = [x, y, z]"))
    if thumb is None:
        more.append(_ask(anatomy, hub, "which digit is the thumb", 'thumb = "joint"'))
    pads = pads_of(anatomy, tuple(digits), palm, hub.joint, width)
    confidence = hub.likeness * (0.5 + 0.5 * frame.certainty)
    return HandDescription(hub.joint, side, palm, tuple(digits), pads, opposition, confidence, (*notes, *more))


def _claw(anatomy: Anatomy, hub: Hub, words: HandWords | None, notes: list[str]) -> HandDescription:
    """Digits round an axis: each closes towards it."""
    bases = np.array([anatomy.position[limb.joints[0]] for limb in hub.limbs])
    tips = np.array([limb.tip for limb in hub.limbs])
    centre = bases.mean(axis=0)
    axis = unit(np.sum([unit(t - b) for t, b in zip(tips, bases, strict=True)], axis=0))
    told = np.array(words.palm) if words and words.palm else None
    axis = axis if told is None else unit(told)
    digits: list[Digit] = []
    for limb in _around(anatomy, hub.limbs, centre, axis):
        middle = np.mean([anatomy.position[j] for j in limb.joints] + [limb.tip], axis=0)
        closing = across(centre - middle, axis)
        parts = segments(len(limb.joints), has_metacarpal(anatomy, hub.joint, limb), False)
        bones, _ = finger_bones(anatomy, limb, closing, parts)
        role = chain_role([anatomy.names[j] for j in limb.joints])[0]
        digits.append(Digit(role or f"digit {len(digits) + 1}", bones, limb.tip, limb.tip_joint))
    if len({digit.role for digit in digits}) < len(digits):
        digits = [Digit(f"digit {k + 1}", d.bones, d.tip, d.tip_joint) for k, d in enumerate(digits)]
    palm = Palm(palm_point(anatomy, centre, axis), axis, axis, is_plane=False)
    pads = pads_of(anatomy, tuple(digits), palm, hub.joint, 0.0)
    joint = anatomy.rig.joints[hub.joint]
    notes = [
        *notes,
        f"The digits at {joint} stand round an axis: it has no palm, and each digit closes towards the axis.",
    ]
    return HandDescription(hub.joint, "", palm, tuple(digits), pads, None, hub.likeness, tuple(notes))


def _closing_axis(anatomy: Anatomy, limb: Limb, normal: FloatArray) -> FloatArray:
    """(3,) unit axis about which a straight digit turns towards the palm's normal."""
    chord = unit(limb.tip - anatomy.position[limb.joints[0]])
    return unit(np.cross(chord, across(normal, chord)))


def _around(anatomy: Anatomy, limbs: Sequence[Limb], centre: FloatArray, axis: FloatArray) -> list[Limb]:
    """Digits in their order round an axis, the first joint's first."""
    first = unit(across(limbs[0].tip - centre, axis))
    second = np.cross(axis, first)

    def angle(limb: Limb) -> float:
        way = limb.tip - centre
        return float(np.arctan2(way @ second, way @ first) % (2 * np.pi - 1e-6))

    return sorted(limbs, key=angle)


def _side(
    anatomy: Anatomy, hub: Hub, frame: PalmFrame, thumb: Limb | None, words: HandWords | None
) -> tuple[Side, list[str]]:
    """Which hand it is, by its shape; a note where the names say the other one."""
    if words is not None and words.side:
        return words.side, []
    named = chain_role([anatomy.names[j] for limb in hub.limbs for j in limb.joints])[1]
    if thumb is None:
        return named, []
    shape: Side = "right" if frame.handedness > 0 else "left"
    if named and named != shape:
        joint = anatomy.rig.joints[hub.joint]
        return shape, [f"The hand at {joint} is a {shape} one by its shape, though its names say {named}."]
    return shape, []


def _ask(anatomy: Anatomy, hub: Hub, what: str, line: str) -> str:
    joint = anatomy.rig.joints[hub.joint]
    return (
        f'It could not be told {what} of the hand at {joint}; say it in rig.toml: [[hand]] hub = "{joint}", {line}.'
    )
