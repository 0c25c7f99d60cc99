"""Axes that all point the same way: three of the paper's five subjects re-drew axes to get just that."""

from __future__ import annotations

from contact_builtins.axes.along_bone import AlongBone
from contact_builtins.axes.principal import Principal
from contact_builtins.axes.straight import Flattened, flatten, through_centre
from contact_core.contact.axis import draw_axis
from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, log_map, parallel_transport


class Consistent:
    """The direction of the nearest axis that is drawn already, carried here by parallel transport along a shortest
    geodesic. The first axis of a surface goes along its bone or, without a rig, along the patch."""

    name = "consistent"
    summary = "parallel to the nearest axis drawn already; the first one along its bone or its patch"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        carried = [_carried(flat, axis) for _, axis in sorted(request.other_axes.items()) if len(axis) >= 2]
        nearest = min((found for found in carried if found), key=lambda found: found[0], default=None)
        return through_centre(flat, nearest[1]) if nearest else _first(request)


def _carried(flat: Flattened, axis: SurfacePoints) -> tuple[float, complex] | None:
    """An axis's distance from the patch's centre (surface units), and its direction at its nearest point carried
    there, a unit heading; None where they are not connected."""
    _, drawn = draw_axis(flat.mesh, axis)
    log = log_map(flat.mesh, drawn.points, flat.centre)
    if log.anchor[0] < 0:
        return None
    nearest = int(log.anchor[0])
    heading = parallel_transport(flat.mesh, drawn.points[nearest], flat.centre, drawn.tangents[[nearest]])[0]
    return float(log.distance[0]), complex(heading / abs(heading))


def _first(request: AxisRequest) -> SurfacePoints:
    if request.bones is not None:
        try:
            return AlongBone().generate(request)
        except InvalidInput:  # the patch has no bone, or its bone stands upright on it
            pass
    return Principal().generate(request)
