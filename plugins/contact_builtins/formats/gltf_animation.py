"""Writing a clip as a glTF animation: cubic keys as CUBICSPLINE, straight ones as LINEAR (glTF 2.0, appendix C).

A cubic pose key is the very curve of CUBICSPLINE: translations are Hermite, rotations Hermite curves of quaternions
that are normalised where they are read. Tangents are per second. Times may not be negative, so a clip that begins
before frame 0 is shifted; `extras` say the rate, and the frame at time 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from contact_builtins.formats.glb_scene import GlbScene
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseCurves, PoseKeys

ALIKE = 1e-7  # up to which a channel stands still


def add_animation(
    scene: GlbScene, clip: Clip, assets: Sequence[Asset], nodes: Mapping[str, Sequence[int | None]]
) -> None:
    """Add a clip to a scene. nodes: per asset the node of each joint, None for one that shear split in two.

    Raises InvalidInput for keys of something that is not there, and for what a node cannot do.
    """
    start = min(0.0, *(keys.frames[0] for keys in clip.keys)) if clip.keys else 0.0
    entry: dict[str, Any] = {"name": clip.name, "channels": [], "samplers": []}
    entry["extras"] = {"frames_per_second": clip.rate, "frame_at_0": start}
    by_name = {asset.name: asset for asset in assets}
    for keys in clip.keys:
        if keys.rig not in by_name:
            raise InvalidInput(
                f"the clip moves {keys.rig!r}, but no such asset is written; there are {[*by_name]}."
            )
        curves = _curves(by_name[keys.rig], keys)
        seconds = ((curves.frames - start) / clip.rate).astype("<f4")
        times = scene.accessor(seconds[:, None], bounds=True)
        for joint, node in enumerate(nodes[keys.rig]):
            for path, values, slopes in _channels(curves, joint, keys.rig):
                if node is None:
                    raise InvalidInput(f"{keys.rig!r} has a sheared joint that moves, which no glTF node can do.")
                if not _moves(values, slopes, _standing(scene.nodes[node], path)):
                    continue
                entry["samplers"].append(_sampler(scene, times, values, slopes, clip.rate))
                target = {"node": node, "path": path}
                entry["channels"].append({"sampler": len(entry["samplers"]) - 1, "target": target})
    if entry["channels"]:
        scene.animations.append(entry)


def _curves(asset: Asset, keys: PoseKeys) -> PoseCurves:
    if asset.rig is not None:
        return PoseCurves.of(asset.rig, keys)
    local = np.array([pose.local for pose in keys.poses])
    if local.shape[1] != 1:
        raise InvalidInput(f"{asset.name!r} has no rig: it moves as one joint, but got {local.shape[1]}.")
    return PoseCurves.joined(keys.frames, local, np.array(keys.speeds) if keys.is_cubic else None)


def _channels(curves: PoseCurves, joint: int, name: str) -> list[tuple[str, FloatArray, FloatArray | None]]:
    """Of a joint: path, values (k, w) and slopes per frame (k, w), None for straight blends."""
    moves, turns = curves.translation_slopes, curves.quaternion_slopes
    stretch = curves.stretches[:, joint]
    sizes = np.diagonal(stretch, axis1=1, axis2=2)
    if np.abs(stretch - sizes[:, None, :] * np.eye(3)).max() > 1e-5:
        raise InvalidInput(f"{name!r} has keys with shear, which no glTF node can have.")
    xyzw = [1, 2, 3, 0]
    return [
        ("translation", curves.translations[:, joint], None if moves is None else moves[:, joint]),
        ("rotation", curves.quaternions[:, joint][:, xyzw], None if turns is None else turns[:, joint][:, xyzw]),
        ("scale", sizes, None),
    ]


def _standing(node: Mapping[str, Any], path: str) -> FloatArray:
    """What a node says of a path, without animation."""
    rest = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}[path]
    return np.asarray(node.get(path, rest), float)


def _moves(values: FloatArray, slopes: FloatArray | None, standing: FloatArray) -> bool:
    """Whether a channel says anything beside what its node says."""
    if slopes is not None and np.abs(slopes).max() > ALIKE:
        return True
    off = np.abs(values - standing).max()
    if len(standing) == 4:  # a quaternion and its negative are one rotation
        off = min(off, np.abs(values + standing).max())
    return bool(off > ALIKE)


def _sampler(
    scene: GlbScene, times: int, values: FloatArray, slopes: FloatArray | None, rate: float
) -> dict[str, Any]:
    cubic = slopes is not None and len(values) > 1  # the specification asks for two keys
    if cubic and slopes is not None:
        per_second = slopes * rate
        values = np.stack([per_second, values, per_second], axis=1).reshape(-1, values.shape[1])
    output = scene.accessor(np.ascontiguousarray(values).astype("<f4"))
    return {"input": times, "output": output, "interpolation": "CUBICSPLINE" if cubic else "LINEAR"}
