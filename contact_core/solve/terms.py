"""The three terms of the paper's objective (eq. 3).

Scale: distances are in units of l = manipulator length / 18 (1 cm on an 18 cm hand), contact points weigh
a_i / A, and the prior is divided by N_ref = 800, so the weights 1, 1, 10 keep the paper's meaning at any
scale and density.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.settings import HasSettings, setting
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.state import PoseState
from contact_core.solve.term import BoundTerm, LeastSquares, PoseTerm

__all__ = [  # what a term is, too: plugins were told to import it from here
    "BoundTerm", "DistanceTerm", "LeastSquares", "NormalTerm", "PoseTerm", "PriorTerm", "paper_terms",
]  # fmt: skip

REFERENCE_COUNT = 800.0  # the paper's typical number of contact points
SMALLEST_DISTANCE = 1e-3  # in l: where reweighting stops sharpening |d|


@dataclass(frozen=True)
class DistanceTerm(HasSettings):
    """(1/A) sum a_i rho(d_i / l) over contact pairs: rho(x) = x^2 ("squares") or x ("paper")."""

    summary: ClassVar[str] = "contact points that are paired come together"
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "distance"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Squares(self, problem) if problem.form == "squares" else _Distances(self, problem)


class _Squares:
    """The squared form: its Gauss-Newton matrix needs one constant gram matrix, whatever the number of points."""

    def __init__(self, term: DistanceTerm, problem: BareProblem) -> None:
        self.gap = problem.pairs.gap
        self.factors = term.weight * problem.pairs.weights / problem.unit**2  # (k,)
        self.gram = self.gap.gram(2.0 * self.factors)

    def value(self, state: PoseState) -> float:
        gap = state.vectors(self.gap)
        return float(self.factors @ np.einsum("ki,ki->k", gap, gap))

    def gradient(self, state: PoseState) -> FloatArray:
        return state.pull(self.gap, 2.0 * self.factors[:, None] * state.vectors(self.gap))

    def normal_matrix(self, state: PoseState) -> FloatArray:
        return state.quadratic(self.gap, self.gram)


class _Distances:
    """The paper's unsquared form, with the reweighting that majorises |d| by a parabola."""

    def __init__(self, term: DistanceTerm, problem: BareProblem) -> None:
        self.gap = problem.pairs.gap
        self.factors = term.weight * problem.pairs.weights / problem.unit  # (k,)
        self.smallest = SMALLEST_DISTANCE * problem.unit

    def value(self, state: PoseState) -> float:
        return float(self.factors @ np.linalg.norm(state.vectors(self.gap), axis=1))

    def gradient(self, state: PoseState) -> FloatArray:
        gap = state.vectors(self.gap)
        length = np.linalg.norm(gap, axis=1)
        unit = np.divide(gap, length[:, None], out=np.zeros_like(gap), where=length[:, None] > 0)
        return state.pull(self.gap, self.factors[:, None] * unit)

    def normal_matrix(self, state: PoseState) -> FloatArray:
        length = np.linalg.norm(state.vectors(self.gap), axis=1)
        return state.quadratic(self.gap, self.gap.gram(self.factors / np.maximum(length, self.smallest)))


@dataclass(frozen=True)
class NormalTerm(HasSettings):
    """(1/A) sum a_i (1 + n_i . n'_i): surfaces that touch face each other. Half the square of n + n'."""

    summary: ClassVar[str] = "surfaces that touch face each other"
    weight: float = setting(1.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "normal"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Normals(self, problem)


class _Normals:
    def __init__(self, term: NormalTerm, problem: BareProblem) -> None:
        self.first, self.second = problem.pairs.manipulator_normals, problem.pairs.object_normals
        self.factors = term.weight * problem.pairs.facing  # (k,)
        # Lengths change little where skin bends and not at all elsewhere: as of the start, they keep the
        # Gauss-Newton matrix constant in the bones. Value and gradient are exact.
        start = problem.start_state
        scaled = [t.scaled(1.0 / _lengths(start.vectors(t))) for t in (self.first, self.second)]
        self.sum = scaled[0].combined(scaled[1])
        self.gram = self.sum.gram(self.factors)

    def value(self, state: PoseState) -> float:
        (u, _), (v, _) = self._units(state)
        both = u + v
        return 0.5 * float(self.factors @ np.einsum("ki,ki->k", both, both))  # never below 0, as 1 + u.v is

    def gradient(self, state: PoseState) -> FloatArray:
        (u, a), (v, b) = self._units(state)
        cosine = np.einsum("ki,ki->k", u, v)[:, None]
        w = self.factors[:, None]
        return state.pull(self.first, w * (v - cosine * u) / a) + state.pull(self.second, w * (u - cosine * v) / b)

    def _units(self, state: PoseState) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
        """Unit normals (k, 3) of both ends and their lengths (k, 1) before; found once per state."""
        kept = state.memory.get(self)
        if kept is None:
            ends = [state.vectors(track) for track in (self.first, self.second)]
            lengths = [_lengths(end)[:, None] for end in ends]
            kept = state.memory[self] = tuple((e / n, n) for e, n in zip(ends, lengths, strict=True))
        return kept

    def normal_matrix(self, state: PoseState) -> FloatArray:
        return state.quadratic(self.sum, self.gram)


def _lengths(vectors: FloatArray) -> FloatArray:
    """(k,) lengths, 1 where a vector vanishes (a normal of a degenerate face pulls nowhere)."""
    length = np.sqrt(np.einsum("ki,ki->k", vectors, vectors))
    return np.where(length > 1e-12, length, 1.0)


@dataclass(frozen=True)
class PriorTerm(HasSettings):
    """(1/N_ref) sum_j w_j rho(theta_j - prior_j) over the dofs that do not place the whole manipulator."""

    summary: ClassVar[str] = "joints stay near the pose that they start from, or rest"
    weight: float = setting(10.0, low=0.0, help="how much it counts beside the other terms")
    name: str = "prior"

    def bind(self, problem: BareProblem) -> BoundTerm:
        return _Prior(self, problem)


class _Prior:
    def __init__(self, term: PriorTerm, problem: BareProblem) -> None:
        self.prior = problem.prior_theta
        self.factors = term.weight / REFERENCE_COUNT * problem.prior_weights  # (d,)
        self.squares = problem.form == "squares"

    def value(self, state: PoseState) -> float:
        away = state.theta - self.prior
        return float(self.factors @ (away * away if self.squares else np.abs(away)))

    def gradient(self, state: PoseState) -> FloatArray:
        away = state.theta - self.prior
        return self.factors * (2.0 * away if self.squares else np.sign(away))

    def normal_matrix(self, state: PoseState) -> FloatArray:
        if self.squares:
            return np.diag(2.0 * self.factors)
        return np.diag(self.factors / np.maximum(np.abs(state.theta - self.prior), SMALLEST_DISTANCE))


def paper_terms(distance: float = 1.0, normal: float = 1.0, prior: float = 10.0) -> tuple[PoseTerm, ...]:
    """The objective of the paper with its weights; a weight of 0 leaves the term out."""
    terms = (DistanceTerm(distance), NormalTerm(normal), PriorTerm(prior))
    return tuple(term for term in terms if term.weight > 0.0)
