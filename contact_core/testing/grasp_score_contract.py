"""The contract of grasp scores. Subclass it and give the fixture `score`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contact_core.grasping.slots import KINDS, GraspFacts, GraspScore, Kind
from contact_core.testing.contract import Contract
from contact_core.testing.settings_checks import check_settings

GOOD: dict[str, Any] = {
    "mean_contact_distance": 0.006,
    "p95_contact_distance": 0.015,
    "gap": 0.004,
    "opposed_normals": 0.99,
    "opposed_normals_45": 0.8,
    "worst_patch_opposed_45": 0.6,
    "max_penetration": 0.004,
    "skin_inside": 0.01,
    "bones_through": 0,
    "skin_stretch_p99": 1.4,
    "max_joint_change_deg": 60.0,
    "contacts": 400,
    "patches": {},
    "pads_placed": 1.0,
    "digits_in_contact": 5,
    "digits_wanted": 5,
    "thumb_in_contact": True,
    "skin_through": 0.005,
    "uneven_curl_deg": 15.0,
    "opposition_deg": 150.0,
    "thumb_along": 0.0,
    "thumb_away": 0.0,
    "crossing": 0.0,
    "digits_through": 0,
    "through_loop": [],
    "loops_held": 0,
    "closure": 0.1,
}


def facts(kind: Kind = "power", **others: Any) -> GraspFacts:
    """A good grasp, or one with other metrics."""
    return GraspFacts(kind, {**GOOD, **others}, closure=0.1, comfort=0.85, clearance=1.0, failures=())


class GraspScoreContract(Contract):
    """Fixture: `score`, a GraspScore."""

    about, letter = "grasp score", "R"

    def test_r01_is_named(self, score: GraspScore) -> None:
        """Has a name and says in a sentence what it does."""
        assert score.name == score.name.strip() != ""
        assert len(score.summary.split()) >= 3, score.summary

    @pytest.mark.parametrize("kind", KINDS)
    def test_r02_is_a_number(self, score: GraspScore, kind: Kind) -> None:
        """Gives a finite number for every kind, also where nothing could be measured or nothing touches."""
        nothing = dict.fromkeys(key for key in GOOD if "contact_distance" in key or "opposed" in key)
        for asked in (
            facts(kind),
            facts(kind, **nothing, pads_placed=0.0, digits_in_contact=0, max_penetration=None),
        ):
            assert np.isfinite(float(score.score(asked)))

    def test_r03_is_deterministic(self, score: GraspScore) -> None:
        """The same facts give the same score, to the bit."""
        assert score.score(facts()) == score.score(facts())

    @pytest.mark.parametrize("kind", KINDS)
    def test_r04_failures_cost(self, score: GraspScore, kind: Kind) -> None:
        """A grasp that fails is worse than the same that does not, and more so the more it fails."""
        values = [score.score(replace(facts(kind), failures=("it slips.",) * count)) for count in range(4)]
        assert values == sorted(values, reverse=True) and len(set(values)) == 4, values

    @pytest.mark.parametrize(
        "worse",
        [
            {"mean_contact_distance": 0.02},
            {"pads_placed": 0.5},
            {"digits_in_contact": 2},
        ],
    )
    def test_r05_more_contact_is_no_worse(self, score: GraspScore, worse: dict[str, Any]) -> None:
        """Pads farther away, fewer of them, or fewer digits that touch never raise the score."""
        assert score.score(facts(**worse)) <= score.score(facts())

    def test_r06_declares_its_settings(self, score: GraspScore) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(score)
