"""The pose problem of a job, and the plugin that solves it."""

from __future__ import annotations

from contact_core.errors import Cancelled
from contact_core.job.workpiece import Job
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_TERMS
from contact_core.plugins.solving import solve_by_plugin
from contact_core.pose.body import Body, PairedPoints
from contact_core.pose.problem import PoseProblem
from contact_core.pose.rig import Pose
from contact_core.pose.solver import Iteration, PoseSolution, SolveOptions, SolveStatus
from contact_core.pose.terms import PoseTerm, paper_terms


def solve(job: Job, plugins: PluginManager, *, again: bool = False) -> tuple[PoseSolution, Pose]:
    """Pose the manipulator by the job's pairs; `again` goes on from the pose found before.

    Raises Cancelled when the user stops it, InvalidInput for wrong settings.
    """
    problem = pose_problem(job, plugins, job.pose if again else job.start)
    wanted = dict(job.recipe.solve.options)
    candidates = tuple(wanted.pop("candidates", SolveOptions().candidates))
    options = SolveOptions(
        max_iterations=wanted.pop("max_iterations", 200),
        tolerance=wanted.pop("tolerance", 1e-5),
        candidates=("current",) if again else candidates,
        seed=wanted.pop("seed", 0),
        more=wanted,
    )
    most = options.max_iterations

    def seen(iteration: Iteration) -> bool:
        share = min(iteration.number / most, 1.0)
        if job.progress is None:
            return False
        return job.progress(0.45 + 0.2 * share, f"Solving the pose, iteration {iteration.number}") is False

    solution = solve_by_plugin(problem, plugins, job.recipe.solve.solver, options, seen)
    if solution.status is SolveStatus.CANCELLED:
        raise Cancelled("the job was cancelled; nothing was written.")
    return solution, solution.poses[job.manipulator.name]


def pose_problem(job: Job, plugins: PluginManager, start: Pose) -> PoseProblem:
    """The job's pairs, the paper's terms in the recipe's weights, and the penetration term where it is on."""
    spec = job.recipe.solve
    hand, thing = job.manipulator.name, job.object.name
    terms: list[PoseTerm] = list(paper_terms(*spec.weights))
    if spec.penetration > 0.0 and job.solids:
        term = plugins.get(POSE_TERMS, "penetration")
        terms.append(_made(term)(spec.penetration, solids={thing: job.solids}))
    contacts = tuple(
        PairedPoints(pair.pair.name, hand, pair.manipulator_points, thing, pair.object_points, pair.weights)
        for pair in job.session.pairs()
    )
    return PoseProblem(
        bodies=(
            Body.skinned(job.rig, name=hand, pose=start),
            Body.rigid(thing, job.object.mesh, world_from_surface=job.placed),
        ),
        contacts=contacts,
        terms=tuple(terms),
        limits="rig" if spec.limits else "none",
    )


def _made(term: object) -> type:
    """The class of a registered term: the slot holds one made with its defaults."""
    return term if isinstance(term, type) else type(term)
