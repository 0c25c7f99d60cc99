"""A pose solver on SciPy's L-BFGS-B: a few lines on top of `Run`, which counts, remembers the best and reports."""

import numpy as np
from scipy.optimize import minimize

from contact_core.arrays import FloatArray
from contact_core.errors import Cancelled
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, Run, SolveOptions, SolveStatus, unsolvable


class LBFGSB:
    name = "l-bfgs-b"
    summary = "SciPy's L-BFGS-B, started from the current pose"

    def solve(
        self, problem: PoseProblem, options: SolveOptions | None = None, progress: Progress = NO_PROGRESS
    ) -> PoseSolution:
        options = options or SolveOptions(max_iterations=2000)
        run = Run(self.name, problem, options, progress)
        stopped = unsolvable(run)
        if stopped is not None:
            return stopped
        lower, upper = problem.limits_of_theta
        scale = problem.scale  # (d,) makes a radian and a length of the manipulator weigh alike

        def objective(x: FloatArray) -> tuple[float, FloatArray]:
            state, value = run.evaluate(np.clip(x * scale, lower, upper))
            return value, problem.gradient(state) * scale

        try:
            found = minimize(
                objective,
                problem.start / scale,
                jac=True,
                method="L-BFGS-B",
                bounds=list(zip(lower / scale, upper / scale, strict=True)),
                callback=lambda _: run.iteration(),
                options={"maxiter": options.max_iterations, "ftol": 1e-3 * options.tolerance, "gtol": 0.0},
            )
        except Cancelled:
            return run.solution(SolveStatus.CANCELLED)
        return run.solution(SolveStatus.CONVERGED if found.status == 0 else SolveStatus.STOPPED)
