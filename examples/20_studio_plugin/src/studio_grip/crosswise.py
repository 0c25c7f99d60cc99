"""An axis across the finger: our riggers wrap patches round poles, and want the wrap to follow the axis."""

import numpy as np

from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints


class Crosswise:
    name = "crosswise"
    summary = "across the bone that owns the patch, from its right side to its left, seen from outside"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        positions = request.points.positions(request.mesh)  # (n, 3), surface units
        owners = () if request.bone_of_point is None else request.bone_of_point[request.bone_of_point >= 0]
        if request.bones is None or not len(owners) or len(positions) < 2:
            raise InvalidInput("a crosswise axis needs a patch of two points or more that belong to a bone.")
        head, tail = request.bones[np.bincount(owners).argmax()]
        outward = request.points.normals(request.mesh).mean(axis=0)
        across = (positions - positions.mean(axis=0)) @ np.cross(outward, tail - head)  # (n,)
        return request.points[[int(across.argmin()), int(across.argmax())]]
