"""The verdict on a posed grasp: which thresholds hold, which patches failed, and the table that says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

# What a grasp must reach unless its recipe says otherwise; fractions, degrees, counts. The loosest of GRASP.
ACCEPT: dict[str, tuple[str, float]] = {
    "mean_contact_distance": ("<=", 0.025),
    "p95_contact_distance": ("<=", 0.055),
    "gap": ("<=", 0.015),
    "opposed_normals": (">=", 0.92),
    "opposed_normals_45": (">=", 0.52),
    "worst_patch_opposed_45": (">=", 0.20),
    "max_penetration": ("<=", 0.018),
    "skin_inside": ("<=", 0.034),
    "bones_through": ("<=", 0.0),
    "skin_stretch_p99": ("<=", 1.6),
    "max_joint_change_deg": ("<=", 120.0),
}

SCHEMA = 1
_PER_LENGTH = ("mean_contact_distance", "p95_contact_distance", "gap", "max_penetration")
_WORDS = {
    "mean_contact_distance": "mean distance",
    "p95_contact_distance": "95 % of points within",
    "gap": "gap to the surface",
    "opposed_normals": "normals opposed",
    "opposed_normals_45": "... within 45 degrees",
    "worst_patch_opposed_45": "... in the worst patch",
    "max_penetration": "deepest penetration",
    "skin_inside": "skin inside",
    "bones_through": "bones through",
    "skin_stretch_p99": "skin stretch (p99)",
    "max_joint_change_deg": "largest joint change",
}


DEFINITIONS = {
    "lengths": "distances are fractions of the manipulator's length, the largest rest extent of its skin",
    "mean_contact_distance": "mean distance of each contact point on the deformed skin to its paired point",
    "p95_contact_distance": "the distance that 95 % of the contact points keep",
    "gap": "mean unsigned distance of the contact points on the skin to the object's surface",
    "opposed_normals": "fraction of pairs with n.n' < 0, normals of the deformed meshes",
    "opposed_normals_45": "fraction of pairs with n.n' < -0.707",
    "worst_patch_opposed_45": "the smallest opposed_normals_45 of any patch",
    "max_penetration": "depth of the deepest skin vertex inside a solid (generalised winding number > 0.5)",
    "skin_inside": "fraction of the skin's area inside a solid, a third of each face to each corner",
    "bones_through": "number of bones (joint to child joint) that cross the object's surface",
    "skin_stretch_p99": "99th percentile over skin edges of posed / rest length",
    "max_joint_change_deg": "largest rotation of a joint (roots left out) away from rest, degrees",
    "opposition_deg": "median over the fingers of the angle from which each presses against thumb and palm",
    "thumb_away": "how far the thumb's last bone is from the object, in hand lengths, 0.3 at most",
    "thumb_along": "how much the thumb points along what the fingers go round, 0 to 1; 0 on a ball or a plate",
    "crossing": "how far bones of two digits are in one another, as a share of how near they may come",
    "digits_through": "how many digits go through a loop at the place that was to be held",
    "through_loop": "which: their centre lines cross a disk across the loop more often one way than the other",
    "loops_held": "how many loops there have digits through them, two where scissors are held by both",
    "skin_through": "how far a digit's skin is beyond a wall between it and its bone, a fraction of the length",
    "closure": "Ferrari and Canny's measure of force closure; below 0 the contacts do not hold",
    "start_distance": "closest distance of the open hand to the object before the solve",
    "solids": "the object's surface where it is closed, and a filled proxy (hull) where the recipe asks",
}


@dataclass(frozen=True)
class Verdict:
    """failures: sentences, one per threshold or patch that fails. failed_patches: by name, why."""

    failures: tuple[str, ...]
    failed_patches: Mapping[str, str]
    limits: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_grasp(self) -> bool:
        return not self.failures


def judge(metrics: Mapping[str, Any], left_out: Mapping[str, str], accept: Mapping[str, float]) -> Verdict:
    """Compare metrics with the thresholds of a recipe. A metric that could not be measured (None) is not judged.

    A patch fails when it was left out, when its points lie farther from their partners on average than the
    threshold for 95 % of all points, or when fewer of its normals oppose within 45 degrees than the worst may.
    """
    limits = {key: accept.get(key, usual) for key, (_, usual) in ACCEPT.items()}
    failures = [
        f"{_WORDS[key]}: {spell(key, metrics[key])}, wanted {ACCEPT[key][0]} {spell(key, limits[key])}"
        for key in ACCEPT
        if metrics.get(key) is not None and not holds(key, metrics[key], limits[key])
    ]
    if not metrics.get("contacts"):
        failures.append("no contact was placed")
    failed = dict(left_out)
    for name, values in metrics["patches"].items():
        if not holds("mean_contact_distance", values["mean_contact_distance"], limits["p95_contact_distance"]):
            failed[name] = f"{spell('gap', values['mean_contact_distance'])} from its target on average"
        elif not holds("worst_patch_opposed_45", values["opposed_normals_45"], limits["worst_patch_opposed_45"]):
            failed[name] = f"only {spell('opposed_normals', values['opposed_normals_45'])} of it faces the object"
    failures += [f"patch {name}: {why}" for name, why in failed.items()]
    if 2 * len(left_out) >= len(left_out) + len(metrics["patches"]) > 0:
        failures.append("the hand is not near the object: at least half of its patches found no place")
    return Verdict(tuple(failures), failed, limits)


# What a hold needs beside its contacts, by kind of grasp: digits that touch, closure, and of all the share of pads.
DIGITS = {"power": 3, "precision": 3, "hook": 2, "lateral": 2, "pinch": 2}
CLOSURE = {"power": 0.02, "precision": 0.01, "pinch": 0.0, "hook": -np.inf, "lateral": -np.inf}
PADS_PLACED = {"power": 0.5, "precision": 0.6, "pinch": 0.6, "hook": 0.4, "lateral": 0.5}
OPPOSED = {"power": 100.0, "precision": 100.0, "pinch": 110.0, "lateral": 80.0, "hook": -np.inf}  # degrees
CAGED = 2  # digits through a loop: what they go round is held by its shape, and wants no friction
SKIN_THROUGH = 0.025
UNEVEN = 65.0  # degrees
CLEAR, LEAST_SCALE = 0.06, 0.05  # of a limit: what is farther from it is clear of it; what a limit counts at least
CROSSING = 0.35  # of how near bones of two digits may come


def judge_hold(metrics: Mapping[str, Any], kind: str) -> tuple[str, ...]:
    """What keeps a grasp from being a hold of its kind though its contacts may be good, in sentences."""
    failures = []
    digits, wanted = metrics["digits_in_contact"], min(DIGITS[kind], metrics["digits_wanted"])
    if digits < wanted:
        failures.append(f"only {digits} of {metrics['digits_wanted']} digits touch, a {kind} grasp wants {wanted}")
    if not metrics["thumb_in_contact"]:
        failures.append("the thumb touches nothing")
    if metrics["pads_placed"] < PADS_PLACED[kind]:
        share = f"{100 * metrics['pads_placed']:.0f} % of the pads"
        failures.append(f"only {share} found a place, a {kind} grasp wants {100 * PADS_PLACED[kind]:.0f} %")
    if metrics["closure"] < floor(CLOSURE, metrics, kind):
        failures.append("the contacts do not hold the object: it would slip or turn out of the hand")
    if metrics["opposition_deg"] < floor(OPPOSED, metrics, kind):
        failures.append(
            "the hand is laid on the object and does not close round it: fingers press from"
            f" {metrics['opposition_deg']:.0f} degrees against thumb and palm, wanted >= {OPPOSED[kind]:.0f}"
        )
    if metrics["crossing"] > CROSSING:
        failures.append(f"two digits go {100 * metrics['crossing']:.0f} % into one another")
    if metrics["skin_through"] > SKIN_THROUGH:
        deep = f"{100 * metrics['skin_through']:.1f} % of the hand's length"
        failures.append(
            f"a digit's skin goes {deep} through the object's wall, wanted <= {100 * SKIN_THROUGH:.1f} %"
        )
    if metrics["uneven_curl_deg"] > UNEVEN:
        failures.append(f"neighbouring fingers are bent {metrics['uneven_curl_deg']:.0f} degrees apart")
    return tuple(failures)


def told_through(metrics: Mapping[str, Any]) -> str:
    """Which digits go through a loop, in words; empty where none does."""
    loops = {0: "", 1: "the loop"}.get(metrics["loops_held"], f"{metrics['loops_held']} loops")
    return f"through {loops}: {', '.join(metrics['through_loop'])}" if loops else ""


def floor(limits: Mapping[str, float], metrics: Mapping[str, Any], kind: str) -> float:
    """Of closure or opposition. Fingers through a loop are round it and cannot lose it, however slippery it is and
    wherever the thumb lies, on top of a handle for instance."""
    return -np.inf if metrics.get("digits_through", 0) >= CAGED else limits[kind]


def margin(metrics: Mapping[str, Any], kind: str) -> float:
    """0 to 1: how far a grasp of a kind that passes is from the limit nearest to it, as a share of that limit,
    and 1 from `CLEAR` on; 0 at a limit or beyond. Counts have no margin. The last bits of a processor decide
    the verdict of a grasp that has none."""
    limits = [(metrics.get(key), sign, limit) for key, (sign, limit) in ACCEPT.items()]
    limits += [
        (metrics.get("closure"), ">=", floor(CLOSURE, metrics, kind)),
        (metrics.get("opposition_deg"), ">=", floor(OPPOSED, metrics, kind)),
        (metrics.get("crossing"), "<=", CROSSING),
        (metrics.get("skin_through"), "<=", SKIN_THROUGH),
        (metrics.get("uneven_curl_deg"), "<=", UNEVEN),
    ]
    shares = [
        (limit - value if sign == "<=" else value - limit) / max(abs(limit), LEAST_SCALE)
        for value, sign, limit in limits
        if value is not None and np.isfinite(limit) and (limit or sign == ">=")  # no bones through is a count
    ]
    return float(np.clip(min(shares, default=CLEAR) / CLEAR, 0.0, 1.0))


def holds(key: str, value: float, limit: float) -> bool:
    """Whether a value keeps its threshold."""
    return value <= limit if ACCEPT[key][0] == "<=" else value >= limit


def spell(key: str, value: float | None) -> str:
    """A metric for people: lengths and shares in percent, angles in degrees."""
    if value is None:
        return "not measured"
    if key == "bones_through":
        return f"{value:.0f}"
    if key == "skin_stretch_p99":
        return f"{value:.2f}"
    if key == "max_joint_change_deg":
        return f"{value:.0f} deg"
    return f"{100 * value:.2f} %" if key in _PER_LENGTH else f"{100 * value:.1f} %"


def table(metrics: Mapping[str, Any], verdict: Verdict) -> tuple[tuple[str, str, bool], ...]:
    """Rows (name, value, failed) for a picture or a terminal: the metrics, then each patch that failed."""
    rows = [
        (
            _WORDS[key],
            spell(key, metrics.get(key)),
            metrics.get(key) is not None and not holds(key, metrics[key], verdict.limits[key]),
        )
        for key in ACCEPT
    ]
    return (*rows, *((name, why, True) for name, why in verdict.failed_patches.items()))
