"""What a term of the pose objective is.

A term is a few lines: `bind` makes once per problem what does not change during a solve, and returns something that
gives value, gradient and Gauss-Newton matrix at a state. A term that is a sum of squares can subclass
`LeastSquares` and give residuals and their Jacobian only. The paper's three are in `terms`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol, runtime_checkable

from contact_core.arrays import FloatArray
from contact_core.solve.bare_problem import BareProblem
from contact_core.solve.state import PoseState


class BoundTerm(Protocol):
    """A term made ready for one problem. The term's weight is already inside."""

    def value(self, state: PoseState) -> float: ...

    def gradient(self, state: PoseState) -> FloatArray:
        """(d,) exact derivative of `value`."""
        ...

    def normal_matrix(self, state: PoseState) -> FloatArray:
        """(d, d) positive semidefinite model of the second derivative (Gauss-Newton or a majoriser)."""
        ...


@runtime_checkable
class PoseTerm(Protocol):
    """One term of the objective (hook `contact_pose_terms`, which takes classes: a problem makes its own).

    Settings, the weight among them, are fields, see `contact_core.settings`; data such as solids are other fields.
    A class whose `bind` reads neither the contacts nor the start may say `reads_contacts = False`: it then stays
    bound while contacts are dragged (`PoseProblem.continued`).
    """

    @property
    def name(self) -> str: ...

    @property
    def summary(self) -> str: ...

    @property
    def weight(self) -> float: ...

    def bind(self, problem: BareProblem) -> BoundTerm:
        """Make ready for one problem. Raises InvalidInput when the problem lacks what the term needs."""
        ...


class LeastSquares(ABC):
    """A bound term 1/2 |r|^2 out of residuals r and their Jacobian."""

    @abstractmethod
    def residuals(self, state: PoseState) -> FloatArray:
        """(m,)"""

    @abstractmethod
    def jacobian(self, state: PoseState) -> FloatArray:
        """(m, d)"""

    def value(self, state: PoseState) -> float:
        r = self.residuals(state)
        return 0.5 * float(r @ r)

    def gradient(self, state: PoseState) -> FloatArray:
        return self.residuals(state) @ self.jacobian(state)

    def normal_matrix(self, state: PoseState) -> FloatArray:
        jacobian = self.jacobian(state)
        return jacobian.T @ jacobian
