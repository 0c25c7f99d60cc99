"""Animations of a glTF file as pose keys of its rig.

CUBICSPLINE channels that have their keys together become cubic keys, LINEAR ones straight keys at all of their
times, both exactly. Everything else is sampled at whole frames: steps, curves with broken tangents, joints that a
moving node above them carries.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_nodes import Nodes
from contact_builtins.formats.gltf_skeleton import Skeleton
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseKeys, hermite_weights, rotations_of, turning_of
from contact_core.rig.rig import Pose, Rig

MAX_CLIPS, MAX_CHANNELS, MAX_MATRICES = 1_000, 100_000, 4_000_000
SAME = 1e-4  # relative difference up to which tangents on both sides of a key count as one
WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}


@dataclass(frozen=True, eq=False)
class Channel:
    """What moves one path of a node. frames: (k,) of its keys. values: (k, w), quaternions x, y, z, w, unit.

    before, after: (k, w) derivatives per frame on both sides of each key, None where it is not cubic.
    """

    node: int
    path: str
    kind: str
    frames: FloatArray
    values: FloatArray
    before: FloatArray | None = None
    after: FloatArray | None = None

    def at(self, frames: FloatArray) -> FloatArray:
        """(n, w) held beyond the ends."""
        times, values = self.frames, self.values
        at = np.clip(frames, times[0], times[-1])
        before = np.searchsorted(times, at, side="right") - 1
        if self.kind == "STEP" or len(times) == 1:
            return np.asarray(values[before])
        first = np.minimum(before, len(times) - 2)
        if self.before is None or self.after is None:
            return self._straight(at)
        second = first + 1
        gap = times[second] - times[first]
        a, b, c, d = (w[:, None] for w in hermite_weights((at - times[first]) / gap, gap))
        found = a * values[first] + b * values[second] + c * self.after[first] + d * self.before[second]
        return found / np.linalg.norm(found, axis=1, keepdims=True) if self.path == "rotation" else found

    def _straight(self, at: FloatArray) -> FloatArray:
        if self.path == "rotation":
            return np.asarray(Slerp(self.frames, Rotation.from_quat(self.values))(at).as_quat())
        return np.stack([np.interp(at, self.frames, column) for column in self.values.T], axis=1)

    @property
    def is_smooth(self) -> bool:
        """Whether it is cubic, with the same tangent on both sides of each key, and signs that do not flip."""
        if self.before is None or self.after is None:
            return False
        size = max(float(np.abs(self.before).max()), float(np.abs(self.after).max()), 1e-12)
        if np.abs(self.before - self.after)[1:-1].max(initial=0.0) > SAME * size:
            return False
        return self.path != "rotation" or bool(((self.values[1:] * self.values[:-1]).sum(axis=1) > 0.0).all())


def read_clips(gltf: Gltf, nodes: Nodes, skeleton: Skeleton, rig: Rig, rate: float | None) -> tuple[Clip, ...]:
    """The animations that move joints of a rig. rate: frames per second; None: what the file says, else 24.

    Raises InvalidInput for times that do not rise and values that do not fit.
    """
    entries = gltf.entries("animations")
    bounded(len(entries), "animations", MAX_CLIPS)
    clips = []
    for number, entry in enumerate(entries):
        said = entry.get("extras") if isinstance(entry.get("extras"), dict) else {}
        assert said is not None
        fps = rate or _number(said.get("frames_per_second"), 24.0)
        start = _number(said.get("frame_at_0"), 0.0)
        moving = _Moving(gltf, nodes, skeleton, _channels(gltf, entry, fps))
        if moving.channels:
            keys = moving.keys(rig, start)
            clips.append(Clip(str(entry.get("name") or f"animation {number + 1}"), fps, (keys,)))
    return tuple(clips)


def _number(value: Any, otherwise: float) -> float:
    good = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if good and (value > 0.0 or otherwise == 0.0) else otherwise


def _channels(gltf: Gltf, entry: dict[str, Any], rate: float) -> list[Channel]:
    listed = entry["channels"]
    bounded(len(listed), "channels of an animation", MAX_CHANNELS)
    found = []
    for channel in listed:
        target = channel["target"]
        if target.get("path") not in WIDTHS or "node" not in target:
            continue  # weights of morph targets, and what extensions point at
        gltf.entry("nodes", target["node"])
        sampler = entry["samplers"][channel["sampler"]]
        found.append(_channel(gltf, target["node"], target["path"], sampler, rate))
    return found


def _channel(gltf: Gltf, node: int, path: str, sampler: dict[str, Any], rate: float) -> Channel:
    kind = sampler.get("interpolation", "LINEAR")
    # stored in single precision: what was keyed at a frame comes back at that frame
    times = np.round(gltf.accessor(sampler["input"]).astype(np.float64)[:, 0] * rate, 4)
    values = gltf.accessor(sampler["output"]).astype(np.float64)
    each = 3 if kind == "CUBICSPLINE" else 1
    if kind not in ("LINEAR", "STEP", "CUBICSPLINE") or values.shape != (each * len(times), WIDTHS[path]):
        raise InvalidInput(f"a channel of {path} has {len(times)} times and values {values.shape} of kind {kind!r}")
    if not len(times) or not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise InvalidInput("the times of an animation do not rise")
    if not np.isfinite(values).all():
        raise InvalidInput("an animation holds values that are no numbers")
    before = after = None
    if each == 3:
        before, values, after = values[0::3] / rate, values[1::3], values[2::3] / rate
    if path == "rotation":
        lengths = np.linalg.norm(values, axis=1, keepdims=True)
        if not lengths.all():
            raise InvalidInput("an animation holds a rotation of length 0")
        values = values / lengths
    return Channel(node, path, kind, times, values, before, after)


class _Moving:
    """The joints of a skeleton while channels move them and the nodes above them."""

    def __init__(self, gltf: Gltf, nodes: Nodes, skeleton: Skeleton, channels: list[Channel]) -> None:
        self.gltf, self.nodes, self.skeleton = gltf, nodes, skeleton
        above = set[int]()
        for node in skeleton.nodes:
            while node >= 0 and node not in above:
                above.add(node)
                node = int(nodes.parents[node])
        self.order = [node for node in nodes.order if node in above]
        self.channels = [channel for channel in channels if channel.node in above]
        raw = nodes.world[list(skeleton.nodes)]
        # what normalising the skeleton put behind each joint: reflections and scales, whatever the pose
        self.behind = np.linalg.solve(raw, skeleton.rest)

    def keys(self, rig: Rig, start: float) -> PoseKeys:
        """The keys; `start` is the frame at time 0."""
        frames = np.unique(np.concatenate([channel.frames for channel in self.channels]))
        plain = {channel.node for channel in self.channels} <= set(self.skeleton.nodes)
        cubic = plain and self._is_cubic(frames)
        if not cubic and not (plain and all(c.kind == "LINEAR" and c.path != "scale" for c in self.channels)):
            first, last = math.ceil(frames[0]), math.floor(frames[-1])
            bounded((last - first) * len(self.order), "transforms of an animation", MAX_MATRICES)
            frames = np.unique([frames[0], *range(first, last + 1), frames[-1]])
        bounded(len(frames) * len(self.order), "transforms of an animation", MAX_MATRICES)
        poses = tuple(Pose(rig.joints, local) for local in self.local(frames))
        return PoseKeys(rig.name, tuple((start + frames).tolist()), poses, self._speeds() if cubic else ())

    def local(self, frames: FloatArray) -> FloatArray:
        """(n, j, 4, 4) parent_from_joint at frames (n,)."""
        world: dict[int, FloatArray] = {}
        for node in self.order:
            own, above = self._node(node, frames), int(self.nodes.parents[node])
            world[node] = world[above] @ own if above in world else own
        joints = np.stack([world[node] for node in self.skeleton.nodes], axis=1) @ self.behind
        result = joints.copy()
        for joint, parent in enumerate(self.skeleton.parents):
            if parent >= 0:
                result[:, joint] = np.linalg.solve(joints[:, parent], joints[:, joint])
        return result

    def _node(self, node: int, frames: FloatArray) -> FloatArray:
        """(n, 4, 4) parent_from_node."""
        entry = self.gltf.entry("nodes", node)
        found = {channel.path: channel.at(frames) for channel in self.channels if channel.node == node}
        if not found:
            own, above = self.nodes.world[node], int(self.nodes.parents[node])
            still = own if above < 0 else np.linalg.solve(self.nodes.world[above], own)
            return np.broadcast_to(still, (len(frames), 4, 4))
        if "matrix" in entry:
            raise InvalidInput(f"node {node} is animated, but has a matrix, which glTF does not allow")

        def of(path: str, rest: list[float]) -> FloatArray:
            return found[path] if path in found else np.array([entry.get(path, rest)], float)

        result = np.tile(np.eye(4), (len(frames), 1, 1))
        turns = rotations_of(np.roll(of("rotation", [0.0, 0.0, 0.0, 1.0]), 1, axis=1))
        result[:, :3, :3] = turns * of("scale", [1.0, 1.0, 1.0])[:, None, :]
        result[:, :3, 3] = of("translation", [0.0, 0.0, 0.0])
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
