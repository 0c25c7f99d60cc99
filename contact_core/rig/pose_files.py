"""Poses and keys as JSON files, and the pose library: a folder of them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.atomic_file import write_atomic
from contact_core.errors import FileRefused, InvalidInput
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose

SCHEMA = 1
LARGEST_FILE = 64_000_000  # bytes


@dataclass(frozen=True)
class PoseLibrary:
    """A folder of named poses, one JSON file each, that people may copy about."""

    folder: Path
    rig: str = ""

    def names(self) -> list[str]:
        """The poses in the library, sorted."""
        return sorted(path.name.removesuffix(".pose.json") for path in self.folder.glob("*.pose.json"))

    def save(self, name: str, pose: Pose) -> Path:
        """Keep a pose under a name, replacing the one that is there."""
        path = self._path(name)
        save_pose(path, pose, rig=self.rig)
        return path

    def load(self, name: str) -> Pose:
        """A pose by name; raises FileRefused naming those that exist."""
        if not self._path(name).is_file():
            raise FileRefused(f"the pose library has no {name!r}; it has {', '.join(self.names()) or 'none yet'}.")
        return load_pose(self._path(name))

    def remove(self, name: str) -> None:
        """Take a pose out; raises FileRefused when it is not there."""
        self.load(name)
        self._path(name).unlink()

    def _path(self, name: str) -> Path:
        if not re.fullmatch(r"[\w][\w .()+-]{0,99}", name):
            raise InvalidInput(f"a pose is named by letters, digits, blanks and . ( ) + - _, but got {name!r}.")
        return self.folder / f"{name}.pose.json"


def save_pose(path: Path | str, pose: Pose, *, rig: str = "") -> None:
    """Write a pose as JSON, atomically. Raises FileRefused."""
    write_atomic(path, json.dumps({"kind": "contact.pose", "schema": SCHEMA, "rig": rig, **_plain(pose)}))


def load_pose(path: Path | str) -> Pose:
    """A pose out of its JSON file. Raises FileRefused with a sentence for anything else."""
    return _pose(_read(path, "contact.pose"), Path(path))


def save_keys(path: Path | str, keys: PoseKeys) -> None:
    """Write keys as JSON, atomically. Raises FileRefused."""
    held = [{"frame": frame, **_plain(pose)} for frame, pose in zip(keys.frames, keys.poses, strict=True)]
    for key, speeds in zip(held, keys.speeds, strict=keys.is_cubic):
        key["speeds"] = speeds.ravel().tolist()
    write_atomic(path, json.dumps({"kind": "contact.keys", "schema": SCHEMA, "rig": keys.rig, "keys": held}))


def load_keys(path: Path | str) -> PoseKeys:
    """Keys out of their JSON file. Raises FileRefused with a sentence for anything else."""
    data = _read(path, "contact.keys")
    try:
        frames = tuple(float(key["frame"]) for key in data["keys"])
        poses = tuple(_pose(key, Path(path)) for key in data["keys"])
        speeds = tuple(np.array(key["speeds"], float).reshape(-1, 6) for key in data["keys"] if "speeds" in key)
        return PoseKeys(str(data["rig"]), frames, poses, speeds)
    except (KeyError, TypeError, ValueError) as error:
        raise FileRefused(f"{Path(path).name} holds no keys that can be read: {error}.") from error


def _plain(pose: Pose) -> dict[str, Any]:
    return {"joints": list(pose.joints), "local": pose.local.reshape(-1, 16).tolist()}


def _pose(data: Mapping[str, Any], path: Path) -> Pose:
    try:
        joints = tuple(str(name) for name in data["joints"])
        return Pose(joints, np.array(data["local"], float).reshape(len(joints), 4, 4))
    except (KeyError, TypeError, ValueError) as error:
        raise FileRefused(f"{path.name} holds no pose that can be read: {error}.") from error


def _read(path: Path | str, kind: str) -> dict[str, Any]:
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FileRefused(f"{path.name} is larger than {LARGEST_FILE // 1_000_000} MB, too much for {kind}.")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileRefused(f"cannot read {path}: {error.strerror or error}.") from error
    except ValueError as error:
        raise FileRefused(f"{path.name} is no JSON: {error}.") from error
    if not isinstance(data, dict) or data.get("kind") != kind:
        raise FileRefused(f"{path.name} is not a file of the kind {kind}.")
    if data.get("schema") != SCHEMA:
        raise FileRefused(f"{path.name} has schema {data.get('schema')!r}; this version reads {SCHEMA}.")
    return data
