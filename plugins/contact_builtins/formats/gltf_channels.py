"""Channels of glTF animations, and the nodes that they move."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from contact_builtins.formats.gltf_container import Gltf
from contact_builtins.formats.gltf_nodes import Nodes
from contact_builtins.formats.refusal import bounded
from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.pose_keys import hermite_weights, rotations_of

MAX_CHANNELS, MAX_MATRICES = 100_000, 4_000_000
SAME = 1e-4  # relative difference up to which tangents on both sides of a key count as one
HIDING = 1e-6  # of a scale
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


def read_channels(gltf: Gltf, entry: dict[str, Any], rate: float) -> list[Channel]:
    """The channels of an animation that move nodes. rate: frames per second. Raises InvalidInput."""
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
    if not len(times) or not np.isfinite(times).all() or (np.diff(times) < 0.0).any():
        raise InvalidInput("the times of an animation do not rise")
    last = np.append(np.diff(times) > 0.0, True)  # of keys at one time the last holds from there on
    times, values = times[last], values[np.repeat(last, each)]
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


class MovingNodes:
    """Some nodes while channels move them and the nodes above them. channels: those that do."""

    def __init__(self, gltf: Gltf, nodes: Nodes, wanted: Iterable[int], channels: list[Channel]) -> None:
        self.gltf, self.nodes = gltf, nodes
        above = set[int]()
        for node in wanted:
            while node >= 0 and node not in above:
                above.add(node)
                node = int(nodes.parents[node])
        self.order = [node for node in nodes.order if node in above]
        self.channels = [channel for channel in channels if channel.node in above]

    def keyed(self) -> FloatArray:
        """(k,) the frames of all keys."""
        return np.unique(np.concatenate([channel.frames for channel in self.channels]))

    def whole(self) -> FloatArray:
        """(k,) every whole frame from the first key to the last, and these. Raises InvalidInput for too many."""
        frames = self.keyed()
        first, last = math.ceil(frames[0]), math.floor(frames[-1])
        bounded((last - first) * len(self.order), "transforms of an animation", MAX_MATRICES)
        return np.unique([frames[0], *range(first, last + 1), frames[-1]])

    def world(self, frames: FloatArray) -> dict[int, FloatArray]:
        """(n, 4, 4) world_from_node of each at frames (n,)."""
        bounded(len(frames) * len(self.order), "transforms of an animation", MAX_MATRICES)
        world: dict[int, FloatArray] = {}
        for node in self.order:
            own, above = self._node(node, frames), int(self.nodes.parents[node])
            world[node] = world[above] @ own if above in world else own
        return world

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
        scale = of("scale", [1.0, 1.0, 1.0])
        # 0 is how files hide things for a while: nothing is seen at this size either, and the way back stays
        result[:, :3, :3] = turns * np.where(np.abs(scale) < HIDING, HIDING, scale)[:, None, :]
        result[:, :3, 3] = of("translation", [0.0, 0.0, 0.0])
        return result
