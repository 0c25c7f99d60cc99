"""Solving through plugins: who chooses the solver, and who hears of it."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from contact_core.errors import InvalidInput
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.solving import solve_by_plugin
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, SolveOptions
from contact_core.testing.solver_contract import small


class Other(LevenbergMarquardt):
    name = "other"


def offering(heard: list[str], choice: str | None) -> object:
    class Plugin:
        @hookimpl
        def contact_pose_solvers(self) -> list[type]:
            return [LevenbergMarquardt, Other]

        @hookimpl
        def contact_choose_pose_solver(self, problem: PoseProblem, offered: Sequence[str]) -> str | None:
            assert isinstance(problem, PoseProblem) and tuple(offered) == ("levenberg-marquardt", "other")
            return choice

        @hookimpl
        def contact_pose_solved(self, solution: PoseSolution) -> None:
            heard.append(solution.status.name)

    return Plugin()


@pytest.mark.parametrize(
    ("named", "choice", "taken"),
    [("other", None, "other"), (None, "other", "other"), (None, None, "levenberg-marquardt")],
)
def test_named_then_chosen_then_first(named: str | None, choice: str | None, taken: str) -> None:
    heard: list[str] = []
    plugins = PluginManager([offering(heard, choice)], discover=False)
    solution = solve_by_plugin(small(), plugins, named, SolveOptions(max_iterations=2))
    assert solution.solver == taken
    assert heard == [solution.status.name]


def test_an_unknown_solver_lists_those_that_there_are() -> None:
    plugins = PluginManager([offering([], None)], discover=False)
    with pytest.raises(InvalidInput, match="no pose solver 'othr'; there are: other"):
        solve_by_plugin(small(), plugins, "othr")
