"""Poses as SkelAnimation in our layer: a default value for the pose without a key, time samples for keys.

An animation that the scene brings is copied when its skeleton is first posed here, so that our keys join its keys;
the scene's own layers stay as they are.
"""

from __future__ import annotations

import numpy as np
from pxr import Sdf, Usd, UsdSkel, Vt

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_usd.mesh import gf_matrix, matrix_of

ROUNDING = 1e-3  # relative; scales are stored in half precision, which rounds by less than half of this


def local_pose(
    cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton, rest: FloatArray, frame: float | None
) -> FloatArray:
    """(j, 4, 4) parent_from_joint at a frame, in skeleton space; None: unkeyed value, first key, or rest.

    Raises InvalidInput where the animation holds no numbers.
    """
    query = cache.GetSkelQuery(skeleton)
    animation = query.GetAnimQuery()
    if not animation:
        return rest
    time = Usd.TimeCode(frame) if frame is not None else _standing_time(animation.GetPrim())
    matrices = query.ComputeJointLocalTransforms(time)
    if matrices is None or len(matrices) != len(rest):
        return rest
    local = np.stack([matrix_of(m) for m in matrices])
    if not np.isfinite(local).all():
        raise InvalidInput(
            f"{animation.GetPrim().GetPath()} holds values that are no numbers, so it gives no pose."
        )
    return local


def key_frames(cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton) -> tuple[float, ...]:
    """Time codes with a sample of any joint, ascending."""
    animation = cache.GetSkelQuery(skeleton).GetAnimQuery()
    return tuple(animation.GetJointTransformTimeSamples()) if animation else ()


def write(
    stage: Usd.Stage, cache: UsdSkel.Cache, skeleton: UsdSkel.Skeleton, local: FloatArray, frame: float | None
) -> None:
    """Write a whole pose (j, 4, 4) into an animation beside the skeleton; the edit target must be our layer.

    Raises InvalidInput for what a SkelAnimation cannot hold.
    """
    _check_scales(local, str(skeleton.GetPath()))
    query = cache.GetSkelQuery(skeleton)
    place = skeleton.GetPrim().GetPath()
    path = place.GetParentPath().AppendChild(f"{place.name}_ContactPose")
    make_editable(stage, place)
    if stage.GetEditTarget().GetLayer().GetAttributeAtPath(path.AppendProperty("rotations")):
        animation = UsdSkel.Animation.Get(stage, path)
    else:  # perhaps it is in a layer below: a posed shot that another shot is made of
        samples = _samples_of_source(query)
        animation = UsdSkel.Animation.Define(stage, path)
        animation.CreateJointsAttr(query.GetJointOrder())
        for at, matrices in samples:
            animation.SetTransforms(matrices, at)
    binding = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath(place))  # again each time: somebody may have unbound it
    binding.CreateAnimationSourceRel().SetTargets([path])
    time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
    animation.SetTransforms(Vt.Matrix4dArray([gf_matrix(m) for m in local]), time)


def make_editable(stage: Usd.Stage, path: Sdf.Path) -> None:
    """A prim inside an instance is read-only: the instances above it stop being instances, in our layer."""
    while stage.GetPrimAtPath(path).IsInstanceProxy():
        prim = stage.GetPrimAtPath(path)
        while not prim.IsInstance() or prim.IsInstanceProxy():
            prim = prim.GetParent()
        prim.SetInstanceable(False)


def _samples_of_source(query: UsdSkel.SkeletonQuery) -> list[tuple[Usd.TimeCode, Vt.Matrix4dArray]]:
    """All samples, for all joints, of the animation that drove the skeleton so far.

    All are read before one is written: samples of two layers do not join, the stronger layer's are all there is.
    """
    source = query.GetAnimQuery()
    if not source:
        return []
    times = [Usd.TimeCode(frame) for frame in source.GetJointTransformTimeSamples()]
    standing = _standing_time(source.GetPrim())
    if standing.IsDefault():
        times.append(standing)
    return [(time, query.ComputeJointLocalTransforms(time)) for time in times]


def _standing_time(prim: Usd.Prim) -> Usd.TimeCode:
    """The time of the pose as it stands: the default values where any are authored, else the first sample."""
    animation = UsdSkel.Animation(prim)
    tracks = (animation.GetTranslationsAttr(), animation.GetRotationsAttr(), animation.GetScalesAttr())
    if any(track.Get(Usd.TimeCode.Default()) is not None for track in tracks):
        return Usd.TimeCode.Default()
    return Usd.TimeCode.EarliestTime()


def _check_scales(local: FloatArray, path: str) -> None:
    """SkelAnimation holds scales in half precision and no shear: refuse what would not come back."""
    scales = np.linalg.norm(local[:, :3, :3], axis=1)  # (j, 3) of the columns
    off = np.abs(scales.astype(np.float16) - scales) - ROUNDING * scales  # (j, 3) above 0 where too much is lost
    shear = np.einsum("jia,jib->jab", local[:, :3, :3], local[:, :3, :3])
    shear = np.abs(shear - np.eye(3) * np.diagonal(shear, axis1=1, axis2=2)[:, None, :]).max(initial=0.0)
    if off.max(initial=-1.0) > 0.0 or not scales.all() or shear > ROUNDING:
        raise InvalidInput(
            f"a pose of {path} has sheared joints (by {shear:.2g}) or scales out of the range of half"
            f" precision ({scales.min():.3g} to {scales.max():.3g}); a SkelAnimation cannot hold it."
        )
