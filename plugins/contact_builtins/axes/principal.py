"""An axis along the patch's longest direction, through its centre."""

from __future__ import annotations

from contact_builtins.axes.straight import flatten, principal_heading, through_centre
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints


class Principal:
    """Principal component of the patch in the log map of its centre: one stray point does not turn it."""

    name = "principal"
    summary = "along the patch's longest direction, through its centre"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        return through_centre(flat, principal_heading(flat))
