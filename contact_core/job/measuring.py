"""What a job's pose is worth: each manipulator measured against each object that it touches, the worst counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contact_core.geometry.transform import transform_points
from contact_core.grasping.metrics import Contact, PosedScene, measure
from contact_core.grasping.verdict import ACCEPT, Verdict, judge
from contact_core.job.job import Job
from contact_core.rig.bones import bone_segments
from contact_core.rig.chart import pose_on
from contact_core.rig.poses import posed_points, posed_world


def measured(job: Job) -> dict[str, Any]:
    """The metrics of `report.json`; of several manipulators or objects the worst of each."""
    found = [measure(posed_scene(job, hand, thing)) for hand, thing in job.touching]
    return found[0] if len(found) == 1 else _worst(found)


def judged(job: Job) -> Verdict:
    """Whether the metrics keep the recipe's thresholds."""
    return judge(job.metrics, job.left_out, job.recipe.accept)


def posed_scene(job: Job, hand: str, thing: str) -> PosedScene:
    """What the metrics look at: a manipulator as the document poses it, in the space of an object."""
    document, rig = job.session.document, job.session.rigs[hand]
    surfaces, pose = document.surfaces, document.poses[hand]
    into = np.linalg.inv(surfaces[thing].world_from_surface) @ surfaces[hand].world_from_surface
    pairs = {
        pair.pair.name: Contact(pair.manipulator_points, pair.object_points)
        for pair in job.session.geometry.pairs()
        if (pair.manipulator_surface, pair.object_surface) == (hand, thing)
    }
    return PosedScene(
        rest=rig.surface,
        skin=rig.surface.with_points(transform_points(into, posed_points(rig, pose))),
        bones=bone_segments(rig.parents, into @ posed_world(rig, pose)),
        rest_local=rig.rest_local,
        local=pose_on(rig, pose),
        moving=rig.parents >= 0,
        object_mesh=job.session.geometry.mesh(thing),
        solids=job.solids[thing],
        contacts=pairs,
        length=job.length(hand),
    )


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
