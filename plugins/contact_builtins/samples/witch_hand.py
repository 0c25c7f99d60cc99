"""A witch's right hand: long knobbly fingers, claws, a narrow palm with its tendons showing; 27 cm.

Rig space as for the human hand: fingers along +y, palm towards +z, thumb towards +x.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contact_builtins.samples.digits import MM, Digit, digit, digit_flesh, finer_at_tips, hand_rig
from contact_builtins.samples.fields import Field, ball, chain, common, half_space, round_cone, slab, union
from contact_builtins.samples.modelling import surface_of
from contact_core.document.asset import Asset

INDEX_RADII, MIDDLE_RADII, RING_RADII = (8.8, 8.0, 7.0, 5.2), (9.0, 8.2, 7.2, 5.3), (8.6, 7.7, 6.8, 5.1)
LITTLE_RADII, THUMB_RADII = (7.8, 6.9, 6.0, 4.7), (9.4, 8.4, 6.2)

FINGERS = (
    digit("index", (12, 24, -2), (24, 96, -4), (0.14, 1, 0), (0.1, 0, 1), (68, 44, 32), (8, 24, 16), INDEX_RADII),
    digit("middle", (3, 26, -4), (3, 101, -7), (0.01, 1, 0), (0, 0, 1), (74, 50, 34), (10, 26, 18), MIDDLE_RADII),
    digit("ring", (-7, 24, -3), (-16, 94, -5), (-0.1, 1, 0), (-0.1, 0, 1), (68, 45, 32), (14, 26, 18), RING_RADII),
    digit(
        "little", (-15, 21, 0), (-32, 82, 0), (-0.26, 1, 0), (-0.2, 0, 1), (54, 34, 27), (12, 28, 18), LITTLE_RADII
    ),
)
THUMB = digit(
    "thumb", (17, 16, 7), (42, 52, 22), (0.5, 0.85, 0.2), (-0.62, 0.1, 0.72), (50, 40), (2, 16), THUMB_RADII
)
DIGITS = (THUMB, *FINGERS)


def build() -> Asset:
    """The hand as a rig of 25 joints."""
    fingers = [union([digit_flesh(d, knobbly=3.2, nail=0.0), _claw(d)], 1.0 * MM) for d in DIGITS]
    flesh = union([_palm(), union(fingers, 1.0 * MM)], 5 * MM)
    sizing = finer_at_tips(DIGITS, (2.2 * MM, 4.0 * MM, 5.0 * MM))
    mesh = surface_of(flesh, np.array([-95, -36, -32]) * MM, np.array([120, 292, 125]) * MM, 3.0 * MM, sizing)
    wrist = ("wrist", np.array([0, -44, 0]) * MM, np.array([0, 14, 0]) * MM, 14 * MM)
    rig = hand_rig("witch_hand", mesh, DIGITS, wrist, 9 * MM)
    return Asset(name=rig.name, mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def _claw(d: Digit) -> Field:
    """A nail that grew for a century: from the back of the tip, bent to the palm side, ending in a point."""
    frame, tip, r = d.frames[-1], d.joints[-1], d.radii[-1]
    local = (
        np.array([[-0.4, -0.45, 0], [1.4, -0.25, 0], [2.9, 0.35, 0], [3.9, 1.0, 0]]) * r
    )  # (4, 3) along, palmar, -
    return chain(list(tip + local @ frame.T), [0.62 * r, 0.58 * r, 0.40 * r, 0.26 * r], 0.8 * MM)


def _palm() -> Field:
    """Bones under thin skin: metacarpals apart, tendons, a hollow palm, a bony wrist."""
    cones = [round_cone(d.joints[0], d.joints[1], 10 * MM, 1.02 * d.radii[0]) for d in FINGERS]
    body = union(cones, 8 * MM)
    sheets = [
        slab(one.joints[0], one.joints[1], 0.8 * two.joints[1] + 0.2 * two.joints[0], 7.5 * MM)
        for one, two in pairwise(FINGERS)
    ]
    body = union([body, *sheets, *_webs()], 5 * MM)
    base, knuckle, index = THUMB.joints[0], THUMB.joints[1], FINGERS[0].joints[1]
    through = [base + np.array([-4, -4, 1]) * MM, 0.5 * (base + knuckle) + np.array([-4, 1, 1]) * MM, knuckle]
    thenar = chain(through, [11 * MM, 12 * MM, 9.6 * MM], 3 * MM)
    fold = slab(
        base + np.array([0, 8, -3]) * MM,
        knuckle + np.array([-3, -9, -4]) * MM,
        index - np.array([4, 30, 0]) * MM,
        5 * MM,
    )
    heel = chain(
        list(np.array([[-17, 10, 5], [-24, 36, 4], [-30, 66, 2]]) * MM), [10 * MM, 10 * MM, 8.4 * MM], 3 * MM
    )
    body = union([body, thenar, fold, heel], 10 * MM)
    tendons = [
        chain([0.15 * d.joints[1] + _BACK, d.joints[1] + 0.75 * _BACK], [3.5 * MM, 3.2 * MM]) for d in FINGERS
    ]
    knuckles = [ball(d.joints[1] - d.frames[1][:, 1] * 3.2 * MM, 1.02 * d.radii[0]) for d in FINGERS]
    body = union([body, *tendons, *knuckles], 5 * MM)
    radius = round_cone(np.array([8, 14, 0]) * MM, np.array([8, -46, 0]) * MM, 14 * MM, 14 * MM)
    ulna = round_cone(np.array([-8, 14, 0]) * MM, np.array([-9, -46, -1]) * MM, 13.5 * MM, 13 * MM)
    styloid = ball(np.array([-17, -9, -8]) * MM, 7 * MM)
    body = union([body, union([radius, ulna, styloid], 7 * MM)], 13 * MM)
    return common(body, half_space(np.array([0, -31, 0]) * MM, [0, -1, 0]), 5 * MM)


_BACK = np.array([0, 0, -9.5]) * MM


def _webs() -> list[Field]:
    webs = []
    for one, two in pairwise(FINGERS):
        ends = [d.joints[1] + 0.16 * (d.joints[2] - d.joints[1]) for d in (one, two)]
        webs.append(slab(ends[0], ends[1], 0.5 * (one.joints[1] + two.joints[1]), 5.5 * MM))
    return webs
