"""Capsules fitted to a rig: one per joint that holds skin, for cheap tests of a body against itself."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.geometry.transform import transform_points
from contact_core.rig.rig import Rig

FITTED_SHARE = 0.7  # of the median distance from skin to bone: capsules stay within flesh that gives
LEAST_VERTICES = 6

_FITTED: WeakKeyDictionary[Rig, dict[float, Capsules]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Capsules:
    """c capsules. joints: (c,). ends: (c, 2, 3) in the joints' frames. radii: (c,). pairs: (p, 2) to be kept
    apart: not of one chain link, and not overlapping at rest."""

    joints: IntArray
    ends: FloatArray
    radii: FloatArray
    pairs: IntArray

    def __post_init__(self) -> None:
        count = len(self.joints)
        object.__setattr__(self, "joints", frozen(self.joints, np.int64, (None,), "joints"))
        object.__setattr__(self, "ends", frozen(self.ends, np.float64, (count, 2, 3), "ends"))
        object.__setattr__(self, "radii", frozen(self.radii, np.float64, (count,), "radii"))
        object.__setattr__(self, "pairs", frozen(self.pairs, np.int64, (None, 2), "pairs"))


def fit_capsules(rig: Rig, share: float = FITTED_SHARE) -> Capsules:
    """Capsules along the bones: axis from the joint's origin through its skin, radius `share` of the median. Found
    once for a rig."""
    known = _FITTED.setdefault(rig, {})
    if share not in known:
        known[share] = _fitted(rig, share)
    return known[share]


def _fitted(rig: Rig, share: float) -> Capsules:
    points = rig.surface.points
    owner = rig.skin_joints[np.arange(len(points)), rig.skin_weights.argmax(axis=1)]
    joints, ends, radii = [], [], []
    for joint in range(len(rig.joints)):
        own = points[owner == joint]
        if len(own) >= LEAST_VERTICES:
            segment, radius = _capsule(own, rig.rest_world[joint, :3, 3], share)
            into = np.linalg.inv(rig.rest_world[joint])
            joints.append(joint)
            ends.append(transform_points(into, segment))
            radii.append(radius)
    none = np.zeros((0, 2), np.int64)
    alone = Capsules(np.array(joints, np.int64), np.array(ends).reshape(-1, 2, 3), np.array(radii, float), none)
    return Capsules(alone.joints, alone.ends, alone.radii, _separable(rig, alone))


def _capsule(own: FloatArray, origin: FloatArray, share: float) -> tuple[FloatArray, float]:
    """Segment (2, 3) from near the joint to near the end of its skin, and a radius."""
    centre = own.mean(axis=0)
    axis = centre - origin
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        return np.stack([centre, centre]), share * float(np.median(np.linalg.norm(own - centre, axis=1)))
    axis = axis / length
    along = (own - origin) @ axis
    radius = share * float(np.median(np.linalg.norm(own - origin - along[:, None] * axis, axis=1)))
    low, high = float(along.min()) + radius, float(along.max()) - radius
    if low > high:
        low = high = 0.5 * (low + high)
    return origin + np.array([[low], [high]]) * axis, radius


def _separable(rig: Rig, capsules: Capsules) -> IntArray:
    """(p, 2) pairs of capsules that are no neighbours in the tree and do not touch at rest."""
    from_joint = rig.rest_world[capsules.joints]
    world = np.einsum("cab,ceb->cea", from_joint[:, :3, :3], capsules.ends) + from_joint[:, None, :3, 3]
    first, second = np.triu_indices(len(capsules.joints), 1)
    a, b = capsules.joints[first], capsules.joints[second]
    neighbours = (rig.parents[a] == b) | (rig.parents[b] == a)
    share = closest_on_segments(world[first], world[second])
    gap = np.linalg.norm(_between(world[first], share[:, 0]) - _between(world[second], share[:, 1]), axis=1)
    apart = gap > capsules.radii[first] + capsules.radii[second]
    keep = apart & ~neighbours
    return np.stack([first[keep], second[keep]], axis=1)


def closest_on_segments(one: FloatArray, two: FloatArray) -> FloatArray:
    """(p, 2) where, as a share of each segment, segments one and two (p, 2, 3) come closest to each other.

    Ericson, "Real-Time Collision Detection", 5.1.9.
    """
    d1, d2, r = one[:, 1] - one[:, 0], two[:, 1] - two[:, 0], one[:, 0] - two[:, 0]
    a, e, f = (np.einsum("pi,pi->p", x, y) for x, y in ((d1, d1), (d2, d2), (d2, r)))
    b, c = np.einsum("pi,pi->p", d1, d2), np.einsum("pi,pi->p", d1, r)
    tiny = 1e-30
    parallel = a * e - b * b
    s = np.where(parallel > 1e-12 * a * e, np.clip((b * f - c * e) / np.maximum(parallel, tiny), 0.0, 1.0), 0.0)
    t = np.where(e > tiny, (b * s + f) / np.maximum(e, tiny), 0.0)
    t_in = np.clip(t, 0.0, 1.0)
    s_again = np.where(a > tiny, np.clip((b * t_in - c) / np.maximum(a, tiny), 0.0, 1.0), 0.0)
    return np.stack([np.where(t == t_in, s, s_again), t_in], axis=1)


def _between(segments: FloatArray, share: FloatArray) -> FloatArray:
    """(p, 3) points at a share of segments (p, 2, 3)."""
    return segments[:, 0] + share[:, None] * (segments[:, 1] - segments[:, 0])
