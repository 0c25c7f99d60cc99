"""Even points on the part of a surface that a stroke reaches.

Distances from the stroke run over the surface, so nothing bleeds onto the next finger; points are a maximal
Poisson-disk sample (Cook 1986; darts thrown in random order until none fits), so the mesh's own density does not
show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.contact.brush import BrushGesture
from contact_core.contact.pointer import strokes
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map
from contact_core.geometry.raycast import Locator
from contact_core.geometry.thinning import first_of_each

_DARTS = 14.0  # candidates per square of the spacing; fewer leave gaps
_MOST = 400_000  # candidates: beyond them the spacing is not meant


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of faces. faces: (p,). corners: (p, 3, 3) barycentric coordinates of their corners."""

    faces: IntArray
    corners: FloatArray

    def positions(self, mesh: TriangleMesh) -> FloatArray:
        """(p, 3, 3) corner positions."""
        return np.asarray(self.corners @ mesh.points[mesh.faces[self.faces]])

    def where(self, keep: BoolArray) -> Pieces:
        """The pieces that stay; keep: (p,)."""
        return Pieces(self.faces[keep], self.corners[keep])


def radius_of(gesture: BrushGesture) -> float:
    """The brush's radius, surface units; 4% of the bounding box where the gesture leaves the choice."""
    return gesture.radius or 0.04 * gesture.mesh.bounding_box_diagonal


def spacing_of(gesture: BrushGesture, radius: float) -> float:
    """The distance between points, surface units; an eighth of the radius where the gesture leaves the choice."""
    return gesture.spacing or radius / 8.0


def stroke_line(gesture: BrushGesture, step: float, *, closed: bool = False) -> SurfacePoints:
    """The stroke with points at most about `step` apart, those in one place once.

    A gesture drawn on the screen is followed there, and is cut at silhouettes. Otherwise the path between two
    points that the pointer reported goes straight and drops onto the surface. Raises InvalidInput for a stroke that
    meets the surface nowhere.
    """
    line = _seen_line(gesture, step, closed) if gesture.is_drawn else _dropped_line(gesture, step, closed)
    if not len(line):
        raise InvalidInput("a stroke needs at least one point on the surface, but got none.")
    return line[first_of_each(line.positions(gesture.mesh), 1e-9 * gesture.mesh.bounding_box_diagonal)]


def _seen_line(gesture: BrushGesture, step: float, closed: bool) -> SurfacePoints:
    """Of each unbroken part of a stroke on the screen, its ends and points about `step` apart between them."""
    chosen = []
    for run in strokes(gesture, 0.5 * step, jump=step, closed=closed):
        walked = np.concatenate([[0.0], np.cumsum(run.gaps)])
        stops = np.searchsorted(walked, np.arange(0.0, walked[-1], 0.5 * step))
        chosen.append(run.points[np.unique(np.append(stops, len(walked) - 1))])
    return SurfacePoints.concatenate(chosen)


def _dropped_line(gesture: BrushGesture, step: float, closed: bool) -> SurfacePoints:
    """The path, and between its points others on straight lines in space, dropped onto the surface."""
    at = gesture.path.positions(gesture.mesh)
    ends = np.roll(at, -1, axis=0) if closed else np.concatenate([at[1:], at[-1:]])
    parts = []
    for k, (start, end) in enumerate(zip(at, ends, strict=True)):
        count = min(int(np.ceil(np.linalg.norm(end - start) / step)), 1000)
        parts.append(gesture.path[k])
        if count > 1:
            steps = np.arange(1, count)[:, None] / count
            parts.append(Locator.of(gesture.mesh).closest(start + steps * (end - start)).points)
    return SurfacePoints.concatenate(parts)


def near_pieces(mesh: TriangleMesh, line: SurfacePoints, reach: float, size: float) -> Pieces:
    """The faces within `reach` of a line in space, split until no part is larger than `size`."""
    at = line.positions(mesh)
    low, high = at.min(axis=0) - reach, at.max(axis=0) + reach
    corners = mesh.points[mesh.faces]  # (m, 3, 3)
    inside = (corners.max(axis=1) >= low).all(axis=1) & (corners.min(axis=1) <= high).all(axis=1)
    faces = np.flatnonzero(inside & (mesh.face_areas > 0.0))
    pieces = Pieces(faces, np.tile(np.eye(3), (len(faces), 1, 1)))
    tree, done = cKDTree(at), []
    while len(pieces.faces):
        triangles = pieces.positions(mesh)
        centre = triangles.mean(axis=1)
        around = np.linalg.norm(triangles - centre[:, None], axis=2).max(axis=1)  # (p,)
        keep = tree.query(centre)[0] <= reach + around
        large = around > size
        done.append(pieces.where(keep & ~large))
        pieces = _quartered(pieces.where(keep & large))
    return Pieces(np.concatenate([part.faces for part in done]), np.concatenate([part.corners for part in done]))


def darts(mesh: TriangleMesh, pieces: Pieces, spacing: float, seed: int) -> SurfacePoints:
    """Random points over the pieces, enough for a maximal sample. Raises InvalidInput for far too small a
    spacing."""
    a, b, c = np.moveaxis(pieces.positions(mesh), 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)  # (p,)
    count = int(np.ceil(_DARTS * area.sum() / spacing**2))
    if count > _MOST:
        raise InvalidInput(
            f"a spacing of {spacing:.3g} would need over {int(count / _DARTS)} points here; use a larger spacing."
        )
    random = np.random.default_rng(seed)
    chosen = np.searchsorted(np.cumsum(area), random.random(count) * area.sum()).clip(max=len(area) - 1)
    root, v = np.sqrt(random.random(count)), random.random(count)
    weights = np.stack([1.0 - root, root * (1.0 - v), root * v], -1)  # (count, 3) uniform in a triangle
    return SurfacePoints(pieces.faces[chosen], np.einsum("kc,kcb->kb", weights, pieces.corners[chosen]))


def thinned(mesh: TriangleMesh, points: SurfacePoints, spacing: float) -> IntArray:
    """Indices of points that stay when each, in order, keeps all later ones at `spacing`."""
    return first_of_each(points.positions(mesh), spacing)


def spread(
    mesh: TriangleMesh, line: SurfacePoints, radius: float, spacing: float, seed: int
) -> tuple[SurfacePoints, FloatArray]:
    """Even points within `radius` of a line over the surface, the line's own first, and their distances (n,) from
    it."""
    pieces = near_pieces(mesh, line, radius, 0.5 * radius)
    candidates = SurfacePoints.concatenate([line, darts(mesh, pieces, spacing, seed)])
    distance = log_map(mesh, line, candidates, max_distance=radius).distance
    reached = np.flatnonzero(distance <= radius)
    kept = reached[thinned(mesh, candidates[reached], spacing)]
    return candidates[kept], distance[kept]


def _quartered(pieces: Pieces) -> Pieces:
    """Each piece cut into four at the middles of its sides."""
    a, b, c = np.moveaxis(pieces.corners, 1, 0)
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    corners = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])  # (4, 3, p, 3)
    return Pieces(np.tile(pieces.faces, 4), corners.transpose(0, 2, 1, 3).reshape(-1, 3, 3))
