"""The part of the parity test that runs in a Blender process: `python blender_parity.py FOLDER`.

FOLDER/jobs.json names rigs: {"name": {"joint": ..., "blend": ..., "object": ...}}. A rig of a .blend is read here,
in its native host, and put away as FOLDER/name.rig; any other lies there already. Then the script runs on each in
Blender, and its outcome is FOLDER/name.npz; the scene, exported by Blender's own exporter, is FOLDER/name.usdc.
A stage FOLDER/shot.usda, if there, is imported by Blender's own importer, and FOLDER/imported.npz tells how its rig
stands at the script's frame.
"""

from __future__ import annotations

import json
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from parity_script import FRAME, Outcome, build_scene, prepared, run

from contact_core.document.asset import Asset
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.scene.memory_host import MemoryHost


def put_away(asset: Asset, path: Path) -> None:
    """A rig as a file that any process reads: a memory scene with that rig."""
    host = MemoryHost()
    host.add(asset)
    host.save(path)


def fetch(path: Path) -> Asset:
    """The rig of such a file."""
    host = MemoryHost(path)
    (item,) = host.objects()
    return host.read_rig(item.id)


def outcome_to_arrays(outcome: Outcome) -> dict[str, Any]:
    """For np.savez: poses as names and matrices."""
    arrays: dict[str, Any] = {}
    for field in fields(outcome):
        value = getattr(outcome, field.name)
        if isinstance(value, dict):
            arrays[f"{field.name} names"] = np.array(list(value))
            value = np.array(list(value.values()))
        arrays[field.name] = value
    return arrays


def outcome_from_arrays(arrays: Any) -> Outcome:
    """The inverse."""
    values: dict[str, Any] = {}
    for field in fields(Outcome):
        value = arrays[field.name]
        if f"{field.name} names" in arrays:
            value = dict(zip(arrays[f"{field.name} names"].tolist(), value, strict=True))
        elif field.name != "skin":
            value = tuple(value.tolist()) if value.ndim else value.item()
        values[field.name] = value
    return Outcome(**values)


def main(folder: Path) -> None:
    from contact_blender.host import BlenderHost, bpy

    for name, job in json.loads((folder / "jobs.json").read_text()).items():
        if "blend" in job:
            put_away(prepared(BlenderHost(job["blend"]).read_rig(job["object"])), folder / f"{name}.rig")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        host = BlenderHost()
        build_scene(host, fetch(folder / f"{name}.rig"), job["joint"])
        np.savez(folder / name, **outcome_to_arrays(run(host, job["joint"], folder / f"{name}.blend")))
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = int(FRAME), int(FRAME)
        bpy.ops.wm.usd_export(filepath=str(folder / f"{name}.usdc"), export_animation=True)
    if (folder / "shot.usda").is_file():
        np.savez(folder / "imported", **imported(folder / "shot.usda"))


def imported(stage: Path) -> dict[str, Any]:
    """World points of the rig of a stage at the script's frame: as we skin its animation, and as Blender does."""
    from contact_blender.host import BlenderHost, bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(stage))
    host = BlenderHost()
    (key,) = [item.id for item in host.objects() if item.kind == "rig"]
    rig, place = host.read_rig(key).rig, host.placement(key, FRAME)
    ours = skin(rig, forward_kinematics(rig.parents, host.read_pose(key, FRAME).local))
    bpy.context.scene.frame_set(int(FRAME))
    evaluated = bpy.data.objects[key].evaluated_get(bpy.context.evaluated_depsgraph_get())
    theirs = np.array([tuple(evaluated.matrix_world @ vertex.co) for vertex in evaluated.data.vertices])
    return {
        "ours": ours @ place[:3, :3].T + place[:3, 3],
        "theirs": theirs,
        "keys": np.array(host.pose_keys(key)),
        "joints": np.array(rig.joints),
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]))
