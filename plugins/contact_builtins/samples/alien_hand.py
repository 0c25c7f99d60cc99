"""A three-fingered alien hand: two heavy fingers and a thumb with bulbous pads, 22 cm.

Rig space as for the human hand: fingers along +y, palm towards +z, thumb towards +x.
"""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.digits import MM, Digit, digit, digit_flesh, finer_at_tips, hand_rig
from contact_builtins.samples.fields import (
    Field,
    ball,
    chain,
    common,
    ellipsoid,
    half_space,
    round_cone,
    slab,
    union,
)
from contact_builtins.samples.modelling import surface_of
from contact_core.document.asset import Asset

FINGER_RADII, THUMB_RADII = (15, 11.5, 10, 11.5), (15.5, 12, 11.5)

INDEX = digit("index", (12, 24, 0), (27, 92, -2), (0.3, 1, 0), (0.2, 0, 1), (50, 36, 27), (10, 14, 6), FINGER_RADII)
MIDDLE = digit(
    "middle", (-14, 24, 0), (-27, 90, -2), (-0.26, 1, 0), (-0.2, 0, 1), (50, 36, 27), (10, 14, 6), FINGER_RADII
)
THUMB = digit(
    "thumb", (20, 18, 10), (55, 46, 26), (0.75, 0.8, 0.3), (-0.6, 0.1, 0.75), (44, 32), (2, 6), THUMB_RADII
)
DIGITS = (THUMB, INDEX, MIDDLE)


def build() -> Asset:
    """The hand as a rig of 15 joints."""
    fingers = [union([digit_flesh(d, knobbly=1.5, nail=0.0), _bulb(d)], 4 * MM) for d in DIGITS]
    flesh = union([_palm(), union(fingers, 2 * MM)], 12 * MM)
    sizing = finer_at_tips(DIGITS, (3.2 * MM, 4.5 * MM, 5.5 * MM))
    mesh = surface_of(flesh, np.array([-105, -36, -45]) * MM, np.array([150, 240, 90]) * MM, 3.8 * MM, sizing)
    wrist = ("wrist", np.array([0, -44, 0]) * MM, np.array([0, 20, 0]) * MM, 20 * MM)
    rig = hand_rig("alien_hand", mesh, DIGITS, wrist, 17 * MM)
    return Asset(name=rig.name, mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def _bulb(d: Digit) -> Field:
    """A wide gripping pad at the tip, like a tree frog's."""
    frame, tip, r = d.frames[-1], d.joints[-1], d.radii[-1]
    return ellipsoid(tip + frame[:, 1] * 0.12 * r - frame[:, 0] * 0.1 * r, [1.3 * r, 0.98 * r, 1.28 * r], frame)


def _palm() -> Field:
    """A broad soft palm with a ridge over each metacarpal."""
    cones = [round_cone(d.joints[0], d.joints[1], 17 * MM, 15.5 * MM) for d in (INDEX, MIDDLE)]
    between = slab(INDEX.joints[1], MIDDLE.joints[1], np.array([0, 20, 0]) * MM, 13 * MM)
    base, knuckle = THUMB.joints[0], THUMB.joints[1]
    thenar = chain(
        [base - np.array([4, 4, 0]) * MM, 0.5 * (base + knuckle), knuckle], [17 * MM, 18 * MM, 15.5 * MM], 4 * MM
    )
    fold = slab(base, knuckle + np.array([-3, 2, -4]) * MM, INDEX.joints[1] - np.array([0, 22, -4]) * MM, 9 * MM)
    heel = ball(np.array([-20, 26, 7]) * MM, 17 * MM)
    crest = [
        chain(
            [0.2 * d.joints[1] - np.array([0, 0, 15]) * MM, d.joints[1] - np.array([0, 3, 13]) * MM],
            [5 * MM, 6 * MM],
        )
        for d in (INDEX, MIDDLE)
    ]
    body = union([union([*cones, between, thenar, fold, heel], 14 * MM), *crest], 8 * MM)
    arm = round_cone(np.array([0, 16, 0]) * MM, np.array([0, -50, 0]) * MM, 23 * MM, 20 * MM)
    return common(union([body, arm], 18 * MM), half_space(np.array([0, -31, 0]) * MM, [0, -1, 0]), 8 * MM)
