"""Where on an object a saved grasp belongs: the places at which its hand sees the object most like it saw its own.

What a hand sees are signed distances of the object from fixed points before its palm. They tell a rod from a plate
and a rim from a handle, need no names and no symmetry, and a left hand sees what a right one sees in a mirror.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.grasping.features import features_of
from contact_core.library.record import SavedObject

REACH = 0.15  # hand lengths: farther things are all alike
NEAR = 0.06  # hand lengths: how fast what is farther counts less
AROUND, TURNS = 40, 12  # places of the surface at which the palm is laid, and turns about each normal
REFINED, STEPS = 14, 12  # of the likeliest places, moved to where the object is seen best
UPSIDE_DOWN = 0.012  # hand lengths that it costs to turn what stands on its head
SAME = 0.008  # hand lengths that it is worth to be at the very place, which fields of other cells see a little off
CANDIDATES = 6
APART = 0.05  # hand lengths: palms nearer than this, turned alike, are at one place
AXES = {"X": 0, "Y": 1, "Z": 2}


@dataclass(frozen=True, eq=False)
class Places:
    """placed: (k, 4, 4) object from palm, the likeliest first. unlike: (k,) mean difference of what is seen, in
    hand lengths."""

    placed: FloatArray
    unlike: FloatArray


def seen_points() -> FloatArray:
    """(p, 3) points in the palm's frame, in hand lengths, mirrored about z = 0."""
    x, y, z = np.linspace(0.0, 0.36, 5), np.linspace(-0.2, 0.44, 6), np.linspace(-0.3, 0.3, 6)
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)


def seen_from_palm(field: DistanceField, placed: FloatArray, length: float, flip: bool = False) -> FloatArray:
    """(k, p) signed distances in hand lengths at `placed` (k, 4, 4). length: of the hand, in the field's units.
    flip: as the other hand sees it."""
    points = seen_points() * length * (np.array([1.0, 1.0, -1.0]) if flip else 1.0)
    where = np.concatenate([transform_points(g, points) for g in placed])
    return np.clip(field.distances(where).reshape(len(placed), -1) / length, -REACH, REACH)


def weights_of(seen: FloatArray) -> FloatArray:
    """(p,) how much each distance counts: what is at hand more than what is far."""
    weights = np.exp(-np.abs(seen) / NEAR) + 0.05
    return np.asarray(weights / weights.sum())


def main_axes(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """(4, 4) rigid, object space from its main axes (of the second moment of its surface), the middle of its box
    between them at the origin; and half its extents along them (3,)."""
    areas = mesh.face_areas / max(float(mesh.face_areas.sum()), 1e-300)
    corners = mesh.points[mesh.faces]
    middles = corners.mean(axis=1)
    away = corners - areas @ middles
    moment = np.einsum("f,fci,fcj->ij", areas, away, away)
    ways = np.linalg.eigh(moment)[1]
    ways[:, 2] = np.cross(ways[:, 0], ways[:, 1])
    along = mesh.points[mesh.used_points] @ ways
    frame = np.eye(4)
    frame[:3, :3] = ways
    frame[:3, 3] = ways @ (0.5 * (along.min(axis=0) + along.max(axis=0)))
    return frame, 0.5 * np.ptp(along, axis=0)


def like_places(
    saved: SavedObject,
    placed: FloatArray,
    seen: FloatArray,
    mesh: TriangleMesh,
    field: DistanceField,
    length: float,
    unit: float,
    *,
    up_axis: str = "Y",
    flip: bool = False,
    at: FloatArray | None = None,
    count: int = CANDIDATES,
) -> Places:
    """The places of an object that are most like the one of a saved grasp, apart from one another.

    placed: (4, 4) of the grasp, metres. seen: (p,) of the grasp. mesh, field: of the object, in the hand's units,
    of `unit` metres. flip: whether a right hand takes over from a left one or the other way. at: (3,) only places
    whose palm looks at it.
    """
    same = _moved_along(saved, placed, mesh, unit) if not flip else np.zeros((0, 4, 4))
    carried = _by_axes(saved, placed, mesh, unit, flip)
    laid = _laid_on(mesh, placed, seen, length, at)
    ups = np.eye(3)[[AXES[saved.up_axis], AXES[up_axis]]]
    upright = placed[:3, :3].T @ ups[0]  # how the hand saw what is up
    candidates = np.concatenate([carried, laid])

    def price(several: FloatArray, off: FloatArray) -> FloatArray:
        up = np.einsum("kji,j->ki", several[:, :3, :3], ups[1]) * (np.array([1.0, 1.0, -1.0]) if flip else 1.0)
        away = np.zeros(len(several))
        if at is not None:
            centre = several[:, :3, 3] + 0.15 * length * several[:, :3, 0]
            away = np.maximum(np.linalg.norm(centre - at, axis=1) / length - 0.15, 0.0)
        return np.asarray(off + UPSIDE_DOWN * 0.5 * (1.0 - up @ upright) + away)

    weights = weights_of(seen)
    off = np.abs(seen_from_palm(field, candidates, length, flip) - seen) @ weights
    best = np.argsort(price(candidates, off), kind="stable")[:REFINED]
    refined = np.array([_refined(g, seen, weights, field, length, flip) for g in candidates[best]])
    both = np.concatenate([same, candidates[best], refined])
    off = np.abs(seen_from_palm(field, both, length, flip) - seen) @ weights
    cost = price(both, off) - SAME * (np.arange(len(both)) < len(same))
    chosen = _apart(both, np.argsort(cost, kind="stable"), length, count)
    return Places(both[chosen], off[chosen])


def _by_axes(saved: SavedObject, placed: FloatArray, mesh: TriangleMesh, unit: float, flip: bool) -> FloatArray:
    """The palm's own point and directions carried in the main axes of both objects, in all ways to lay those on one
    another; mirrored ways for the other hand. The point keeps its distance from the sides of the box."""
    frame, half = main_axes(mesh)
    own_frame, own_half = saved.frame.copy(), saved.half / unit
    own_frame[:3, 3] /= unit
    palm = placed.copy()
    palm[:3, 3] /= unit
    local = np.linalg.inv(own_frame) @ palm
    result = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if (np.linalg.det(turn) < 0.0) != flip:
                continue
            point = turn @ local[:3, 3]
            grown = np.sign(point) * np.maximum(np.abs(point) + half - np.abs(turn) @ own_half, 0.0)
            shared = point * half / np.maximum(np.abs(turn) @ own_half, 1e-12)
            inside = np.abs(point) < np.abs(turn) @ own_half  # along these the place is a share of the extent
            ways = turn @ local[:3, :3]
            ways[:, 2] = np.cross(ways[:, 0], ways[:, 1])
            way = np.eye(4)
            way[:3, :3], way[:3, 3] = ways, np.where(inside, shared, grown)
            result.append(frame @ way)
    return np.array(result)


def _moved_along(saved: SavedObject, placed: FloatArray, mesh: TriangleMesh, unit: float) -> FloatArray:
    """(k, 4, 4) the palm as it was to an object of the same extents: where it stands as the grasp's own does, and
    where it was moved or turned in its own space, in all ways in which its main axes may be that."""
    frame, half = main_axes(mesh)
    if np.abs(half * unit - saved.half).max() > 1e-6 * saved.half.max():
        return np.zeros((0, 4, 4))
    own, palm = saved.frame.copy(), placed.copy()
    own[:3, 3] /= unit
    palm[:3, 3] /= unit
    signs = ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
    turned = [frame @ np.diag([*sign, 1.0]) @ np.linalg.inv(own) @ palm for sign in signs]
    return np.array([palm, *turned])


def _laid_on(
    mesh: TriangleMesh, placed: FloatArray, seen: FloatArray, length: float, at: FloatArray | None
) -> FloatArray:
    """The palm before places all over the surface, as far from it as it was, in turns about their normals."""
    found = features_of(mesh, length, AROUND, 0, at, 0.2)
    points = seen_points()
    before = float(seen[np.linalg.norm(points, axis=1).argmin()]) * length
    result = []
    for point, out, axis in zip(found.points, found.normals, found.axis, strict=True):
        other = np.cross(out, axis)
        for angle in np.arange(TURNS) * (2.0 * np.pi / TURNS):
            fingers = np.cos(angle) * axis + np.sin(angle) * other
            frame = np.eye(4)
            frame[:3, :3] = np.stack([-out, fingers, np.cross(-out, fingers)], axis=1)
            frame[:3, 3] = point + max(before, 0.0) * out
            result.append(frame)
    return np.array(result)


def _refined(
    placed: FloatArray, seen: FloatArray, weights: FloatArray, field: DistanceField, length: float, flip: bool
) -> FloatArray:
    """A palm moved to where it sees what it shall: damped Gauss-Newton on the weighted distances."""
    points = seen_points() * length * (np.array([1.0, 1.0, -1.0]) if flip else 1.0)
    root = np.sqrt(weights)
    damping, here = 1e-3, placed

    def residuals(g: FloatArray) -> tuple[FloatArray, FloatArray]:
        where = transform_points(g, points)
        value, gradient = field.sample(where)
        value = value / length
        inside = (np.abs(value) < REACH)[:, None]
        arms = (where - g[:3, 3]) / length
        rows = np.concatenate([gradient, np.cross(arms, gradient)], axis=1) * inside
        return root * (np.clip(value, -REACH, REACH) - seen), root[:, None] * rows

    off, rows = residuals(here)
    for _ in range(STEPS):
        normal = rows.T @ rows
        step = np.linalg.solve(normal + damping * (np.eye(6) + np.diag(np.diag(normal))), -rows.T @ off)
        moved = _moved(here, np.asarray(step, np.float64), length)
        new_off, new_rows = residuals(moved)
        if new_off @ new_off < off @ off:
            here, off, rows, damping = moved, new_off, new_rows, 0.3 * damping
        else:
            damping *= 10.0
        if np.abs(step).max() < 1e-5:
            break
    return here


def _moved(placed: FloatArray, step: FloatArray, length: float) -> FloatArray:
    from contact_core.rig.rotations import exponential

    result = placed.copy()
    result[:3, :3] = exponential(step[None, 3:])[0][0] @ placed[:3, :3]
    result[:3, 3] += step[:3] * length
    return result


def _apart(placed: FloatArray, order: IntArray, length: float, count: int) -> IntArray:
    chosen: list[int] = []
    for n in order:
        far = [
            np.linalg.norm(placed[n, :3, 3] - placed[m, :3, 3]) / length
            + 0.3 * np.linalg.norm(placed[n, :3, :3] - placed[m, :3, :3])
            > APART
            for m in chosen
        ]
        if all(far):
            chosen.append(int(n))
        if len(chosen) >= count:
            break
    return np.array(chosen, np.int64)
