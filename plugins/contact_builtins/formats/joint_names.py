"""What joint names say: which digit, which segment, which side. Conventions differ; the words hardly do."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from contact_core.arrays import IntArray

DIGITS = {
    "thumb": "thumb", "index": "index", "pointer": "index", "middle": "middle", "ring": "ring",
    "little": "little", "pinky": "little", "pinkie": "little",
}  # fmt: skip
# Segment words in the order from the wrist outwards.
SEGMENTS = (("metacarp", 0), ("carpal", 0), ("proximal", 1), ("intermediate", 2), ("medial", 2), ("distal", 3))
ENDS = ("tip", "end", "nub", "null")
WRISTS = ("wrist", "hand", "palm")
Side = Literal["left", "right", ""]


@dataclass(frozen=True)
class DigitJoint:
    """A joint of a digit. rank orders the joints of a digit from the wrist outwards."""

    digit: str
    side: Side
    rank: float
    segment: str  # "metacarpal", ... as far as the name says it


def words_of(name: str) -> list[str]:
    """Lower-case words and numbers of a name: "hand_L.IndexFinger01" -> hand, l, index, finger, 01."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.rsplit(":", 1)[-1])
    return re.findall(r"[a-z]+|\d+", spaced.lower())


def side_of(name: str) -> Side:
    """Left, right, or neither."""
    words = words_of(name)
    for side, short in (("left", "l"), ("right", "r")):
        if side in words or short in words or any(w.startswith(side) or w.endswith(side) for w in words):
            return side  # type: ignore[return-value]
    return ""


def digit_joint(name: str) -> DigitJoint | None:
    """What a name says about a digit; None when it names none."""
    words = words_of(name)
    digit = next((DIGITS[key] for word in words for key in DIGITS if word.startswith(key)), None)
    if digit is None:
        return None
    numbers = [int(word) for word in words if word.isdigit()]
    rank: float = numbers[-1] if numbers else 0.5
    segment = ""
    for word in words:
        for start, order in SEGMENTS:
            if word.startswith(start) or (start == "metacarp" and word in ("meta", "cmc")):
                rank, segment = order, start
    if any(word in ENDS for word in words):
        rank = 99.0
    return DigitJoint(digit, side_of(name), rank, "metacarpal" if segment in ("metacarp", "carpal") else segment)


def is_wrist(name: str) -> bool:
    return digit_joint(name) is None and any(word in WRISTS for word in words_of(name))


def tree_from_names(names: Sequence[str]) -> dict[str, str] | None:
    """Parent by name for joints that came without a hierarchy; None when the names do not say it all.

    Each digit is a chain from the wrist outwards. A wrist has the parent "".
    """
    parents: dict[str, str] = {}
    chains: dict[tuple[str, Side], list[tuple[float, str]]] = defaultdict(list)
    wrists = [name for name in names if is_wrist(name)]
    for name in names:
        joint = digit_joint(name)
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


def digit_chains(names: Sequence[str], parents: IntArray) -> dict[tuple[str, Side], list[int]]:
    """Joint indices of each digit, from the wrist outwards; parents come before children."""
    chains: dict[tuple[str, Side], list[int]] = defaultdict(list)
    for index, name in enumerate(names):
        joint = digit_joint(name)
        if joint is not None:
            chain = chains[joint.digit, joint.side]
            if not chain or int(parents[index]) == chain[-1]:  # twist and helper bones hang beside the chain
                chain.append(index)
    return dict(chains)


def mirrored_name(name: str) -> str | None:
    """The name of the joint on the other side; None when the name has no side."""
    swaps = (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT"))
    for one, other in (*swaps, *((b, a) for a, b in swaps)):
        if one in name:
            return name.replace(one, other)
    match = re.search(r"(?<![A-Za-z])([lLrR])(?![A-Za-z])", name)
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
