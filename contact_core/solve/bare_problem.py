"""A pose problem without its terms: what terms are made ready for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose
from contact_core.solve.extent import length_of
from contact_core.solve.layout import DofLayout
from contact_core.solve.pairs import KeptEnds, KeptTracks, Pairs, pairs_of
from contact_core.solve.state import PoseState

Form = Literal["squares", "paper"]


@dataclass(frozen=True, eq=False)
class BareProblem(DofLayout):
    """Bodies, contact pairs, what may move, near which prior.

    prior: "rest", "current" or poses by body. form: rho(x) = x^2 ("squares") or |x| ("paper"). length: manipulator
    length when it shall not be measured.
    """

    _: KW_ONLY
    prior: Literal["rest", "current"] | Mapping[str, Pose] = "rest"
    form: Form = "squares"
    length: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.form not in ("squares", "paper"):
            raise InvalidInput(f'form is "squares" or "paper", but got {self.form!r}.')
        if isinstance(self.prior, str) and self.prior not in ("rest", "current"):
            raise InvalidInput(f'the prior is "rest", "current" or poses by body, but got {self.prior!r}.')

    @cached_property
    def manipulator_length(self) -> float:
        """Largest rest extent of the skin that the free joints drive, world units (over all bodies)."""
        if self.length is not None:
            return float(self.length)
        return length_of(self)

    @cached_property
    def unit(self) -> float:
        """l: the length that distances are measured in, a centimetre on an 18 cm hand."""
        return self.manipulator_length / 18.0

    @cached_property
    def scale(self) -> FloatArray:
        """(d,) natural size of each dof: 1 radian, or the manipulator's length."""
        return np.where(self.is_translation, self.manipulator_length, 1.0)

    @cached_property
    def prior_weights(self) -> FloatArray:
        """(d,) the rigs' prior weights; 0 for dofs that place a whole body (the paper's first modification)."""
        return np.where(self.is_root, 0.0, self._gather([c.prior_weight for c in self.charts]))

    @cached_property
    def prior_theta(self) -> FloatArray:
        """(d,) where the prior pulls to."""
        if self.prior == "rest":
            return np.zeros(len(self.start))
        if self.prior == "current":
            return self.start
        for name in self.prior:
            self.body_index(name)
        thetas = [
            chart.theta_of(self.prior[body.name])[0] if body.name in self.prior else np.zeros(chart.size)
            for body, chart in zip(self.bodies, self.charts, strict=True)
        ]
        return self._gather(thetas)

    @cached_property
    def start_state(self) -> PoseState:
        """The state at the start."""
        return self.state(self.start)

    def state(self, theta: FloatArray) -> PoseState:
        """All bodies at theta (d,)."""
        return PoseState(self, theta)

    @cached_property
    def pairs(self) -> Pairs:
        """The contact pairs as tracks."""
        return pairs_of(self, self.kept_tracks, self.kept_ends)

    @cached_property
    def kept_tracks(self) -> KeptTracks:
        """Tracks of points that lie still on their bodies, for the problems that continue this one."""
        return {}

    @cached_property
    def kept_ends(self) -> KeptEnds:
        """The same, of one end of all contacts."""
        return {}
