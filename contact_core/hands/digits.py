"""Which digit is the thumb, where the knuckles are, and in what order the fingers stand."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.hands.anatomy import Anatomy, across, unit
from contact_core.hands.description import HandWords
from contact_core.hands.hubs import Hub, Limb
from contact_core.hands.names import ROLES, chain_role

STANDS_OUT = 0.25  # by how much a thumb differs more from the others than the next digit
IN_PALM = 0.58  # a first joint nearer to the hub than this part of the second one's distance lies in the palm


def bones_of(anatomy: Anatomy, limb: Limb) -> FloatArray:
    """(b, 3) unit directions of a digit's bones, the last one to the end of its skin or its tip joint."""
    points = [anatomy.position[j] for j in limb.joints]
    end = anatomy.position[limb.tip_joint] if limb.tip_joint >= 0 else limb.tip
    if np.linalg.norm(end - points[-1]) < 1e-9:
        end = limb.tip
    return np.array([unit(b - a) for a, b in zip(points, [*points[1:], end], strict=True)])


def knuckle(anatomy: Anatomy, hub: int, limb: Limb) -> int:
    """The place in a finger's joints of its knuckle: the first one that is not within the palm."""
    if len(limb.joints) < 3:
        return 0
    start = root_point(anatomy, hub)
    first, second = (np.linalg.norm(anatomy.position[j] - start) for j in limb.joints[:2])
    return 1 if first < IN_PALM * second and _bends_skin(anatomy, limb) else 0


def root_point(anatomy: Anatomy, hub: int) -> FloatArray:
    """(3,) where the digits part: the hub, or the place at which all of them start (a forearm without a hand)."""
    below = [c for c in anatomy.children[hub] if anatomy.depth[c] >= 2]
    bases = anatomy.position[below]
    length = np.linalg.norm(bases - anatomy.position[hub], axis=1).max(initial=0.0)
    same = len(bases) > 1 and np.ptp(bases, axis=0).max() < 0.05 * length
    return np.asarray(bases.mean(axis=0) if same else anatomy.position[hub])


def has_metacarpal(anatomy: Anatomy, hub: int, limb: Limb) -> bool:
    """Whether a finger's first joint is within the palm and three more follow, or its name says so."""
    named = anatomy.names[limb.joints[0]]
    if named is not None and named.segment == "metacarpal" and len(limb.joints) > 1:
        return True
    return len(limb.joints) >= 4 and knuckle(anatomy, hub, limb) == 1


def _bends_skin(anatomy: Anatomy, limb: Limb) -> bool:
    return all(anatomy.rig.freedoms[j].kind != "hinge" for j in limb.joints)  # robots start with a sideways hinge


def thumb_of(anatomy: Anatomy, hub: Hub, words: HandWords | None) -> tuple[int, list[str]]:
    """The place of the thumb among a hub's limbs, -1 for none, and notes.

    A thumb reaches least far the way all digits go, differs most in direction, has a joint less; or names say it.
    """
    limbs = hub.limbs
    named = [k for k, limb in enumerate(limbs) if role_of(anatomy, limb) == "thumb"]
    if words is not None and words.thumb is not None:
        told = [k for k, limb in enumerate(limbs) if words.thumb in [anatomy.rig.joints[j] for j in limb.joints]]
        return (told[0] if told else -1), []
    score = _oddness(anatomy, hub)
    order = np.argsort(score)
    found = int(order[-1]) if len(limbs) > 2 and score[order[-1]] - score[order[-2]] >= STANDS_OUT else -1
    if len(named) == 1:
        notes = []
        if found >= 0 and found != named[0]:
            notes.append(
                f"By its shape the digit of {anatomy.rig.joints[limbs[found].joints[0]]} is the thumb, but another"
                " one is named so; the name was taken."
            )
        return named[0], notes
    return found, []


def role_of(anatomy: Anatomy, limb: Limb) -> str:
    """The role that the names of a limb say, or an empty word."""
    return chain_role([anatomy.names[j] for j in limb.joints])[0]


def _oddness(anatomy: Anatomy, hub: Hub) -> FloatArray:
    """(k,) how much each digit is like a thumb beside the others."""
    way = np.array([unit(limb.tip - anatomy.position[limb.joints[0]]) for limb in hub.limbs])
    reach = np.array([limb.tip - anatomy.position[hub.joint] for limb in hub.limbs])
    forward = unit(way.sum(axis=0))
    along = reach @ forward
    count = np.array([len(limb.joints) for limb in hub.limbs])
    bases = np.array([anatomy.position[limb.joints[0]] for limb in hub.limbs])
    start = np.linalg.norm(bases - anatomy.position[hub.joint], axis=1)
    score = np.zeros(len(way))
    for k in range(len(way)):
        others = np.delete(np.arange(len(way)), k)
        angle = np.arccos(np.clip(way[k] @ unit(way[others].sum(axis=0)), -1, 1))
        score[k] = (np.median(along[others]) - along[k]) / max(float(along.max()), 1e-12)
        score[k] += 0.6 * angle / (0.5 * np.pi) + 0.3 * float(count[k] < np.median(count[others]))
        score[k] += (
            0.5 * max(float(np.median(start[others]) - start[k]), 0.0) / max(float(np.abs(along).max()), 1e-12)
        )
    return score


def in_order(anatomy: Anatomy, limbs: list[Limb], line: FloatArray) -> list[Limb]:
    """Fingers from the thumb's side on: by their middles along `line` (3,), which points away from it."""

    def place(limb: Limb) -> float:
        middle = 0.5 * (limb.tip + anatomy.position[limb.joints[min(1, len(limb.joints) - 1)]])
        return float(middle @ line)

    return sorted(limbs, key=place)


def roles(anatomy: Anatomy, fingers: list[Limb], words: HandWords | None) -> list[str]:
    """Roles of fingers that stand in order: as told, as named where the names differ, else counted."""
    told: dict[int, str] = {}
    for role, name in (words.digits if words else {}).items():
        told |= {k: role for k, f in enumerate(fingers) if name in [anatomy.rig.joints[j] for j in f.joints]}
    named = [role_of(anatomy, limb) for limb in fingers]
    good = all(named) and len(set(named)) == len(named) and "thumb" not in named
    counted = list(ROLES[1:]) if len(fingers) <= 4 else [f"finger {k + 1}" for k in range(len(fingers))]
    return [told.get(k, named[k] if good else counted[k]) for k in range(len(fingers))]


def knuckle_line(points: FloatArray, forward: FloatArray) -> FloatArray:
    """(3,) unit direction along which points (k, 3) lie most spread out, square to `forward`; either way round."""
    flat = points - points.mean(axis=0)
    flat = flat - np.outer(flat @ forward, forward)
    _, _, axes = np.linalg.svd(flat, full_matrices=True)
    return unit(across(axes[0], forward))


def roundness(points: FloatArray, forward: FloatArray) -> float:
    """0 for points in a row seen along `forward`, 1 for points evenly round an axis."""
    flat = points - points.mean(axis=0)
    flat = flat - np.outer(flat @ forward, forward)
    values = np.linalg.svd(flat, compute_uv=False)
    return float(values[1] / max(float(values[0]), 1e-300))
