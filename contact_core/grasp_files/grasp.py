"""`contact grasp`: from two files to a folder of grasps: a contact sheet, and a document, pose and model for
each."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from contact_core._version import __version__
from contact_core.arrays import FloatArray
from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import check_writable, replacing_set
from contact_core.document.asset import Asset
from contact_core.document.library import ContactSet
from contact_core.document.schema import dump_document
from contact_core.edit.command import apply_command
from contact_core.errors import Cancelled, ContactError, InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.grasp_files.grounds import without_grounds
from contact_core.grasp_files.views import views
from contact_core.grasping.finishing import Suggestion
from contact_core.grasping.pads import remark_on_size
from contact_core.grasping.scene import GraspScene
from contact_core.grasping.searching import GraspSettings
from contact_core.grasping.suggest import ranked, suggest
from contact_core.grasping.verbs import grasp_scene
from contact_core.grasping.verdict import DEFINITIONS, spell, told_through
from contact_core.hands.description import HandWords
from contact_core.job.standing import object_mesh
from contact_core.library.like import suggest_like
from contact_core.library.record import Grasp
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.plugins.registry import RENDERERS
from contact_core.plugins.writing import write_model
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.recipe.recipe import AssetSource, ObjectSpec
from contact_core.rig.pose_files import save_pose
from contact_core.rig.rig import Pose
from contact_core.scene.camera import camera_of
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.session import Session
from contact_core.solve.body import manipulator_length

HAND, OBJECT = "manipulator", "object"
SHEET, REPORT = "sheet.png", "report.json"
COLUMNS = 4
PANEL = (380, 340)  # pixels of one picture
SKIN, THING = (0.84, 0.64, 0.53), (0.62, 0.69, 0.76)
NEAR = 0.55  # hand lengths: how much of the object round the hand is in the frame
SCHEMA = 1


@dataclass(frozen=True, eq=False)
class GraspJob:
    """The two assets in one session. object: in the hand's units, scaled. notes: of what was read. unit: a sentence
    on the unit that the object does not say, None where it does."""

    session: Session
    hand: Asset
    object: Asset
    words: tuple[HandWords, ...] = ()
    notes: list[str] = field(default_factory=list)
    unit: str | None = None


@dataclass(frozen=True, eq=False)
class GraspResult:
    """Grasps, the best first, the content of report.json, and the files by role."""

    grasps: tuple[Suggestion, ...]
    report: dict[str, Any]
    files: dict[str, Path]


def grasp(
    hand: str,
    thing: str,
    out: Path,
    settings: GraspSettings,
    *,
    scale: float = 1.0,
    like: tuple[Grasp, ContactSet] | None = None,
    plugins: PluginManager | None = None,
    progress: Progress = NO_PROGRESS,
) -> GraspResult:
    """Suggest grasps of one file by the hand in another, and write them into `out`. scale: of the object. like: a
    saved grasp with its contacts, whose like places come first.

    Raises ContactError; then nothing is half-written. Cancelled when progress raises it.
    """
    plugins, out = plugins or PluginManager(), Path(out)
    names = [SHEET, REPORT, *(name for k in range(64) for name in _names(k + 1).values())]
    check_writable(out, names)
    began = time.perf_counter()
    job = prepare(hand, thing, scale, plugins)
    scene = grasp_scene(job.session, HAND, OBJECT, job.words)
    try:
        found, first = [], 0.0
        part = progress.part(0.05, 0.85)
        for one in suggest(scene, settings, part) if like is None else suggest_like(scene, *like, settings, part):
            first = first or time.perf_counter() - began
            found.append(one)
        found = ranked(found)
        seconds = {"first": round(first, 2), "all": round(time.perf_counter() - began, 2)}
        return write_results(job, scene, found, out, plugins, seconds, settings, progress)
    except Cancelled as cancelled:
        raise Cancelled("the search for grasps was cancelled; nothing was written.") from cancelled
    except InvalidInput as error:
        if job.unit is None:
            raise
        raise InvalidInput(f"{error} {job.unit}") from error


def prepare(hand: str, thing: str, scale: float, plugins: PluginManager) -> GraspJob:
    """Both files in a session. Raises FileRefused, InvalidInput."""
    manipulator, raw = read_asset(hand, plugins), read_asset(thing, plugins)
    if manipulator.rig is None:
        raise InvalidInput(f"{manipulator.name} has no skeleton, so it is no hand; give the hand first.")
    unit = manipulator.rig.meters_per_unit
    length = manipulator_length(manipulator.rig)
    factor = scale * (1.0 if raw.meters_per_unit is None else raw.meters_per_unit / unit)
    raw, ground = without_grounds(raw, length / abs(factor)) if factor else (raw, None)
    mesh = object_mesh(raw, ObjectSpec(AssetSource(file=str(thing)), scale=scale), unit, length)
    name = f"{raw.name} (object)" if raw.name == manipulator.name else raw.name
    placed = Asset(
        name, mesh, None, raw.source_vertices, raw.source_faces, unit, raw.up_axis, raw.notes, raw.details
    )
    session = Session(plugins=plugins)
    session.surfaces.add(HAND, manipulator.mesh, meters_per_unit=unit, rig=manipulator.rig)
    session.surfaces.add(OBJECT, mesh, meters_per_unit=unit, up_axis=raw.up_axis)
    words = tuple(HandWords(**each) for each in manipulator.details.get("hands", ()))
    notes = [f"{asset.name}: {note}" for asset in (manipulator, raw) for note in asset.notes]
    notes += [] if ground is None else [ground]
    unsaid = None
    if raw.meters_per_unit is None:
        unsaid = f"{raw.name} says no unit; the hand's was taken. Give --scale where it has another size."
        notes.append(unsaid)
    return GraspJob(session, manipulator, placed, words, notes, unsaid)


def _names(place: int) -> dict[str, str]:
    return {
        "document": f"grasp_{place}.json",
        "pose": f"grasp_{place}.pose.json",
        "model": f"grasp_{place}.glb",
    }


def write_results(
    job: GraspJob, scene: GraspScene, found: Sequence[Suggestion], out: Path, plugins: PluginManager,
    seconds: dict[str, float], settings: GraspSettings, progress: Progress,
) -> GraspResult:  # fmt: skip
    """Grasps of a job as files: sheet, report, and a document, a pose and a model for each. Raises FileRefused."""
    names = [SHEET, REPORT, *(name for k in range(64) for name in _names(k + 1).values())]
    with replacing_set(out, names) as stage:
        for place, one in enumerate(found):
            progress.tell(0.85 + 0.08 * place / max(len(found), 1), f"Writing grasp {place + 1}")
            _write_one(job, one, stage, _names(place + 1), plugins)
        progress.tell(0.93, "Drawing the contact sheet")
        _draw(scene, found, stage / SHEET, plugins, job.notes)
        report = report_of(job, scene, found, seconds, settings)
        write_atomic(stage / REPORT, json.dumps(report, indent=2, allow_nan=False) + "\n")
        written = {path.name: out / path.name for path in sorted(stage.iterdir())}
        progress.tell(1.0, "Finishing")
    return GraspResult(tuple(found), report, written)


def _write_one(job: GraspJob, one: Suggestion, stage: Path, names: dict[str, str], plugins: PluginManager) -> None:
    document = apply_command(one.proposal.command, job.session.document)
    pose = document.poses[HAND]
    write_atomic(stage / names["document"], dump_document(document))
    save_pose(stage / names["pose"], pose, rig=job.session.rigs[HAND].name)
    poses = {job.hand.name: pose, job.object.name: Pose((job.object.name,), np.eye(4)[None])}
    write_model(stage / names["model"], [job.hand, job.object], poses, plugins)


def _draw(
    scene: GraspScene, found: Sequence[Suggestion], path: Path, plugins: PluginManager, notes: list[str]
) -> None:
    """The contact sheet by the best renderer that can."""
    pictures = sheet(scene, found)
    columns = min(COLUMNS, len(found))
    size = (PANEL[0] * columns, PANEL[1] * (1 + max(p.row for p in pictures)))
    for renderer in sorted(plugins.offers(RENDERERS).values(), key=lambda r: (-r.priority, r.name)):
        try:
            renderer.render(pictures, path, size=size)
        except ContactError as error:
            notes.append(f"renderer {renderer.name}: {error}")
        else:
            return
    notes.append("no renderer could draw a picture; everything else was written.")


def sheet(scene: GraspScene, found: Sequence[Suggestion]) -> list[Picture]:
    """Every grasp from two sides, one below the other, so many in a row as fit."""
    pictures = []
    for place, one in enumerate(found):
        picture = _picture(scene, one, place + 1)
        for side, way in enumerate(_sides(scene, one, picture)):
            caption = picture.caption if side == 0 else f"   {_beside(one)}"
            row = 2 * (place // COLUMNS) + side
            pictures.append(replace(picture, camera_from=tuple(way.tolist()), caption=caption, row=row))
    return sorted(pictures, key=lambda picture: picture.row)


def _beside(one: Suggestion) -> str:
    return f"{spell('gap', one.facts.metrics['gap'])} gap {told_through(one.facts.metrics)}".rstrip()


def _sides(scene: GraspScene, one: Suggestion, picture: Picture) -> tuple[FloatArray, FloatArray]:
    """The ways (3,) to the eye of both sides of a grasp."""

    def eye_of(way: FloatArray) -> FloatArray:
        return camera_of(replace(picture, camera_from=tuple(way.tolist())), PANEL[0] / PANEL[1]).eye

    return views((one.skin, scene.mesh), _own(scene, one), _near(scene, one), one.way, eye_of)


def _own(scene: GraspScene, one: Suggestion) -> FloatArray:
    """(k, 3) points of the skin of digits and palm, in the object's space."""
    digits = one.skin.points[np.concatenate(scene.hand.skin_of_digits)]
    return np.concatenate([digits, transform_points(one.placed, scene.hand.tested)])


def _near(scene: GraspScene, one: Suggestion) -> FloatArray:
    """(k, 3) the object's vertices near the digits."""
    middle = one.skin.points[np.concatenate(scene.hand.skin_of_digits)].mean(axis=0)
    return scene.mesh.points[np.linalg.norm(scene.mesh.points - middle, axis=1) < NEAR * scene.hand.length]


def _picture(scene: GraspScene, one: Suggestion, place: int) -> Picture:
    """A grasp with what of it has to be in the frame."""
    word = "" if one.is_grasp else " - NOT good"
    return Picture(
        meshes=(PictureMesh(one.skin, SKIN), PictureMesh(scene.mesh, THING)), caption=f"{place}. {one.kind}{word}",
        focus=np.concatenate([_own(scene, one), _near(scene, one)]),
    )  # fmt: skip


def report_of(
    job: GraspJob,
    scene: GraspScene,
    found: Sequence[Suggestion],
    seconds: dict[str, float],
    settings: GraspSettings,
) -> dict[str, Any]:
    """The content of report.json."""
    return {
        "schema": "contact.grasps",
        "version": SCHEMA,
        "contact_core": __version__,
        "hand": job.hand.name,
        "object": job.object.name,
        "hand_length": scene.hand.length,
        "meters_per_unit": scene.rig.meters_per_unit,
        "seed": settings.seed,
        "summary": summary(found, remark_on_size(scene)),
        "seconds": seconds,
        "grasps": [_entry(one, place + 1) for place, one in enumerate(found)],
        "notes": [*job.notes, *scene.hand.description.notes],
        "definitions": DEFINITIONS,
    }


def summary(found: Sequence[Suggestion], size: str = "") -> str:
    """One sentence: how many good grasps there are, and where there is none what keeps the best from being one."""
    good = sum(one.is_grasp for one in found)
    if good:
        return f"{good} good grasp{'s' if good > 1 else ''} of {len(found)} shown."
    if not found:
        return "No grasp was found: the hand reaches the object nowhere with two pads."
    fails = found[0].verdict.failures[0]
    return f"No good grasp was found; the best of {len(found)} fails: {fails}. {size}".rstrip()


def _entry(one: Suggestion, place: int) -> dict[str, Any]:
    return {
        "place": place,
        "kind": one.kind,
        "verdict": "grasp" if one.is_grasp else "bad",
        "failures": list(one.verdict.failures),
        "through": told_through(one.facts.metrics),
        "score": one.score,
        "closure": one.facts.closure,
        "comfort": one.facts.comfort,
        "clearance": one.facts.clearance,
        **one.facts.metrics,
        "left_out": dict(one.left_out),
        "files": _names(place),
    }
