"""Self-collision: capsules of one skinned body that overlap cost the square of their depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.rig.capsules import Capsules, closest_on_segments, fit_capsules
from contact_core.rig.skinning import joint_track
from contact_core.rig.track import Track
from contact_core.settings import HasSettings, setting
from contact_core.solve.body import uniform_scale
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm, LeastSquares

if TYPE_CHECKING:
    from contact_core.solve.bare_problem import BareProblem


@dataclass(frozen=True)
class SelfCollisionTerm(HasSettings):
    """Mean over a body's capsules of (depth / l)^2, summed over pairs that are apart at rest."""

    summary: ClassVar[str] = "parts of one body stay out of each other"
    reads_contacts: ClassVar[bool] = False
    weight: float = setting(5.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "self-collision"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _SelfCollision(self, problem)


@dataclass(frozen=True, eq=False)
class _Capsuled:
    """One body: the track of all capsule ends (2c rows), radii (c,), pairs (p, 2)."""

    ends: Track
    radii: FloatArray
    pairs: IntArray


@dataclass(frozen=True, eq=False)
class _Overlap:
    """Overlapping pairs: the track of the vectors between closest points, those vectors, depths."""

    between: Track
    direction: FloatArray
    depth: FloatArray


class _SelfCollision(LeastSquares):
    def __init__(self, term: SelfCollisionTerm, problem: BareProblem) -> None:
        self.bodies = []
        for index, body in enumerate(problem.bodies):
            if len(body.rig.joints) > 1 and len(problem.free_of_body[index]):
                capsules = fit_capsules(body.rig)
                joints = np.repeat(capsules.joints, 2)
                track = joint_track(joints, capsules.ends.reshape(-1, 3), int(problem.bone_offsets[index]))
                self.bodies.append(
                    _Capsuled(
                        track,
                        uniform_scale(body.world_from_rig) * capsules.radii,
                        _moving(problem, index, capsules),
                    )
                )
        if not self.bodies:
            raise InvalidInput("the self-collision term needs a skinned body that moves, but the problem has none.")
        count = sum(len(body.radii) for body in self.bodies)
        self.factor = np.sqrt(2.0 * term.weight / max(count, 1)) / problem.unit

    def residuals(self, state: PoseState) -> FloatArray:
        return self.factor * np.concatenate([overlap.depth for overlap in self._overlaps(state)])

    def jacobian(self, state: PoseState) -> FloatArray:
        rows = [
            -np.einsum("pi,pid->pd", overlap.direction, state.jacobian(overlap.between))
            for overlap in self._overlaps(state)
        ]
        return self.factor * np.concatenate(rows)

    def _overlaps(self, state: PoseState) -> list[_Overlap]:
        """Per body; found once per state. Where on the segments two capsules come closest does not vary to first
        order in their distance, so the closest points count as fixed to their joints."""
        kept: list[_Overlap] | None = state.memory.get(self)
        if kept is None:
            kept = state.memory[self] = [_overlap(state, body) for body in self.bodies]
        return kept


def _moving(problem: BareProblem, index: int, capsules: Capsules) -> IntArray:
    """(p, 2) the pairs whose capsules can move against one another: between them a joint is free. A body whose
    hand alone is posed has few such."""
    body, chart = problem.bodies[index], problem.charts[index]
    if body.black_box is not None:
        return capsules.pairs
    free = np.zeros(len(body.rig.joints), bool)
    free[chart.joint_of_dof[problem.free_of_body[index]]] = True
    part = np.full(len(free), -1)  # by joint, the nearest free one at or above it; a root moves all alike
    for joint, parent in enumerate(body.rig.parents):
        if parent >= 0:
            part[joint] = joint if free[joint] else part[parent]
    first, second = part[capsules.joints[capsules.pairs]].T
    return capsules.pairs[first != second]


def _overlap(state: PoseState, body: _Capsuled) -> _Overlap:
    ends = state.vectors(body.ends).reshape(-1, 2, 3)
    first, second = body.pairs.T
    share = closest_on_segments(ends[first], ends[second])  # (p, 2)
    between = _at(ends, first, share[:, 0]) - _at(ends, second, share[:, 1])
    distance = np.linalg.norm(between, axis=1)
    depth = body.radii[first] + body.radii[second] - distance
    deep = (depth > 0.0) & (distance > 0.0)  # axes that cross have no direction to part in
    first, second, share = first[deep], second[deep], share[deep]
    track = _rows_at(body.ends, first, share[:, 0]).combined(_rows_at(body.ends, second, share[:, 1]), -1.0)
    return _Overlap(track, between[deep] / distance[deep, None], depth[deep])


def _at(ends: FloatArray, index: IntArray, share: FloatArray) -> FloatArray:
    return (1.0 - share)[:, None] * ends[index, 0] + share[:, None] * ends[index, 1]


def _rows_at(ends: Track, index: IntArray, share: FloatArray) -> Track:
    return ends.rows(2 * index).scaled(1.0 - share).combined(ends.rows(2 * index + 1).scaled(share))
