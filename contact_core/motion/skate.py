"""Skate: how fast contact points slip over what they hold, seen from the object.

Seen from the world a held point moves with the object; seen from the object it must not move at all. The gap of
each pair is therefore measured in the frame of the bone that carries its object point, and skate is how the gap
changes from frame to frame. Targets that slide on purpose take the gap along, so only what lags behind them costs.
A contact that fades in or out is on its way and holds nothing yet: its approach is no slip.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.motion.band import BlockBand
from contact_core.motion.depth import HELD
from contact_core.rig.track import Track
from contact_core.solve.problem import PoseProblem
from contact_core.solve.state import PoseState


class ObjectGaps:
    """The gaps of one frame's problem in the frames of the objects. bone: (k,) carries each object point, as an
    index into `axes`, the track of the three axes of each bone, one below the other."""

    def __init__(self, problem: PoseProblem) -> None:
        track = problem.pairs.object_points
        if len(track.bones):
            strength = np.linalg.norm(track.blocks, axis=2)  # (k, b)
            bones, self.bone = np.unique(track.bones[strength.argmax(axis=1)], return_inverse=True)
        else:
            bones, self.bone = np.zeros(0, np.int64), np.zeros(len(track), np.int64)
        self.is_placed = len(bones) > 0  # what black boxes evaluate has no bones: seen from the world
        self.axes = Track.axes(bones)
        self.gap = problem.pairs.gap

    def values(self, state: PoseState) -> FloatArray:
        """(k, 3)"""
        gap = state.vectors(self.gap)
        return np.einsum("kai,ki->ka", self._frames(state)[0][self.bone], gap) if self.is_placed else gap

    def jacobian(self, state: PoseState) -> FloatArray:
        """(k, 3, d)"""
        moved = state.jacobian(self.gap)
        if not self.is_placed:
            return moved
        frames, lengths = self._frames(state)
        result = frames[self.bone] @ moved
        if not state.layout.is_still(self.axes):
            turned = state.jacobian(self.axes).reshape(-1, 3, 3, moved.shape[2]) / lengths[:, :, None, None]
            result += np.einsum("kaid,ki->kad", turned[self.bone], state.vectors(self.gap))
        return np.asarray(result)

    def _frames(self, state: PoseState) -> tuple[FloatArray, FloatArray]:
        """(b, 3, 3) the axes of the bones as rows, world, unit; their lengths (b, 3) before."""
        axes = state.vectors(self.axes).reshape(-1, 3, 3)
        lengths = np.linalg.norm(axes, axis=2)
        return axes / lengths[:, :, None], lengths


@dataclass(frozen=True, eq=False)
class Slip:
    """What is held from one frame to the next: rows of the pairs at both, and the weight (k,) of each."""

    before: IntArray
    then: IntArray
    weights: FloatArray


def held_rows(before: PoseProblem, then: PoseProblem) -> Slip:
    """The points of the contacts that are fully on in both problems (gain from `HELD`, as the report counts them),
    paired by name, with as many points in both. Weights are shares of all contacts' weights, times the gain."""
    first, second, weights = [], [], []
    total = sum(float(contact.weights.sum()) for contact in then.contacts)
    known = {contact.name: contact for contact in before.contacts}
    for contact in then.contacts:
        other = known.get(contact.name)
        if other is None or len(other.weights) != len(contact.weights) or contact.hold == "direction":
            continue
        gain = min(other.gain, contact.gain)
        if gain >= HELD and total > 0.0:
            ends = before.pairs.rows[contact.name], then.pairs.rows[contact.name]
            first.append(np.arange(ends[0].start, ends[0].stop))
            second.append(np.arange(ends[1].start, ends[1].stop))
            weights.append(gain * contact.weights / total)
    whole = np.zeros(0, np.int64)
    return Slip(
        np.concatenate([whole, *first]), np.concatenate([whole, *second]), np.concatenate([np.zeros(0), *weights])
    )


class SkateEnergy:
    """sum over frames of weight / gap time * sum_i w_i |gap'_i - gap_i|^2 / l^2: the integral of squared speeds."""

    def __init__(self, problems: tuple[PoseProblem, ...], gaps: FloatArray, weight: float) -> None:
        self.problems, self.time, self.weight = problems, gaps, weight
        self.unit = problems[0].unit

    @cached_property
    def seen(self) -> list[ObjectGaps]:
        """Per frame."""
        return [ObjectGaps(problem) for problem in self.problems]

    @cached_property
    def held(self) -> list[Slip]:
        """Per step."""
        return [held_rows(a, b) for a, b in zip(self.problems[:-1], self.problems[1:], strict=True)]

    def value(self, states: list[PoseState]) -> float:
        """The energy."""
        if self.weight <= 0.0:
            return 0.0
        gaps = [seen.values(state) for seen, state in zip(self.seen, states, strict=True)]
        return sum(float(factors @ np.einsum("ki,ki->k", slip, slip)) for _, factors, slip in self._slips(gaps))

    def add_model(self, states: list[PoseState], gradient: FloatArray, matrix: BlockBand) -> None:
        """Add the derivative to gradient (n, d) and the Gauss-Newton model to the matrix."""
        if self.weight <= 0.0:
            return
        gaps = [seen.values(state) for seen, state in zip(self.seen, states, strict=True)]
        d = gradient.shape[1]
        moved: tuple[int, FloatArray] = (-1, np.zeros(0))  # of the last frame: only two are kept at a time
        for f, factors, slip in self._slips(gaps):
            held = self.held[f]
            before = moved[1] if moved[0] == f else self.seen[f].jacobian(states[f])
            then = self.seen[f + 1].jacobian(states[f + 1])
            moved = f + 1, then
            root = np.sqrt(2.0 * factors)[:, None]
            first = (root[:, :, None] * before[held.before]).reshape(-1, d)
            second = (root[:, :, None] * then[held.then]).reshape(-1, d)
            residual = (root * slip).ravel()
            gradient[f] -= residual @ first
            gradient[f + 1] += residual @ second
            matrix.own[f] += first.T @ first
            matrix.own[f + 1] += second.T @ second
            matrix.next[f] -= second.T @ first

    def _slips(self, gaps: list[FloatArray]) -> list[tuple[int, FloatArray, FloatArray]]:
        """Steps on which anything is held, their factors (k,) and slips (k, 3)."""
        result = []
        for f, held in enumerate(self.held):
            if len(held.weights):
                factors = self.weight / (self.time[f] * self.unit**2) * held.weights
                result.append((f, factors, gaps[f + 1][held.then] - gaps[f][held.before]))
        return result
