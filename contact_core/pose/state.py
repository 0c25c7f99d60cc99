"""A pose problem at one theta: what terms ask for points, forces and Gauss-Newton matrices.

Everything is computed when first asked for and kept, so that a trial step costs forward kinematics and one
product, and an accepted step adds the derivatives.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.pose.chart import Motion
from contact_core.pose.skinning import Track, outward_carrier

if TYPE_CHECKING:
    from contact_core.pose.problem import PoseProblem


class PoseState:
    """All bodies of a problem at theta (d,), the values of its free dofs. Read-only for terms."""

    def __init__(self, problem: PoseProblem, theta: FloatArray) -> None:
        self.problem = problem
        self.theta: FloatArray = np.array(theta, dtype=np.float64)  # a copy: solvers reuse their buffers
        # By identity; the track is kept beside its vectors so that its id stays its own.
        self._vectors: dict[int, tuple[Track, FloatArray]] = {}
        self._derivatives: dict[tuple[int, bytes], FloatArray] = {}
        self.memory: dict[object, Any] = {}  # what bound terms keep of this state for themselves

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """The motion of every body, in the problem's order."""
        return self.problem.motions(self.theta)

    @cached_property
    def world(self) -> FloatArray:
        """(j, 4, 4) world_from_joint of all bones of all bodies."""
        return np.concatenate([motion.world for motion in self.motions])

    def vectors(self, track: Track) -> FloatArray:
        """(k, 3) what a track carries here: points, or normals that are not normalised."""
        key = id(track)
        if key not in self._vectors:
            carrier = self._bones if track.width == 4 else self._carriers
            self._vectors[key] = track, track.matrix @ carrier[:, track.columns].T
        return self._vectors[key][1]

    def pull(self, track: Track, forces: FloatArray) -> FloatArray:
        """(d,) gradient of an energy whose derivative by the track's vectors is `forces` (k, 3).

        The virtual work of the forces: accumulated per bone first, so the cost hardly knows d or k.
        """
        per_bone = forces.T @ track.matrix  # (3, width b)
        return self._derivative(track).reshape(len(self.theta), -1) @ per_bone.ravel()

    def quadratic(self, track: Track, gram: FloatArray) -> FloatArray:
        """(d, d) sum_i w_i J_i^T J_i over the track's rows, from `track.gram(w)`; costs nothing per row."""
        d = len(self.theta)
        moved = self._derivative(track)  # (d, 3, width b)
        return (moved.reshape(3 * d, -1) @ gram).reshape(d, -1) @ moved.reshape(d, -1).T

    def jacobian(self, track: Track) -> FloatArray:
        """(k, 3, d) derivative of the track's vectors."""
        d = len(self.theta)
        flat = track.matrix @ self._derivative(track).reshape(3 * d, -1).T  # (k, 3 d)
        return flat.reshape(len(track), d, 3).transpose(0, 2, 1)

    @cached_property
    def _bones(self) -> FloatArray:
        """(3, 4 j) all bone matrices side by side."""
        return self.world[:, :3].transpose(1, 0, 2).reshape(3, -1)

    @cached_property
    def _carriers(self) -> FloatArray:
        """(3, 3 j) what carries outward normals, side by side."""
        linear = self.world[:, :3, :3] if self.problem.is_rigid else outward_carrier(self.world)
        return linear.transpose(1, 0, 2).reshape(3, -1)

    @cached_property
    def _generators(self) -> FloatArray:
        """(d, 3, 4) velocity fields of the free dofs."""
        parts = [m.generators[free] for m, free in zip(self.motions, self.problem.free_of_body, strict=True)]
        return np.concatenate(parts)

    def _derivative(self, track: Track) -> FloatArray:
        """(d, 3, width b) derivative of the bones (or normal carriers) that a track uses."""
        key = (track.width, track.bones.tobytes())
        if key not in self._derivatives:
            d, b = len(self.theta), len(track.bones)
            if track.width == 4:
                fields, carrier = self._generators, self.world.transpose(1, 0, 2)[:, track.bones].reshape(4, -1)
            else:
                linear = self._generators[:, :, :3]
                fields = np.einsum("daa->d", linear)[:, None, None] * np.eye(3) - linear.transpose(0, 2, 1)
                carrier = self._carriers[:, track.columns]
            moved = (fields.reshape(3 * d, -1) @ carrier).reshape(d, 3, b, track.width)
            moved *= self.problem.moves[:, None, track.bones, None]
            self._derivatives[key] = moved.reshape(d, 3, -1)
        return self._derivatives[key]
