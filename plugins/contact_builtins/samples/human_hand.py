"""A right human hand, 18 cm from wrist to middle fingertip, open and relaxed.

Rig space: fingers along +y, palm towards +z, thumb towards +x, wrist joint at the origin. Bone lengths and
widths follow the averages of hand anthropometry (Garrett 1971; Buryanov and Kotiuk 2010), rounded.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contact_builtins.samples.digits import MM, Digit, digit, digit_flesh, finer_at_tips, hand_rig
from contact_builtins.samples.fields import Field, ball, chain, common, half_space, round_cone, slab, union
from contact_builtins.samples.modelling import surface_of
from contact_core.document.asset import Asset

# Half thickness at knuckle, middle joint, last joint and tip, in millimetres.
INDEX_RADII, MIDDLE_RADII = (10.2, 9.2, 8.2, 6.9), (10.4, 9.4, 8.4, 7.0)
RING_RADII, LITTLE_RADII = (9.8, 8.8, 7.9, 6.7), (8.9, 7.7, 7.0, 5.9)
THUMB_RADII = (11.4, 10.3, 8.2)

# Name; metacarpal base, knuckle; direction and palm side of the finger; phalanges; rest curl; radii.
FINGERS = (
    digit("index", (14, 22, -2), (25, 84, -4), (0.1, 1, 0), (0.06, 0, 1), (41, 24, 18), (9, 12, 7), INDEX_RADII),
    digit("middle", (3, 24, -4), (3, 88, -7), (0, 1, 0), (0, 0, 1), (45, 28, 18), (10, 14, 8), MIDDLE_RADII),
    digit("ring", (-8, 22, -3), (-18, 82, -5), (-0.09, 1, 0), (-0.08, 0, 1), (42, 26, 18), (12, 16, 9), RING_RADII),
    digit(
        "little", (-18, 19, 0), (-36, 72, 0), (-0.24, 1, 0), (-0.2, 0, 1), (33, 19, 16), (12, 16, 10), LITTLE_RADII
    ),
)
THUMB = digit(
    "thumb", (19, 16, 8), (46, 48, 22), (0.5, 0.85, 0.2), (-0.62, 0.1, 0.72), (33, 24), (4, 8), THUMB_RADII
)
DIGITS = (THUMB, *FINGERS)


def build() -> Asset:
    """The hand as a rig of 25 joints, named as in WebXR and OpenXR."""
    flesh = union([palm_flesh(), union([digit_flesh(d) for d in DIGITS], 1.5 * MM)], 6 * MM)
    sizing = finer_at_tips(DIGITS, (2.5 * MM, 3.6 * MM, 4.8 * MM))
    mesh = surface_of(flesh, np.array([-75, -30, -32]) * MM, np.array([92, 195, 60]) * MM, 3.0 * MM, sizing)
    wrist = ("wrist", np.array([0, -40, 0]) * MM, np.array([0, 14, 0]) * MM, 17 * MM)
    rig = hand_rig("human_hand", mesh, DIGITS, wrist, 12 * MM)
    return Asset(name=rig.name, mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def palm_flesh() -> Field:
    """Metacarpals under one skin, the balls of thumb and little finger, webs, knuckles and wrist."""
    index, _, _, little = FINGERS
    body = union([round_cone(d.joints[0], d.joints[1], 13 * MM, 1.10 * d.radii[0]) for d in FINGERS], 10 * MM)
    body = union([body, *_webs()], 6 * MM)
    mounts = [ball(d.joints[1] + d.frames[1] @ np.array([-3, 3.2, 0]) * MM, 8.6 * MM) for d in FINGERS]
    body = union([body, *mounts], 12 * MM)
    body = union([body, _thenar(), _thumb_web(index), _hypothenar(little)], 13 * MM)
    knuckles = [ball(d.joints[1] - d.frames[1][:, 1] * 2.6 * MM, 0.95 * d.radii[0]) for d in FINGERS]
    body = union([body, *knuckles], 5 * MM)
    return common(union([body, _wrist()], 16 * MM), half_space(np.array([0, -26, 0]) * MM, [0, -1, 0]), 6 * MM)


def _webs() -> list[Field]:
    """The skin between the fingers, a third of the first phalanx long."""
    webs = []
    for one, two in pairwise(FINGERS):
        ends = [d.joints[1] + 0.34 * (d.joints[2] - d.joints[1]) + 1.5 * MM * d.frames[1][:, 1] for d in (one, two)]
        webs.append(slab(ends[0], ends[1], 0.5 * (one.joints[1] + two.joints[1]), 7.0 * MM))
    return webs


def _thenar() -> Field:
    """The ball of the thumb."""
    base, knuckle = THUMB.joints[0], THUMB.joints[1]
    through = [base + np.array([-4, -4, 1]) * MM, 0.5 * (base + knuckle) + np.array([-5, 1, 2]) * MM, knuckle]
    return chain(through, [13 * MM, 14.5 * MM, 11.4 * MM], 4 * MM)


def _thumb_web(index: Digit) -> Field:
    """The fold from thumb to index finger."""
    base, knuckle = THUMB.joints[0], THUMB.joints[1]
    offsets = np.array([[0, 8, -3], [-3, -5, -4], [-4, -18, 2]]) * MM
    return slab(base + offsets[0], knuckle + offsets[1], index.joints[1] + offsets[2], 6.5 * MM)


def _hypothenar(little: Digit) -> Field:
    """The heel of the hand on the little finger's side."""
    through = np.array([[-19, 10, 5], [-28, 34, 5], [-34, 60, 3]]) * MM
    return chain(list(through), [12 * MM, 13 * MM, 1.15 * little.radii[0]], 4 * MM)


def _wrist() -> Field:
    """The ends of radius and ulna."""
    radius = round_cone(np.array([9, 14, 0]) * MM, np.array([10, -42, 0]) * MM, 17.5 * MM, 17 * MM)
    ulna = round_cone(np.array([-9, 14, 0]) * MM, np.array([-11, -42, 0]) * MM, 17 * MM, 16 * MM)
    return union([radius, ulna], 10 * MM)
