"""A term by which skin that is stretched costs: thumbs and fingers stay where the web between them can follow."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.rig.rig import Rig
from contact_core.rig.skinning import vertex_track
from contact_core.rig.track import Track
from contact_core.settings import HasSettings, setting
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.body import uniform_scale
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm

_SHARE = 0.01  # of the skin's edges: they are what a verdict looks at (`grasping.metrics`, its 99th percentile)
_MOST = 0.02  # by which blends of two ends differ, below which an edge stretches with no pose worth speaking of


@dataclass(frozen=True, eq=False)
class SkinStretchTerm(HasSettings):
    """sum_e max(0, |d_e| / L_e - allowed)^2 / (0.01 E) over the E edges of the skin, L_e their lengths at rest.

    A hundredth of the edges stretched by their length more than is allowed costs as much as all contacts one l
    apart. Edges whose ends are carried alike never stretch; of the others at most `samples` stand for all.
    """

    summary: ClassVar[str] = "skin is not torn between joints that move apart"
    reads_contacts: ClassVar[bool] = False
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    allowed: float = setting(1.4, low=1.0, help="posed by rest length up to which stretch costs nothing")
    samples: int = setting(1500, low=10, high=1_000_000, help="how many edges stand for the skin of a body")
    name: str = field(default="stretch")

    def bind(self, problem: BareProblem) -> BoundTerm:
        skins = []
        for index, body in enumerate(problem.bodies):
            if body.black_box is None and len(body.rig.joints) > 1 and len(problem.free_of_body[index]):
                edges, share = stretching_edges(body.rig, self.samples)
                offset = int(problem.bone_offsets[index])
                first, second = (vertex_track(body.rig, edges[:, side], offset) for side in (0, 1))
                points = body.rig.surface.points
                lengths = uniform_scale(body.world_from_rig) * np.linalg.norm(
                    points[edges[:, 1]] - points[edges[:, 0]], axis=1
                )
                free = (self.allowed * lengths) ** 2
                skins.append(_Edges(second.combined(first, -1.0), lengths, free, self.weight * share / _SHARE))
        return _Stretch(skins, self.allowed)


class _Edges(NamedTuple):
    """Edges of one skin as vectors: their track, rest lengths (e,), squares of lengths that cost nothing (e,), and
    what each counts."""

    track: Track
    lengths: FloatArray
    free: FloatArray
    weight: float


@dataclass(frozen=True, eq=False)
class _TooLong:
    """What is too long of one skin: rows (k,) of its edges, by how much they are stretched beyond what is allowed
    (k,), and which way per length (k, 3)."""

    skin: _Edges
    rows: IntArray
    excess: FloatArray
    along: FloatArray

    @cached_property
    def track(self) -> Track:
        """The track of those edges."""
        return self.skin.track.rows(self.rows)


class _Stretch:
    """Weighted squares of what edges are stretched beyond `allowed`."""

    def __init__(self, skins: list[_Edges], allowed: float) -> None:
        self.skins, self.allowed = skins, allowed

    def value(self, state: PoseState) -> float:
        return sum(found.skin.weight * float(found.excess @ found.excess) for found in self._found(state))

    def gradient(self, state: PoseState) -> FloatArray:
        result = np.zeros(len(state.theta))
        for found in self._found(state):
            forces = 2.0 * found.skin.weight * found.excess[:, None] * found.along
            result += state.pull(found.track, forces)
        return result

    def normal_matrix(self, state: PoseState) -> FloatArray:
        result = np.zeros((len(state.theta), len(state.theta)))
        for found in self._found(state):
            along = np.einsum("ki,kid->kd", found.along, state.jacobian(found.track))
            result += 2.0 * found.skin.weight * along.T @ along
        return result

    def _found(self, state: PoseState) -> list[_TooLong]:
        """Per skin that has any, what is too long; found once per state."""
        kept: list[_TooLong] | None = state.memory.get(self)
        if kept is None:
            kept = [found for found in (self._too_long(state, skin) for skin in self.skins) if len(found.rows)]
            state.memory[self] = kept
        return kept

    def _too_long(self, state: PoseState, skin: _Edges) -> _TooLong:
        vectors = state.vectors(skin.track)
        squares = np.einsum("ei,ei->e", vectors, vectors)
        rows = np.flatnonzero(squares > skin.free)
        lengths, rest = np.sqrt(squares[rows]), skin.lengths[rows]
        return _TooLong(skin, rows, lengths / rest - self.allowed, vectors[rows] / (lengths * rest)[:, None])


def stretching_edges(rig: Rig, count: int) -> tuple[IntArray, float]:
    """At most `count` edges (e, 2) of a skin whose ends are carried differently, evenly chosen, and the share of
    all edges that each stands for. Read-only, and kept with the rig's surface."""
    kept = _chosen.setdefault(rig.surface, {})
    if count not in kept:
        kept[count] = _choose(rig, count)
    return kept[count]


_chosen: WeakKeyDictionary[object, dict[int, tuple[IntArray, float]]] = WeakKeyDictionary()


def _choose(rig: Rig, count: int) -> tuple[IntArray, float]:
    faces = rig.faces
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    points = rig.surface.points
    lengths = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    edges = edges[lengths > 1e-6 * rig.surface.bounding_box_diagonal]
    blends = np.zeros((len(points), len(rig.joints)))
    np.add.at(blends, (np.arange(len(points))[:, None], rig.skin_joints), rig.skin_weights)
    differ = np.abs(blends[edges[:, 0]] - blends[edges[:, 1]]).max(axis=1) > _MOST
    moving = edges[differ]
    if not len(moving):
        return moving, 0.0
    step = max(len(moving) / count, 1.0)
    chosen = moving[np.arange(0.0, len(moving), step).astype(int)]
    chosen.setflags(write=False)
    return chosen, step / len(edges)
