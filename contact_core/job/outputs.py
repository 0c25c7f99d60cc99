"""What a job leaves on the disk: document, pose, posed model, pictures, report. All of them, or nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from contact_core._version import __version__
from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import replacing_set
from contact_core.document.schema import dump_document
from contact_core.errors import InvalidInput
from contact_core.grasping.verdict import DEFINITIONS, SCHEMA, table
from contact_core.job.job import Job, JobResult
from contact_core.job.pictures import pictures_of
from contact_core.plugins.drawing import draw
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.writing import write_model
from contact_core.recipe.recipe import Recipe
from contact_core.recipe.sources import inputs_of
from contact_core.rig.pose_files import save_pose
from contact_core.rig.poses import moved_roots
from contact_core.rig.rig import Pose
from contact_core.scene.host import SceneSpace, StoredDocument
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import MemoryScene, save_scene
from contact_core.scene.picture import Picture


def files_of(recipe: Recipe) -> dict[str, str]:
    """What a job leaves, by role; a picture only where something can draw it. Of several manipulators each has a
    pose of its own."""
    names = [spec.name for spec in recipe.manipulators]
    poses = {f"pose of {name}": f"pose.{number}.json" for number, name in enumerate(names, start=1)}
    return {
        "document": "document.json",
        **(poses if len(names) > 1 else {"pose": "pose.json"}),
        "model": "posed.glb",
        "scene": "scene.contactscene",
        "picture": "picture.png",
        "report": "report.json",
    }


def write_outputs(job: Job, out: Path, plugins: PluginManager) -> JobResult:
    """Draw and write everything. Raises FileRefused where `out` cannot be written."""
    rows = table(job.metrics, job.verdict)
    files = files_of(job.recipe)
    poses = [(role, name) for role, name in files.items() if role.startswith("pose")]
    with replacing_set(out, files.values()) as stage:
        with job.stage("write", 0.75, "Writing the document, the pose and the model"):
            write_atomic(stage / files["document"], dump_document(job.session.timed_document))
            for spec, (_, name) in zip(job.recipe.manipulators, poses, strict=True):
                pose = job.session.document.poses[spec.name]
                save_pose(stage / name, pose, rig=job.session.rigs[spec.name].name)
            _write_model(job, stage / files["model"], plugins)
            save_scene(scene_of(job), stage / files["scene"])
        with job.stage("render", 0.8, "Drawing the pictures"):
            renderer = _draw(job, pictures_of(job, rows), stage / files["picture"], plugins)
        report = report_of(job, renderer)
        write_atomic(stage / files["report"], json.dumps(report, indent=2, allow_nan=False) + "\n")
        written = {role: out / name for role, name in files.items() if (stage / name).exists()}
        job.progress.tell(1.0, "Finishing")  # the last moment to cancel: from here on the files are written
    return JobResult(job.recipe, report, job.verdict, written, rows)


def _draw(job: Job, pictures: list[Picture], path: Path, plugins: PluginManager) -> str | None:
    """Draw with the best renderer that can; its name. What the others lacked goes into the notes."""
    try:
        drawn = draw(pictures, path, plugins, size=job.recipe.view.size)
    except InvalidInput as error:
        job.notes.append(f"{error} Everything else was written.")
        return None
    job.notes += drawn.passed_over
    return drawn.renderer


def _write_model(job: Job, path: Path, plugins: PluginManager) -> None:
    """A model with every manipulator in its pose and every object where it lies, by the format that writes .glb."""
    document = job.session.document
    poses: dict[str, Pose] = {}
    for name, asset in job.assets.items():
        world = document.surface(name).world_from_surface
        poses[asset.name] = Pose((asset.name,), world[None])
        if asset.rig is not None:
            poses[asset.name] = moved_roots(asset.rig, document.poses[name], world)
    if not write_model(path, list(job.assets.values()), poses, plugins):
        job.notes.append("no plugin writes .glb, so there is no posed model.")


def scene_of(job: Job) -> MemoryScene:
    """Meshes, rigs, poses and contacts together, as a host opens them: what is edited on."""
    document, first = job.session.document, job.assets[job.recipe.manipulators[0].name]
    host = MemoryHost(space=SceneSpace(first.meters_per_unit or 1.0, first.up_axis))
    for name, asset in job.assets.items():
        key = host.add(replace(asset, name=name), document.surface(name).world_from_surface)
        if asset.rig is not None:
            host.write_pose(key, document.poses[name])
    return replace(host.scene, document=StoredDocument.of(job.session.timed_document, 0))


def report_of(job: Job, renderer: str | None) -> dict[str, Any]:
    """The content of report.json."""
    metrics, first = dict(job.metrics), job.recipe.manipulators[0].name
    return _finite(
        {
            "schema": "contact.report",
            "version": SCHEMA,
            "contact_core": __version__,
            "solver": job.solution.solver,
            "inputs": inputs_of(job.recipe),
            "recipe": job.recipe.name,
            "verdict": "grasp" if job.verdict.is_grasp else "bad",
            "failures": list(job.verdict.failures),
            "failed_patches": dict(job.verdict.failed_patches),
            **{key: metrics[key] for key in metrics if key != "patches"},
            "limits": dict(job.verdict.limits),
            "patches": metrics["patches"],
            "left_out": dict(job.left_out),
            "dofs": len(job.solution.theta),
            "iterations": len(job.solution.trace),
            "status": job.solution.status.name.lower(),
            "message": job.solution.message,
            "trace": [float(value) for value in job.solution.trace],
            "start_distance": min(job.start_distance[name] / job.length(name) for name in job.start),
            "manipulator_length": job.length(first),
            "meters_per_unit": job.session.rigs[first].meters_per_unit,
            "renderer": renderer,
            "seconds": {key: round(value, 4) for key, value in job.seconds.items()},
            "notes": list(job.notes),
            "definitions": DEFINITIONS,
        }
    )


def _finite(value: Any) -> Any:
    """The same with null for what is no number, for which JSON has no word."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
