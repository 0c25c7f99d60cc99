"""From where a grasp is looked at: beside the hand, but from another side where the hand or what it holds is hidden
there by the object, or by the body behind the hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.grasping.hand import spread_out

HAND_POINTS, THING_POINTS = 80, 40  # of which each eye sees so many or not
ABOVE = 0.02  # of how large all is that is looked at: how far rays start from a surface
THING = 0.5  # what the thing counts, where the hand counts 1
ENOUGH = 0.7  # of what the best eye sees that has to be seen from the usual sides
APART = 0.35  # cosine of the angle that two views are apart, at most
ROUND = 12


def views(
    meshes: Sequence[TriangleMesh],
    hand: FloatArray,
    thing: FloatArray,
    way: FloatArray,
    eye_of: Callable[[FloatArray], FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Two ways (3,) to the eye, far apart. meshes: what hides. hand: (k, 3) points of its skin, thing: (l, 3) of
    the object near it. way: (3,) unit, from the palm into the object. eye_of: where the eye (3,) is that looks from
    a way."""
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
    ways = np.array([*usual, *others, -way])
    ways = ways / np.linalg.norm(ways, axis=1)[:, None]
    eyes = np.array([eye_of(each) for each in ways])
    seen = seen_from_eyes(meshes, hand[spread_out(hand, HAND_POINTS, 0)], eyes)
    if len(thing):
        seen = seen + THING * seen_from_eyes(meshes, thing[spread_out(thing, THING_POINTS, 0)], eyes)
    first = _usual_or_best(seen, 0)
    second = _usual_or_best(np.where(ways @ ways[first] < APART, seen, -1.0), 1)
    return ways[first], ways[second]


def _usual_or_best(seen: FloatArray, usual: int) -> int:
    return usual if seen[usual] >= ENOUGH * seen.max() else int(seen.argmax())


def seen_from_eyes(meshes: Sequence[TriangleMesh], points: FloatArray, eyes: FloatArray) -> FloatArray:
    """(e,) the share of points (k, 3), on surfaces, that eyes (e, 3) see: no mesh is between."""
    starts = np.broadcast_to(points[None], (len(eyes), *points.shape)).reshape(-1, 3)
    ways = np.repeat(eyes, len(points), axis=0) - starts
    above = ABOVE * float(np.linalg.norm(np.ptp(points, axis=0)))
    far = np.maximum(np.linalg.norm(ways, axis=1), 1e-30)
    starts = starts + np.minimum(above / far, 0.5)[:, None] * ways
    hidden = np.zeros(len(starts), bool)
    for mesh in meshes:
        hidden |= (
            Locator.of(mesh).cast(starts, np.repeat(eyes, len(points), axis=0) - starts, max_distance=1.0).found
        )
    return np.asarray(1.0 - hidden.reshape(len(eyes), len(points)).mean(axis=1))
