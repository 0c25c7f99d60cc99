"""Bodies of a pose problem: skinned rigs, rigid things that may move, and fixed surfaces, all as rigs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose, Rig
from contact_core.solve.black_box import BlackBox


@dataclass(frozen=True, eq=False)
class Body:
    """One thing of a pose problem and where it stands.

    pose: where the solve starts. world_from_rig: (4, 4) places rig space in the problem's world (rigid or with
    a uniform scale, so that surfaces of different units meet). black_box: evaluates the body in the rig's stead
    (tier B); the rig then only holds its rest surface.
    """

    name: str
    rig: Rig
    pose: Pose
    world_from_rig: FloatArray = field(default_factory=lambda: np.eye(4))
    black_box: BlackBox | None = None

    def __post_init__(self) -> None:
        placed = frozen(self.world_from_rig, np.float64, (4, 4), f"world_from_rig of {self.name}")
        object.__setattr__(self, "world_from_rig", placed)

    @classmethod
    def skinned(
        cls,
        rig: Rig,
        *,
        name: str | None = None,
        pose: Pose | None = None,
        world_from_rig: FloatArray | None = None,
    ) -> Body:
        """A rig in a pose (its rest pose by default)."""
        return cls(
            name or rig.name, rig, pose or Pose.rest(rig), np.eye(4) if world_from_rig is None else world_from_rig
        )

    @classmethod
    def rigid(
        cls, name: str, mesh: TriangleMesh, *, world_from_surface: FloatArray | None = None, movable: bool = False
    ) -> Body:
        """A surface that stays where it is, or (`movable`) that the solve may move as a whole."""
        rig = Rig.rigid(name, mesh, movable=movable)
        return cls(name, rig, Pose.rest(rig), np.eye(4) if world_from_surface is None else world_from_surface)

    @classmethod
    def evaluated(cls, name: str, black_box: BlackBox, *, pose: Pose | None = None) -> Body:
        """A body that something else evaluates. pose: its dofs by name (`dof_pose`), by default at rest."""
        start = Pose((), np.zeros((0, 4, 4))) if pose is None else pose
        return cls(name, Rig.rigid(name, black_box.surface, movable=False), start, np.eye(4), black_box)


Hold: TypeAlias = Literal["both", "point", "direction"]
HOLDS: tuple[Hold, ...] = ("both", "point", "direction")


def check_hold(hold: str) -> None:
    """Raises InvalidInput for what cannot be held."""
    if hold not in HOLDS:
        raise InvalidInput(f"a contact holds {', '.join(HOLDS)}, but got {hold!r}.")


@dataclass(frozen=True, eq=False)
class PairedPoints:
    """One contact pair as a solver sees it: k points on one body that shall meet k points on another (or itself).

    manipulator, object: names of bodies. weights: (k,) relative weight of each point, by default 1 (give
    areas where points stand for unequal ones); distances are averaged over the weights of all pairs. gain: 0 is
    off. hold: what holds, the "point"s, which may face anywhere, the "direction", at any distance, or "both".
    """

    name: str
    manipulator: str
    manipulator_points: SurfacePoints
    object: str
    object_points: SurfacePoints
    weights: FloatArray = field(default_factory=lambda: np.ones(0))
    gain: float = 1.0
    hold: Hold = "both"

    def __post_init__(self) -> None:
        check_hold(self.hold)
        k = len(self.manipulator_points)
        if len(self.object_points) != k:
            raise InvalidInput(
                f"contact {self.name!r} pairs point by point, but has {k} points on {self.manipulator} and"
                f" {len(self.object_points)} on {self.object}."
            )
        given = np.ones(k) if len(self.weights) == 0 else self.weights
        weights = frozen(given, np.float64, (k,), f"weights of contact {self.name!r}")
        if (weights < 0).any():
            raise InvalidInput(
                f"weights of contact {self.name!r} must not be negative, but got {weights.min():.3g}."
            )
        object.__setattr__(self, "weights", weights)
        if not 0.0 <= self.gain < np.inf:
            raise InvalidInput(
                f"the gain of contact {self.name!r} must be 0 (off) or a positive number, but got {self.gain}."
            )


def manipulator_length(rig: Rig, joints: IntArray | None = None) -> float:
    """The largest rest extent of the skin that `joints` drive (all by default), surface units.

    A vertex belongs to the joint that holds it strongest. This is the length that contacts are judged
    against: a body's hand is measured by the hand, not by the body.
    """
    kept = _lengths.setdefault(rig, {})
    key = None if joints is None else joints.tobytes()
    if key not in kept:
        points = rig.surface.points
        if joints is not None:
            owner = rig.skin_joints[np.arange(len(points)), rig.skin_weights.argmax(axis=1)]
            driven = np.isin(owner, joints)
            points = points[driven] if driven.any() else points
        kept[key] = diameter(points)
    return kept[key]


_lengths: WeakKeyDictionary[Rig, dict[bytes | None, float]] = WeakKeyDictionary()  # a hull takes as long as a step


def uniform_scale(transform: FloatArray) -> float:
    """By how much lengths grow under a transform (4, 4), the mean over directions."""
    return float(abs(np.linalg.det(transform[:3, :3])) ** (1.0 / 3.0))


def diameter(points: FloatArray) -> float:
    """The largest distance between two of the points (n, 3)."""
    if len(points) < 2:
        return 0.0
    from scipy.spatial import ConvexHull, QhullError

    corners = points
    if len(points) > 50:
        try:
            corners = points[ConvexHull(points).vertices]
        except QhullError:  # flat or thin: all points are corners
            corners = np.unique(points, axis=0)
    largest = 0.0
    for start in range(0, len(corners), 256):  # blocks keep the memory small
        gap = corners[start : start + 256, None] - corners[None]
        largest = max(largest, float(np.einsum("abi,abi->ab", gap, gap).max()))
    return float(np.sqrt(largest))
