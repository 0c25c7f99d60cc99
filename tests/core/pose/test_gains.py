"""Gains: what is on does not change how strong the others are, and nothing needs to be on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.errors import InvalidInput
from contact_core.rig.track import Track
from contact_core.solve.body import PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.terms import DistanceTerm, NormalTerm
from contact_core.testing import rigs


def two_contacts(first: float, second: float) -> PoseProblem:
    problem, _ = rigs.planted(rigs.tentacle(4, rigs.limited_freedom), 3, contacts=60)
    (whole,) = problem.contacts
    halves = [
        PairedPoints(
            name, whole.manipulator, whole.manipulator_points[rows], whole.object, whole.object_points[rows],
            gain=gain,
        )
        for name, rows, gain in (("a", slice(0, 20), first), ("b", slice(20, 60), second))
    ]  # fmt: skip
    return replace(problem, contacts=tuple(halves), terms=(DistanceTerm(), NormalTerm()))


@pytest.mark.parametrize("gains", [(1.0, 0.0), (0.25, 1.0), (1e-6, 1e-6), (0.0, 0.0), (2.0, 3.0)])
def test_the_objective_is_linear_in_the_gains(gains: tuple[float, float]) -> None:
    def value(*gain: float) -> float:
        problem = two_contacts(*gain)
        return problem.value(problem.start_state)

    assert value(*gains) == pytest.approx(gains[0] * value(1.0, 0.0) + gains[1] * value(0.0, 1.0), rel=1e-12)


def test_gains_of_one_average_over_all_weights() -> None:
    assert two_contacts(1.0, 1.0).pairs.weights.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("contacts", ["none", "off", "weightless"])
def test_without_an_active_contact_the_prior_alone_counts(contacts: str) -> None:
    problem, theta = rigs.planted(rigs.tentacle(4, rigs.limited_freedom), 3, contacts=60)
    (whole,) = problem.contacts
    kept = {
        "none": (),
        "off": (replace(whole, gain=0.0),),
        "weightless": (replace(whole, weights=np.zeros(60)),),
    }
    bent = replace(problem.at(theta), contacts=kept[contacts], prior="rest")
    solution = LevenbergMarquardt().solve(bent)
    held = bent.prior_weights > 0.0
    assert np.abs(bent.start[held]).max() > 0.1
    assert np.abs(solution.theta[held]).max() < 1e-6
    assert np.array_equal(solution.theta[~held], bent.start[~held])
    assert len(bent.state(theta).vectors(Track.empty(4))) == 0


@pytest.mark.parametrize("gain", [-0.1, np.inf, np.nan])
def test_a_gain_is_a_number_from_zero_up(gain: float) -> None:
    whole = two_contacts(1.0, 1.0).contacts[0]
    with pytest.raises(InvalidInput, match="gain of contact 'a'"):
        replace(whole, gain=gain)
