"""What a job's pose is worth: each manipulator measured against each object that it touches, the worst counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from contact_core.grasping.metrics import measure
from contact_core.grasping.posed_scene import posed_scene
from contact_core.grasping.verdict import ACCEPT, Verdict, judge
from contact_core.job.job import Job


def measured(job: Job) -> dict[str, Any]:
    """The metrics of `report.json`; of several manipulators or objects the worst of each."""
    geometry, rigs = job.session.geometry, job.session.rigs
    found = [
        measure(posed_scene(geometry, rigs[hand], hand, thing, job.length(hand), job.solids[thing]))
        for hand, thing in job.touching
    ]
    return found[0] if len(found) == 1 else _worst(found)


def judged(job: Job) -> Verdict:
    """Whether the metrics keep the recipe's thresholds."""
    return judge(job.metrics, job.left_out, job.recipe.accept)


def _worst(found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of each metric the worst, None where none was measured; contacts and patches of all."""
    together: dict[str, Any] = {}
    for key in found[0]:
        values = [each[key] for each in found if each[key] is not None]
        if key == "patches":
            together[key] = {name: patch for each in found for name, patch in each[key].items()}
        elif key in ("contacts", "bones_through"):
            together[key] = sum(values)
        else:
            worst = min if key in ACCEPT and ACCEPT[key][0] == ">=" else max
            together[key] = worst(values, default=None)
    return together
