"""Poses as JSON files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.atomic_file import write_atomic
from contact_core.errors import FileRefused, quoted
from contact_core.rig.rig import Pose
from contact_core.sealed import json_mistake, sealed, unsealed

SCHEMA = 1
LARGEST_FILE = 64_000_000  # bytes


def save_pose(path: Path | str, pose: Pose, *, rig: str = "") -> None:
    """Write a pose as JSON, atomically. Raises FileRefused."""
    write_atomic(path, json.dumps(sealed({"kind": "contact.pose", "schema": SCHEMA, "rig": rig, **_plain(pose)})))


def load_pose(path: Path | str) -> Pose:
    """A pose out of its JSON file. Raises FileRefused with a sentence for anything else."""
    return _pose(_read(path, "contact.pose"), Path(path))


def _plain(pose: Pose) -> dict[str, Any]:
    return {"joints": list(pose.joints), "local": pose.local.reshape(-1, 16).tolist()}


def _pose(data: Mapping[str, Any], path: Path) -> Pose:
    try:
        joints = tuple(str(name) for name in data["joints"])
        return Pose(joints, np.array(data["local"], float).reshape(len(joints), 4, 4))
    except (KeyError, TypeError, ValueError) as error:
        raise FileRefused(
            f"{path.name} holds no pose that can be read: wanted are names of joints, and for each a matrix of 16"
            " numbers."
        ) from error


def _read(path: Path | str, kind: str) -> dict[str, Any]:
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FileRefused(f"{path.name} is larger than {LARGEST_FILE // 1_000_000} MB, too much for {kind}.")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileRefused(f"cannot read {path}: {error.strerror or error}.") from error
    except (ValueError, RecursionError) as error:
        raise FileRefused(f"{path.name} is no JSON: {json_mistake(error)}.") from error
    if not isinstance(data, dict) or data.get("kind") != kind:
        raise FileRefused(f"{path.name} is not a file of the kind {kind}.")
    if data.get("schema") != SCHEMA:
        raise FileRefused(f"{path.name} has schema {quoted(data.get('schema'))}; this version reads {SCHEMA}.")
    return unsealed(data, path.name)
