"""A geodesic, a log map, and a chain at a saddle.

(a) The shortest way over a surface runs through faces (pink). Along edges (grey) it is longer, on any mesh. (b) All
shortest ways from one point are its log map: a distance, here in bands of a centimetre, and the heading in
which each sets out, here as spokes. (c) Where a block stands on a floor, its foot has corners with 450 degrees
around them, saddles. Every shortest way into the dark region goes through such a corner and turns there, so that no
single straight line leads to it. A point of a patch therefore stores a chain of legs and turns, of one leg nearly
always, and the chain leads back to the point.
"""

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

import contact_core as contact
from contact_core.arrays import ComplexArray
from contact_core.geometry import exact_geodesic, log_map
from contact_core.geometry.exact_geodesics import LogMap
from contact_core.geometry.raycast import Locator
from contact_core.geometry.tracing import Trace, trace_chains
from contact_core.scene.picture import Picture, PictureMesh
from contact_core.testing import meshes
from contact_gallery.looks import AXIS, LETTERING, edges, on, tube
from contact_gallery.sheet import Sheet

PAPER = "Section 4.1, not pictured"
PALE, FLOOR, DARK, GREY = (0.84, 0.84, 0.86), (0.68, 0.68, 0.7), (0.36, 0.46, 0.64), (0.3, 0.3, 0.3)
BANDS = np.array([[0.93, 0.6, 0.3], [0.95, 0.84, 0.35]])
EXACT = "exact in the polyhedral sense"


def draw(sheet: Sheet) -> None:
    with contact.new(rabbit="sample:rabbit", plugins=sheet.plugins) as session:
        rabbit = session.geometry.mesh("rabbit")
    sheet.show(through_faces(sheet), log_of_a_point(sheet, rabbit), round_a_corner(sheet))


def through_faces(sheet: Sheet) -> Picture:
    """The geodesic between two vertices of a ball, and the shortest way along its edges."""
    ball, wanted = meshes.icosphere(3), np.array([[-0.8, -0.3, 0.6], [0.75, 0.45, 0.5]])
    start, end = (int(np.argmin(np.linalg.norm(ball.points - place, axis=1))) for place in wanted)
    straight = exact_geodesic(ball, *(contact.SurfacePoints.at_vertices(ball, [one]) for one in (start, end)))
    pairs = np.unique(np.sort(ball.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    costs = np.linalg.norm(np.diff(ball.points[pairs], axis=1)[:, 0], axis=1)
    graph = csr_matrix((costs, tuple(pairs.T)), shape=2 * (len(ball.points),))
    lengths, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    way = [end]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    longer = lengths[end] / straight.length - 1.0
    sheet.measure("(a) the way along edges is longer by", f"{100 * longer:.1f} %", EXACT)
    lines = [
        PictureMesh(tube(on(ball, straight.points, 0.006), 0.012), AXIS),
        PictureMesh(tube(1.006 * ball.points[way], 0.01), GREY),
    ]
    return Picture(
        (PictureMesh(ball, PALE), *lines), lines=((edges(ball), (0.72, 0.72, 0.75)),),
        camera_from=(0.1, 0.3, 1.0), caption="(a) geodesic", lettering=LETTERING,
    )  # fmt: skip


def log_of_a_point(sheet: Sheet, rabbit: contact.TriangleMesh) -> Picture:
    """The log map of a point on a rabbit's back."""
    source = Locator.of(rabbit).closest([(-0.06, 0.11, 0.04)]).points
    every = contact.SurfacePoints.at_vertices(rabbit, np.arange(len(rabbit.points)))
    log = log_map(rabbit, source, every, max_distance=0.08)
    near = np.isfinite(log.distance)
    color = np.tile(np.array([PALE]), (len(near), 1))
    color[near] = BANDS[np.floor(100.0 * log.distance[near]).astype(int) % 2]
    spokes = straight_on(rabbit, source, 0.08 * np.exp(1j * np.radians(np.arange(0.0, 360.0, 20.0))))
    lines = [PictureMesh(tube(on(rabbit, spoke, 0.0006), 0.0007), AXIS) for spoke in ways_of(spokes)]
    back = chained(rabbit, source, log_map(rabbit, source, every[near])).points.positions(rabbit)
    lost = np.linalg.norm(back - rabbit.points[near], axis=1).max()
    sheet.measure(f"(b) {near.sum():,} points by their log map and back, farthest", f"{1e9 * lost:.1g} nm", EXACT)
    shown = (PictureMesh(rabbit, PALE, vertex_colors=color), *lines)
    return Picture(shown, camera_from=(-0.9, 0.5, 0.9), caption="(b) log map", lettering=LETTERING)


def round_a_corner(sheet: Sheet) -> Picture:
    """A block of cubes on a floor: shortest ways from one point, and dark what no straight way leads to."""
    solid = np.zeros((12, 9, 4), bool)
    solid[:, :, 0] = solid[4:7, 3:6, :] = True
    stage = meshes.blocks(solid)
    stage = meshes.subdivided(meshes.subdivided(meshes.subdivided(stage.with_points(stage.points - 1.0))))
    source, stands = Locator.of(stage).closest([(1.5, 4.5, 1.0)]).points, stage.points[:, 2] > 0.99
    log = log_map(stage, source, contact.SurfacePoints.at_vertices(stage, np.arange(len(stands))))
    dark = (np.diff(log.offsets) > 0) & stands
    goals = Locator.of(stage).closest([(10.5, y, 1.0) for y in np.linspace(0.7, 8.3, 11)]).points
    ways = chained(stage, source, log_map(stage, source, goals))
    lines = [PictureMesh(tube(on(stage, way, 0.05), 0.05), AXIS) for way in ways_of(ways)]
    missed = [
        np.linalg.norm(ends.points.positions(stage)[dark] - stage.points[dark], axis=1)
        for ends in (chained(stage, source, log), straight_on(stage, source, log.coordinates))
    ]
    sheet.measure(
        f"(c) {dark.sum():,} points behind corners, by chains: farthest", f"{missed[0].max():.1g} cubes", EXACT
    )
    sheet.measure("(c) the same, by one straight line each: mean", f"{missed[1].mean():.1f} cubes")
    shown = (PictureMesh(stage, PALE, vertex_colors=np.where(dark[:, None], [DARK], [FLOOR])), *lines)
    caption = "(c) a chain at a saddle"
    return Picture(shown, camera_from=(-0.35, -0.75, 1.3), up=(0, 0, 1), caption=caption, lettering=LETTERING)


def chained(mesh: contact.TriangleMesh, source: contact.SurfacePoints, log: LogMap) -> Trace:
    """The ways of a log map from one source, walked again."""
    starts, ways = source[np.zeros(len(log.distance), int)], (log.offsets, log.turning_angles, log.lengths)
    return trace_chains(mesh, starts, log.first_leg, *ways, polyline=True)


def straight_on(mesh: contact.TriangleMesh, source: contact.SurfacePoints, legs: ComplexArray) -> Trace:
    """Straight ways from one source, without turns."""
    starts, none = source[np.zeros(len(legs), int)], np.zeros(0)
    return trace_chains(mesh, starts, legs, np.zeros(len(legs) + 1, int), none, none, polyline=True)


def ways_of(trace: Trace) -> list[contact.SurfacePoints]:
    """The polylines of a trace, one each."""
    assert trace.polylines is not None
    return [trace.polylines[k] for k in range(len(trace.polylines))]
