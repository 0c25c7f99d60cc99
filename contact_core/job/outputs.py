"""What a job leaves on the disk: document, pose, posed model, pictures, report. All of them, or nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from contact_core._version import __version__
from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import replacing_set
from contact_core.document.schema import dump_document
from contact_core.errors import ContactError
from contact_core.job.pictures import pictures_of
from contact_core.job.report import DEFINITIONS, SCHEMA, inputs_of, table
from contact_core.job.workpiece import Job, JobResult
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS, RENDERERS
from contact_core.rig.rig import Pose
from contact_core.scene.picture import Picture

# What a job leaves, by role; a picture only where something can draw it.
FILES = {
    "document": "document.json",
    "pose": "pose.json",
    "model": "posed.glb",
    "picture": "picture.png",
    "report": "report.json",
}


def write_outputs(job: Job, out: Path, plugins: PluginManager) -> JobResult:
    """Draw and write everything. Raises FileRefused where `out` cannot be written."""
    rows = table(job.metrics, job.verdict)
    with replacing_set(out, FILES.values()) as stage:
        with job.stage("write", 0.75, "Writing the document, the pose and the model"):
            write_atomic(stage / FILES["document"], dump_document(job.session.timed_document))
            write_atomic(stage / FILES["pose"], pose_json(job.rig.name, job.pose))
            _write_model(job, stage / FILES["model"], plugins)
        with job.stage("render", 0.8, "Drawing the pictures"):
            renderer = draw(job, pictures_of(job, rows), stage / FILES["picture"], plugins)
        report = report_of(job, renderer)
        write_atomic(stage / FILES["report"], json.dumps(report, indent=2, allow_nan=False) + "\n")
        written = {role: out / name for role, name in FILES.items() if (stage / name).exists()}
        job.progress.tell(1.0, "Finishing")  # the last moment to cancel: from here on the files are written
    return JobResult(job.recipe, report, job.verdict, written, rows)


def draw(job: Job, pictures: list[Picture], path: Path, plugins: PluginManager) -> str | None:
    """Draw with the best renderer that can; its name. What the others lacked goes into the notes."""
    renderers = sorted(plugins.offers(RENDERERS).values(), key=lambda r: (-r.priority, r.name))
    for renderer in renderers:
        try:
            renderer.render(pictures, path, size=job.recipe.view.size)
        except ContactError as error:
            job.notes.append(f"renderer {renderer.name}: {error}")
        else:
            return renderer.name
    job.notes.append("no renderer could draw a picture; everything else was written.")
    return None


def _write_model(job: Job, path: Path, plugins: PluginManager) -> None:
    """A model with the manipulator in its pose and the object where it lies, by the format that writes .glb."""
    writers = [f for f in plugins.offers(FORMATS).values() if f.can_write and ".glb" in f.suffixes]
    if not writers:
        job.notes.append("no plugin writes .glb, so there is no posed model.")
        return
    standing = Pose((job.object.name,), job.placed[None])
    poses = {job.manipulator.name: job.pose, job.object.name: standing}
    writers[0].write(path, [job.manipulator, job.object], poses)


def pose_json(rig: str, pose: Pose) -> str:
    """Local joint transforms by name: parent_from_joint, rows of a 4 x 4 matrix, column vectors, surface units."""
    joints = {name: local.tolist() for name, local in zip(pose.joints, pose.local, strict=True)}
    head = {
        "schema": "contact.pose",
        "version": 1,
        "rig": rig,
        "matrix": "parent_from_joint, 4 rows, column vectors",
    }
    return json.dumps({**head, "joints": joints}, indent=1) + "\n"


def report_of(job: Job, renderer: str | None) -> dict[str, Any]:
    """The content of report.json."""
    metrics = dict(job.metrics)
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
            "left_out": dict(job.placement.left_out),
            "dofs": len(job.solution.theta),
            "iterations": len(job.solution.trace),
            "status": job.solution.status.name.lower(),
            "message": job.solution.message,
            "trace": [float(value) for value in job.solution.trace],
            "start_distance": job.start_distance / job.length,
            "manipulator_length": job.length,
            "meters_per_unit": job.rig.meters_per_unit,
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
