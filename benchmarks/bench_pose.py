"""The pose solver: cost of an evaluation, cold and warm solves, and the authors' scheme beside it.

    python benchmarks/bench_pose.py [--quick] [--placements 50]

All on synthetic problems with a known answer (a 57-dof hand and a mold of it), so that nothing but this
repository is needed. Medians, by the clock and in processor time, which other processes hardly change.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np
from harness import record

from contact_builtins.solvers.nlopt_solver import NLoptSolver
from contact_builtins.solvers.stepwise import MultiStartSolver
from contact_core.errors import Cancelled
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.rig.rotations import exponential
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import Iteration, SolveOptions
from contact_core.solve.threads import one_blas_thread
from contact_core.testing import meshes, rigs


def milliseconds(work: Callable[[], object], repeats: int) -> float:
    """Median time of a call."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return 1e3 * median(times)


def kernels(repeats: int) -> dict[str, float]:
    """An evaluation at 1000 contact points and 57 dofs."""
    problem, _ = rigs.planted(rigs.hand_like(), 0, contacts=1000)
    theta = problem.start + np.random.default_rng(0).normal(0.0, 0.2, len(problem.start))

    def value() -> None:
        problem.value(problem.state(theta))

    def gradient() -> None:
        state = problem.state(theta)
        problem.value(state)
        problem.gradient(state)

    def model() -> None:
        state = problem.state(theta)
        problem.value(state)
        problem.gradient(state)
        problem.normal_matrix(state)

    with one_blas_thread():
        calls = {"value": value, "value and gradient": gradient, "value, gradient and normal matrix": model}
        return {name: milliseconds(call, repeats) for name, call in calls.items()}


def six_patches(seed: int) -> PoseProblem:
    """500 contacts in six patches: five fingertips and the palm, on a mold of a random pose."""
    rig = rigs.hand_like(rigs.limited_freedom)
    whole, _ = rigs.planted(rig, seed, contacts=1)
    owner = rig.skin_joints[rig.faces[:, 0], 0]
    random = np.random.default_rng(seed)
    contacts = []
    for name in ("wrist", *(f"finger{k}_2" for k in range(5))):
        faces = random.choice(np.flatnonzero(owner == rig.joint_index(name)), 100 if name == "wrist" else 80)
        weights = random.dirichlet(np.ones(3), len(faces))
        ends = SurfacePoints(faces, weights), SurfacePoints(faces, weights[:, ::-1])
        contacts.append(PairedPoints(name, rig.name, ends[0], "mold", ends[1]))
    return replace(whole, contacts=tuple(contacts))


def placed(problem: PoseProblem, seed: int, reach: float = 3.0) -> PoseProblem:
    """The hand at rest, up to `reach` lengths from the mold and turned up to 180 degrees."""
    random = np.random.default_rng(1000 + seed)
    hand = problem.bodies[0]
    local = hand.rig.rest_local.copy()
    axis, away = random.normal(size=3), random.normal(size=3)
    turn = axis / np.linalg.norm(axis) * random.uniform(0.0, np.pi)
    local[0, :3, :3] = exponential(turn[None])[0][0] @ local[0, :3, :3]
    centre = problem.bodies[1].rig.surface.points.mean(axis=0)
    away *= reach * problem.manipulator_length * random.uniform() / np.linalg.norm(away)
    local[0, :3, 3] = centre + away
    return replace(problem, bodies=(replace(hand, pose=Pose(hand.rig.joints, local)), *problem.bodies[1:]))


def nudged(problem: PoseProblem, seed: int) -> PoseProblem:
    """One of six patches moved by 1 cm (l) in space: its targets become a body of their own."""
    random = np.random.default_rng(seed)
    contact = problem.contacts[int(random.integers(len(problem.contacts)))]
    shift = np.eye(4)
    direction = random.normal(size=3)
    shift[:3, 3] = problem.unit * direction / np.linalg.norm(direction)
    moved = Body.rigid("moved", problem.bodies[1].rig.surface, world_from_surface=shift)
    contacts = tuple(replace(c, object="moved") if c is contact else c for c in problem.contacts)
    return replace(problem, bodies=(*problem.bodies, moved), contacts=contacts)


def live(depths: Sequence[int], repeats: int) -> dict[int, tuple[float, float]]:
    """What a drag makes anew at each move, by faces of the object: bodies, tracks and terms from a document's
    parts (the first time, then the median, processor ms). `problem.at` keeps the tracks, so it hides this cost."""
    rig, random = rigs.hand_like(rigs.limited_freedom), np.random.default_rng(0)
    figures = {}
    for depth in depths:
        ball = meshes.icosphere(depth)
        ends = [
            SurfacePoints(random.integers(faces, size=500), random.dirichlet(np.ones(3), 500))
            for faces in (len(rig.faces), len(ball.faces))
        ]
        times = []
        for _ in range(repeats + 1):
            began = time.process_time()
            contact = PairedPoints("all", rig.name, ends[0], "ball", ends[1])
            made = PoseProblem((Body.skinned(rig), Body.rigid("ball", ball)), (contact,))
            made.value(made.start_state)
            times.append(1e3 * (time.process_time() - began))
        figures[len(ball.faces)] = times[0], median(times[1:])
    return figures


def solves(count: int) -> dict[str, float]:
    """Cold solves from random placements, and warm ones after a patch moved."""
    cold, warm, iterations = [], [], []
    for seed in range(count):
        start = placed(six_patches(seed), seed)
        began = time.process_time()
        solution = LevenbergMarquardt().solve(start)
        cold.append((solution.seconds, time.process_time() - began))
        dragged = nudged(solution.problem.at(solution.theta), seed)
        began = time.process_time()
        again = LevenbergMarquardt().solve(dragged, SolveOptions(candidates=("current",), tolerance=1e-4))
        warm.append((again.seconds, time.process_time() - began))
        iterations.append(len(again.trace))
    figures = {"warm, iterations": float(median(iterations))}
    for name, times in (("cold", cold), ("warm", warm)):
        wall, processor = zip(*times, strict=True)
        figures |= {
            f"{name}, median ms": 1e3 * median(wall),
            f"{name}, median processor ms": 1e3 * median(processor),
        }
    return figures


class ForwardDifferences(PoseProblem):
    """The authors' scheme: one whole evaluation per dof and gradient."""

    def gradient(self, state: Any) -> Any:
        here, step = self.value(state), 1e-6
        counted.evaluations += len(state.theta)
        moved = (self.value(self.state(state.theta + step * unit)) for unit in np.eye(len(state.theta)))
        return np.array([(value - here) / step for value in moved])


class counted:  # noqa: N801  (a counter with a name)
    evaluations = 0


def beside_the_authors(count: int, most: int) -> list[dict[str, float]]:
    """Levenberg-Marquardt, LD_MMA with our gradient, LD_MMA with forward differences: to 1.02x of the optimum."""
    rows = []
    for seed in range(count):
        problem = six_patches(seed)
        optimum = LevenbergMarquardt().solve(problem).value

        def reached(seen: Iteration, goal: float = 1.02 * optimum) -> None:
            if seen.value <= goal:
                raise Cancelled("near enough to the optimum.")

        own = LevenbergMarquardt().solve(problem, SolveOptions(watch=reached))
        mma = SolveOptions(
            max_iterations=most,
            tolerance=0.0,
            candidates=("current",),
            watch=reached,
        )
        ours = NLoptSolver(algorithm="LD_MMA").solve(problem, mma)
        fields = {name: getattr(problem, name) for name in PoseProblem.__dataclass_fields__}
        counted.evaluations = 0
        authors = NLoptSolver(algorithm="LD_MMA").solve(ForwardDifferences(**fields), mma)
        rows.append(
            {
                "evaluations": own.evaluations,
                "evaluations, MMA": ours.evaluations,
                "evaluations, authors": authors.evaluations + counted.evaluations,
                "ms": 1e3 * own.seconds,
                "ms, MMA": 1e3 * ours.seconds,
                "ms, authors": 1e3 * authors.seconds,
                "reached by MMA": float(ours.value <= 1.02 * optimum),
                "reached by authors": float(authors.value <= 1.02 * optimum),
            }
        )
    return rows


def placements(count: int, starts: int) -> dict[str, float]:
    """Share of random placements that come within 2% of the best objective known."""
    problem = six_patches(0)
    values: dict[str, list[float]] = {"levenberg-marquardt": [], "current only": [], "LD_MMA, 100 evaluations": []}
    mma = SolveOptions(max_iterations=100, candidates=("current",))
    for seed in range(count):
        start = placed(problem, seed)
        values["levenberg-marquardt"].append(LevenbergMarquardt().solve(start).value)
        values["current only"].append(
            LevenbergMarquardt().solve(start, SolveOptions(candidates=("current",))).value
        )
        values["LD_MMA, 100 evaluations"].append(NLoptSolver(algorithm="LD_MMA").solve(start, mma).value)
    known = MultiStartSolver(starts=starts).solve(problem).value
    best = min(known, *(min(found) for found in values.values()))
    return {name: float(np.mean(np.array(found) <= 1.02 * best)) for name, found in values.items()}


def told(
    figures: dict[str, dict[str, float]], rows: list[dict[str, float]], success: dict[str, float]
) -> dict[str, str]:
    """Figures as lines of the results, each with what it has to meet."""
    lines = {
        f"{name}, 1000 points, 57 dofs{BARS.get(name, '')}": f"{ms:.3f} ms"
        for name, ms in figures["evaluation"].items()
    }
    for kind in ("cold", "warm"):
        clock, processor = (figures["solves"][f"{kind}, median {unit}"] for unit in ("ms", "processor ms"))
        lines[f"{KINDS[kind]}{BARS[kind]}"] = f"{clock:.1f} ms by the clock, {processor:.1f} of processor"
    for name in ("evaluations", "ms"):
        own, gradient, authors = (median(row[name + of] for row in rows) for of in ("", ", MMA", ", authors"))
        lines[f"to 1.02 of the optimum, {name}: ours, LD_MMA with our gradient, the authors' scheme"] = (
            f"{own:.0f}, {gradient:.0f}, {authors:.0f}"
        )
    arrived = [sum(row[f"reached by {of}"] for row in rows) for of in ("MMA", "authors")]
    lines["  arrived there, LD_MMA and the authors' scheme (else the figures are lower bounds)"] = (
        f"{arrived[0]:.0f} and {arrived[1]:.0f} of {len(rows)}"
    )
    fewer = min(row["evaluations, authors"] / row["evaluations"] for row in rows)
    faster = min(row["ms, MMA"] / row["ms"] for row in rows)
    lines["  times fewer evaluations than the authors' scheme, least (bar: 200)"] = f"{fewer:.0f}"
    lines["  times less time than LD_MMA with our gradient, least (bar: 10)"] = f"{faster:.0f}"
    return lines | {
        f"placements within 2 % of the lowest known, {name}": f"{100 * share:.0f} %"
        for name, share in success.items()
    }


KINDS = {
    "cold": "500 contacts, solve from a random placement, median",
    "warm": "500 contacts, again after one of six patches moved by 1 cm, median",
}
BARS = {"value and gradient": " (bar: 0.5 ms)", "cold": " (bar: 60 ms)", "warm": " (bar: 25 ms)"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats: a smoke test, which is not recorded")
    parser.add_argument("--placements", type=int, default=50)
    given = parser.parse_args()
    few = given.quick
    drags = live((4, 6) if few else (4, 6, 7, 8), 5 if few else 25)
    figures = {"evaluation": kernels(20 if few else 300), "solves": solves(4 if few else 25)}
    rows = beside_the_authors(1 if few else 2, 200 if few else 1200)
    lines = told(figures, rows, placements(4 if few else given.placements, 8 if few else 200))
    lines |= {
        f"a drag's problem made anew, 500 contacts, object of {faces} faces (first, then; processor)": (
            f"{first:.1f}, {later:.1f} ms"
        )
        for faces, (first, later) in drags.items()
    }
    if few:
        sys.stdout.writelines(f"{name}: {line}\n" for name, line in lines.items())
    else:
        record("Posing", lines)


if __name__ == "__main__":
    main()
