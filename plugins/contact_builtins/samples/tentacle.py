"""A tentacle: 60 cm, tapered to a point, round on the back and flat on the inner side that grips.

Rig space: it grows along +y from its root at the origin, its flat side towards +z.
"""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.binding import bone_heat_weights, strongest
from contact_builtins.samples.digits import heat_sources
from contact_builtins.samples.fields import Field, chain, smooth_min
from contact_builtins.samples.modelling import surface_of
from contact_builtins.samples.skeleton import Bone, bone_frame, fixed, limits, rig_of, root
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset

MM = 1e-3
SEGMENTS = 20
LENGTH = 600 * MM
FLAT = 0.35  # the inner side lies this fraction of the radius off the axis


def build() -> Asset:
    """The tentacle as a rig of 21 joints, root first; the last is a tip that stays with its parent."""
    axis, frames = spine()
    thick = radius(np.linspace(0.0, 1.0, SEGMENTS + 1))
    low, high = axis.min(axis=0) - 62 * MM, axis.max(axis=0) + 62 * MM
    sizing_from = axis[:, 1]
    mesh = surface_of(
        flesh(axis, frames, thick),
        low,
        high,
        6.5 * MM,
        lambda p: np.interp(p[:, 1], sizing_from, 3.2 * MM + 0.16 * thick),
    )
    bones = []
    for k in range(SEGMENTS + 1):
        freedom = root() if k == 0 else fixed() if k == SEGMENTS else limits(15, 35, -30, 60)
        frame = frames[min(k, SEGMENTS - 1)]
        bones.append(
            Bone(
                f"segment_{k:02d}", f"segment_{k - 1:02d}" if k else "", axis[k], frame[:, 0], frame[:, 1], freedom
            )
        )
    segments = [(f"segment_{k:02d}", axis[k], axis[k + 1], 0.0) for k in range(SEGMENTS)]
    owner, distance = heat_sources(mesh.points, bones, segments)
    # thick flesh would smear one segment over many: what counts is the segment's length
    weights = bone_heat_weights(mesh, owner, np.minimum(distance, 0.8 * LENGTH / SEGMENTS), len(bones))
    rig = rig_of("tentacle", bones, mesh, *strongest(weights, 6))
    return Asset(name=rig.name, mesh=rig.surface, rig=rig, meters_per_unit=1.0, up_axis="Y")


def radius(along: FloatArray) -> FloatArray:
    """Half thickness (metres) at 0..1 from root to tip: swelling root, long taper, fine tip."""
    return (5.0 + 37.0 * (1.0 - along) ** 1.25 + 9.0 * np.exp(-((along / 0.07) ** 2))) * MM


def spine() -> tuple[FloatArray, FloatArray]:
    """(21, 3) joint positions and (20, 3, 3) frames: it leans to its inner side, more towards the tip."""
    axis, frames = [np.zeros(3)], []
    for k in range(SEGMENTS):
        lean = np.radians(-14.0 + 62.0 * (k / (SEGMENTS - 1)) ** 2)
        along = np.array([0.0, np.cos(lean), np.sin(lean)])
        frames.append(bone_frame(along, [0, 0, 1]))
        axis.append(axis[-1] + along * LENGTH / SEGMENTS)
    return np.array(axis), np.array(frames)


def flesh(axis: FloatArray, frames: FloatArray, thick: FloatArray) -> Field:
    """Round cones along the axis, cut flat on the inner side."""
    body = chain(list(axis), list(thick))
    middles = 0.5 * (axis[:-1] + axis[1:])  # (20, 3)

    def field(p: FloatArray) -> FloatArray:
        away = np.linalg.norm(p[:, None, :] - middles, axis=2)  # (n, 20)
        share = np.exp(
            -(
                (away / (0.9 * LENGTH / SEGMENTS)) ** 2
                - (away.min(axis=1, keepdims=True) / (0.9 * LENGTH / SEGMENTS)) ** 2
            )
        )
        share /= share.sum(axis=1, keepdims=True)
        height = np.einsum("nkj,kj->nk", p[:, None, :] - middles, frames[:, :, 1])  # over each segment's axis
        half = 0.5 * (thick[:-1] + thick[1:])
        flat = ((height - FLAT * half) * share).sum(axis=1)
        rounding = 0.5 * (half * share).sum(axis=1)
        return -_smooth_min_by(-body(p), -flat, rounding)

    return field


def _smooth_min_by(x: FloatArray, y: FloatArray, blend: FloatArray) -> FloatArray:
    """`smooth_min` with a blend per point."""
    return np.asarray(smooth_min(x / blend, y / blend, 1.0) * blend)
