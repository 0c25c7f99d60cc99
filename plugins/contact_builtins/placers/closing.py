"""Approach and auto-close: bring an open hand to an object and curl its fingers until they touch.

The rule is GraspIt!'s (Miller and Allen 2004): the joints of a digit flex together, and a joint stops when its
own link or one beyond it touches. The thumb stays out of the approach (else it stops the hand and all fingers
close on air) and is searched for afterwards, over starts of its first joint.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contact_builtins.placers.hand_pose import HandPose, flexion_dof, matching, palm_and_digits
from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins.slots import PlacementRequest
from contact_core.settings import HasSettings, setting

STEP = np.radians(3.0)
LAST_RATIO = 0.7  # the last joint of a digit curls more slowly, as tendons make it
TOUCH = 0.002  # of the bounding box diagonal of the hand: nearer than this is touching
TURNED = 0.04  # hand lengths that a pad of the thumb is worth that looks away from the object
OPPOSE = 0.008
SHORTEST = 1e-30  # of an approach: what is shorter vanishes once it is squared
FREE_UPPER = np.radians(100.0)  # for joints without limits


@dataclass(frozen=True)
class Approaching(HasSettings):
    """The settings of placers that bring the hand to the object first."""

    approach: tuple[float, float, float] | None = setting(
        None,
        low=-1e30,
        high=1e30,
        help="direction in rig space in which the hand moves until it touches; none: it stays where it is",
    )
    without: tuple[str, ...] = setting((), help="joint patterns whose skin the approach does not test")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.approach is not None and not np.linalg.norm(self.approach) > SHORTEST:
            raise InvalidInput(f"the approach is a direction, but got {list(self.approach)}, which has no length.")

    def approached(self, request: PlacementRequest) -> HandPose:
        """The request's hand after its approach. Raises InvalidInput when it passes the object by."""
        hand = HandPose(request)
        if self.approach is not None:
            approach(hand, np.array(self.approach), matching(request.rig, self.without, "placer.without"))
        return hand


def approach(hand: HandPose, direction: FloatArray, without: IntArray) -> None:
    """Move the hand along `direction` (3,) in rig space until skin of a palm or digit that no joint of `without`
    holds touches: a wrist that came first would keep the palm away.

    It comes from outside, also when it starts inside the object. Raises InvalidInput when it passes by.
    """
    tested = np.flatnonzero(~np.isin(hand.owner, without) & palm_and_digits(hand.rig))
    if not len(tested):
        raise InvalidInput("the approach leaves out every part of the manipulator; leave some skin to touch with.")
    way = hand.object_from_rig[:3, :3] @ (direction / np.linalg.norm(direction))
    points = hand.points(tested)  # (k, 3)
    field = hand.fields[0]
    size = np.array(field.values.shape) * field.spacing
    reach = float(np.linalg.norm(np.ptp(points, axis=0)) + np.linalg.norm(size))
    middle = field.origin + 0.5 * size
    ahead = float((middle - points.mean(axis=0)) @ way)  # how far the object lies along the way
    travelled, end = ahead - reach, ahead + reach
    tolerance = 0.1 * field.spacing
    while travelled < end:
        clear = float(hand.distance(points + travelled * way).min())
        if clear < tolerance:
            hand.shift = hand.shift + travelled * (direction / np.linalg.norm(direction))
            return
        travelled += max(0.9 * clear, 0.5 * tolerance)  # a distance field never overestimates by much
    raise InvalidInput(
        "the hand passes the object without touching it: check the coarse object_center and the approach direction."
    )


def close(hand: HandPose, digit: Sequence[int] | IntArray, step: float = STEP) -> None:
    """Curl the joints of one digit (root to tip) until they touch or reach their limits."""
    chain = [(joint, dof) for joint in digit if (dof := flexion_dof(hand.chart, joint)) is not None]
    if not chain:
        raise InvalidInput(f"no joint of the digit {[hand.rig.joints[j] for j in digit]} can curl.")
    dofs = np.array([dof for _, dof in chain])
    rates = np.ones(len(chain))
    rates[-1] = LAST_RATIO if len(chain) > 1 else 1.0
    upper = np.where(np.isfinite(hand.chart.upper[dofs]), hand.chart.upper[dofs], FREE_UPPER)
    vertices, link = _links(hand, [joint for joint, _ in chain])
    touch = TOUCH * hand.rig.surface.bounding_box_diagonal
    moving = np.ones(len(chain), bool)
    while moving.any():
        touching = link[hand.clearance(vertices) < touch]
        if len(touching):
            moving[: touching.max() + 1] = False  # a joint stops when its link or one beyond it touches
        before = hand.theta[dofs]
        hand.theta[dofs] = np.where(moving, np.minimum(before + step * rates, np.maximum(upper, before)), before)
        moving &= hand.theta[dofs] > before


def search_thumb(
    hand: HandPose,
    digit: Sequence[int] | IntArray,
    pads: Sequence[SurfacePoints],
    others: Sequence[SurfacePoints] = (),
    oppose: float = OPPOSE,
) -> None:
    """Try starts of the thumb's first joint, close each, keep the one whose pads lie best on the object.

    pads: points that should touch; the thumb's last link where there are none. others: the pads of the fingers,
    which a thumb opposes; oppose: how many hand lengths of distance it is worth that it does.
    """
    first, rest = int(digit[0]), list(digit[1:])
    where = hand.chart.rotation_slices[first]
    lower, upper = (
        np.where(np.isfinite(b), b, s * np.pi / 4)
        for b, s in ((hand.chart.lower[where], -1), (hand.chart.upper[where], 1))
    )
    fractions = [(0.35, 0.65), (0.2, 0.5, 0.8), (0.1, 0.37, 0.63, 0.9)][3 - len(lower) :]  # twist, spread, flexion
    start = hand.theta.copy()
    against = oppose * _mean_normal(hand, others)
    best: tuple[float, FloatArray] | None = None
    for chosen in itertools.product(*fractions):
        hand.theta = start.copy()
        hand.theta[where] = lower + np.array(chosen) * (upper - lower)
        close(hand, rest)
        score = _misfit(hand, digit, pads, against)
        if best is None or score < best[0]:
            best = score, hand.theta.copy()
    if best is not None:
        hand.theta = best[1]


def _misfit(
    hand: HandPose, digit: Sequence[int] | IntArray, pads: Sequence[SurfacePoints], against: FloatArray
) -> float:
    """How badly pads lie: mean distance, normals turned away from the object, and to the same side as the fingers'
    mean normal (`against`, times its worth), skin of the digit that is inside. In lengths of the hand.
    """
    length = hand.rig.surface.bounding_box_diagonal
    skin = hand.skin()
    if pads:
        together = SurfacePoints.concatenate(pads)
        points, normals = together.positions(skin), together.normals(skin)
    else:
        tip = [joint for joint in digit if len(hand.vertices_of(np.array([joint])))][-1:]
        vertices = hand.vertices_of(np.array(tip))
        points, normals = skin.points[vertices], skin.vertex_normals[vertices]
    distance, outward = hand.fields[0].sample(points)
    turned = 1.0 + np.einsum("ki,ki->k", normals, outward).mean()  # 0: the pads look straight at the object
    beside = float(normals.mean(axis=0) @ against)  # least: straight against the fingers
    inside = hand.distance(skin.points[hand.vertices_of(np.array(digit))]).min(initial=0.0)
    return float((np.abs(distance).mean() - 2.0 * min(inside, 0.0)) / length + TURNED * turned + beside)


def _mean_normal(hand: HandPose, pads: Sequence[SurfacePoints]) -> FloatArray:
    """(3,) unit mean normal of pads on the posed skin, zero without any."""
    if not pads:
        return np.zeros(3)
    skin = hand.skin()
    mean = np.mean([pad.normals(skin).mean(axis=0) for pad in pads], axis=0)
    return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-12))


def _links(hand: HandPose, joints: list[int]) -> tuple[IntArray, IntArray]:
    """Vertices that move with a chain, and for each the place in the chain of the joint that carries it."""
    place_of = np.full(len(hand.rig.joints), -1)
    for joint, parent in enumerate(hand.rig.parents):
        place_of[joint] = joints.index(joint) if joint in joints else (place_of[parent] if parent >= 0 else -1)
    place = place_of[hand.owner]
    return np.flatnonzero(place >= 0), place[place >= 0]
