"""What an object offers to a hand: places, how thick it is there, along which way, and what is opposite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints

DENSE = 4000  # points on which the surface's shape is judged
AROUND = 0.16  # hand lengths: how far that shape is looked at
SPOKES = 16  # ways in which the end of a plate is looked for
DEEPER = 1.5  # times as deep as it is thick is what ends in a rim; a ball has none
PARALLEL = 0.6  # - cos of the angle between both sides of what is a plate or a wall
NEAR_RIM, OUTSIDE = 1.0, 0.35  # hand lengths from a place to the end, and the room that a palm needs there
INSIDE = 1e-4  # hand lengths that a ray starts below the surface


@dataclass(frozen=True, eq=False)
class Features:
    """k places of a surface. points, normals: (k, 3), outwards. thickness: (k,) to the other side along the inward
    normal, inf where there is none. opposite: (k, 3) the normal there. axis: (k, 3) unit, in the surface: the way
    along which it goes on alike. elongation: (k,) 0 for a ball or a plate, 1 for a rod. width: (k,) across axis and
    normal, through the middle. free: (k,) how far the way outwards is, inf where nothing is there."""

    points: FloatArray
    normals: FloatArray
    thickness: FloatArray
    opposite: FloatArray
    axis: FloatArray
    elongation: FloatArray
    width: FloatArray
    free: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: IntArray) -> Features:
        return Features(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    @property
    def middles(self) -> FloatArray:
        """(k, 3) halfway through."""
        return self.points - 0.5 * np.minimum(self.thickness, 1e9)[:, None] * self.normals

    @property
    def across(self) -> FloatArray:
        """(k, 3) unit, in the surface, across the axis."""
        return np.asarray(np.cross(self.normals, self.axis))


def surface_samples(mesh: TriangleMesh, count: int, seed: int) -> SurfacePoints:
    """Points spread over a surface at random, as many on equal areas."""
    random = np.random.default_rng(seed)
    areas = mesh.face_areas
    faces = np.searchsorted(np.cumsum(areas), random.uniform(0.0, areas.sum(), count)).clip(0, len(areas) - 1)
    root, other = np.sqrt(random.uniform(size=count)), random.uniform(size=count)
    return SurfacePoints(faces, np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1))


def features_of(
    mesh: TriangleMesh, length: float, count: int, seed: int, at: FloatArray | None = None, reach: float = 0.12
) -> Features:
    """About `count` places of a surface, far from one another. length: of the hand.

    at: (3,) only places within `reach` hand lengths of it.
    """
    dense = surface_samples(mesh, DENSE, seed)
    points, normals = dense.positions(mesh), mesh.face_normals[dense.faces]
    near = np.arange(len(points))
    if at is not None:
        away = np.linalg.norm(points - at, axis=1)
        near = np.flatnonzero(away < max(reach * length, np.sort(away)[min(40, len(away) - 1)]))
    chosen = near[_thinned(points[near], count, seed)]
    here, out = points[chosen], normals[chosen]
    locator = Locator.of(mesh)
    hit = locator.cast(here - INSIDE * length * out, -out)
    thickness = np.where(hit.found, hit.distance + INSIDE * length, np.inf)
    opposite = np.where(hit.found[:, None], mesh.face_normals[hit.points.faces], 0.0)
    axis, elongation = _axes(points, normals, here, out, length)
    across = np.cross(out, axis)
    middle = here - 0.5 * np.minimum(thickness, length)[:, None] * out
    sides = [locator.cast(middle, s * across) for s in (1.0, -1.0)]
    width = np.sum([np.where(side.found, side.distance, np.inf) for side in sides], axis=0)
    ahead = locator.cast(here + INSIDE * length * out, out)
    free = np.where(ahead.found, ahead.distance, np.inf)
    return Features(here, out, thickness, opposite, axis, elongation, width, free)


@dataclass(frozen=True, eq=False)
class Rims:
    """k places at which a plate or a wall ends. points: (k, 3) on the rim, in its middle. across: (k, 3) unit, its
    normal. inwards: (k, 3) unit, across that, from the rim into the plate. thickness: (k,) of the plate."""

    points: FloatArray
    across: FloatArray
    inwards: FloatArray
    thickness: FloatArray


def rims_of(
    mesh: TriangleMesh, length: float, thickest: float, seed: int, at: FloatArray | None = None, reach: float = 0.3
) -> Rims:
    """Where what is thinner than `thickest` ends, with room outside: the nearest end from each of many places that
    are no farther from it than a hand's `length`, where the thing reaches deeper than it is thick.

    at: (3,) only ends within `reach` hand lengths of it.
    """
    dense = surface_samples(mesh, DENSE, seed)
    here, out = dense.positions(mesh), mesh.face_normals[dense.faces]
    locator = Locator.of(mesh)
    hit = locator.cast(here - INSIDE * length * out, -out, max_distance=thickest)
    opposite = mesh.face_normals[hit.points.faces]
    flat = np.flatnonzero(hit.found & (np.einsum("ki,ki->k", out, opposite) < -PARALLEL))
    thickness, out = hit.distance[flat] + INSIDE * length, out[flat]
    middles = here[flat] - 0.5 * thickness[:, None] * out
    first = np.cross(out, np.eye(3)[np.abs(out).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    turn = (np.arange(SPOKES) * 2.0 * np.pi / SPOKES)[:, None, None]
    ways = np.cos(turn) * first + np.sin(turn) * np.cross(out, first)  # (s, k, 3)
    hit = locator.cast(np.broadcast_to(middles, ways.shape).reshape(-1, 3), ways.reshape(-1, 3))
    ends = np.where(hit.found, hit.distance, np.inf).reshape(SPOKES, len(flat))
    near, each = ends.argmin(axis=0), np.arange(len(flat))
    away, way = ends[near, each], ways[near, each]
    deep = away + ends[(near + SPOKES // 2) % SPOKES, each] > DEEPER * thickness
    kept = np.flatnonzero((away < NEAR_RIM * length) & deep)
    rim = middles[kept] + away[kept, None] * way[kept]
    free = locator.cast(rim + INSIDE * length * way[kept], way[kept], max_distance=OUTSIDE * length)
    close = np.full(len(rim), True) if at is None else np.linalg.norm(rim - at, axis=1) < reach * length
    rows = np.flatnonzero(~free.found & close)
    return Rims(rim[rows], out[kept][rows], -way[kept][rows], thickness[kept][rows])


def _thinned(points: FloatArray, count: int, seed: int) -> IntArray:
    from contact_core.grasping.hand import spread_out

    return spread_out(points, count, seed)


def _axes(
    points: FloatArray, normals: FloatArray, here: FloatArray, out: FloatArray, length: float
) -> tuple[FloatArray, FloatArray]:
    """The way along which normals vary least, in the surface, and how much less than across it."""
    tree = cKDTree(points)
    axis, elongation = np.zeros_like(here), np.zeros(len(here))
    for k, near in enumerate(tree.query_ball_point(here, AROUND * length)):
        normal = out[k]
        first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
        first /= np.linalg.norm(first)
        plane = np.stack([first, np.cross(normal, first)])  # (2, 3)
        turned = normals[near] @ plane.T
        spread = (points[near] - here[k]) @ plane.T
        bending, extent = np.cov(turned.T, bias=True).reshape(2, 2), np.cov(spread.T, bias=True).reshape(2, 2)
        bends, ways = np.linalg.eigh(bending)
        long, along = np.linalg.eigh(extent)
        by_normals = (bends[1] - bends[0]) / max(bends[1], 0.02)
        by_extent = 1.0 - np.sqrt(max(long[0], 0.0) / max(long[1], 1e-30))
        best = ways[:, 0] if by_normals >= by_extent else along[:, 1]
        axis[k], elongation[k] = best @ plane, max(by_normals, by_extent)
    return axis, np.clip(elongation, 0.0, 1.0)
