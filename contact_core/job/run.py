"""The job: from a recipe to painted contacts, transferred contacts, a solved pose, pictures and a report.

Every step is a call of a `Session` that a user could make, so the document that comes out has the history of an
artist's work. Targets come from the recipe and its placer; a solved pose never places them, unless the recipe asks
to settle or slide contacts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.atomic_set import check_writable
from contact_core.document.asset import Asset
from contact_core.errors import Cancelled, InvalidInput, NotManifold
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.job.job import Job, JobResult
from contact_core.job.measuring import judged, measured
from contact_core.job.outputs import files_of, write_outputs
from contact_core.job.points import axis_points, painted_points, target_root
from contact_core.job.standing import object_mesh, solids_of, world_from_manipulator, world_from_object
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS, PLACERS, POSE_TERMS
from contact_core.plugins.slots import PlacementRequest, PlacementResult
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.proposal import AGAIN, Proposal, SolveSettings
from contact_core.recipe.reader import load_recipe
from contact_core.recipe.recipe import PatchSpec, Recipe
from contact_core.recipe.sources import read_source
from contact_core.rig.poses import backed_off, curled
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective
from contact_core.session import Session
from contact_core.settings import configured
from contact_core.settings import settings_of as declared_by
from contact_core.solve.solver import SolveOptions, SolveStatus
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import paper_terms

SOLVE, MOVE, MEASURE = 0.45, 0.55, 0.7  # where these begin, as fractions of the job
COMMON = tuple(each.name for each in declared_by(SolveOptions))


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
    """Run a recipe and write document, poses, posed model, pictures and report into `out`.

    Raises ContactError; Cancelled when progress raises it. Then nothing is written.
    """
    plugins, out = plugins or PluginManager(), Path(out)
    check_writable(out, files_of(recipe).values())  # before the work, not after it
    try:
        return write_outputs(perform(recipe, plugins, progress=progress), out, plugins)
    except Cancelled as cancelled:
        raise Cancelled("the job was cancelled; nothing was written.") from cancelled


def perform(recipe: Recipe, plugins: PluginManager, *, progress: Progress = NO_PROGRESS) -> Job:
    """All of a job but its files: read, paint, place, solve, measure. Raises ContactError."""
    job = prepare(recipe, plugins, progress=progress)
    with job.stage("solve", SOLVE, "Solving the pose"):
        _solve(job)
        _move_contacts(job)
    job.progress.tell(MEASURE, "Measuring")
    job.metrics = measured(job)
    job.verdict = judged(job)
    return job


def prepare(recipe: Recipe, plugins: PluginManager, *, progress: Progress = NO_PROGRESS) -> Job:
    """A job up to its solve: read, painted, placed and paired; `job.session.problem` makes its problem."""
    job = Job(recipe, Session(plugins=plugins), progress)
    with job.stage("read", 0.0, "Reading the manipulator and the object"):
        _read(job)
    with job.stage("parameterize", 0.1, "Painting contacts on the manipulator"):
        for spec in recipe.patches:
            _paint(job, spec)
    with job.stage("transfer", 0.3, "Placing the contacts on the object"):
        _place(job)
        _start(job)
    job.notes += job.session.notes  # on surfaces that got proxies
    return job


def _read(job: Job) -> None:
    recipe, session = job.recipe, job.session
    for spec in recipe.manipulators:
        asset = job.assets[spec.name] = read_source(spec.source, session.plugins, recipe.folder)
        if asset.rig is None:
            raise InvalidInput(f"the manipulator {asset.name} has no skeleton; a recipe poses a skinned one.")
        job.notes += [f"{asset.name}: {note}" for note in asset.notes]
    rigs = {name: asset.rig for name, asset in job.assets.items() if asset.rig is not None}
    unit = next(iter(rigs.values())).meters_per_unit
    for spec in recipe.manipulators:
        rig = rigs[spec.name]
        if rig.meters_per_unit != unit:
            raise InvalidInput(
                f"the manipulators of a recipe share their unit, but {rig.name} has {rig.meters_per_unit:g} metres"
                f" per unit and the first {unit:g}."
            )
        standing = world_from_manipulator(spec)
        mesh = job.assets[spec.name].mesh
        session.surfaces.add(spec.name, mesh, meters_per_unit=unit, rig=rig, world_from_surface=standing)
    length = job.length(recipe.manipulators[0].name)
    taken = {asset.name for asset in job.assets.values()}
    for thing in recipe.objects:
        raw = read_source(thing.source, session.plugins, recipe.folder)
        mesh = object_mesh(raw, thing, unit, length)
        name = f"{raw.name} ({thing.name})" if raw.name in taken else raw.name
        taken.add(name)
        job.assets[thing.name] = Asset(
            name, mesh, None, raw.source_vertices, raw.source_faces, unit, raw.up_axis, raw.notes, raw.details
        )
        job.solids[thing.name] = solids_of(mesh, thing)
        standing = world_from_object(thing, mesh)
        session.surfaces.add(thing.name, mesh, meters_per_unit=unit, world_from_surface=standing)
        job.notes += [f"{raw.name}: {note}" for note in raw.notes]


def _paint(job: Job, spec: PatchSpec) -> None:
    surface, _ = job.touches(spec)
    asset, plugins = job.assets[surface], job.session.plugins
    points = _points(job, spec, asset, surface)
    try:
        name = plugins.name_for(AXIS_GENERATORS, "recipe", spec.generator)
        generator = plugins.make(AXIS_GENERATORS, name, **spec.generator_options)
        axis = axis_points(spec, asset)
        job.session.patches.paint(spec.name, points, surface=surface, axis=axis, generator=generator)
    except InvalidInput as error:
        raise type(error)(f"the axis of patch {spec.name!r}: {error}") from error


def _points(job: Job, spec: PatchSpec, asset: Asset, surface: str) -> SurfacePoints:
    """The points of a patch; where the manipulator's surface is too broken for a disk, it gets a proxy."""
    session = job.session
    try:
        return painted_points(spec, asset, surface, session.geometry)
    except NotManifold:
        if not session.makers.mends or session.document.surface(surface).proxy is not None:
            raise
        session.surfaces.add_proxy(surface)
        return painted_points(spec, asset, surface, session.geometry)


def _place(job: Job) -> None:
    recipe, session = job.recipe, job.session
    coarse = {spec.name: curled(session.rigs[spec.name], spec.pose) for spec in recipe.manipulators}
    for hand, thing in job.touching:
        specs = [spec for spec in recipe.patches if job.touches(spec) == (hand, thing)]
        names = [spec.name for spec in specs if spec.place is None]
        if names:
            found = place_from(job, hand, thing, names, recipe.placer, coarse[hand], recipe.placer_options)
            job.left_out |= found.left_out
            for name, place in found.placed.items():
                _transfer(job, name, thing, place.root, direction=place.direction)
            if found.pose is not None and recipe.solve.start == "coarse":
                job.start[hand] = found.pose
        for spec in specs:
            if spec.place is not None:
                point, way = target_root(spec.place, job.assets[thing])
                _transfer(job, spec.name, thing, point, **way)
    if not session.document.pairs:
        reasons = "; ".join(f"{name}: {why}" for name, why in job.left_out.items())
        raise InvalidInput(f"the hand is not near the object, no contact found a place ({reasons}).")


def place_from(
    job: Job, hand: str, thing: str, names: list[str], placer: str | None, pose: Pose, options: Mapping[str, Any]
) -> PlacementResult:
    """Ask a placer for roots and directions of patches on an object, the manipulator in `pose`. None: the default
    placer."""
    plugins, geometry = job.session.plugins, job.session.geometry
    request = PlacementRequest(
        rig=job.session.rigs[hand],
        pose=pose,
        object_mesh=geometry.mesh(thing),
        object_from_rig=geometry.surface_from_surface(thing, hand),
        patch_points={name: geometry.points(name) for name in names},
        patch_axes={name: geometry.axis_points(name) for name in names},
        solids=job.solids[thing],
    )
    return plugins.make(PLACERS, plugins.name_for(PLACERS, "recipe", placer), **options).place(request)


def target(patch: str, thing: str = "object") -> str:
    """Name of the copy of a patch on an object."""
    return f"{patch} on {thing}"


def _transfer(job: Job, name: str, thing: str, point: SurfacePoints, **heading: Any) -> None:
    session = job.session
    copy = session.patches.transfer(name, thing, point, name=target(name, thing), **heading)
    session.patches.recolor(copy, session.document.patch(name).color)
    session.pairs.add(name, copy, name=name)


def _start(job: Job) -> None:
    """Where the solve starts: the open hand away from its objects, or the placer's coarse pose."""
    recipe, session, geometry = job.recipe, job.session, job.session.geometry
    usual = tuple(-x for x in recipe.placer_options.get("approach", (0.0, 0.0, -1.0)))
    direction = np.array(recipe.away_direction or usual, float)
    for spec in recipe.manipulators:
        hand = spec.name
        objects = [(geometry.surface_from_surface(t, hand), geometry.mesh(t)) for h, t in job.touching if h == hand]
        job.start_distance[hand] = 0.0
        if hand not in job.start:
            clear = recipe.away * job.length(hand)
            job.start[hand], job.start_distance[hand] = backed_off(session.rigs[hand], objects, direction, clear)
        session.surfaces.set_pose(hand, job.start[hand], title="Start")


def _solve(job: Job) -> None:
    """Pose the manipulators by the job's pairs. Raises Cancelled when the user stops it, InvalidInput for wrong
    settings."""
    moves = job.recipe.solve.settle or job.recipe.solve.slide
    part = job.progress.part(SOLVE, MOVE if moves else MEASURE, "Solving the pose")
    proposal = job.session.solve(settings=replace(settings_of(job), progress=part))
    if proposal.after.status is SolveStatus.CANCELLED:
        raise Cancelled("the solve was cancelled.")
    _accept(job, proposal)


def _move_contacts(job: Job) -> None:
    """Settle contacts, then let them slide, where the recipe asks for it: proposals, accepted as they come."""
    spec = job.recipe.solve
    settings = settings_of(job, AGAIN)
    middle = 0.5 * (MOVE + MEASURE)
    if spec.settle:
        settling = replace(settings, progress=job.progress.part(MOVE, middle, "Settling contacts"))
        _accept(job, job.session.settle(rounds=spec.settle, settings=settling))
    if spec.slide:
        sliding = replace(settings, progress=job.progress.part(middle, MEASURE, "Sliding contacts"))
        _accept(job, job.session.slide(slack=spec.slide, settings=sliding))


def settings_of(job: Job, candidates: tuple[str, ...] | None = None) -> SolveSettings:
    """The recipe's settings. candidates: in place of the recipe's."""
    spec = job.recipe.solve
    common = {name: value for name, value in spec.options.items() if name in COMMON}
    common |= {"candidates": candidates} if candidates else {}
    return SolveSettings(
        solver=spec.solver,
        solver_settings={name: value for name, value in spec.options.items() if name not in COMMON},
        options=configured(SolveOptions, common, "solve.options"),
        objective=Objective(_terms(job), "rig" if spec.limits else "none"),
        solids={name: solids for name, solids in job.solids.items() if solids},
    )


def _accept(job: Job, proposal: Proposal) -> None:
    job.session.accept(proposal)
    job.notes += [f"{name} stays where it is: {why}." for name, why in proposal.left_out.items()]
    job.solution = proposal.after


def _terms(job: Job) -> tuple[PoseTerm, ...]:
    spec = job.recipe.solve
    terms = paper_terms(*spec.weights)
    solids = {name: solids for name, solids in job.solids.items() if solids}
    if spec.penetration > 0.0 and solids:
        plugins = job.session.plugins
        name = plugins.name_for(POSE_TERMS, "depth")
        terms += (plugins.make(POSE_TERMS, name, weight=spec.penetration, solids=solids),)
    return terms
