"""How a hand brings the pad of its thumb to face those of its fingers, by how far apart they then are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.grasping.hand import Hand, turn_about
from contact_core.grasping.slots import Kind

CURLS = (0.12, 0.2, 0.28, 0.36, 0.44, 0.52, 0.6)  # of their room, that fingers are bent
THUMB_CURLS = (0.0, 0.2, 0.4, 0.6)
TURNED = 0.15  # hand lengths that pads are worth which look past each other
WIDTHS = 12
SIDEWAYS = 0.55  # of their room, that fingers are bent whose side holds


@dataclass(frozen=True, eq=False)
class Opposition:
    """width: between the pads. middle: (3,) halfway, rig space. towards: (3,) unit, thumb to fingers. digits: those
    that take part. curl: of the fingers just before they touch. misfit: how badly the pads face each other. room:
    how far the palm is from the middle."""

    width: float
    middle: FloatArray
    towards: FloatArray
    digits: tuple[int, ...]
    curl: float
    misfit: float
    room: float


def oppositions(hand: Hand, kind: Kind) -> list[Opposition]:
    """The best by width, from closed to wide open, and by how far the fingers are bent; none for a hand without a
    thumb or pads."""
    if hand.thumb < 0:
        return []
    fingers = _fingers(hand, kind)
    thumbs = [
        _pad(hand, hand.thumb, start, share)
        for start in range(int(hand.start_counts[hand.thumb]))
        for share in THUMB_CURLS
    ]
    best: dict[tuple[int, float, bool], Opposition] = {}
    for curl in CURLS:
        if kind == "lateral":
            curl = SIDEWAYS
        virtual = [_side(hand, d, curl) if kind == "lateral" else _pad(hand, d, 0, curl) for d in fingers]
        if any(pad is None for pad in virtual) or any(pad is None for pad in thumbs):
            return []
        at = np.mean([pad[0] for pad in virtual if pad], axis=0)
        out = np.mean([pad[1] for pad in virtual if pad], axis=0)
        for pad in thumbs:
            assert pad is not None
            gap = at - pad[0]
            width = float(np.linalg.norm(gap))
            line = gap / max(width, 1e-12)
            misfit = TURNED * ((1.0 - pad[1] @ line) + (1.0 + out @ line))
            digits = (hand.thumb, *fingers)
            middle = 0.5 * (at + pad[0])
            room = float(np.linalg.norm(hand.tested - middle, axis=1).min())
            one = Opposition(width, middle, line, digits, 0.75 * curl, float(misfit), room)
            place = (int(WIDTHS * width / hand.length), curl, room > 0.5 * width)
            if width > 0.01 * hand.length and (place not in best or misfit < best[place].misfit):
                best[place] = one
    return [one for one in best.values() if one.misfit < 1.6 * TURNED]


def _fingers(hand: Hand, kind: Kind) -> tuple[int, ...]:
    """The fingers that take part: the first for a pinch, up to three for a precision grasp."""
    others = [d for d in range(len(hand.bones) - 1) if d != hand.thumb]
    return tuple(others[: {"pinch": 1, "lateral": 1, "precision": 3}.get(kind, 3)])


def frame_of(hand: Hand, digit: int, start: int, share: float, last: int) -> FloatArray:
    """(3, 4) of a bone of a digit bent by a share of its room, in rig space."""
    frame = np.eye(4)
    for b in range(hand.bones[digit], last + 1):
        turn = np.eye(4)
        angle = share * hand.high[b] if hand.flexes[b] else 0.0
        if digit == hand.thumb and b == hand.firsts[digit]:
            angle = hand.start_angles[digit, start]
        turn[:3, :3] = turn_about(hand.axes[b], float(angle))
        if b == hand.firsts[digit]:
            turn[:3, :3] = hand.starts[digit, start] @ turn[:3, :3]
        frame = frame @ np.vstack([hand.links[b], [0.0, 0.0, 0.0, 1.0]]) @ turn
    return frame[:3]


def _pad(hand: Hand, digit: int, start: int, share: float) -> tuple[FloatArray, FloatArray] | None:
    """Position and normal (3,) of the pad at the tip of a bent digit."""
    own = [b for b in range(hand.bones[digit], hand.bones[digit + 1]) if hand.has_pad[b]]
    if not own:
        return None
    frame = frame_of(hand, digit, start, share, own[-1])
    return frame @ np.append(hand.pads[own[-1]], 1.0), frame[:, :3] @ hand.pad_normals[own[-1]]


def _side(hand: Hand, digit: int, share: float) -> tuple[FloatArray, FloatArray] | None:
    """Position and normal of the thumb's side of a bent finger, halfway along its last bone but one."""
    flexing = [b for b in range(hand.bones[digit], hand.bones[digit + 1]) if hand.flexes[b] and hand.radii[b] > 0.0]
    if len(flexing) < 2:
        return None
    b = flexing[-2]
    frame = frame_of(hand, digit, 0, share, b)
    out = hand.thumbwards
    middle = frame @ np.append(hand.capsules[b].mean(axis=0), 1.0)
    return middle + hand.radii[b] * out, out
