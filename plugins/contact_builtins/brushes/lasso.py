"""The lasso: a closed curve on the surface, its inside filled with even points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.brushes.sampling import darts, near_pieces, spacing_of, stroke_line, thinned
from contact_core.arrays import BoolArray, ComplexArray, FloatArray
from contact_core.contact.brush import BrushGesture, BrushMark
from contact_core.contact.pointer import met
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map
from contact_core.settings import HasSettings, setting


@dataclass(frozen=True)
class LassoBrush(HasSettings):
    """Inside is the side that the curve turns towards on the whole. A point is inside when it leaves its nearest
    point of the curve to that side: no plane and no window is needed, so the curve may run round a finger."""

    name: ClassVar[str] = "lasso"
    summary: ClassVar[str] = "fills the inside of a closed curve with even points"
    erases: ClassVar[bool] = False
    reach: float | None = setting(
        None, above=0.0, unit="surface units", help="how deep the inside may be; half the curve's length by default"
    )

    def mark(self, gesture: BrushGesture) -> BrushMark:
        mesh = gesture.mesh
        at = _corners(gesture)
        length = float(np.linalg.norm(np.roll(at, -1, axis=0) - at, axis=1).sum()) if len(at) else 0.0
        if len(at) < 3 or length <= 1e-9 * mesh.bounding_box_diagonal:
            raise InvalidInput(f"a lasso needs a closed curve of three points or more, but got {len(at)}.")
        spacing = spacing_of(gesture, 0.15 * length)
        reach = self.reach or 0.5 * length  # more than a flat inside can have
        curve = stroke_line(gesture, max(spacing, length / 200.0), closed=True)
        candidates = darts(mesh, near_pieces(mesh, curve, reach, 0.25 * reach), spacing, gesture.seed)
        candidates = candidates[_inside(mesh, curve, candidates, reach)]
        points = candidates[thinned(mesh, candidates, spacing)]
        if not len(points):
            raise InvalidInput(f"the lasso holds no point at a spacing of {spacing:.3g}; make the spacing smaller.")
        return BrushMark(points, np.ones(len(points)))


def _corners(gesture: BrushGesture) -> FloatArray:
    """(k, 3) where the pointer was, as reported: the path, or what its rays meet."""
    if not gesture.is_drawn:
        return gesture.path.positions(gesture.mesh)
    assert gesture.screen is not None
    found = met(gesture, gesture.screen)
    return found.points[found.hit].positions(gesture.mesh)


def _inside(mesh: TriangleMesh, curve: SurfacePoints, points: SurfacePoints, reach: float) -> BoolArray:
    """(n,) whether points lie on the inner side of a closed curve (c) and within reach of it."""
    ahead, left = _sectors(mesh, curve)
    log = log_map(mesh, curve, points, max_distance=reach)
    found = log.anchor >= 0
    anchor = np.maximum(log.anchor, 0)
    turn = np.angle(log.coordinates * np.conj(ahead[anchor])) % (2.0 * np.pi)  # (n,) from straight ahead
    to_the_left = turn < left[anchor]
    turns_left = float((np.pi - left).sum()) > 0.0
    return np.asarray(found & (to_the_left if turns_left else ~to_the_left))


def _sectors(mesh: TriangleMesh, curve: SurfacePoints) -> tuple[ComplexArray, FloatArray]:
    """At each point of a closed curve: the unit heading ahead (c,), and the angle (c,) from there,
    counter-clockwise, to the heading back: the sector on the left of the curve."""
    c = len(curve)
    ahead, left = np.empty(c, complex), np.empty(c)
    for k in range(c):
        log = log_map(mesh, curve[k], curve[[(k + 1) % c, (k - 1) % c]])
        if (log.anchor < 0).any() or (log.distance == 0).any():
            raise InvalidInput("the lasso runs over parts of the surface that are not connected.")
        ahead[k] = log.coordinates[0] / log.distance[0]
        left[k] = np.angle(log.coordinates[1] * np.conj(ahead[k])) % (2.0 * np.pi)
    return ahead, left
