"""Where the hands of a rig are: the joints at which chains part that are like digits.

A hub is ranked by the number of its digits, how alike they are, whether they go one way, how close they stand, and
by what names say against it. A body's hips have legs and a spine, too, but a better hub stands below them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.hands.anatomy import Anatomy, unit
from contact_core.hands.names import OTHER_PARTS, counts_a_tip, words_of

LEAST = 0.3  # a hub that is less like a hand is none
COUNTS = {2: 0.5, 3: 0.85, 4: 1.0, 5: 1.0, 6: 0.85, 7: 0.6, 8: 0.45}  # by number of digits


@dataclass(frozen=True, eq=False)
class Limb:
    """One digit as found: joints from the palm outwards, a tip joint or -1, and where its skin ends."""

    joints: tuple[int, ...]
    tip_joint: int
    tip: FloatArray  # (3,)


@dataclass(frozen=True, eq=False)
class Hub:
    """A joint, the digits that part there, and how much like a hand it is, 0 to 1."""

    joint: int
    limbs: tuple[Limb, ...]
    likeness: float


def hubs_of(anatomy: Anatomy) -> list[Hub]:
    """The hands of a rig, the most hand-like first; none of them above or below another."""
    candidates = [hub for j in range(len(anatomy.rig.joints)) if (hub := hub_at(anatomy, j)) is not None]
    chosen: list[Hub] = []
    for hub in sorted(candidates, key=lambda hub: (-round(hub.likeness, 3), -hub.joint)):
        apart = all(
            not _is_above(anatomy, hub.joint, one.joint) and not _is_above(anatomy, one.joint, hub.joint)
            for one in chosen
        )
        if hub.likeness >= LEAST and apart:
            chosen.append(hub)
    return sorted(chosen, key=lambda hub: (-round(hub.likeness, 2), hub.joint))


def hub_at(anatomy: Anatomy, joint: int) -> Hub | None:
    """The hub at a joint; None where fewer than two digits part there."""
    chains, branches = _chains(anatomy, joint)
    limbs = [limb for chain in chains if (limb := _limb(anatomy, chain)) is not None]
    if len(limbs) < 2 or branches < 2:
        return None
    return Hub(joint, tuple(limbs), _likeness(anatomy, joint, limbs))


def _chains(anatomy: Anatomy, joint: int) -> tuple[list[list[int]], int]:
    """Chains that leave a joint, directly or through a joint of the palm, and from how many branches."""
    chains: list[list[int]] = []
    branches = 0
    for child in anatomy.children[joint]:
        chain = anatomy.chain(child)
        inner = [chain] if chain is not None else [anatomy.chain(c) for c in anatomy.children[child]]
        if chain is None and (any(c is None for c in inner) or len(inner) > 3):
            continue  # a limb of its own, with a hub further down
        found = [c for c in inner if c is not None and (len(c) >= 2 or anatomy.names[c[0]] is not None)]
        chains += found
        branches += bool(found)
    return chains, branches


def _limb(anatomy: Anatomy, chain: list[int]) -> Limb | None:
    """A chain without its tip joint; None when nothing of it holds skin."""
    rig = anatomy.rig
    kept = list(chain)
    rigid = {j for j in chain if rig.freedoms[j].kind == "fixed"}
    hinged = any(rig.freedoms[j].kind == "hinge" for j in chain)
    tip_joint = -1
    while len(kept) > 1:
        last = kept[-1]
        bare = not anatomy.holds_skin[last] or (hinged and last in rigid)
        if not bare and not counts_a_tip([anatomy.names[j] for j in kept]):
            break
        tip_joint = kept.pop()
    while hinged and len(kept) > 1 and kept[0] in rigid:
        kept.pop(0)
    if not any(anatomy.moves_skin[j] for j in kept):
        return None
    return Limb(tuple(kept), tip_joint, _tip(anatomy, kept, tip_joint))


def _tip(anatomy: Anatomy, joints: list[int], tip_joint: int) -> FloatArray:
    """(3,) the end of the skin of a digit: the middle of its farthest tenth along the last bone."""
    last = joints[-1]
    here = anatomy.position[last]
    skin = anatomy.vertices([last] + ([tip_joint] if tip_joint >= 0 else []))
    if tip_joint >= 0 and np.linalg.norm(anatomy.position[tip_joint] - here) > 0:
        along = unit(anatomy.position[tip_joint] - here)
    elif len(joints) > 1:
        along = unit(here - anatomy.position[joints[-2]])
    else:
        along = unit(here - anatomy.position[max(int(anatomy.rig.parents[last]), 0)])
    before = float(np.linalg.norm(here - anatomy.position[joints[-2]])) if len(joints) > 1 else 0.0
    reach = (skin - here) @ along
    astray = before > 0 and len(skin) and not 0.0 < reach.max() < 4.0 * before  # skin that is not round the bone
    if not len(skin) or astray:
        return np.asarray(anatomy.position[tip_joint] if tip_joint >= 0 else here + 0.8 * before * along)
    return np.asarray(skin[reach >= reach.min() + 0.9 * np.ptp(reach)].mean(axis=0))


def _likeness(anatomy: Anatomy, joint: int, limbs: list[Limb]) -> float:
    base = np.array([anatomy.position[limb.joints[0]] for limb in limbs])  # (k, 3)
    reach = np.array([limb.tip for limb in limbs]) - base
    length = np.linalg.norm(reach, axis=1)
    if length.min() <= 0:
        return 0.0
    one_way = float(np.linalg.norm((reach / length[:, None]).mean(axis=0)))
    alike = float(length.min() / length.max())
    spread = float(np.linalg.norm(base - base.mean(axis=0), axis=1).max() / length.mean())
    stem = float(np.linalg.norm(base - anatomy.position[joint], axis=1).mean() / length.mean())
    names = _said(anatomy, limbs)
    score = COUNTS.get(len(limbs), 0.25)
    score *= 0.35 + 0.65 * min(one_way / 0.5, 1.0)
    score *= min(alike / 0.35, 1.0)
    score *= min(1.0, 0.8 / max(spread, 1e-9)) ** 2
    score *= min(1.0, 2.0 / max(stem, 1e-9))  # toes stand far from the ankle
    return float(np.clip(score * names, 0.0, 1.0))


def _said(anatomy: Anatomy, limbs: list[Limb]) -> float:
    """What names are worth: more than 1 for digits, little for both sides in one hand or other parts of a body."""
    joints = [j for limb in limbs for j in limb.joints]
    named = [anatomy.names[limb.joints[-1]] or anatomy.names[limb.joints[0]] for limb in limbs]
    words = [set(words_of(anatomy.rig.joints[j])) for j in joints]
    sides = {side for w in words for side in ("left", "right") if {side, side[0]} & w}
    other = np.mean([bool(w & set(OTHER_PARTS)) or _is_body(w) for w in words])
    if sum(n is not None for n in named) >= 2:
        return 2.0 if len(sides) < 2 else 0.1
    return 0.05 if len(sides) == 2 or other > 0.3 else 1.0


def _is_body(words: set[str]) -> bool:
    return any(
        re.match(r"(lower|upper|fore)(arm|leg)|clavicle|shoulder|calf|shin|toe|hip|pelvis|knee", w) for w in words
    )


def _is_above(anatomy: Anatomy, upper: int, lower: int) -> bool:
    while lower >= 0 and lower != upper:
        lower = int(anatomy.rig.parents[lower])
    return lower == upper
