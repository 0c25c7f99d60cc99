"""Axes that all point the same way: three of the paper's five subjects re-drew axes to get just that."""

from __future__ import annotations

import numpy as np

from contact_builtins.axes.along_bone import bone_heading
from contact_builtins.axes.straight import Flattened, flatten, principal_heading, projected_heading, through_centre
from contact_core.arrays import FloatArray
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints


class Consistent:
    """The nearest axis that is drawn already says which way to go. On a rig, this axis makes the same angle with
    its bone as that one with its own: crosswise on one finger is crosswise on the next. Without a rig it is
    parallel to that one in space. The first axis runs along its bone or, without a rig, along the patch.

    Parallel transport over the surface was tried instead and measured: the way from one fingertip to the next leads
    through the web between them and turns a direction by any angle (median error 104 degrees on fingertips)."""

    name = "consistent"
    summary = "the same way as the nearest axis drawn already, seen from its bone; the first one along its bone"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        along = bone_heading(request, flat)
        heading = drawn_heading(request, flat, along) or along
        return through_centre(flat, principal_heading(flat) if heading is None else heading)


def drawn_heading(request: AxisRequest, flat: Flattened, along: complex | None) -> complex | None:
    """The way of the nearest axis drawn already, None when none is drawn. along: the bone's heading."""
    drawn = _nearest(request, flat)
    if drawn is None:
        return None
    if along is None:
        return projected_heading(flat, drawn[1] - drawn[0])
    return along * _angle_to_bone(request, drawn)


def _nearest(request: AxisRequest, flat: Flattened) -> FloatArray | None:
    """(2, 3) start and end of the drawn axis whose middle is nearest to the patch's centre; None when none is
    drawn."""
    ends = [
        axis[[0, len(axis) - 1]].positions(flat.mesh)
        for _, axis in sorted(request.other_axes.items())
        if len(axis) >= 2
    ]
    centre = flat.centre.positions(flat.mesh)[0]
    return min(ends, key=lambda pair: float(np.linalg.norm(pair.mean(axis=0) - centre)), default=None)


def _angle_to_bone(request: AxisRequest, drawn: FloatArray) -> complex:
    """The turn from a drawn axis's nearest bone to that axis, seen from outside, as a unit complex number."""
    assert request.bones is not None
    middle, axis = drawn.mean(axis=0), drawn[1] - drawn[0]
    heads, along = request.bones[:, 0], request.bones[:, 1] - request.bones[:, 0]  # (b, 3)
    part = np.einsum("bi,bi->b", middle - heads, along) / np.maximum((along**2).sum(axis=1), 1e-300)
    away = middle - (heads + np.clip(part, 0.0, 1.0)[:, None] * along)  # (b, 3) from each bone to the axis
    nearest = int(np.argmin(np.linalg.norm(away, axis=1)))
    outward = away[nearest] / max(float(np.linalg.norm(away[nearest])), 1e-300)
    bone = along[nearest] - outward * float(along[nearest] @ outward)
    turn = complex(float(bone @ axis), float(np.cross(bone, axis) @ outward))
    return turn / abs(turn) if abs(turn) > 0.0 else 1.0 + 0.0j
