"""A small player of GLB animations, written after the specification and not after our own reader."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Player:
    """One GLB. skin(seconds): (n, 3) world positions of the vertices of its skinned mesh at a time."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        self.binary = data[28 + size :]

    def accessor(self, index: int) -> npt.NDArray[Any]:
        entry = self.json["accessors"][index]
        view = self.json["bufferViews"][entry["bufferView"]]
        kind = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[entry["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        return np.frombuffer(self.binary, kind, entry["count"] * width, start).reshape(-1, width).copy()

    def channels(self) -> list[tuple[int, str, str, Array, Array]]:
        animation = self.json["animations"][0]
        found = []
        for channel in animation["channels"]:
            sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
            times = self.accessor(sampler["input"])[:, 0].astype(float)
            values = self.accessor(sampler["output"]).astype(float)
            found.append((target["node"], target["path"], sampler["interpolation"], times, values))
        return found

    def nodes_at(self, seconds: float) -> list[Array]:
        """World transforms of all nodes."""
        local = [dict(node) for node in self.json["nodes"]]
        for node, path, kind, times, values in self.channels():
            local[node][path] = sampled(kind, times, values, seconds, path)
        matrices = [transform(node) for node in local]
        parents = {child: index for index, node in enumerate(local) for child in node.get("children", [])}

        def world(index: int) -> Array:
            return world(parents[index]) @ matrices[index] if index in parents else matrices[index]

        return [world(index) for index in range(len(local))]

    def skin(self, seconds: float) -> Array:
        worlds = self.nodes_at(seconds)
        node = next(node for node in self.json["nodes"] if "skin" in node)
        skin, mesh = self.json["skins"][node["skin"]], self.json["meshes"][node["mesh"]]
        inverse = self.accessor(skin["inverseBindMatrices"]).astype(float).reshape(-1, 4, 4).swapaxes(1, 2)
        joints = np.array([worlds[joint] for joint in skin["joints"]]) @ inverse
        attributes = mesh["primitives"][0]["attributes"]
        points = np.c_[self.accessor(attributes["POSITION"]).astype(float), np.ones(self.count(attributes))]
        result = np.zeros((len(points), 3))
        k = 0
        while f"JOINTS_{k}" in attributes:
            index, weight = self.accessor(attributes[f"JOINTS_{k}"]), self.accessor(attributes[f"WEIGHTS_{k}"])
            for column in range(4):
                moved = np.einsum("vab,vb->va", joints[index[:, column]], points)[:, :3]
                result += weight[:, column : column + 1] * moved
            k += 1
        return result

    def count(self, attributes: dict[str, int]) -> int:
        return int(self.json["accessors"][attributes["POSITION"]]["count"])


def sampled(kind: str, times: Array, values: Array, seconds: float, path: str) -> Array:
    """A channel at a time (glTF 2.0, appendix C)."""
    if kind == "CUBICSPLINE":
        before, values, after = values[0::3], values[1::3], values[2::3]
    if seconds <= times[0] or seconds >= times[-1] or len(times) == 1:
        return np.asarray(values[0 if seconds <= times[0] else -1])
    k = int(np.searchsorted(times, seconds, side="right")) - 1
    gap = times[k + 1] - times[k]
    t = (seconds - times[k]) / gap
    if kind == "STEP":
        return np.asarray(values[k])
    if kind == "CUBICSPLINE":
        found = (
            (2 * t**3 - 3 * t**2 + 1) * values[k]
            + gap * (t**3 - 2 * t**2 + t) * after[k]
            + (-2 * t**3 + 3 * t**2) * values[k + 1]
            + gap * (t**3 - t**2) * before[k + 1]
        )
        return np.asarray(found / np.linalg.norm(found) if path == "rotation" else found)
    if path == "rotation":
        a = float(np.arccos(min(abs(float(values[k] @ values[k + 1])), 1.0)))
        sign = np.sign(float(values[k] @ values[k + 1])) or 1.0
        if a < 1e-6:
            return np.asarray(values[k])
        return np.asarray((np.sin(a * (1 - t)) * values[k] + sign * np.sin(a * t) * values[k + 1]) / np.sin(a))
    return np.asarray((1 - t) * values[k] + t * values[k + 1])


def transform(node: dict[str, Any]) -> Array:
    """(4, 4) of a node."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    result = np.eye(4)
    result[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), float)
    result[:3, 3] = node.get("translation", [0, 0, 0])
    return result
