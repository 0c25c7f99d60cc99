"""The harder scenes of the paper, out of built-in samples: a progressive wrap, a body that sits by stages."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from contact_builtins.solvers.stepwise import ProgressiveSolver, StagedSolver
from contact_core.geometry.distance_field import DistanceField
from contact_core.rig.rig import skin
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt


@pytest.fixture(scope="module")
def scenes() -> ModuleType:
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "pose_scenes.py"
    spec = importlib.util.spec_from_file_location("pose_scenes", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["pose_scenes"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_tentacle_wraps_the_pole(scenes: ModuleType) -> None:
    """No flipped normals and nothing inside; all contacts at once end in a worse basin."""
    problem = scenes.wrap().problem
    solution = ProgressiveSolver().solve(problem)
    patch = solution.patches["strip"]
    assert patch.opposed == 1.0
    assert patch.mean < 0.012 * problem.manipulator_length
    posed = skin(problem.bodies[0].rig, problem.state(solution.theta).motions[0].world)
    depth = -DistanceField.of(problem.bodies[1].rig.surface, resolution=96).sample(posed)[0]
    assert depth.max() < 0.02 * problem.manipulator_length
    assert solution.value < 0.5 * LevenbergMarquardt().solve(problem).value


@pytest.mark.slow
def test_the_body_sits_down_by_stages(scenes: ModuleType) -> None:
    problem = scenes.chair().problem
    solution = StagedSolver(scenes.STAGES).solve(problem)
    length = problem.manipulator_length
    for name, patch in solution.patches.items():
        assert patch.mean < 0.013 * length, name
        assert patch.opposed > 0.8, name  # a palm laid on the thigh bends round it
    hips = problem.state(solution.theta).motions[0].world[0]
    assert 0.45 < hips[1, 3] < 0.65  # as high as the seat and the flesh on it
    assert hips[1, :3] @ problem.bodies[0].rig.rest_world[0, 1, :3] > np.cos(np.radians(20.0))
