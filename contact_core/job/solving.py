"""What the job asks of its session: solve the pose, then settle contacts or let them slide."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from contact_core.errors import Cancelled
from contact_core.job.workpiece import HAND, OBJECT, Job
from contact_core.plugins.registry import POSE_TERMS
from contact_core.proposals.proposal import AGAIN, Proposal, SolveSettings
from contact_core.scene.problem import Objective
from contact_core.settings import configured
from contact_core.settings import settings_of as declared_by
from contact_core.solve.solver import SolveOptions, SolveStatus
from contact_core.solve.terms import PoseTerm, paper_terms

SOLVE, MOVE, MEASURE = 0.45, 0.55, 0.7  # where these begin, as fractions of the job
COMMON = tuple(each.name for each in declared_by(SolveOptions))


def solve(job: Job) -> None:
    """Pose the manipulator by the job's pairs. Raises Cancelled when the user stops it, InvalidInput for wrong
    settings."""
    moves = job.recipe.solve.settle or job.recipe.solve.slide
    part = job.progress.part(SOLVE, MOVE if moves else MEASURE, "Solving the pose")
    proposal = job.session.solve(settings=replace(settings_of(job), progress=part))
    if proposal.after.status is SolveStatus.CANCELLED:
        raise Cancelled("the solve was cancelled.")
    _accept(job, proposal)


def move_contacts(job: Job) -> None:
    """Settle contacts, then let them slide, where the recipe asks for it: proposals, accepted as they come."""
    spec = job.recipe.solve
    settings = settings_of(job, AGAIN)
    middle = 0.5 * (MOVE + MEASURE)
    if spec.settle:
        settling = replace(settings, progress=job.progress.part(MOVE, middle, "Settling contacts"))
        _accept(job, job.session.settle(rounds=spec.settle, settings=settling))
    if spec.slide:
        sliding = replace(settings, progress=job.progress.part(middle, MEASURE, "Sliding contacts"))
        _accept(job, job.session.slide(slack=spec.slide, settings=sliding))


def settings_of(job: Job, candidates: tuple[str, ...] | None = None) -> SolveSettings:
    """The recipe's settings. candidates: in place of the recipe's."""
    options = _options(job, candidates)
    return SolveSettings(
        solver=job.recipe.solve.solver,
        solver_settings=_own_settings(job),
        options=options,
        objective=Objective(_terms(job), "rig" if job.recipe.solve.limits else "none"),
        solids={OBJECT: job.solids} if job.solids else {},
    )


def _accept(job: Job, proposal: Proposal) -> None:
    job.session.accept(proposal)
    job.notes += [f"{name} stays where it is: {why}." for name, why in proposal.left_out.items()]
    job.solution, job.pose = proposal.after, proposal.poses[HAND]


def _options(job: Job, candidates: tuple[str, ...] | None = None) -> SolveOptions:
    """What the recipe says to every solver. candidates: in place of the recipe's."""
    given = {name: value for name, value in job.recipe.solve.options.items() if name in COMMON}
    return configured(SolveOptions, given | ({"candidates": candidates} if candidates else {}), "solve.options")


def _own_settings(job: Job) -> dict[str, Any]:
    """What the recipe says to its solver alone."""
    return {name: value for name, value in job.recipe.solve.options.items() if name not in COMMON}


def _terms(job: Job) -> tuple[PoseTerm, ...]:
    spec = job.recipe.solve
    terms = paper_terms(*spec.weights)
    if spec.penetration > 0.0 and job.solids:
        plugins = job.session.plugins
        name = plugins.name_for(POSE_TERMS, "depth")
        terms += (plugins.make(POSE_TERMS, name, weight=spec.penetration, solids={OBJECT: job.solids}),)
    return terms
