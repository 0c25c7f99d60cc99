"""The built-in sampler and score keep their contracts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_builtins.grasps.around import Around
from contact_builtins.grasps.balanced import Balanced
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.mesh import TriangleMesh
from contact_core.grasping.closing import close_hands
from contact_core.grasping.hand import hand_of
from contact_core.grasping.slots import GraspRequest, GraspSampler, GraspScore
from contact_core.hands.describe import describe_hand
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
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


def test_tips_go_over_the_rims_of_a_plate_that_is_large_wherever_places_are() -> None:
    rig = read_asset("sample:human_hand", PluginManager()).rig
    assert rig is not None
    one = hand_of(rig, describe_hand(rig))
    corners = (
        np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (4.0, 4.0, 0.1) * one.length
    )
    quads = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
    mesh = TriangleMesh(corners, np.array([[q[0], *pair] for q in quads for pair in (q[1:3], q[2:4])]))
    asked = GraspRequest(one, mesh, DistanceField.of(mesh, resolution=64), kinds=("precision",))
    found = Around(places=8, most=20000).sample(asked)
    closed = close_hands(one, asked.field, found.placed, found.ways, found.bars, found.curls, found.limits)
    touches = closed.clear < 0.02 * one.length
    holds = touches[:, one.thumb] & (touches.sum(axis=1) >= 3)
    assert holds.sum() >= 20, "of nine square lengths on each side none but its edge can be spanned"
    palms = found.placed[holds, :3, :3] @ one.description.palm.point + found.placed[holds, :3, 3]
    assert (np.abs(palms[:, :2]).max(axis=1) > 3.9 * one.length).all(), "the palm is outside"


def test_what_hangs_on_a_limit_ranks_below_what_is_clear_of_it() -> None:
    score, clear = Balanced(), facts("power")
    assert score.score(replace(clear, margin=0.0)) < score.score(replace(clear, margin=0.5)) < score.score(clear)
    assert score.score(replace(clear, failures=("it slips.",))) < score.score(replace(clear, margin=0.0))


def test_a_thumb_whose_end_is_in_the_air_ranks_below_one_that_lies_on_the_thing() -> None:
    score = Balanced()
    assert score.score(facts("power", thumb_away=0.3)) < score.score(facts("power", thumb_away=0.03))
    assert score.score(facts("power", thumb_away=0.03)) < score.score(facts("power"))


def test_a_thumb_along_a_rod_ranks_below_one_across_it_but_not_in_a_pinch() -> None:
    score = Balanced()
    assert score.score(facts("power", thumb_along=0.9)) < score.score(facts("power"))
    assert score.score(facts("pinch", thumb_along=0.9)) == score.score(facts("pinch"))
