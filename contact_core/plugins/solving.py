"""Solving through plugins: the solver that was named, or that a plugin chooses, or the first one; and who is
told."""

from __future__ import annotations

from dataclasses import dataclass

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
) -> PoseSolution:
    """The solution of a problem. solver: a name; None asks `contact_choose_pose_solver` and then takes the first
    solver offered. Afterwards `contact_pose_solved` tells every plugin. Raises InvalidInput for an unknown name.
    """
    offered = plugins.offers(POSE_SOLVERS)
    name = (
        solver or plugins.choose("contact_choose_pose_solver", offered, problem=problem) or next(iter(offered), "")
    )
    solution = plugins.get(POSE_SOLVERS, name).solve(problem, options, progress)
    plugins.notify("contact_pose_solved", problem=problem, solution=solution)
    return solution


@dataclass(frozen=True)
class PluginSolver:
    """`solve_by_plugin` as a solver, for what takes one. wanted: a name; None leaves the choice to the plugins."""

    plugins: PluginManager
    wanted: str | None = None
    name = "by plugin"
    summary = "The solver that was named, or that the plugins choose."

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        return solve_by_plugin(problem, self.plugins, self.wanted, options, progress)
