"""The built-in sampler and score keep their contracts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from contact_builtins.grasps.around import Around
from contact_builtins.grasps.balanced import Balanced
from contact_core.grasping.slots import GraspSampler, GraspScore
from contact_core.testing.grasp_sampler_contract import GraspSamplerContract
from contact_core.testing.grasp_score_contract import GraspScoreContract, facts


class TestAround(GraspSamplerContract):
    @pytest.fixture
    def sampler(self) -> GraspSampler:
        return Around(places=30, most=120)


class TestBalanced(GraspScoreContract):
    @pytest.fixture
    def score(self) -> GraspScore:
        return Balanced()


def test_what_hangs_on_a_limit_ranks_below_what_is_clear_of_it() -> None:
    score, clear = Balanced(), facts("power")
    assert score.score(replace(clear, margin=0.0)) < score.score(replace(clear, margin=0.5)) < score.score(clear)
    assert score.score(replace(clear, failures=("it slips.",))) < score.score(replace(clear, margin=0.0))


def test_a_thumb_along_a_rod_ranks_below_one_across_it_but_not_in_a_pinch() -> None:
    score = Balanced()
    assert score.score(facts("power", thumb_along=0.9)) < score.score(facts("power"))
    assert score.score(facts("pinch", thumb_along=0.9)) == score.score(facts("pinch"))
