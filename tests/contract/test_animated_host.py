"""A host with curves and with a choice of bones keeps the whole contract: the reference for both capabilities."""

from __future__ import annotations

import importlib.util
import pickle
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.polar import split_world_from_local
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import JointFreedom, Pose
from contact_core.scene.host import BoneChoosing, CurveWriting
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import MemoryObject, MemoryScene
from contact_core.scene.reading import unstretch_pose
from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene


def _memory() -> Any:
    """tests/contract/test_memory_host.py, also where this file is loaded by itself (for its mutants)."""
    if "memory_subject" not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            "memory_subject", Path(__file__).with_name("test_memory_host.py")
        )
        assert spec is not None and spec.loader is not None
        sys.modules["memory_subject"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["memory_subject"])
    return sys.modules["memory_subject"]


@dataclass(frozen=True, eq=False)
class AnimatedObject(MemoryObject):
    """curves: by joint, cubic keys of that joint alone. groups: joints by name. chosen: a group, or "all"."""

    curves: Mapping[str, PoseKeys] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    chosen: str = "all"

    def pose_at(self, frame: float | None) -> Pose:
        pose = super().pose_at(frame)
        if frame is None:
            return pose
        local = np.array(pose.local)
        for joint, keys in self.curves.items():
            at = self.rig.joint_index(joint)
            local[at] = keys.sampled(self.rig, [frame])[0, at]
        return Pose(pose.joints, local)

    def with_pose(self, pose: Pose, frame: float | None) -> AnimatedObject:
        posed = super().with_pose(pose, frame)
        assert isinstance(posed, AnimatedObject)
        if frame is None:
            return posed
        keyed = {
            joint: self.curves[joint].with_key(frame, Pose((joint,), matrix[None]))
            for joint, matrix in zip(pose.joints, pose.local, strict=True)
            if joint in self.curves
        }
        return replace(posed, curves={**self.curves, **keyed})

    def with_curves(self, keys: PoseKeys) -> AnimatedObject:
        """A copy whose named joints follow cubic keys from the first to the last. Raises InvalidInput."""
        first, last = keys.frames[0], keys.frames[-1]
        curves = dict(self.curves)
        for row, joint in enumerate(keys.poses[0].joints):
            rows = {f: (m, s) for f, (m, s) in self._keys_of(joint).items() if not first <= f <= last}
            for frame, pose, speed in zip(keys.frames, keys.poses, keys.speeds, strict=True):
                rows[frame] = (pose.local[row], speed[row])
            frames = tuple(sorted(rows))
            poses = tuple(Pose((joint,), rows[f][0][None]) for f in frames)
            curves[joint] = PoseKeys(self.rig.name, frames, poses, tuple(rows[f][1][None] for f in frames))
        whole = set(curves) == set(self.rig.joints)
        kept = tuple(each for each in self.keys if not (whole and first <= each[0] <= last))
        return replace(self, curves=curves, keys=kept)

    def _keys_of(self, joint: str) -> dict[float, tuple[Any, Any]]:
        """Its matrices and speeds by frame; a key of a straight blend is one at rest."""
        at = self.rig.joint_index(joint)
        if joint not in self.curves:
            return {frame: (pose.local[at], np.zeros(6)) for frame, pose in self.keys}
        known = self.curves[joint]
        return {f: (p.local[0], s[0]) for f, p, s in zip(known.frames, known.poses, known.speeds, strict=True)}


class AnimatedHost(MemoryHost, CurveWriting, BoneChoosing):
    """A memory host whose rigs have curves and groups of joints; what memory scenes lack is saved beside them."""

    def __init__(self, path: Path | str | None = None, *, scene: MemoryScene | None = None) -> None:
        super().__init__(path, scene=scene)
        if path is not None:
            extra = pickle.loads(_beside(Path(path)).read_bytes())
            objects = {k: _animated(item, **extra[k]) for k, item in self._scene.objects.items()}
            self._scene = replace(self._scene, objects=objects)
            self._states = [("open", self._scene)]

    def save(self, path: Path | None = None) -> None:
        super().save(path)
        names = ("curves", "groups", "chosen")
        extra = {k: {name: getattr(item, name) for name in names} for k, item in self._scene.objects.items()}
        assert self._path is not None
        _beside(self._path).write_bytes(pickle.dumps(extra))

    def _put_new(self, item: MemoryObject) -> str:
        return super()._put_new(_animated(item))

    def pose_keys(self, object_id: str) -> tuple[float, ...]:
        item = self._animated(object_id)
        frames = {frame for keys in item.curves.values() for frame in keys.frames}
        return tuple(sorted(frames | set(super().pose_keys(object_id))))

    def write_curves(self, object_id: str, pose_keys: PoseKeys) -> None:
        item = self._animated(object_id)
        stretch = split_world_from_local(item.world).surface_from_local
        speeds = [np.array(each) for each in pose_keys.speeds]
        for each in speeds:
            each[:, :3] = each[:, :3] @ np.linalg.inv(stretch).T
        poses = tuple(unstretch_pose(pose, stretch) for pose in pose_keys.poses)
        self._put("Curves", object_id, item.with_curves(replace(pose_keys, poses=poses, speeds=tuple(speeds))))

    def bones_of(self, object_id: str) -> str:
        return self._animated(object_id).chosen

    def choose_bones(self, object_id: str, choice: str) -> None:
        item = self._animated(object_id)
        if choice not in ("all", *item.groups):
            raise InvalidInput(f"{item.name} has no group {choice!r}; it has {sorted(item.groups)}.")
        self._put("Choose bones", object_id, replace(item, chosen=choice))

    def freedoms(self, object_id: str) -> tuple[JointFreedom, ...]:
        item, rig = self._animated(object_id), super().read_rig(object_id).rig
        assert rig is not None
        chosen = item.groups.get(item.chosen, rig.joints)
        return tuple(
            freedom if name in chosen else JointFreedom("fixed")
            for name, freedom in zip(rig.joints, rig.freedoms, strict=True)
        )

    def read_rig(self, object_id: str) -> Asset:
        asset = super().read_rig(object_id)
        assert asset.rig is not None
        return replace(asset, rig=replace(asset.rig, freedoms=self.freedoms(object_id)))

    def _animated(self, object_id: str) -> AnimatedObject:
        item = self._object(object_id)
        assert isinstance(item, AnimatedObject)
        return item


def _animated(item: MemoryObject, **extra: Any) -> AnimatedObject:
    return AnimatedObject(item.name, item.shape, item.world, item.pose, item.keys, item.selections, **extra)


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.animation")


def build_animated(scene: HostScene, host_type: type[AnimatedHost] = AnimatedHost) -> AnimatedHost:
    """The contract's scene in a fresh host, with nothing left to undo."""
    made: MemoryScene = _memory().build_in_memory(scene).scene
    groups = {rig.name: rig.groups for rig in scene.rigs}
    objects = {k: _animated(item, groups=groups.get(item.name, {})) for k, item in made.objects.items()}
    return host_type(scene=replace(made, objects=objects))


class TestAnimatedHost(HostContract):
    subject = "memory with curves"

    @pytest.fixture
    def build(self) -> Build:
        return build_animated

    def foreign_edit(self, host: MemoryHost) -> None:
        farther = host.placement("plain").copy()
        farther[0, 3] += 1.0
        host.move("plain", farther)

    def choice_of(self, group: str) -> str:
        return group
