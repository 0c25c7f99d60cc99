"""An axis along the bone that owns the patch: on a hand, every finger's axis then runs towards its tip."""

from __future__ import annotations

import numpy as np

from contact_builtins.axes.straight import flatten, through_centre
from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading


class AlongBone:
    """The bone that owns most of the patch's points, projected onto the surface at the patch's centre."""

    name = "along_bone"
    summary = "along the bone that owns most of the patch, from its head to its tail"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        owners = np.zeros(0, np.int64) if request.bone_of_point is None else request.bone_of_point
        owners = owners[owners >= 0]
        if request.bones is None or not len(owners):
            raise InvalidInput(
                "an axis along a bone needs a patch on a rig, but this patch has no bone; use another generator."
            )
        head, tail = request.bones[int(np.bincount(owners).argmax())]  # (3,), (3,)
        normal = flat.centre.normals(request.mesh)[0]
        direction = (tail - head) - normal * float((tail - head) @ normal)
        if np.linalg.norm(direction) < 1e-3 * np.linalg.norm(tail - head):
            raise InvalidInput("the bone of this patch stands upright on it, so it gives no direction.")
        return through_centre(flat, complex(direction_to_heading(request.mesh, flat.centre, direction[None])[0]))
