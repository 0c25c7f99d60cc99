"""The job: from a recipe to painted contacts, transferred contacts, a solved pose, pictures and a report.

Everything goes through a `Session`, so the document that comes out has the history of an artist's work. Targets
come from the recipe and its placer; a solved pose never places them, unless the recipe asks to settle or slide
contacts.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.atomic_set import check_writable
from contact_core.document.asset import Asset
from contact_core.errors import Cancelled, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.job.assets import object_mesh, read_source, solids_of
from contact_core.job.metrics import Contact, PosedScene, measure
from contact_core.job.outputs import FILES, write_outputs
from contact_core.job.painting import axis_picks, explicit_root, paint
from contact_core.job.recipe import Recipe
from contact_core.job.recipe_reader import load_recipe
from contact_core.job.report import judge
from contact_core.job.scene import away_pose, coarse_pose, posed_skin, posed_world, world_from_object
from contact_core.job.solving import move_contacts, solve
from contact_core.job.workpiece import HAND, OBJECT, Job, JobResult
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import PLACERS
from contact_core.plugins.slots import PlacementRequest, PlacementResult
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.bones import bone_segments
from contact_core.rig.rig import Pose
from contact_core.session import Session


def run_recipe(
    path: Path | str, out: Path | str, *, plugins: PluginManager | None = None, progress: Progress = NO_PROGRESS
) -> JobResult:
    """Run a recipe file and write its results into `out`. Raises ContactError; then nothing is half-written."""
    return run(load_recipe(Path(path)), out, plugins=plugins, progress=progress)


def run(
    recipe: Recipe,
    out: Path | str,
    *,
    plugins: PluginManager | None = None,
    progress: Progress = NO_PROGRESS,
) -> JobResult:
    """Run a recipe and write document, pose, posed model, pictures and report into `out`.

    Raises ContactError; Cancelled when progress raises it. Then nothing is written.
    """
    plugins, out = plugins or PluginManager(), Path(out)
    check_writable(out, FILES.values())  # before the work, not after it
    try:
        return write_outputs(perform(recipe, plugins, progress=progress), out, plugins)
    except Cancelled as cancelled:
        raise Cancelled("the job was cancelled; nothing was written.") from cancelled


def perform(recipe: Recipe, plugins: PluginManager, *, progress: Progress = NO_PROGRESS) -> Job:
    """All of a job but its files: read, paint, place, solve, measure. Raises ContactError."""
    job = prepare(recipe, plugins, progress=progress)
    _solve(job)
    return job


def prepare(recipe: Recipe, plugins: PluginManager, *, progress: Progress = NO_PROGRESS) -> Job:
    """A job up to its solve: read, painted, placed and paired; `job.session.problem` makes its problem."""
    job = Job(recipe, Session(plugins=plugins), progress)
    _read(job, plugins)
    _paint(job, plugins)
    _place(job, plugins)
    return job


def _read(job: Job, plugins: PluginManager) -> None:
    recipe = job.recipe
    with job.stage("read", 0.0, "Reading the manipulator and the object"):
        job.manipulator = read_source(recipe.manipulator, plugins, recipe.folder)
        if job.manipulator.rig is None:
            raise InvalidInput(
                f"the manipulator {job.manipulator.name} has no skeleton; a recipe poses a skinned one."
            )
        unit = job.rig.meters_per_unit
        raw = read_source(recipe.object.source, plugins, recipe.folder)
        mesh = object_mesh(raw, recipe.object, unit, job.length)
        job.object = Asset(
            f"{raw.name} (object)" if raw.name == job.manipulator.name else raw.name, mesh, None,
            raw.source_vertices, raw.source_faces, unit, raw.up_axis, raw.notes, raw.details,
        )  # fmt: skip
        job.solids = solids_of(mesh, recipe.object)
        job.placed = world_from_object(recipe.coarse, mesh)
        job.session.surfaces.add(HAND, job.manipulator.mesh, meters_per_unit=unit, rig=job.rig)
        job.session.surfaces.add(OBJECT, mesh, meters_per_unit=unit, world_from_surface=job.placed)
        job.notes += [f"{asset.name}: {note}" for asset in (job.manipulator, raw) for note in asset.notes]


def _paint(job: Job, plugins: PluginManager) -> None:
    with job.stage("parameterize", 0.1, "Painting contacts on the manipulator"):
        drawn: dict[str, SurfacePoints] = {}
        for spec in job.recipe.patches:
            points = paint(spec, job.manipulator)
            drawn[spec.name] = axis_picks(spec, job.manipulator, points, drawn, plugins)
            job.session.patches.paint(spec.name, points, surface=HAND, axis=drawn[spec.name])


def _place(job: Job, plugins: PluginManager) -> None:
    recipe, session = job.recipe, job.session
    with job.stage("transfer", 0.3, "Placing the contacts on the object"):
        own = {spec.name: spec.place for spec in recipe.patches if spec.place is not None}
        names = [spec.name for spec in recipe.patches if spec.name not in own]
        pose = coarse_pose(job.rig, recipe.coarse)
        job.placement = PlacementResult({}, {}, pose)
        if names:
            job.placement = place_from(job, plugins, names, recipe.placer, pose, recipe.placer_options)
        for name, place in job.placement.placed.items():
            _transfer(session, name, place.root, direction=place.direction)
        for name, root in own.items():
            point, heading = explicit_root(root, job.object)
            _transfer(session, name, point, heading=heading)
        if not session.document.pairs:
            reasons = "; ".join(f"{name}: {why}" for name, why in job.placement.left_out.items())
            raise InvalidInput(f"the hand is not near the object, no contact found a place ({reasons}).")
        job.start, job.start_distance = _start(job)
        session.surfaces.set_pose(HAND, job.start, title="Start")


def place_from(
    job: Job, plugins: PluginManager, names: list[str], placer: str | None, pose: Pose, options: Mapping[str, Any]
) -> PlacementResult:
    """Ask a placer for roots and directions of patches, the manipulator in `pose`. None: the default placer."""
    request = PlacementRequest(
        rig=job.rig,
        pose=pose,
        object_mesh=job.object.mesh,
        object_from_rig=np.asarray(np.linalg.inv(job.placed)),
        patch_points={name: job.session.geometry.points(name) for name in names},
        patch_axes={name: job.session.geometry.axis_points(name) for name in names},
        solids=job.solids,
    )
    return plugins.make(PLACERS, plugins.name_for(PLACERS, "recipe", placer), **options).place(request)


def target(name: str) -> str:
    """Name of the copy of a patch on the object."""
    return f"{name} on {OBJECT}"


def _transfer(session: Session, name: str, point: SurfacePoints, **heading: Any) -> None:
    copy = session.patches.transfer(name, OBJECT, point, name=target(name), **heading)
    session.patches.recolor(copy, session.document.patch(name).color)
    session.pairs.add(name, copy, name=name)


def _start(job: Job) -> tuple[Pose, float]:
    """Where the solve starts: the open hand away from the object, or the placer's coarse pose."""
    recipe = job.recipe
    direction = recipe.away_direction or tuple(-x for x in recipe.placer_options.get("approach", (0.0, 0.0, -1.0)))
    pose, distance = away_pose(
        job.rig, job.placed, job.object.mesh, np.array(direction, float), recipe.away * job.length
    )
    if recipe.solve.start == "coarse" and job.placement.pose is not None:
        return job.placement.pose, 0.0
    return pose, distance


def _solve(job: Job) -> None:
    with job.stage("solve", 0.45, "Solving the pose"):
        solve(job)
        move_contacts(job)
    job.progress.tell(0.7, "Measuring")
    job.metrics = measure(posed_scene(job, job.pose))
    job.verdict = judge(job.metrics, job.placement.left_out, job.recipe.accept)


def posed_scene(job: Job, pose: Pose) -> PosedScene:
    """What the metrics look at, for one pose."""
    into_object = np.asarray(np.linalg.inv(job.placed))
    pairs = {geometry.pair.name: geometry for geometry in job.session.geometry.pairs()}
    return PosedScene(
        rest=job.manipulator.mesh,
        skin=posed_skin(job.rig, pose, job.placed),
        bones=bone_segments(job.rig.parents, into_object @ posed_world(job.rig, pose)),
        rest_local=job.rig.rest_local,
        local=pose.local[[pose.joints.index(name) for name in job.rig.joints]],
        moving=job.rig.parents >= 0,
        object_mesh=job.object.mesh,
        solids=job.solids,
        contacts={name: Contact(pair.manipulator_points, pair.object_points) for name, pair in pairs.items()},
        length=job.length,
    )
