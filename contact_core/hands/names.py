"""What joint names say: which digit, which segment, which side.

Read are the conventions of Mixamo, Rigify, VRM, Unreal, Daz ("lMid1"), Reallusion, 3ds Max Biped and Valve
("Finger0" to "Finger42"), MakeHuman ("finger2-1.L"), MMD (in Japanese and in English), SMPL-X, WebXR, OpenXR and
ARKit ("MidStart"), and the fingers' names in German, French, Spanish and Italian. Geometry comes first
(contact_core.hands.describe); names confirm it and give the roles.
"""

from __future__ import annotations

import re
import unicodedata
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

Side = Literal["left", "right", ""]
ROLES = ("thumb", "index", "middle", "ring", "little")
DIGITS = {
    "thumb": "thumb", "index": "index", "pointer": "index", "forefinger": "index", "middle": "middle",
    "ring": "ring", "little": "little", "pinky": "little", "pinkie": "little",
    "daumen": "thumb", "zeige": "index", "mittel": "middle", "klein": "little",
    "pouce": "thumb", "majeur": "middle", "annulaire": "ring", "auriculaire": "little",
    "pulgar": "thumb", "indice": "index", "corazon": "middle", "anular": "ring", "menique": "little",
    "pollice": "thumb", "mignolo": "little",
}  # fmt: skip
WHOLE_WORDS = {"mid": "middle", "fore": "index", "third": "ring", "idx": "index", "pink": "little"}
JAPANESE = {
    "親指": "thumb", "人指": "index", "人差": "index", "示指": "index", "中指": "middle", "薬指": "ring",
    "小指": "little",
}  # fmt: skip
# Segment words in the order from the wrist outwards.
SEGMENTS = (
    ("metacarp", 0), ("carpal", 0), ("start", 0), ("proximal", 1), ("intermediate", 2), ("medial", 2),
    ("distal", 3),
)  # fmt: skip
ENDS = ("tip", "end", "nub", "null", "先")
WRISTS = ("wrist", "hand", "palm", "手首")
# A name with one of these is of another part of a body: "hair_middle", "LittleToe", "ForeArm", "SpineMid".
OTHER_PARTS = (
    "toe", "toes", "bigtoe", "foot", "leg", "thigh", "arm", "forearm", "spine", "hair", "skirt", "tail", "ear",
    "wing", "tongue", "neck", "head", "lip", "brow", "eye", "eyebrow", "eyelid", "lid", "mouth", "chest", "jaw",
)  # fmt: skip
TIP_RANK = 99.0


@dataclass(frozen=True)
class DigitJoint:
    """A joint of a digit. rank orders the joints of a digit from the wrist outwards.

    number: what the name counts its segment with, -1 where it has no number.
    """

    digit: str
    side: Side
    rank: float
    segment: str  # "metacarpal", ... as far as the name says it
    number: int = -1

    @property
    def is_tip(self) -> bool:
        return self.rank >= TIP_RANK


def words_of(name: str) -> list[str]:
    """Lower-case words and numbers of a name: "hand_L.IndexFinger01" -> hand, l, index, finger, 01."""
    plain = unicodedata.normalize("NFKC", name.rsplit(":", 1)[-1])
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", plain)
    return re.findall(r"[a-z]+|\d+|[^\W\d_a-z]+", spaced.lower())


_SIDES: tuple[tuple[Side, str, str], ...] = (("left", "l", "左"), ("right", "r", "右"))


def side_of(name: str) -> Side:
    """Left, right, or neither."""
    words = words_of(name)
    for side, short, sign in _SIDES:
        if side in words or short in words or any(w.startswith((side, sign)) or w.endswith(side) for w in words):
            return side
    return ""


def digit_joint(name: str) -> DigitJoint | None:
    """What one name says about a digit; None when it names none. A numbered "finger" counts its thumb as 0."""
    words = words_of(name)
    numbers = [int(word) for word in words if word.isdigit()]
    if any(word in OTHER_PARTS for word in words):
        return None
    digit = _named_digit(words)
    if digit is None and "fingers" in words and not numbers:
        digit = "fingers"  # of a mitten
    if digit is None:
        counted = _counted_finger(words)
        if counted is None:
            return None
        digit, numbers = f"finger {counted[0]}", [counted[1]] if counted[1] >= 0 else []
    number = numbers[-1] if numbers else -1
    rank, segment = float(number) if number >= 0 else 0.5, ""
    for word in words:
        for start, order in SEGMENTS:
            if word.startswith(start) or (start == "metacarp" and word in ("meta", "cmc")):
                rank, segment = order, start
    if any(word in ENDS or word.endswith("先") for word in words):
        rank = TIP_RANK
    segment = "metacarpal" if segment in ("metacarp", "carpal", "start") else segment
    return DigitJoint(_zero_based(digit), side_of(name), rank, segment, number)


def digit_joints(names: Sequence[str]) -> list[DigitJoint | None]:
    """(j,) what the names of one rig say about digits, read together.

    "finger1" is a thumb where five fingers are counted from 1 and none is called a thumb (MakeHuman), an index
    finger where there is a "finger0" (Biped, Valve) or a thumb by name.
    """
    found = [digit_joint(name) for name in names]
    counted = {k: c[0] for k, name in enumerate(names) if found[k] and (c := _counted_finger(words_of(name)))}
    counted = {k: c for k, c in counted.items() if _named_digit(words_of(names[k])) is None}
    named = {joint.digit for k, joint in enumerate(found) if joint and k not in counted}
    if len(named - {"thumb"}) > 1:  # fingers have names here, so a number beside "finger" counts segments
        return [None if k in counted else joint for k, joint in enumerate(found)]
    thumb_named = any(joint and joint.digit == "thumb" and k not in counted for k, joint in enumerate(found))
    if counted and 0 not in counted.values() and not thumb_named and max(counted.values()) in (5, 4, 3):
        for k, count in counted.items():
            joint = found[k]
            if joint is not None and 1 <= count <= len(ROLES):
                found[k] = replace(joint, digit=ROLES[count - 1])
    return found


def _named_digit(words: Sequence[str]) -> str | None:
    for word in words:
        for key, role in DIGITS.items():
            if word.startswith(key):
                return role
        for key, role in JAPANESE.items():
            if key in word:
                return role
    return next((WHOLE_WORDS[word] for word in words if word in WHOLE_WORDS), None)


def _counted_finger(words: Sequence[str]) -> tuple[int, int] | None:
    """Finger and segment of "finger2-1" (2, 1), "Finger21" (2, 1), "Finger2" (2, -1: the first of its digit)."""
    for k, word in enumerate(words[:-1]):
        if word in ("finger", "fingers", "digit") and words[k + 1].isdigit():
            text = words[k + 1]
            after = words[k + 2] if k + 2 < len(words) and words[k + 2].isdigit() else ""
            if after:
                return int(text), int(after)
            if len(text) == 2 and text[0] != "0":
                return int(text[0]), int(text[1])
            return (0, int(text[1])) if len(text) == 2 else (int(text), 0)
    return None


def _zero_based(digit: str) -> str:
    count = digit.removeprefix("finger ")
    return ROLES[int(count)] if count.isdigit() and int(count) < len(ROLES) else digit


def is_wrist(name: str) -> bool:
    return digit_joint(name) is None and any(w in WRISTS or w.endswith("手首") for w in words_of(name))


def tree_from_names(names: Sequence[str]) -> dict[str, str] | None:
    """Parent by name for joints that came without a hierarchy; None when the names do not say it all.

    Each digit is a chain from the wrist outwards. A wrist has the parent "".
    """
    parents: dict[str, str] = {}
    chains: dict[tuple[str, Side], list[tuple[float, str]]] = defaultdict(list)
    wrists = [name for name in names if is_wrist(name)]
    for name, joint in zip(names, digit_joints(names), strict=True):
        if joint is not None:
            chains[joint.digit, joint.side].append((joint.rank, name))
        elif name in wrists:
            parents[name] = ""
        else:
            return None
    for (_, side), chain in chains.items():
        own = [wrist for wrist in wrists if side_of(wrist) == side] or wrists
        ranks = [rank for rank, _ in chain]
        if len(own) != 1 or len(set(ranks)) != len(ranks):
            return None
        parent = own[0]
        for _, name in sorted(chain):
            parents[name] = parent
            parent = name
    return parents


def chain_role(joints: Sequence[DigitJoint | None]) -> tuple[str, Side]:
    """Role and side that most joints of a chain are named for; empty words where they name none."""
    said = [joint for joint in joints if joint is not None]
    if not said:
        return "", ""
    roles = [joint.digit for joint in said]
    sides = [joint.side for joint in said]
    return max(roles, key=roles.count), max(sides, key=sides.count)


def counts_a_tip(joints: Sequence[DigitJoint | None]) -> bool:
    """Whether the last joint of a chain is a tip by its name, or by being the last of four that are counted from 1
    (Mixamo). "metacarpal" in the chain speaks against the latter."""
    last = joints[-1] if joints else None
    if last is not None and last.is_tip:
        return True
    numbers = [joint.number for joint in joints if joint is not None and not joint.segment]
    return len(joints) == 4 and numbers == [1, 2, 3, 4]


def mirrored_name(name: str) -> str | None:
    """The name of the joint on the other side; None when the name has no side."""
    swaps = (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT"), ("左", "右"))
    for one, other in (*swaps, *((b, a) for a, b in swaps)):
        if one in name:
            return name.replace(one, other)
    match = re.search(r"(?<![A-Za-z])([lLrR])(?![A-Za-z])", name) or re.search(r"^([lr])(?=[A-Z])", name)
    if match is None:
        return None
    other_side = {"l": "r", "r": "l", "L": "R", "R": "L"}[match[1]]
    return name[: match.start(1)] + other_side + name[match.end(1) :]


def mirrored_pairs(names: Sequence[str]) -> dict[str, str]:
    """Left joint name -> right joint name, for the pairs that exist."""
    present = set(names)
    return {
        name: other
        for name in names
        if side_of(name) == "left" and (other := mirrored_name(name)) in present and other is not None
    }
