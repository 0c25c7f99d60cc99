"""Random reachable poses of real rigs are found again from their own contacts, from lengths away and any turn.

Two seeds a rig here; fifty a rig were run once (docs/adr/0032).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact_builtins.samples import catalogue
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.rig.rig import Rig
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.testing import rigs


def assert_recovered(rig: Rig) -> None:
    for seed in range(2):
        problem, _ = rigs.planted(rig, seed, contacts=300, reach=3.0)
        solution = LevenbergMarquardt().solve(problem)
        lower, upper = problem.limits_of_theta
        assert ((solution.theta >= lower) & (solution.theta <= upper)).all()
        assert rigs.mean_gap(problem, solution.theta) < 0.01, (seed, solution.message)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["HUMAN_HAND", "ALIEN_HAND", "TENTACLE"])
def test_built_in_rigs(name: str) -> None:
    rig = getattr(catalogue, name).build().rig
    assert rig is not None
    assert_recovered(rig)


@pytest.mark.assets
@pytest.mark.parametrize(
    "name", ["webxr_generic_hand_left.glb", "snake_tentacle_like.glb", "allegro_hand_right/allegro_hand_right.urdf"]
)
def test_rigs_from_files(name: str, assets: Path) -> None:
    path = assets / "rigs" / name
    formats = PluginManager().offers(FORMATS).values()
    reader = next(f for f in formats if path.suffix in f.suffixes and f.can_read)
    rig = reader.read(path).rig
    assert rig is not None
    assert np.isfinite(rig.bind_points).all()
    assert_recovered(rig)
