"""Grips of the built-in recipes, measured: the penetration term, contacts that move along, random placements, and
planted poses of six rigs.

    python benchmarks/pose_grips.py [penetration] [sliding] [placements] [planted]

Each named part (all, without names) rewrites its section of docs/pose-grips.md and of results/latest.json; the
others stay. `penetration` is the part whose milliseconds matter, and takes half a minute: leave the machine alone
meanwhile. `placements` judges by the lowest objective that any solver ever found (best_known.py).
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
from bench_pose import placed
from best_known import STARTS, keep, kept, search
from harness import record
from planted_poses import planted_rows
from sliding_study import sliding_rows

import contact_builtins
from contact_builtins.demos import demo_recipe
from contact_builtins.solvers.nlopt_solver import NLoptSolver
from contact_core.arrays import FloatArray
from contact_core.geometry.inside import depth_inside
from contact_core.geometry.transform import transform_points
from contact_core.job.job import Job
from contact_core.job.run import prepare, settings_of
from contact_core.plugins.manager import PluginManager
from contact_core.recipe.reader import load_recipe
from contact_core.rig.rig import skin
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, SolveOptions, patch_residuals

HERE = Path(__file__).resolve().parent
GRIPS = ("baseball", "pole", "mug")  # of benchmarks/grips and of `contact demo`
DEMOS = ("baseball",)
EXAMPLES = ("01_ball_fingertips", "04_bunny")  # with meshes that this repository does not hold
NEAR = 1.02  # of the best objective known
ROUNDS = 9  # of timed pairs
PLUGINS = PluginManager([contact_builtins], discover=False)


class Grip:
    """One recipe, ready to solve."""

    def __init__(self, name: str) -> None:
        self.name = name
        frozen = HERE / "grips" / f"{name}.toml"  # what is compared over years does not move with a demo
        example = HERE.parent / "examples" / f"{name}.toml"
        recipe = demo_recipe(name) if name in DEMOS else load_recipe(frozen if name in GRIPS else example)
        self.job: Job = prepare(recipe, PLUGINS)
        self.problem = self.job.session.problem(settings_of(self.job).objective)

    def depth(self, problem: PoseProblem, theta: FloatArray) -> float:
        """Of the deepest skin vertex in the true solids, in % of the length: no grid comes in between."""
        state = problem.state(theta)
        into = np.linalg.inv(self.job.session.document.surface("object").world_from_surface)
        points = transform_points(into, skin(self.job.session.rigs["manipulator"], state.motions[0].world))
        deepest = max(
            depth_inside(points, solid).max()
            for solid in self.job.solids["object"] or (self.job.assets["object"].mesh,)
        )
        return 100.0 * float(deepest) / problem.manipulator_length


def gap(solution: PoseSolution) -> float:
    """Mean distance over all paired points, in % of the length."""
    residuals = patch_residuals(solution.problem, solution.theta)
    counts = [len(contact.object_points) for contact in solution.problem.contacts]
    mean = np.average([residuals[c.name].mean for c in solution.problem.contacts], weights=counts)
    return 100.0 * float(mean) / solution.problem.manipulator_length


class Timed(NamedTuple):
    """One solve: milliseconds of this process, which other processes hardly change, and by the clock."""

    solution: PoseSolution
    processor: float
    wall: float

    @classmethod
    def of(cls, problem: PoseProblem) -> Timed:
        processor, wall = time.process_time(), time.perf_counter()
        solution = LevenbergMarquardt().solve(problem)
        return cls(solution, 1e3 * (time.process_time() - processor), 1e3 * (time.perf_counter() - wall))


def penetration(grips: Sequence[Grip]) -> list[str]:
    """Without the term and with it, as the recipe weighs it, in turn: a busy moment hits both."""
    lines = [
        "Wanted on baseball, pole and mug: at most 1 % deep, for at most 150 ms more. Medians over"
        f" {ROUNDS} pairs of solves, with the term and without, in turn. Processor time is this process's own; the"
        f" clock also counts whatever else ran: {os.getloadavg()[0]:.1f} processes wanted {os.cpu_count()} cores"
        " in the minute before.",
        "",
        "| | deepest without | with | distance without | with | processor, ms | more | clock, ms | more |",
        "|---" * 9 + "|",
    ]
    rows = {}
    for grip in grips:
        without = replace(grip.problem, terms=tuple(t for t in grip.problem.terms if t.name != "penetration"))
        pairs = [(Timed.of(without), Timed.of(grip.problem)) for _ in range(ROUNDS + 1)][
            1:
        ]  # fields are built once
        plain, termed = (solved.solution for solved in pairs[0])
        deep = grip.depth(without, plain.theta), grip.depth(grip.problem, termed.theta)
        took = median(a.processor for a, _ in pairs), median(a.wall for a, _ in pairs)
        more = median(b.processor - a.processor for a, b in pairs), median(b.wall - a.wall for a, b in pairs)
        lines.append(
            f"| {grip.name} | {deep[0]:.2f} | {deep[1]:.2f} | {gap(plain):.2f} | {gap(termed):.2f} |"
            f" {took[0]:.0f} | {more[0]:+.0f} | {took[1]:.0f} | {more[1]:+.0f} |"
        )
        rows[grip.name] = (
            f"{deep[0]:.2f} to {deep[1]:.2f} % deep, {more[0]:+.0f} ms of processor, {more[1]:+.0f} by the clock"
        )
    record("Grips: the penetration term (at most 1 % deep, at most 150 ms more)", rows)
    return lines


def placements(grips: Sequence[Grip], count: int, starts: int) -> list[str]:
    """Share of random placements that come within 2% of the best objective known, by default and by LD_MMA."""
    lines = [
        f"{count} placements up to 3 hand lengths away and 180° off, solved by default settings; near: within 2 %"
        " of the lowest objective that any solver ever found. That is every solver of the registry, NLopt by each"
        f" of its local algorithms, from {STARTS} starts (the grip's own, and random ones), then each polishing the"
        f" lowest pose of all; and multi-start from {starts} random placements and finger poses."
        " `grips_best_known.json` holds the lowest of each. Wanted: 98 %.",
        "",
        "| | lowest known | found by | searches that end within 0.1 % of it | near, default, % | median above, % |"
        " worst above, % | near, LD_MMA 100, % |",
        "|---" * 8 + "|",
    ]
    rows = {}
    mma = SolveOptions(max_iterations=100, candidates=("current",))
    for grip in grips:
        best, earlier = search(grip.problem, PLUGINS, starts), kept(grip.problem, grip.name)
        if earlier is not None:
            best.join(earlier)
        problems = [placed(grip.problem, seed) for seed in range(count)]
        ours = [LevenbergMarquardt().solve(problem) for problem in problems]
        theirs = [NLoptSolver(algorithm="LD_MMA").solve(problem, mma) for problem in problems]
        for by, solutions in (("levenberg-marquardt", ours), ("nlopt LD_MMA", theirs)):
            for solution in solutions:
                best.judge(by, solution.theta)
        keep(grip.name, best)
        above = np.array([[s.value / best.value for s in solutions] for solutions in (ours, theirs)])  # (2, count)
        near = 100.0 * (above <= NEAR).mean(axis=1)
        agreed = sum(value <= 1.001 * best.value for value in best.searched.values())
        lines.append(
            f"| {grip.name} | {best.value:.6f} | {best.by} | {agreed} of {len(best.searched)} | {near[0]:.0f} |"
            f" {100 * (np.median(above[0]) - 1):.3f} | {100 * (above[0].max() - 1):.2f} | {near[1]:.0f} |"
        )
        rows[grip.name] = f"{near[0]:.0f} % by default, {near[1]:.0f} % by LD_MMA with 100 evaluations"
    record(f"Grips: {count} random placements within 2 % of the lowest known (at least 98 %)", rows)
    return lines


HEAD = """# Grips, measured

Written by `python benchmarks/pose_grips.py`; run it again to check. Recipes of `contact demo` and
of `benchmarks/grips`, on built-in assets, and of `examples/`; lengths in % of the hand's length, times in
milliseconds.
"""

PARTS = {  # section titles of the page, in order
    "penetration": "The penetration term",
    "sliding": "Sliding contacts",
    "placements": "Random placements",
    "planted": "Planted poses",
}


def rewrite(page: Path, measured: dict[str, list[str]]) -> None:
    """The page with the measured sections new and the others as they were."""
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    sections = dict(part.split("\n", 1) for part in old.split("\n## ")[1:])  # title -> text
    sections |= {PARTS[name]: "\n" + "\n".join(lines) + "\n" for name, lines in measured.items()}
    texts = [f"## {title}\n{sections[title]}" for title in PARTS.values() if title in sections]
    page.write_text("\n".join([HEAD, *texts]), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of {', '.join(PARTS)}; all without one")
    parser.add_argument("--placements", type=int, default=50)
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=50, help="of planted poses, a rig")
    parser.add_argument("--examples", nargs="*", default=EXAMPLES, help="recipes of examples/; none without assets")
    parser.add_argument("--out", type=Path, default=HERE.parent / "docs")
    given = parser.parse_args()
    unknown = sorted(set(given.parts) - set(PARTS))
    if unknown:
        parser.error(f"no part is called {', '.join(unknown)}; there are {', '.join(PARTS)}.")
    wanted = given.parts or list(PARTS)
    names = (*GRIPS, *given.examples) if {"penetration", "placements"} & set(wanted) else ()
    grips = [Grip(name) for name in names]
    measures: dict[str, Callable[[], list[str]]] = {
        "penetration": lambda: penetration(grips),
        "sliding": lambda: sliding_rows(assets=bool(given.examples)),
        "placements": lambda: placements(grips, given.placements, given.starts),
        "planted": lambda: planted_rows(given.seeds),
    }
    for name in PARTS:
        if name in wanted:
            rewrite(given.out / "pose-grips.md", {name: measures[name]()})


if __name__ == "__main__":
    main()
