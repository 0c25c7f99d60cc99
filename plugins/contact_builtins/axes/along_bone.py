"""An axis along the bone that owns the patch: on a hand, every finger's axis then runs towards its tip."""

from __future__ import annotations

import numpy as np

from contact_builtins.axes.straight import Flattened, flatten, projected_heading, through_centre
from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints


class AlongBone:
    """The bone that owns most of the patch's points, projected onto the surface at the patch's centre."""

    name = "along_bone"
    summary = "along the bone that owns most of the patch, from its head to its tail"
    default_for = "recipe"  # whose patches lie on fingers

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        heading = bone_heading(request, flat)
        if heading is None:
            raise InvalidInput(
                "an axis along a bone needs a patch on a rig whose bone does not stand upright on it; use another"
                " generator here."
            )
        return through_centre(flat, heading)


def owning_bone(request: AxisRequest) -> int | None:
    """The bone that owns most of the patch's points; None without a rig."""
    owners = np.zeros(0, np.int64) if request.bone_of_point is None else request.bone_of_point
    owners = owners[owners >= 0]
    return None if request.bones is None or not len(owners) else int(np.bincount(owners).argmax())


def bone_heading(request: AxisRequest, flat: Flattened) -> complex | None:
    """The direction of the patch's bone at its centre, a unit heading; None without a bone, or with one upright."""
    bone = owning_bone(request)
    if bone is None or request.bones is None:
        return None
    head, tail = request.bones[bone]  # (3,), (3,)
    return projected_heading(flat, tail - head)
