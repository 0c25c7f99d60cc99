"""Black-box bodies (tier B): something else evaluates them, a solver sees points, normals and numbers.

For rigs that the analytic skin cannot honour (dual quaternions, envelopes, constraints, a host's own deformers) and
for anything else that moves contact points by parameters. Derivatives are central differences, so every iteration
costs twice as many evaluations as there are free dofs; what knows its own is a `Differentiable`.

A pose of a black box is its dofs by name, each as a translation along x.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose, Rig

# theta (all dofs) -> world points (k, 3) and unit normals (k, 3) of the watched contact points
Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@runtime_checkable
class Differentiable(Protocol):
    """An `Evaluate` that knows its derivatives."""

    def __call__(self, theta: FloatArray, /) -> tuple[FloatArray, FloatArray]: ...

    def derivatives(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(d, k, 3) of points and of normals, by all dofs."""
        ...


@dataclass(frozen=True)
class BlackBoxDof:
    """One number that moves a black box; 0 is rest. step: of the central differences.

    is_translation: a length rather than an angle. is_root: it places the whole body, so the prior leaves it out.
    """

    name: str
    lower: float = -np.inf
    upper: float = np.inf
    prior_weight: float = 1.0
    is_translation: bool = False
    is_root: bool = False
    step: float = 1e-4


@runtime_checkable
class BlackBox(Protocol):
    """What evaluates a black-box body. surface: its rest surface, on which contacts are given.

    world_length: what distances are judged against, like a manipulator's length; 0 where it is none.
    """

    @property
    def dofs(self) -> Sequence[BlackBoxDof]: ...

    @property
    def surface(self) -> TriangleMesh: ...

    @property
    def world_length(self) -> float: ...

    def watch(self, points: SurfacePoints) -> Evaluate:
        """Get ready to evaluate these points, in this order."""
        ...


class DeformedSkin:
    """A black box out of a function theta -> posed world vertices (n, 3): what a host's evaluation gives."""

    def __init__(
        self,
        surface: TriangleMesh,
        dofs: Sequence[BlackBoxDof],
        deform: Callable[[FloatArray], FloatArray],
        world_length: float,
    ) -> None:
        self.surface, self.dofs, self.deform, self.world_length = surface, tuple(dofs), deform, world_length

    def watch(self, points: SurfacePoints) -> Evaluate:
        """Points by barycentric coordinates, normals those of the posed faces round them."""

        def evaluate(theta: FloatArray) -> tuple[FloatArray, FloatArray]:
            posed = self.surface.with_points(self.deform(theta))
            return points.positions(posed), points.normals(posed)

        return evaluate


def dof_pose(names: Sequence[str], theta: FloatArray) -> Pose:
    """The pose of a black box: its dofs (d,) by name, each as a translation along x."""
    local = np.tile(np.eye(4), (len(theta), 1, 1))
    local[:, 0, 3] = theta
    return Pose(tuple(names), local)


class BlackBoxMotion:
    """One body at one theta, as `chart.Motion` is for rigs: no bones, but the watched points and normals (k, 3)."""

    def __init__(self, chart: BlackBoxChart, theta: FloatArray) -> None:
        self._chart, self._theta = chart, theta
        self.points, self.normals = chart.evaluate(theta)
        self.world: FloatArray = np.zeros((0, 4, 4))
        self.generators: FloatArray = np.zeros((len(theta), 3, 4))

    def derivatives(self, dofs: IntArray) -> tuple[FloatArray, FloatArray]:
        """(q, k, 3) of points and of normals, by some of the dofs: its own, or central differences."""
        if isinstance(self._chart.evaluate, Differentiable):
            own = self._chart.evaluate.derivatives(self._theta)
            return own[0][dofs], own[1][dofs]
        moved, turned = (np.empty((len(dofs), len(self.points), 3)) for _ in range(2))
        for row, q in enumerate(dofs):
            size = self._chart.black_box.dofs[q].step
            step = np.zeros(len(self._theta))
            step[q] = size
            ahead, behind = self._chart.evaluate(self._theta + step), self._chart.evaluate(self._theta - step)
            moved[row] = (ahead[0] - behind[0]) / (2.0 * size)
            turned[row] = (ahead[1] - behind[1]) / (2.0 * size)
        return moved, turned


class BlackBoxChart:
    """What `chart.Chart` is to a rig: dofs, limits, poses. theta is the dofs themselves."""

    is_rigid = True  # it has no bones that could scale

    def __init__(self, black_box: BlackBox, rig: Rig, watched: SurfacePoints) -> None:
        dofs = black_box.dofs
        if len({dof.name for dof in dofs}) != len(dofs):
            raise InvalidInput(f"the dofs of {rig.name} need unique names.")
        self.black_box, self.rig, self.size = black_box, rig, len(dofs)
        self.dof_names = tuple(dof.name for dof in dofs)
        self.lower, self.upper = np.array([d.lower for d in dofs]), np.array([d.upper for d in dofs])
        self.prior_weight: FloatArray = np.array([d.prior_weight for d in dofs], float)
        self.is_translation: BoolArray = np.array([d.is_translation for d in dofs], bool)
        self.is_root: BoolArray = np.array([d.is_root for d in dofs], bool)
        self.locked: BoolArray = np.zeros(self.size, bool)
        self.joint_of_dof: IntArray = np.zeros(self.size, np.int64)
        self.moves: BoolArray = np.zeros((self.size, 0), bool)
        self.watched = len(watched)
        self.evaluate = black_box.watch(watched)

    def theta_of(self, pose: Pose) -> tuple[FloatArray, None]:
        """theta (d,) of a pose that `dof_pose` made; dofs it does not name are 0."""
        values = dict(zip(pose.joints, pose.local[:, 0, 3].tolist(), strict=True))
        return np.array([values.get(name, 0.0) for name in self.dof_names]), None

    def local(self, theta: FloatArray, leftover: FloatArray | None = None) -> FloatArray:
        """(d, 4, 4) the dofs as translations along x."""
        return dof_pose(self.dof_names, theta).local

    def motion(self, theta: FloatArray, leftover: FloatArray | None = None) -> BlackBoxMotion:
        """The watched points at theta (d,)."""
        return BlackBoxMotion(self, theta)
