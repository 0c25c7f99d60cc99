"""What straight axes share: a patch's centre, its plane there, and an axis through the centre in one direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray
from contact_core.contact.axis_generator import AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map, trace_geodesic
from contact_core.geometry.tangent import direction_to_heading


@dataclass(frozen=True, eq=False)
class Flattened:
    """A patch laid flat round its centre. centre: one of its points. plane: (n,) complex, the log map from there in
    the centre's tangent frame, surface units."""

    mesh: TriangleMesh
    centre: SurfacePoints
    plane: ComplexArray


def require(request: AxisRequest, count: int = 2) -> FloatArray:
    """(n, 3) positions of the patch. Raises InvalidInput when fewer than `count` of them are apart."""
    positions = request.points.positions(request.mesh)
    apart = len(np.unique(np.round(positions / max(request.mesh.bounding_box_diagonal, 1e-300), 9), axis=0))
    if apart < count:
        raise InvalidInput(
            f"an axis needs a patch of at least {count} points in different places, but got {apart}."
        )
    return positions


def flatten(request: AxisRequest) -> Flattened:
    """The patch by its log map from the patch point that is nearest to its mean. Raises InvalidInput."""
    positions = require(request)
    offset = np.linalg.norm(positions - positions.mean(axis=0), axis=1)
    centre = request.points[int(np.argmin(offset))]
    log = log_map(request.mesh, centre, request.points)
    if (log.anchor < 0).any():
        raise InvalidInput(
            f"an axis needs a patch in one piece, but {int((log.anchor < 0).sum())} points are on other parts."
        )
    return Flattened(request.mesh, centre, log.coordinates)


def through_centre(flat: Flattened, heading: complex) -> SurfacePoints:
    """The straight axis through the centre along a unit heading, as long as the patch is in that direction."""
    along = (flat.plane * np.conj(heading)).real  # (n,)
    reach = max(float(np.ptp(along)), 1e-300)
    ends = [end for end in (along.min(), along.max()) if abs(end) > 1e-3 * reach]
    traced = trace_geodesic(flat.mesh, flat.centre[np.zeros(len(ends), np.int64)], np.array(ends) * heading)
    before = [traced.points[k] for k, end in enumerate(ends) if end < 0]
    after = [traced.points[k] for k, end in enumerate(ends) if end > 0]
    return SurfacePoints.concatenate([*before, flat.centre, *after])


def principal_heading(flat: Flattened) -> complex:
    """The direction along which the flattened patch is longest, as a unit heading at the centre; its sign is that
    of the third moment, which depends on the patch alone."""
    plane = flat.plane - flat.plane.mean()
    heading = complex(np.exp(0.5j * np.angle((plane**2).mean())))  # a square has twice the angle, and no sign
    return heading if float(((plane * np.conj(heading)).real ** 3).sum()) >= 0.0 else -heading


def elongation(flat: Flattened) -> float:
    """How much longer than wide the flattened patch is: the ratio of its principal spreads, 1 for a round one."""
    plane = flat.plane - flat.plane.mean()
    mean, skew = float((np.abs(plane) ** 2).mean()), float(abs((plane**2).mean()))  # their sum and difference
    return float(np.sqrt((mean + skew) / max(mean - skew, 1e-300)))


def projected_heading(flat: Flattened, direction: FloatArray) -> complex | None:
    """A direction in space (3,) laid onto the surface at the centre, a unit heading; None where it stands
    upright."""
    normal = flat.centre.normals(flat.mesh)[0]
    lying = direction - normal * float(direction @ normal)
    if np.linalg.norm(lying) < 0.05 * np.linalg.norm(direction):
        return None
    return complex(direction_to_heading(flat.mesh, flat.centre, lying[None])[0])
