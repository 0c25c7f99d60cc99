"""A clip in a stage: time samples of skeletons and of what is placed, and the way back."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pxr import Usd, UsdGeom

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.clip import Clip
from contact_core.rig.pose_keys import PoseCurves, PoseKeys
from contact_core.rig.rig import Pose
from contact_core.scene.reading import stretch_pose
from contact_usd.host import UsdHost
from contact_usd.mesh import gf_matrix, world_of

MOST_SAMPLES = 1_000_000  # of all that moves


def write_keys(host: UsdHost, path: str, asset: Asset, keys: PoseKeys) -> None:
    """Time samples of an asset that was added at `path`: of the skeleton of a rig, else of where the mesh stands.

    USD joins samples by straight blends: cubic keys are sampled at every whole frame besides. Raises InvalidInput.
    """
    frames = _frames(keys)
    if asset.rig is not None:
        poses = keys.sampled(asset.rig, frames)
        with host.step("Clip"):
            for frame, local in zip(frames, poses, strict=True):
                pose_rig(host, path, asset, Pose(asset.rig.joints, local), frame)
        return
    places = np.array([pose.local for pose in keys.poses])
    if places.shape[1] != 1:
        raise InvalidInput(f"{asset.name!r} has no rig: it moves as one joint, but got {places.shape[1]}.")
    speeds = np.array(keys.speeds) if keys.is_cubic else None
    sampled = PoseCurves.joined(keys.frames, places, speeds).sampled(frames)[:, 0]
    prim = host.stage.GetPrimAtPath(path)
    standing = world_of(prim)
    operation = UsdGeom.Xformable(prim).MakeMatrixXform()
    for frame, place in zip(frames, sampled, strict=True):
        operation.Set(gf_matrix(standing @ place), Usd.TimeCode(frame))


def pose_rig(host: UsdHost, path: str, asset: Asset, pose: Pose, frame: float | None = None) -> None:
    """Pose a rig that was added at `path`. pose: in the asset's units, which need not be those of the stage."""
    unit = host.space().meters_per_unit
    scale = (asset.meters_per_unit or unit) / unit
    host.write_pose(path, stretch_pose(pose, scale * np.eye(3)), frame)


def place(host: UsdHost, path: str, world: FloatArray) -> None:
    """Move what was added at `path` by (4, 4), in the asset's own space."""
    prim = host.stage.GetPrimAtPath(path)
    standing = world_of(prim)
    UsdGeom.Xformable(prim).MakeMatrixXform().Set(gf_matrix(standing @ world))


def tell_range(stage: Usd.Stage, clip: Clip) -> None:
    """What a player shows."""
    stage.SetStartTimeCode(min(keys.frames[0] for keys in clip.keys))
    stage.SetEndTimeCode(max(keys.frames[-1] for keys in clip.keys))


def read_clip(host: UsdHost, name: str) -> Clip | None:
    """All samples of a stage as keys by the names of its prims, None where nothing moves.

    Keys of an object place its surface as it stands without time: the identity is there. Raises InvalidInput.
    """
    found, total = list[PoseKeys](), 0
    for item in host.objects():
        frames = host.pose_keys(item.id) if item.kind == "rig" else _samples(host.stage.GetPrimAtPath(item.id))
        total += len(frames)
        if total > MOST_SAMPLES:
            raise InvalidInput(f"{name} has more than {MOST_SAMPLES} time samples.")
        if len(frames) < 2 or any(keys.rig == item.name for keys in found):
            continue
        if item.kind == "rig":
            poses = tuple(host.read_pose(item.id, frame) for frame in frames)
        else:
            still = np.linalg.inv(host.placement(item.id))
            poses = tuple(Pose((item.name,), (host.placement(item.id, at) @ still)[None]) for at in frames)
        found.append(PoseKeys(item.name, tuple(map(float, frames)), poses))
    return Clip(name, host.space().frames_per_second, tuple(found)) if found else None


def _frames(keys: PoseKeys) -> list[float]:
    """Where the samples are."""
    if not keys.is_cubic:
        return list(keys.frames)
    whole = range(math.ceil(keys.frames[0]), math.floor(keys.frames[-1]) + 1)
    return sorted({*keys.frames, *map(float, whole)})


def _samples(prim: Usd.Prim) -> Sequence[float]:
    """Time codes at which a prim or what it is in moves."""
    times = set[float]()
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.Xformable):
            times.update(UsdGeom.Xformable(prim).GetTimeSamples())
        prim = prim.GetParent()
    return sorted(times)
