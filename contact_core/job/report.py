"""The verdict on a posed grasp: which thresholds hold, which patches failed, and the table that says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from contact_core.job.recipe import ACCEPT

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
