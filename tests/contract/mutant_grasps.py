"""Grasp samplers and scores, each broken in one way. `test_grasp_mutants` judges them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from contact_builtins.grasps.around import Around
from contact_builtins.grasps.balanced import Balanced
from contact_core.grasping.slots import Approaches, GraspFacts, GraspRequest
from contact_core.testing.grasp_sampler_contract import GraspSamplerContract
from contact_core.testing.grasp_score_contract import GraspScoreContract
from contact_core.testing.mutants import Mutant

# -- samplers ------------------------------------------------------------------------------------------------------


class Mirrored(Around):
    """Puts a left hand where the right one was asked for."""

    def sample(self, request: GraspRequest) -> Approaches:
        found = super().sample(request)
        return replace(found, placed=found.placed @ np.diag([-1.0, 1.0, 1.0, 1.0]))


class AllKinds(Around):
    """Does not listen to what is wanted."""

    def sample(self, request: GraspRequest) -> Approaches:
        return super().sample(replace(request, kinds=("power", "precision")))


class Restless(Around):
    """Another seed every time."""

    seeds = count()

    def sample(self, request: GraspRequest) -> Approaches:
        return super().sample(replace(request, seed=next(self.seeds)))


class FarAway(Around):
    """Takes the hand's units for others."""

    def sample(self, request: GraspRequest) -> Approaches:
        found = super().sample(request)
        placed = found.placed.copy()
        placed[:, :3, 3] += 20.0 * request.hand.length
        return replace(found, placed=placed, ways=np.zeros_like(found.ways))


class Anywhere(Around):
    """Forgets where."""

    def sample(self, request: GraspRequest) -> Approaches:
        return super().sample(replace(request, at=None))


class SamplerMutant(Mutant, GraspSamplerContract):
    made: type[Around]

    @pytest.fixture
    def sampler(self) -> Around:
        return self.made(places=30, most=120)


class TestMirrored(SamplerMutant):
    made, breaks = Mirrored, "G02"
    consequences: Sequence[str] = ("G05", "G06")


class TestAllKinds(SamplerMutant):
    made, breaks = AllKinds, "G03"


class TestRestless(SamplerMutant):
    made, breaks = Restless, "G04"


class TestFarAway(SamplerMutant):
    made, breaks = FarAway, "G05"
    consequences: Sequence[str] = ("G06",)


class TestAnywhere(SamplerMutant):
    made, breaks = Anywhere, "G06"


# -- scores --------------------------------------------------------------------------------------------------------


class Boundless(Balanced):
    """Divides by what may be nothing."""

    def score(self, facts: GraspFacts) -> float:
        digits = facts.metrics["digits_in_contact"]
        return super().score(facts) if digits else float("inf")


class Moody(Balanced):
    """Changes its mind."""

    moods = count()

    def score(self, facts: GraspFacts) -> float:
        return super().score(facts) - 1e-6 * next(self.moods)


class Forgiving(Balanced):
    """Does not count failures beyond the first."""

    def score(self, facts: GraspFacts) -> float:
        return super().score(replace(facts, failures=facts.failures[:1]))


class Contrary(Balanced):
    """Likes pads that lie far away."""

    def score(self, facts: GraspFacts) -> float:
        return super().score(facts) + 100.0 * (facts.metrics["mean_contact_distance"] or 0.0)


class ScoreMutant(Mutant, GraspScoreContract):
    made: type[Balanced]

    @pytest.fixture
    def score(self) -> Balanced:
        return self.made()


class TestBoundless(ScoreMutant):
    made, breaks = Boundless, "R02"


class TestMoody(ScoreMutant):
    made, breaks = Moody, "R03"


class TestForgiving(ScoreMutant):
    made, breaks = Forgiving, "R04"


class TestContrary(ScoreMutant):
    made, breaks = Contrary, "R05"
