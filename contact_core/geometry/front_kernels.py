"""The kernel of fronts: distances that spread from vertex to vertex, each unfolded from two neighbours."""

from __future__ import annotations

import math

from contact_core.arrays import BoolArray, FloatArray
from contact_core.geometry.jit import inlined, kernel
from contact_core.geometry.kernel_arrays import Halfedges, Points, Queue
from contact_core.geometry.queue_kernels import HEAP_SIZE, OVERFLOW, heap_pop, heap_push
from contact_core.geometry.topology_kernels import first_of, following, preceding, twin_of, visit

LOWER = 1.0 - 1e-9  # a distance that is hardly lower is not lowered: rounding would go round in circles


@inlined
def unfolded(h: int, at_tail: float, at_head: float, mesh: Halfedges) -> float:
    """The distance of the apex of h from a source in the plane of its face, beyond h, that is so far from the ends
    of h; inf where the straight line from there does not cross h."""
    length, x, y = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
    if not length > 0.0:
        return math.inf
    along = 0.5 * (length + (at_tail - at_head) * (at_tail + at_head) / length)
    below = math.sqrt(max(at_tail * at_tail - along * along, 0.0))
    high = below + y
    crossing = along + (x - along) * below / high if high > 0.0 else along
    if not 0.0 <= crossing <= length:
        return math.inf
    return math.sqrt((x - along) ** 2 + high * high)


@inlined
def lower(v: int, distance: float, reach: float, distances: FloatArray, lowered: BoolArray, queue: Queue) -> None:
    """Bring the distance of a vertex down, if it is within reach, and let it spread from there."""
    if distance <= reach and distance < LOWER * distances[v]:
        distances[v] = distance
        lowered[v] = True
        heap_push(distance, v, queue)


@kernel
def spread(
    sources: Points, reach: float, mesh: Halfedges, distances: FloatArray, lowered: BoolArray, queue: Queue
) -> bool:
    """Lower distances (n,) of vertices to those from the sources, up to reach; returns whether the queue had room.

    lowered: (n,) False on entry, marks what was. Dijkstra's order; a vertex takes its distance along an edge, or
    unfolded from an edge whose two ends were reached in this search: exact where the surface is flat.
    """
    sources, mesh, queue = Points(*sources), Halfedges(*mesh), Queue(*queue)
    for i in range(len(sources.faces)):
        h, b = 3 * sources.faces[i], sources.barycentric[i]
        visit(sources.faces[i], mesh)
        length, x, y = mesh.shape[h, 0], mesh.shape[h, 1], mesh.shape[h, 2]
        at_x, at_y = b[1] * length + b[2] * x, b[2] * y
        lower(mesh.tail[h], math.sqrt(at_x**2 + at_y**2), reach, distances, lowered, queue)
        lower(mesh.tail[h + 1], math.sqrt((at_x - length) ** 2 + at_y**2), reach, distances, lowered, queue)
        lower(mesh.tail[h + 2], math.sqrt((at_x - x) ** 2 + (at_y - y) ** 2), reach, distances, lowered, queue)
    while queue.state[HEAP_SIZE] > 0:
        key = queue.keys[0]
        v = heap_pop(queue)
        if key > distances[v]:
            continue
        h = first_of(v, mesh)
        while True:
            onto, back = following(h), preceding(h)
            a, b = mesh.tail[onto], mesh.tail[back]
            lower(a, key + mesh.shape[h, 0], reach, distances, lowered, queue)
            lower(b, key + mesh.shape[back, 0], reach, distances, lowered, queue)
            if lowered[a]:
                lower(b, unfolded(h, key, distances[a], mesh), reach, distances, lowered, queue)
            if lowered[b]:
                lower(a, unfolded(back, distances[b], key, mesh), reach, distances, lowered, queue)
            h = twin_of(back, mesh)
            if h < 0 or h == mesh.first[v]:
                break
        if queue.state[OVERFLOW]:
            return False
    return True
