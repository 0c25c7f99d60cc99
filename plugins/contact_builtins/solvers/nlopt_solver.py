"""NLopt's local optimisers on the pose problem, the paper's own choice among them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, ClassVar, Literal

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled, InvalidInput, MissingExtra
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.settings import HasSettings, setting
from contact_core.solve.candidates import starting_thetas
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, Run, SolveOptions, SolveStatus, unsolvable
from contact_core.solve.threads import one_blas_thread


@dataclass(frozen=True)
class NLoptSolver(HasSettings):
    """One NLopt descent from the best starting candidate.

    The preset "paper" is the unsquared form, LD_MMA, xtol_rel 1e-4, 100 evaluations, from the current pose, as in
    the authors' later tool; give the problem limits="paper" for 0..2 pi as well. max_iterations counts evaluations.
    Translations are divided by the manipulator's length, without which L-BFGS rarely arrives.
    """

    name: ClassVar[str] = "nlopt"
    summary: ClassVar[str] = "NLopt with the algorithm of your choice; slower than the default, for comparison."
    algorithm: str | None = setting(
        None, help="the name of a local algorithm of NLopt; by default LD_LBFGS, with the paper's preset LD_MMA"
    )
    preset: Literal["none", "paper"] = setting("none", help="the optimiser and its limits as the paper had them")

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        nlopt = _nlopt()
        options = options or SolveOptions(max_iterations=2000)
        paper = self.preset == "paper"
        algorithm = _known(nlopt, self.algorithm or ("LD_MMA" if paper else "LD_LBFGS"))
        if paper:
            problem = replace(problem, form="paper")
            options = replace(options, candidates=("current",), max_iterations=min(options.max_iterations, 100))
        run = Run(self.name, problem, options, progress)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped
        starts = starting_thetas(problem, options.candidates).values()
        first = min(starts, key=lambda theta: run.evaluate(theta)[1])
        with one_blas_thread():
            return run.solution(_descend(nlopt, getattr(nlopt, algorithm), run, first, options, paper=paper))


def _descend(
    nlopt: ModuleType, algorithm: int, run: Run, first: FloatArray, options: SolveOptions, *, paper: bool
) -> SolveStatus:
    problem, scale = run.problem, run.problem.scale
    lower, upper = problem.limits_of_theta
    cancelled = False

    def objective(x: FloatArray, gradient: FloatArray) -> float:
        nonlocal cancelled
        if cancelled:  # some algorithms ask once more after being stopped
            return run.best_value
        # NLopt rounds at bounds: what is scaled back is brought into the limits before it can become the best.
        state, value = run.evaluate(np.clip(x * scale, lower, upper))
        if gradient.size:
            gradient[:] = problem.gradient(state) * scale
        try:
            run.iteration()
        except Cancelled:  # an exception would be lost on its way through NLopt
            cancelled = True
            optimizer.force_stop()
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
    except _endings(nlopt) as error:  # NLopt throws its result away; the run kept the best pose
        if cancelled:
            return SolveStatus.CANCELLED
        run.notes.append(f"NLopt ended early ({type(error).__name__}); this is the best pose it saw.")
        return SolveStatus.STOPPED
    if cancelled:
        return SolveStatus.CANCELLED
    settled = (nlopt.SUCCESS, nlopt.FTOL_REACHED, nlopt.XTOL_REACHED, nlopt.STOPVAL_REACHED)
    return SolveStatus.CONVERGED if optimizer.last_optimize_result() in settled else SolveStatus.STOPPED


def _endings(nlopt: ModuleType) -> tuple[type[Exception], ...]:
    """The exceptions that end an NLopt run, which differ between its versions."""
    names = ("ForcedStop", "RoundoffLimited", "runtime_error", "invalid_argument")
    return (RuntimeError, ValueError, *(getattr(nlopt, name) for name in names if hasattr(nlopt, name)))


def _known(nlopt: ModuleType, algorithm: str) -> str:
    """The name of an algorithm that NLopt has. Raises InvalidInput that lists those."""
    known = [name for name in dir(nlopt) if name.startswith(("LD_", "LN_"))]
    if algorithm not in known:
        raise InvalidInput(f"NLopt has no local algorithm {algorithm!r}; it has {', '.join(known)}.")
    return algorithm


def _nlopt() -> Any:
    try:
        import nlopt
    except ImportError as error:
        raise MissingExtra("the nlopt solver", "solvers") from error
    return nlopt
