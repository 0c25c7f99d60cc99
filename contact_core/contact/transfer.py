"""Moving a placement: by parallel transport along a surface, or from one surface to another."""

from __future__ import annotations

import numpy as np

from contact_core.contact.placement import Root
from contact_core.errors import InvalidInput, Unreached
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints


def transported(mesh: TriangleMesh, root: Root, to: SurfacePoints) -> Root:
    """The root moved to one surface point along the shortest geodesic, its heading kept parallel (paper, 3.3.1).

    Along a straight leg a direction keeps its angle to the path; where the path turns round a saddle vertex, the
    direction does not, so the turns are taken off again. Raises InvalidInput where no path leads there.
    """
    if len(to) != 1:
        raise InvalidInput(f"a patch is moved to one surface point, but got {len(to)}.")
    log = log_map(mesh, root.point(), to, seek=True)
    if log.anchor[0] < 0:
        raise Unreached("no path on the surface leads from the patch to that point; transfer it instead.")
    if log.distance[0] == 0.0:
        return root
    leaving = complex(log.first_leg[0]) / abs(complex(log.first_leg[0]))
    turned = complex(np.exp(-1j * log.turning_angles.sum()))
    return Root.at(to, root.heading / leaving * turned * complex(log.headings[0]))
