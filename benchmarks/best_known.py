"""The lowest objective of a problem that every registered solver together finds, and who found it.

The registry says which solvers there are, NLopt which algorithms it has. Each runs from several starts,
multi-start from hundreds; then each polishes the lowest pose found. The pose is kept with its value, so that a kept
value proves itself: where its pose does not give it any more, the problem has changed and the search begins anew.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contact_builtins.solvers.nlopt_solver import NLoptSolver
from contact_builtins.solvers.stepwise import MultiStartSolver, random_start
from contact_core.arrays import FloatArray
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_SOLVERS
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolver, SolveOptions

KEPT = Path(__file__).resolve().parent / "grips_best_known.json"
STARTS = 5  # of every solver but multi-start: the problem's own, and random ones
SAME = 1e-6  # relative, between two values of one pose
PRECISE = 1e-9  # tolerance of polishing


class Contestant(NamedTuple):
    """One way to solve. label: the solver, and NLopt's algorithm. searches: worth starting far away."""

    label: str
    solver: PoseSolver
    options: SolveOptions
    searches: bool = True


def contestants(plugins: PluginManager) -> Iterator[Contestant]:
    """Every registered solver; NLopt once per local algorithm that needs no other one, and as in the paper."""
    for name, solver in plugins.offers(POSE_SOLVERS).items():
        if isinstance(solver, NLoptSolver):
            yield from algorithms()
        elif not isinstance(solver, MultiStartSolver):
            yield Contestant(name, solver, SolveOptions())


def algorithms() -> Iterator[Contestant]:
    """Those without gradients only polish: in fifty dimensions they do not arrive from anywhere else."""
    import nlopt

    for name in sorted(dir(nlopt)):
        if name.startswith(("LD_", "LN_")) and "AUGLAG" not in name:  # which only wraps another one
            options = SolveOptions(max_iterations=1000)
            yield Contestant(f"nlopt {name}", NLoptSolver(algorithm=name), options, searches=name.startswith("LD_"))
    yield Contestant("nlopt, preset paper", NLoptSolver(preset="paper"), SolveOptions())


class Found:
    """The pose of the lowest value, and per contestant the lowest of its own searches, and of polishing."""

    def __init__(self, problem: PoseProblem) -> None:
        self.problem = problem
        self.searched: dict[str, float] = {}
        self.polished: dict[str, float] = {}
        self.value, self.by, self.theta = np.inf, "", problem.start

    def judge(self, by: str, theta: FloatArray) -> float:
        """The value of a pose by the problem's own objective, however it was found; kept if it is the lowest."""
        lower, upper = self.problem.limits_of_theta
        assert ((theta >= lower) & (theta <= upper)).all(), f"{by} left the limits"
        value = float(self.problem.value(self.problem.state(theta)))
        if value < self.value:
            self.value, self.by, self.theta = value, by, theta
        return value

    def search(self, by: str, theta: FloatArray) -> None:
        """A pose that a contestant found by itself."""
        self.searched[by] = min(self.judge(by, theta), self.searched.get(by, np.inf))

    def polish(self, by: str, theta: FloatArray) -> None:
        """A pose that a contestant made of the lowest of all."""
        self.polished[by] = self.judge(f"{by}, polishing", theta)

    def join(self, other: Found) -> None:
        """The lowest of another run on the same problem."""
        self.judge(other.by, other.theta)


def search(problem: PoseProblem, plugins: PluginManager, starts: int) -> Found:
    """The lowest of all solvers. starts: of multi-start, random placements and finger poses."""
    found = Found(problem)
    solvers, random = list(contestants(plugins)), np.random.default_rng(0)
    many = plugins.make(POSE_SOLVERS, "multi-start", starts=starts).solve(problem)
    found.search(f"multi-start of {starts}", many.theta)
    for number in range(STARTS):
        start = problem if number == 0 else problem.at(random_start(problem, random))
        for label, solver, options, searches in solvers:
            if searches:
                found.search(label, solver.solve(start, options).theta)
    lowest = problem.at(found.theta)
    for label, solver, options, _ in solvers:
        precise = replace(options, candidates=("current",), tolerance=PRECISE)
        found.polish(label, solver.solve(lowest, precise).theta)
    return found


def kept(problem: PoseProblem, name: str) -> Found | None:
    """The lowest of earlier runs, if it is of this problem: if its pose still gives its value."""
    entry = _entries().get(name)
    if entry is None or len(entry["pose"]) != len(problem.start):
        return None
    found = Found(problem)
    found.judge(entry["found by"], np.clip(entry["pose"], *problem.limits_of_theta))
    return found if abs(found.value - entry["value"]) <= SAME * entry["value"] else None


def keep(name: str, found: Found) -> None:
    """Write what was found into the file beside this script."""
    entry = {
        "value": found.value,
        "found by": found.by,
        "lowest of each from starts of its own": dict(sorted(found.searched.items(), key=lambda item: item[1])),
        "lowest of each by polishing": dict(sorted(found.polished.items(), key=lambda item: item[1])),
        "pose": [float(angle) for angle in found.theta],
    }
    KEPT.write_text(json.dumps(_entries() | {name: entry}, indent=1) + "\n", encoding="utf-8")


def _entries() -> dict[str, Any]:
    return json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
