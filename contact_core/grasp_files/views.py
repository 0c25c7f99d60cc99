"""From where a grasp is looked at: beside the hand, but from another side where the object hides it there."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.grasping.hand import spread_out

POINTS = 100  # of the hand, of which each view sees so many or not
AWAY = 4.0  # hand lengths from the hand to an eye; what is farther hides nothing
ABOVE = 0.01  # hand lengths that rays start from the skin
ENOUGH = 0.5  # share of the hand that has to be seen from the usual sides
APART = 0.35  # cosine of the angle that two views are apart, at most
ROUND = 12


def views(mesh: TriangleMesh, hand: FloatArray, way: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Two ways (3,) to the eye, far apart. hand: (k, 3) points of its skin. way: (3,) unit, from the palm into the
    object. length: of the hand; all in the object's space."""
    up = np.eye(3)[1]
    across = np.cross(way, up)
    across = across / np.linalg.norm(across) if np.linalg.norm(across) > 0.2 else np.eye(3)[0]
    lift = np.cross(across, way)
    lift = lift * (1.0 if lift @ up >= 0 else -1.0)
    usual = (across + 0.35 * way + 0.25 * lift, -across - 0.45 * way + 0.3 * lift)
    turns = np.arange(ROUND) * 2.0 * np.pi / ROUND
    others = [
        np.cos(turn) * across + np.sin(turn) * way + height * lift for height in (0.3, 1.2, -0.6) for turn in turns
    ]
    eyes = np.array([*usual, *others, -way])
    eyes = eyes / np.linalg.norm(eyes, axis=1)[:, None]
    seen = seen_from_eyes(mesh, hand[spread_out(hand, POINTS, 0)], eyes, length)
    first = 0 if seen[0] >= ENOUGH else int(seen.argmax())
    seen = np.where(eyes @ eyes[first] < APART, seen, -1.0)
    second = 1 if seen[1] >= ENOUGH else int(seen.argmax())
    return eyes[first], eyes[second]


def seen_from_eyes(mesh: TriangleMesh, points: FloatArray, eyes: FloatArray, length: float) -> FloatArray:
    """(e,) the share of points (k, 3) that the object does not hide from eyes (e, 3), unit, from the points."""
    starts = points[None] + ABOVE * length * eyes[:, None]
    ways = np.broadcast_to(eyes[:, None], starts.shape)
    hit = Locator.of(mesh).cast(starts.reshape(-1, 3), ways.reshape(-1, 3), max_distance=AWAY * length)
    return np.asarray(1.0 - hit.found.reshape(len(eyes), len(points)).mean(axis=1))
