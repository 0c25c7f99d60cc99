"""Animations of a glTF file as keys of its rig and of its objects.

CUBICSPLINE channels of a rig that have their keys together become cubic keys, LINEAR ones straight keys at all of
their times, both exactly. Everything else is sampled at whole frames: steps, curves with broken tangents, joints
that a moving node above them carries, objects that turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contact_builtins.formats.gltf_channels import SAME, Channel, MovingNodes, read_channels
from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_nodes import Nodes
from contact_builtins.formats.gltf_skeleton import Skeleton
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseKeys, turning_of
from contact_core.rig.rig import Pose, Rig

MAX_CLIPS = 1_000


def read_clips(
    gltf: Gltf, nodes: Nodes, rigged: tuple[Skeleton, Rig] | None, objects: Sequence[int], rate: float | None
) -> tuple[Clip, ...]:
    """The animations of a file that move its rig or its objects, the nodes of meshes without a skin.

    Keys of an object place what `read` gives: the identity is where it stands in the file. Where there is no rig
    and all move as one, they are one, under the file's name. rate: frames per second; None: what the file says,
    else 24. Raises InvalidInput for times that do not rise and values that do not fit.
    """
    entries = gltf.entries("animations")
    bounded(len(entries), "animations", MAX_CLIPS)
    clips = []
    for number, entry in enumerate(entries):
        said = entry.get("extras") if isinstance(entry.get("extras"), dict) else {}
        assert said is not None
        fps = rate or _number(said.get("frames_per_second"), 24.0)
        start = _number(said.get("frame_at_0"), 0.0)
        channels = read_channels(gltf, entry, fps)
        keys = list[PoseKeys]()
        if rigged is not None:
            skeleton, rig = rigged
            joints = _Joints(gltf, nodes, skeleton, channels)
            keys += [joints.keys(rig, start)] if joints.channels else []
            objects = [node for node in objects if not _below(nodes, node, set(skeleton.nodes))]
        moving = _moving_objects(gltf, nodes, objects, channels)
        if rigged is None and len(moving) == len(objects) and all(_alike(moving[0], each) for each in moving[1:]):
            moving = [(gltf.path.stem, *each[1:]) for each in moving[:1]]
        keys += _object_keys(moving, start, {each.rig for each in keys})
        if keys:
            clips.append(Clip(str(entry.get("name") or f"animation {number + 1}"), fps, tuple(keys)))
    return tuple(clips)


def _number(value: Any, otherwise: float) -> float:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if good and (value > 0.0 or otherwise == 0.0) else otherwise


class _Joints(MovingNodes):
    """The joints of a skeleton while channels move them and the nodes above them."""

    def __init__(self, gltf: Gltf, nodes: Nodes, skeleton: Skeleton, channels: list[Channel]) -> None:
        super().__init__(gltf, nodes, skeleton.nodes, channels)
        self.skeleton = skeleton
        raw = nodes.world[list(skeleton.nodes)]
        # what normalising the skeleton put behind each joint: reflections and scales, whatever the pose
        self.behind = np.linalg.solve(raw, skeleton.rest)

    def keys(self, rig: Rig, start: float) -> PoseKeys:
        """The keys; `start` is the frame at time 0."""
        frames = self.keyed()
        plain = {channel.node for channel in self.channels} <= set(self.skeleton.nodes)
        cubic = plain and self._is_cubic(frames)
        if not cubic and not (plain and all(c.kind == "LINEAR" and c.path != "scale" for c in self.channels)):
            frames = self.whole()
        poses = tuple(Pose(rig.joints, local) for local in self.local(frames))
        return PoseKeys(rig.name, tuple((start + frames).tolist()), poses, self._speeds() if cubic else ())

    def local(self, frames: FloatArray) -> FloatArray:
        """(n, j, 4, 4) parent_from_joint at frames (n,)."""
        world = self.world(frames)
        joints = np.stack([world[node] for node in self.skeleton.nodes], axis=1) @ self.behind
        result = joints.copy()
        for joint, parent in enumerate(self.skeleton.parents):
            if parent >= 0:
                result[:, joint] = np.linalg.solve(joints[:, parent], joints[:, joint])
        return result

    def _is_cubic(self, frames: FloatArray) -> bool:
        """Whether cubic keys at these frames are the very curves of the channels."""
        if len(frames) < 2 or any(c.path == "scale" for c in self.channels):
            return False
        if not all(len(c.frames) == len(frames) and c.is_smooth for c in self.channels):
            return False
        linear = self.behind[:, :3, :3]
        size = np.cbrt(np.linalg.det(linear))
        return bool(np.abs(linear - size[:, None, None] * np.eye(3)).max() < SAME * np.abs(size).max())

    def _speeds(self) -> tuple[FloatArray, ...]:
        """(j, 6) per key, per frame."""
        speeds = np.zeros((len(self.channels[0].frames), len(self.skeleton.nodes), 6))
        place = {node: joint for joint, node in enumerate(self.skeleton.nodes)}
        for channel in self.channels:
            joint = place[channel.node]
            assert channel.before is not None
            assert channel.after is not None
            slopes = np.concatenate([channel.after[:1], channel.before[1:]])
            if channel.path == "rotation":
                wxyz, slopes = np.roll(channel.values, 1, axis=1), np.roll(slopes, 1, axis=1)
                speeds[:, joint, 3:] = turning_of(wxyz, slopes)
            else:
                speeds[:, joint, :3] = slopes @ self._into_parent(joint).T
        return tuple(speeds)

    def _into_parent(self, joint: int) -> FloatArray:
        """(3, 3) from the frame of the node above a joint's node to that of its parent joint; neither changes."""
        above, parent = int(self.nodes.parents[self.skeleton.nodes[joint]]), int(self.skeleton.parents[joint])
        carrier = np.eye(4) if above < 0 else self.nodes.world[above]
        if parent < 0:
            return np.asarray(carrier[:3, :3])
        return np.asarray(np.linalg.solve(self.skeleton.rest[parent], carrier)[:3, :3])


Moving = tuple[str, FloatArray, FloatArray]  # a name, frames (n,), and (n, 4, 4) how it moves in the world


def _moving_objects(gltf: Gltf, nodes: Nodes, objects: Sequence[int], channels: list[Channel]) -> list[Moving]:
    """Those of the objects that move."""
    found = []
    for node in objects:
        moving = MovingNodes(gltf, nodes, [node], channels)
        if moving.channels:
            straight = all(each.path == "translation" and each.kind == "LINEAR" for each in moving.channels)
            frames = moving.keyed() if straight else moving.whole()
            away = moving.world(frames)[node] @ np.linalg.inv(nodes.world[node])
            found.append((_name_of(gltf, nodes, node), frames, away))
    return found


def _object_keys(moving: Sequence[Moving], start: float, taken: set[str]) -> list[PoseKeys]:
    """Their keys, each under a name of its own; `start` is the frame at time 0."""
    keys = []
    for wanted, frames, away in moving:
        name, number = wanted, 2
        while name in taken:
            name, number = f"{wanted} {number}", number + 1
        taken.add(name)
        poses = tuple(Pose((name,), local[None]) for local in away)
        keys.append(PoseKeys(name, tuple((start + frames).tolist()), poses))
    return keys


def _alike(one: Moving, two: Moving) -> bool:
    """Whether two objects move as one."""
    return one[2].shape == two[2].shape and bool(np.allclose(one[2], two[2], atol=1e-9))


def _name_of(gltf: Gltf, nodes: Nodes, node: int) -> str:
    """Of the outermost node that has this mesh and nothing beside it: what writers put above to turn and scale."""
    above = int(nodes.parents[node])
    while (
        above >= 0
        and len(gltf.entry("nodes", above).get("children", [])) == 1
        and "mesh" not in gltf.entry("nodes", above)
    ):
        node, above = above, int(nodes.parents[above])
    return nodes.names[node]


def _below(nodes: Nodes, node: int, joints: set[int]) -> bool:
    """Whether a node rides on a joint: what it has is skin of the rig then."""
    while node >= 0 and node not in joints:
        node = int(nodes.parents[node])
    return node >= 0
