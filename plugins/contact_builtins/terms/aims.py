"""Pin and look: an artist's own wishes beside the contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.rig.skinning import joint_track
from contact_core.rig.track import Track
from contact_core.settings import HasSettings, setting
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm, LeastSquares

if TYPE_CHECKING:
    from contact_core.solve.bare_problem import BareProblem

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Pin:
    """A point of a joint (joint space) that shall be at a target (world)."""

    body: str
    joint: str
    target: Vector
    point: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Look:
    """An axis of a joint (joint space) that shall point at a target (world)."""

    body: str
    joint: str
    target: Vector
    axis: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class PinTerm(HasSettings):
    """Mean over the pins of (distance / l)^2."""

    summary: ClassVar[str] = "points of joints come to their targets"
    pins: tuple[Pin, ...] = ()
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "pin"

    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies that are pinned, each once: they take part in a solve though no pair names them."""
        return tuple(dict.fromkeys(pin.body for pin in self.pins))

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Pins(self, problem)


class _Pins(LeastSquares):
    def __init__(self, term: PinTerm, problem: BareProblem) -> None:
        if not term.pins:
            raise InvalidInput("the pin term needs at least one Pin(body, joint, target).")
        self.tracks = [joint_track(*_place(problem, pin.body, pin.joint, [pin.point])) for pin in term.pins]
        self.targets = np.array([pin.target for pin in term.pins], float)  # (p, 3)
        self.factor = np.sqrt(2.0 * term.weight / len(term.pins)) / problem.unit

    def residuals(self, state: PoseState) -> FloatArray:
        points = np.concatenate([state.vectors(track) for track in self.tracks])
        return self.factor * (points - self.targets).ravel()

    def jacobian(self, state: PoseState) -> FloatArray:
        moved = np.concatenate([state.jacobian(track) for track in self.tracks])  # (p, 3, d)
        return self.factor * moved.reshape(-1, moved.shape[2])


@dataclass(frozen=True)
class LookTerm(HasSettings):
    """Mean over the looks of 1 - cosine between the axis and the direction to the target."""

    summary: ClassVar[str] = "axes of joints point at their targets"
    looks: tuple[Look, ...] = ()
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "look"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Looks(self, problem)


class _Looks(LeastSquares):
    """Half the square of the difference of two unit vectors is one minus their cosine."""

    def __init__(self, term: LookTerm, problem: BareProblem) -> None:
        if not term.looks:
            raise InvalidInput("the look term needs at least one Look(body, joint, target).")
        origin = (0.0, 0.0, 0.0)
        self.tracks = [
            joint_track(*_place(problem, look.body, look.joint, [origin, look.axis])) for look in term.looks
        ]
        self.targets = np.array([look.target for look in term.looks], float)  # (p, 3)
        self.factor = np.sqrt(term.weight / len(term.looks))

    def residuals(self, state: PoseState) -> FloatArray:
        return self.factor * np.concatenate(
            [self._axis(state, track)[0] - self._toward(state, i)[0] for i, track in enumerate(self.tracks)]
        )

    def jacobian(self, state: PoseState) -> FloatArray:
        rows = []
        for i, track in enumerate(self.tracks):
            base, tip = state.jacobian(track)  # (3, d) each
            turning = self._axis(state, track)[1] @ (tip - base)
            rows.append(turning + self._toward(state, i)[1] @ base)  # the target stays, the eye moves
        return self.factor * np.concatenate(rows)

    def _axis(self, state: PoseState, track: Track) -> tuple[FloatArray, FloatArray]:
        base, tip = state.vectors(track)
        return _unit(tip - base)

    def _toward(self, state: PoseState, index: int) -> tuple[FloatArray, FloatArray]:
        return _unit(self.targets[index] - state.vectors(self.tracks[index])[0])


def _unit(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The unit vector (3,) and its derivative by the vector (3, 3)."""
    length = float(np.linalg.norm(vector)) or 1.0
    unit = vector / length
    return unit, (np.eye(3) - np.outer(unit, unit)) / length


def _place(problem: BareProblem, body: str, joint: str, points: list[Vector]) -> tuple[IntArray, FloatArray, int]:
    """Joint indices, local points and first bone for `joint_track`."""
    index = problem.body_index(body)
    number = problem.bodies[index].rig.joint_index(joint)
    return np.full(len(points), number), np.array(points, float), int(problem.bone_offsets[index])
