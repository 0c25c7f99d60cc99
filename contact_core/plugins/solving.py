"""Solving through plugins: the solver that was named, or that a plugin chooses, or the first one; and who is
told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_SOLVERS
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, SolveOptions


def solve_by_plugin(
    problem: PoseProblem,
    plugins: PluginManager,
    solver: str | None = None,
    options: SolveOptions | None = None,
    progress: Progress = NO_PROGRESS,
    **settings: Any,
) -> PoseSolution:
    """The solution of a problem. solver: a name; None asks `contact_choose_pose_solver` and then takes the default.
    settings: the solver's own. Afterwards `contact_pose_solved` tells every plugin. Raises InvalidInput for an
    unknown name and for settings that it does not have or refuses.
    """
    name = solver or plugins.choose("contact_choose_pose_solver", plugins.offers(POSE_SOLVERS), problem=problem)
    made = plugins.make(POSE_SOLVERS, plugins.name_for(POSE_SOLVERS, "solve", name), **settings)
    solution = made.solve(problem, options, progress)
    plugins.notify("contact_pose_solved", problem=problem, solution=solution)
    return solution


@dataclass(frozen=True)
class PluginSolver:
    """`solve_by_plugin` as a solver, for what takes one. wanted: a name; None leaves the choice to the plugins.
    settings: the solver's own."""

    plugins: PluginManager
    wanted: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    name: ClassVar[str] = "by plugin"
    summary: ClassVar[str] = "The solver that was named, or that the plugins choose."

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        return solve_by_plugin(problem, self.plugins, self.wanted, options, progress, **self.settings)
