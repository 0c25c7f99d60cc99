"""The default: along a long patch, along the bone of a round one, and always the same way round."""

from __future__ import annotations

from contact_builtins.axes.along_bone import bone_heading
from contact_builtins.axes.consistent import Consistent
from contact_builtins.axes.straight import elongation, flatten, principal_heading, through_centre
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints

_LONG = 1.5  # longer than wide by this factor: the shape of the patch tells more than its bone


class Guided:
    """A stroke says by its shape where its axis goes and a dab does not. The bone gives the sign: an axis does
    not run against it, and one that lies rather across it runs to its left, seen from outside. A round patch
    without a bone goes the way of the axes that are drawn already."""

    name = "guided"
    summary = "along a long patch, along the bone of a round one, never against the bone"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        along = bone_heading(request, flat)
        if elongation(flat) < _LONG:
            return Consistent().generate(request) if along is None else through_centre(flat, along)
        heading = principal_heading(flat)
        if along is not None:
            turn = heading * along.conjugate()
            against = turn.real < 0.0 if abs(turn.real) > abs(turn.imag) else turn.imag < 0.0
            heading = -heading if against else heading
        return through_centre(flat, heading)
