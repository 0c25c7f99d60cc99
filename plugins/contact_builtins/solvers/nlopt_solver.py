"""NLopt's local optimisers on the pose problem, the paper's own choice among them."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput, MissingExtra
from contact_core.pose.candidates import starting_thetas
from contact_core.pose.problem import PoseProblem
from contact_core.pose.solver import PoseSolution, Progress, Run, SolveOptions, SolveStatus, Stop, unsolvable


class NLoptSolver:
    """One NLopt descent from the best starting candidate.

    Settings (`SolveOptions.more`): algorithm, any NLopt name (LD_LBFGS by default); preset "paper": the unsquared
    form, LD_MMA, xtol_rel 1e-4, 100 evaluations, from the current pose, as in the authors' later tool; give the
    problem limits="paper" for 0..2 pi as well. max_iterations counts evaluations. Translations are divided by
    the manipulator's length, without which L-BFGS rarely arrives.
    """

    name = "nlopt"
    summary = "NLopt with the algorithm of your choice; slower than the default, for comparison."

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress | None = None
    ) -> PoseSolution:
        nlopt = _nlopt()
        options = options or SolveOptions(max_iterations=2000)
        algorithm, paper = _settings(nlopt, options)
        if paper:
            problem = replace(problem, form="paper")
            options = replace(options, candidates=("current",), max_iterations=min(options.max_iterations, 100))
        run = Run(self.name, problem, progress)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped
        starts = starting_thetas(problem, options.candidates).values()
        first = min(starts, key=lambda theta: run.evaluate(theta)[1])
        try:
            return run.solution(_descend(nlopt, getattr(nlopt, algorithm), run, first, options, paper=paper))
        except Stop:
            return run.solution(SolveStatus.CANCELLED)


def _descend(
    nlopt: ModuleType, algorithm: int, run: Run, first: FloatArray, options: SolveOptions, *, paper: bool
) -> SolveStatus:
    problem, scale = run.problem, run.problem.scale
    lower, upper = problem.limits_of_theta

    def objective(x: FloatArray, gradient: FloatArray) -> float:
        # NLopt rounds at bounds: what is scaled back is brought into the limits before it can become the best.
        state, value = run.evaluate(np.clip(x * scale, lower, upper))
        if gradient.size:
            gradient[:] = problem.gradient(state) * scale
        run.iteration()
        return value

    optimizer = nlopt.opt(algorithm, len(first))
    optimizer.set_lower_bounds(lower / scale)
    optimizer.set_upper_bounds(upper / scale)
    optimizer.set_min_objective(objective)
    optimizer.set_maxeval(options.max_iterations)
    if paper:
        optimizer.set_xtol_rel(1e-4)
    else:
        optimizer.set_ftol_rel(0.1 * options.tolerance)
    try:
        optimizer.optimize(np.clip(first / scale, lower / scale, upper / scale))
    except (nlopt.RoundoffLimited, RuntimeError, ValueError) as error:  # the best pose is kept by the run
        run.notes.append(f"NLopt ended early ({type(error).__name__}: {error}); this is the best pose it saw.")
        return SolveStatus.STOPPED
    settled = (nlopt.SUCCESS, nlopt.FTOL_REACHED, nlopt.XTOL_REACHED, nlopt.STOPVAL_REACHED)
    return SolveStatus.CONVERGED if optimizer.last_optimize_result() in settled else SolveStatus.STOPPED


def _settings(nlopt: ModuleType, options: SolveOptions) -> tuple[str, bool]:
    preset = options.more.get("preset", "")
    if preset not in ("", "paper"):
        raise InvalidInput(f'the nlopt solver has the preset "paper", but {preset!r} came.')
    algorithm = str(options.more.get("algorithm", "LD_MMA" if preset else "LD_LBFGS"))
    known = [name for name in dir(nlopt) if name.startswith(("LD_", "LN_"))]
    if algorithm not in known:
        raise InvalidInput(f"NLopt has no local algorithm {algorithm!r}; it has {', '.join(known)}.")
    return algorithm, preset == "paper"


def _nlopt() -> Any:
    try:
        import nlopt
    except ImportError as error:
        raise MissingExtra("the nlopt solver", "solvers") from error
    return nlopt
