"""Distances that spread over a mesh as fronts: nearly exact where it is dense, in time linear in what is reached.

After Kimmel and Sethian 1998 in the order, and Novotni and Klein 2002 in the step: a vertex's distance is unfolded
from the two ends of an edge, as if from a source in the plane beyond it. Exact on a flat surface. On the bunny
scan, round places 10 to 40 edges wide, it is 0.02 to 0.05 % of the reach off on average, 1.4 % at most, in a
seventh of the time of an exact search at 40 edges.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.kernel_arrays import Queue, plain
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.topology import Topology
from contact_core.geometry.tracing import require_on_surface

_ROOM = 1 << 14  # vertices that wait, before memory for four times as many is taken


def spread_distances(
    mesh: TriangleMesh, sources: SurfacePoints, reach: float, distances: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Distances (n,) of vertices lowered to those from the nearest of sources, up to reach (surface units), and the
    vertices (k,) that were. Only where they are lowered is anything looked at. A vertex that is not manifold is
    reached through one of its fans of faces. Raises InvalidInput for sources that are not on the mesh.
    """
    from contact_core.geometry.front_kernels import spread

    topology = Topology.of(mesh)
    require_on_surface(topology, sources, "sources")
    room = _ROOM
    while True:
        lower, lowered = distances.copy(), np.zeros(len(distances), bool)
        queue = Queue(np.empty(room), np.empty(room, np.int64), np.zeros(7, np.int64))
        if spread(plain(sources.arrays), reach, plain(topology.halfedges), lower, lowered, plain(queue)):
            return lower, np.flatnonzero(lowered)
        room *= 4
