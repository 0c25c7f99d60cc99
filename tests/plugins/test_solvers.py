"""Every registered solver keeps the solver contract."""

from __future__ import annotations

from typing import ClassVar

import pytest

import contact_builtins
from contact_builtins.solvers.nlopt_solver import NLoptSolver
from contact_builtins.solvers.stepwise import MultiStartSolver, ProgressiveSolver, StagedSolver
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_SOLVERS, POSE_TERMS
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.solver import PoseSolver, SolveOptions
from contact_core.testing.solver_contract import SolverContract


class TestLevenbergMarquardt(SolverContract):
    @pytest.fixture
    def solver(self) -> PoseSolver:
        return LevenbergMarquardt()


class TestStaged(SolverContract):
    cannot: ClassVar[dict[str, str]] = {"budget": "the iterations are counted per stage"}

    @pytest.fixture
    def solver(self) -> PoseSolver:
        return StagedSolver()


class TestProgressive(SolverContract):
    @pytest.fixture
    def solver(self) -> PoseSolver:
        return ProgressiveSolver()


class TestMultiStart(SolverContract):
    @pytest.fixture
    def solver(self) -> PoseSolver:
        return MultiStartSolver(starts=4)


class TestNLopt(SolverContract):
    @pytest.fixture
    def solver(self) -> PoseSolver:
        pytest.importorskip("nlopt")
        return NLoptSolver()

    @pytest.fixture
    def options(self) -> SolveOptions:
        return SolveOptions(max_iterations=1000)


class TestNLoptPaper(SolverContract):
    subject: ClassVar[str] = "NLopt as in the paper"
    cannot: ClassVar[dict[str, str]] = {
        "precision": "100 evaluations of LD_MMA on the unsquared form do not arrive"
    }

    @pytest.fixture
    def solver(self) -> PoseSolver:
        pytest.importorskip("nlopt")
        return NLoptSolver(preset="paper")


JUDGED = {
    "levenberg-marquardt": TestLevenbergMarquardt,
    "staged": TestStaged,
    "progressive": TestProgressive,
    "multi-start": TestMultiStart,
    "nlopt": TestNLopt,
}


def test_every_built_in_solver_and_term_is_judged() -> None:
    """What is offered without a class here or in test_terms.py would be promised without proof."""
    manager = PluginManager([contact_builtins], discover=False)
    assert set(manager.offers(POSE_SOLVERS)) == set(JUDGED)
    assert set(manager.offers(POSE_TERMS)) == {
        "distance", "normal", "prior", "penetration", "self-collision", "pin", "look", "balance",
    }  # fmt: skip
