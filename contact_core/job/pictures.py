"""The three pictures of a job, before, after, and what touches, in world space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from contact_core.arrays import FloatArray
from contact_core.job.scene import moved, posed_skin
from contact_core.job.workpiece import Job
from contact_core.rig.rig import Pose
from contact_core.scene.picture import Picture, PictureMesh

SKIN, THING = (0.84, 0.64, 0.53), (0.66, 0.69, 0.74)
LINES_PER_PATCH = 14
THROUGH = 0.25  # opacity of the hand that one looks through
NEAR = 0.4  # of the length: how much of the object round the contacts is in the frame

Rows = tuple[tuple[str, str, bool], ...]


def pictures_of(job: Job, rows: Rows) -> list[Picture]:
    """The open hand away from the object, with the contacts painted on both and the table of results; the solved
    pose; and the same through the hand, so that one sees where it touches."""
    away = job.start_distance / job.length
    before = f"{job.recipe.title or job.recipe.name}: before, {away:.1f} lengths away" if away else "before"
    verdict = "a grasp" if job.verdict.is_grasp else "NOT a good grasp"
    after = f"after: {job.metrics['contacts']} contact points, {len(job.solution.theta)} dofs"
    legend = tuple((name, job.session.document.patch(name).color) for name in job.session.document.pairs)
    judged = (("solved pose", verdict, not job.verdict.is_grasp), *rows)
    posed = _picture(job, job.pose, after)
    skin, thing = posed.meshes
    return [
        replace(_picture(job, job.start, before), table=judged, legend=legend),
        posed,
        replace(posed, meshes=(replace(skin, opacity=THROUGH), thing), caption="where it touches"),
    ]


def _picture(job: Job, pose: Pose, caption: str) -> Picture:
    skin = posed_skin(job.rig, pose)
    thing = moved(job.object.mesh, job.placed)
    points, lines = [], []
    for pair in job.session.geometry.pairs():
        color = job.session.document.patch(pair.pair.manipulator).color
        here, there = pair.manipulator_points.positions(skin), pair.object_points.positions(thing)
        points += [(here, color), (there, color)]
        chosen = np.unique(np.linspace(0, len(here) - 1, LINES_PER_PATCH).astype(int))
        lines.append((np.stack([here[chosen], there[chosen]], axis=1), color))
    view = job.recipe.view
    return Picture(
        meshes=(PictureMesh(skin, SKIN), PictureMesh(thing, THING)),
        points=tuple(points),
        lines=tuple(lines),
        camera_from=view.camera_from,
        up=view.up,
        caption=caption,
        focus=_focus(skin.points, thing.points, np.concatenate([line[:, 1] for line, _ in lines]), job.length),
    )


def _focus(skin: FloatArray, thing: FloatArray, touched: FloatArray, length: float) -> FloatArray:
    """(k, 3) the manipulator and the part of the object near the contacts: of a pole, where the hand holds it."""
    distance, _ = cKDTree(touched).query(thing)
    return np.concatenate([skin, thing[distance < NEAR * length]])
