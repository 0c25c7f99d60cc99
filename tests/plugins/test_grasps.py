"""The built-in sampler and score keep their contracts."""

from __future__ import annotations

import pytest

from contact_builtins.grasps.around import Around
from contact_builtins.grasps.balanced import Balanced
from contact_core.grasping.slots import GraspSampler, GraspScore
from contact_core.testing.grasp_sampler_contract import GraspSamplerContract
from contact_core.testing.grasp_score_contract import GraspScoreContract


class TestAround(GraspSamplerContract):
    @pytest.fixture
    def sampler(self) -> GraspSampler:
        return Around(places=30, most=120)


class TestBalanced(GraspScoreContract):
    @pytest.fixture
    def score(self) -> GraspScore:
        return Balanced()
