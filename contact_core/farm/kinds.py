"""The kinds of jobs that the core brings: recipes of `contact pose`, and documents with the assets beside them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contact_core.atomic_file import read_bounded, write_atomic
from contact_core.errors import Cancelled, FileRefused, InvalidInput
from contact_core.plugins.slots import JobKind, JobOutcome, JobRequest
from contact_core.progress import Progress

if TYPE_CHECKING:
    from contact_core.document.asset import Asset
    from contact_core.plugins.manager import PluginManager
    from contact_core.session import Session

MAX_BYTES = 1 << 30  # as for every document
SCHEMA_LINE = b'"schema": "contact-core.document"'


class RecipeJob:
    """`contact pose` on one recipe."""

    name = "recipe"
    summary = "a recipe of `contact pose`: document, pose, model, picture and report"
    suffixes: tuple[str, ...] = (".toml",)

    def claims(self, path: Path) -> bool:
        """Every TOML file that speaks of a manipulator, and what is no TOML at all, so that it is told."""
        if path.name.endswith(".rig.toml"):
            return False
        try:
            return "manipulator" in tomllib.loads(path.read_text(encoding="utf-8").removeprefix("\ufeff"))
        except (OSError, ValueError, RecursionError):
            return True

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        """The job of `contact pose`, by the batch's solver where it names one."""
        from contact_core.job.run import run
        from contact_core.recipe.reader import load_recipe

        if request.frames is not None:
            raise InvalidInput("a recipe has no frames; leave --frames out, or give shots.")
        recipe = load_recipe(request.path)
        if request.solver is not None:
            recipe = replace(recipe, solve=replace(recipe.solve, solver=request.solver))
        result = run(recipe, request.folder, plugins=plugins, progress=progress)
        files = {role: path.name for role, path in result.files.items()}
        return JobOutcome(
            tuple(files.values()),
            badness_of(result.report, result.verdict.limits, result.verdict.failures),
            result.verdict.failures,
            result.table,
            tuple(result.report["notes"]),
            files.get("picture"),
        )


class DocumentJob:
    """The pairs of a document, solved on the assets that lie beside it under the names of its surfaces."""

    name = "document"
    summary = "the pairs of a document, solved on the files named as its surfaces"
    suffixes: tuple[str, ...] = (".json",)

    def claims(self, path: Path) -> bool:
        """Whether a file says that it is a document."""
        try:
            return SCHEMA_LINE in read_bounded(path, MAX_BYTES)
        except FileRefused:
            return False

    def run(self, request: JobRequest, plugins: PluginManager, progress: Progress) -> JobOutcome:
        """Solve and write document.json, pose.json and picture.png."""
        from contact_core.atomic_set import replacing_set
        from contact_core.document.schema import dump_document, parse_document
        from contact_core.farm.solved import THUMBNAIL, draw_solved, outcome_of
        from contact_core.session import Session

        if request.frames is not None:
            raise InvalidInput("a document has no frames; leave --frames out, or give shots.")
        names = ("document.json", "pose.json", THUMBNAIL)
        document = parse_document(read_bounded(request.path, MAX_BYTES), request.path.name)
        with Session(document, plugins=plugins) as session:
            notes = _bring(session, request, plugins)
            proposal = session.solve(solver=request.solver, progress=progress.part(0.1, 0.8, "Solving"))
            check_finished(proposal.after.status.name)
            session.accept(proposal)
            with replacing_set(request.folder, names) as stage:
                write_atomic(stage / names[0], dump_document(session.timed_document))
                write_atomic(stage / names[1], _poses_json(session))
                picture = draw_solved(session, proposal, stage / THUMBNAIL)
                written = tuple(name for name in names if (stage / name).exists())
            return outcome_of(proposal, written, picture=picture, notes=notes)


def badness_of(metrics: Mapping[str, Any], limits: Mapping[str, float], failures: tuple[str, ...]) -> float:
    """The largest share of its limit that any metric of a grasp uses up: 1 is at the limit.

    A share that has to be large counts by what is missing to 1. What failed is above 1, whatever failed.
    """
    from contact_core.grasping.verdict import ACCEPT

    shares = [0.0]
    for key, limit in limits.items():
        value = metrics.get(key)
        if value is None:
            continue
        used, room = (value, limit) if ACCEPT[key][0] == "<=" else (1.0 - value, 1.0 - limit)
        shares.append(used / room if room > 0.0 else float(used))
    worst = max(shares)
    return max(worst, 1.0 + 0.01 * len(failures)) if failures else min(worst, 1.0)


def check_finished(status: str) -> None:
    """Raises Cancelled where a solve says that it was."""
    if status == "CANCELLED":
        raise Cancelled("the solve was cancelled; nothing was written.")


def _bring(session: Session, request: JobRequest, plugins: PluginManager) -> tuple[str, ...]:
    """Give every surface of a document its mesh and rig, from the file that carries its name."""
    notes = []
    for name, surface in session.document.surfaces.items():
        asset = _asset_of(name, request, plugins)
        if surface.rig is not None and asset.rig is None:
            raise FileRefused(f"the surface {name!r} was a rig, but its file has no skeleton.")
        if asset.mesh.digest != surface.digest and asset.mesh.topology_digest == surface.topology_digest:
            notes.append(f"{name} has another shape than when it was painted; its contacts went with it.")
        session.surfaces.add(
            name,
            asset.mesh,
            rig=asset.rig,
            meters_per_unit=asset.meters_per_unit or surface.meters_per_unit,
            up_axis=asset.up_axis,
            world_from_surface=surface.world_from_surface,
        )
    return tuple(notes)


def _asset_of(name: str, request: JobRequest, plugins: PluginManager) -> Asset:
    from contact_core.plugins.reading import read_asset
    from contact_core.plugins.registry import FORMATS

    suffixes = sorted({s for kind in plugins.offers(FORMATS).values() if kind.can_read for s in kind.suffixes})
    folders = [request.path.parent, *([request.assets] if request.assets is not None else [])]
    for folder in folders:
        for path in (folder / f"{name}{suffix}" for suffix in suffixes):
            if path.is_file():
                return read_asset(path, plugins)
    where = " or ".join(map(str, folders))
    raise FileRefused(
        f"the surface {name!r} needs its file: {name} with one of {', '.join(suffixes)}, in {where}. Put it there,"
        " or name its folder with --assets DIR."
    )


def _poses_json(session: Session) -> str:
    """Local joint transforms of every posed surface: parent_from_joint, rows of 4 x 4, column vectors."""
    poses = {
        name: {joint: local.tolist() for joint, local in zip(pose.joints, pose.local, strict=True)}
        for name, pose in session.document.poses.items()
    }
    head = {"schema": "contact.poses", "version": 1, "matrix": "parent_from_joint, 4 rows, column vectors"}
    return json.dumps({**head, "surfaces": poses}, indent=1) + "\n"


_KINDS: tuple[JobKind, ...] = (RecipeJob(), DocumentJob())
OWN: Mapping[str, JobKind] = {kind.name: kind for kind in _KINDS}
