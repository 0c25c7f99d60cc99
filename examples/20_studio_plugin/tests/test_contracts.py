"""Both keep their contracts; what they decline is said with its reason."""

import pytest
from studio_grip.crosswise import Crosswise
from studio_grip.lbfgsb import LBFGSB

from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS, POSE_SOLVERS
from contact_core.solve.solver import SolveOptions
from contact_core.testing.axis_generator_contract import AxisGeneratorContract
from contact_core.testing.solver_contract import SolverContract


class TestCrosswise(AxisGeneratorContract):
    cannot = {"without_rig": "it runs across a bone", "mirroring": "from right to left is what it is for"}

    @pytest.fixture
    def generator(self) -> Crosswise:
        return Crosswise()


class TestLBFGSB(SolverContract):
    @pytest.fixture
    def solver(self) -> LBFGSB:
        return LBFGSB()

    @pytest.fixture
    def options(self) -> SolveOptions:
        return SolveOptions(max_iterations=1000)


def test_both_are_found_by_the_entry_point() -> None:
    plugins = PluginManager()
    assert type(plugins.get(AXIS_GENERATORS, "crosswise")) is Crosswise
    assert type(plugins.get(POSE_SOLVERS, "l-bfgs-b")) is LBFGSB
