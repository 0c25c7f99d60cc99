"""The three pictures of a job, before, after, and what touches, in world space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.job.job import Job
from contact_core.rig.rig import Pose
from contact_core.scene.document_picture import world_mesh
from contact_core.scene.picture import Picture, PictureMesh

SKIN, THING = (0.84, 0.64, 0.53), (0.66, 0.69, 0.74)
LINES_PER_PATCH = 14
THROUGH = 0.25  # opacity of the hand that one looks through
NEAR = 0.4  # of the length: how much of the objects round the contacts is in the frame

Rows = tuple[tuple[str, str, bool], ...]


def pictures_of(job: Job, rows: Rows) -> list[Picture]:
    """The open hand away from the object, with the contacts painted on both and the table of results; the solved
    pose; and the same through the hand, so that one sees where it touches."""
    document = job.session.document
    away = min(job.start_distance[name] / job.length(name) for name in job.start)
    before = f"{job.recipe.title or job.recipe.name}: before, {away:.1f} lengths away" if away else "before"
    verdict = "a grasp" if job.verdict.is_grasp else "NOT a good grasp"
    after = f"after: {job.metrics['contacts']} contact points, {len(job.solution.theta)} dofs"
    legend = tuple((name, document.patch(name).color) for name in document.pairs)
    judged = (("solved pose", verdict, not job.verdict.is_grasp), *rows)
    posed = _picture(job, document.poses, after)
    through = tuple(replace(mesh, opacity=THROUGH) if mesh.color == SKIN else mesh for mesh in posed.meshes)
    return [
        replace(_picture(job, job.start, before), table=judged, legend=legend),
        posed,
        replace(posed, meshes=through, caption="where it touches"),
    ]


def _picture(job: Job, poses: Mapping[str, Pose], caption: str) -> Picture:
    session, document = job.session, job.session.document
    geometry = session.geometry.of(replace(document, poses=document.poses.updated(poses)))
    unit = document.surface(next(iter(poses))).meters_per_unit
    meshes = {name: world_mesh(geometry, name, unit) for name in job.assets}
    points, lines = [], []
    for pair in geometry.pairs():
        color = document.patch(pair.pair.manipulator).color
        here = pair.manipulator_points.positions(meshes[pair.manipulator_surface])
        there = pair.object_points.positions(meshes[pair.object_surface])
        points += [(here, color), (there, color)]
        chosen = np.unique(np.linspace(0, len(here) - 1, LINES_PER_PATCH).astype(int))
        lines.append((np.stack([here[chosen], there[chosen]], axis=1), color))
    view = job.recipe.view
    return Picture(
        meshes=tuple(PictureMesh(mesh, SKIN if name in poses else THING) for name, mesh in meshes.items()),
        points=tuple(points),
        lines=tuple(lines),
        camera_from=view.camera_from,
        up=view.up,
        caption=caption,
        focus=_focus(job, meshes, poses, np.concatenate([line[:, 1] for line, _ in lines])),
    )


def _focus(
    job: Job, meshes: Mapping[str, TriangleMesh], poses: Mapping[str, Pose], touched: FloatArray
) -> FloatArray:
    """(k, 3) the manipulators and the parts of objects near the contacts: of a pole, where the hand holds it."""
    near = NEAR * max(map(job.length, poses))
    skins = [mesh.points for name, mesh in meshes.items() if name in poses]
    things = np.concatenate([mesh.points for name, mesh in meshes.items() if name not in poses])
    distance, _ = cKDTree(touched).query(things)
    return np.concatenate([*skins, things[distance < near]])
