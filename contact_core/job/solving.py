"""The pose problem of a job, the plugin that solves it, and contacts that move with the pose."""

from __future__ import annotations

from dataclasses import replace

from contact_core.edit.pose_problem import pose_problem as problem_of_pairs
from contact_core.errors import Cancelled
from contact_core.job.workpiece import HAND, OBJECT, Job
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_TERMS
from contact_core.plugins.solving import solve_by_plugin
from contact_core.proposals.draft import Draft
from contact_core.proposals.proposal import AGAIN, Proposal, ProposalSettings, settle, slide
from contact_core.rig.rig import Pose
from contact_core.solve.body import Body
from contact_core.solve.problem import Limits, PoseProblem
from contact_core.solve.solver import PoseSolution, SolveOptions, SolveStatus
from contact_core.solve.terms import PoseTerm, paper_terms

SOLVE, MOVE, MEASURE = 0.45, 0.55, 0.7  # where these begin, as fractions of the job


def solve(job: Job, plugins: PluginManager) -> None:
    """Pose the manipulator by the job's pairs. Raises Cancelled when the user stops it, InvalidInput for wrong
    settings."""
    problem, options = pose_problem(job, plugins, job.start), _options(job)
    moves = job.recipe.solve.settle or job.recipe.solve.slide
    part = job.progress.part(SOLVE, MOVE if moves else MEASURE, "Solving the pose")
    solution = solve_by_plugin(problem, plugins, job.recipe.solve.solver, options, part)
    if solution.status is SolveStatus.CANCELLED:
        raise Cancelled("the solve was cancelled.")
    _take(job, solution)
    job.session.set_pose(HAND, job.pose, title="Solve")


def move_contacts(job: Job, plugins: PluginManager) -> None:
    """Settle contacts, then let them slide, where the recipe asks for it: proposals, accepted as they come."""
    spec, options = job.recipe.solve, _options(job, AGAIN)
    settings = ProposalSettings(
        solver=spec.solver,
        options=options,
        terms=_terms(job, plugins),
        limits=_limits(job),
        solids={OBJECT: job.solids} if job.solids else {},
    )
    middle = 0.5 * (MOVE + MEASURE)
    if spec.settle:
        settling = replace(settings, progress=job.progress.part(MOVE, middle, "Settling contacts"))
        _accept(job, settle(_draft(job), plugins, job.session.revision, settling, rounds=spec.settle))
    if spec.slide:
        sliding = replace(settings, progress=job.progress.part(middle, MEASURE, "Sliding contacts"))
        _accept(job, slide(_draft(job), plugins, job.session.revision, sliding, slack=spec.slide))


def _draft(job: Job) -> Draft:
    return Draft(job.session.document, job.session.derived, job.session.rigs)


def _accept(job: Job, proposal: Proposal) -> None:
    job.session.accept(proposal)
    job.notes += [f"{name} stays where it is: {why}." for name, why in proposal.left_out.items()]
    _take(job, proposal.after)


def _take(job: Job, solution: PoseSolution) -> None:
    job.solution, job.pose = solution, solution.poses[HAND]


def _options(job: Job, candidates: tuple[str, ...] | None = None) -> SolveOptions:
    """The recipe's options; candidates: in place of the recipe's."""
    wanted = dict(job.recipe.solve.options)
    own = tuple(wanted.pop("candidates", SolveOptions().candidates))
    return SolveOptions(
        max_iterations=wanted.pop("max_iterations", 200),
        tolerance=wanted.pop("tolerance", 1e-5),
        candidates=candidates or own,
        seed=wanted.pop("seed", 0),
        more=wanted,
    )


def pose_problem(job: Job, plugins: PluginManager, start: Pose) -> PoseProblem:
    """The job's pairs, the paper's terms in the recipe's weights, and the penetration term where it is on."""
    bodies = {
        HAND: Body.skinned(job.rig, name=HAND, pose=start),
        OBJECT: Body.rigid(OBJECT, job.object.mesh, world_from_surface=job.placed),
    }
    pairs = job.session.pairs()
    return problem_of_pairs(pairs, bodies.__getitem__, _terms(job, plugins), limits=_limits(job))


def _terms(job: Job, plugins: PluginManager) -> tuple[PoseTerm, ...]:
    spec = job.recipe.solve
    terms = paper_terms(*spec.weights)
    if spec.penetration > 0.0 and job.solids:
        term = plugins.get(POSE_TERMS, "penetration")
        terms += (_made(term)(spec.penetration, solids={OBJECT: job.solids}),)
    return terms


def _limits(job: Job) -> Limits:
    return "rig" if job.recipe.solve.limits else "none"


def _made(term: object) -> type:
    """The class of a registered term: the slot holds one made with its defaults."""
    return term if isinstance(term, type) else type(term)
