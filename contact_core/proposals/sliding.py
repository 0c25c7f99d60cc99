"""Sliding contacts: target patches may move a little on their surface while the pose is solved.

It answers three complaints about transferred contacts: lost finger spacing, other curvature, roots placed a little
off. The slide is limited by the artist's slack, penalised, and may not take skin deeper into the object than it
stood before (`depth_bound`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from contact_core.contact.placement import Root
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_map import SurfaceMap
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals.depth_bound import DepthBound, measured
from contact_core.proposals.sliding_targets import SlidingPatch, SlidingTargets
from contact_core.solve.body import Body
from contact_core.solve.penetration import Solids
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, SolveStatus

SLIDING = ".sliding"  # what the body of the sliding patches of a surface is called: its name and this
ITERATIONS = 20  # at most in a round: the pose is nearly there, and what comes later gains a few hundredths
NO_PROXIES: Mapping[str, SurfaceMap] = MappingProxyType({})
ROUNDS = 5  # of solving and moving the walls; two are usual


@dataclass(frozen=True, eq=False)
class SlidSolution:
    """The pose, and where each patch went: roots by contact name. solution: with sliding targets; its objective is
    that of the problem before, and the penalty. fixed: before anything slid."""

    fixed: PoseSolution
    solution: PoseSolution
    roots: dict[str, Root]


def sliding_problem(
    problem: PoseProblem, patches: Sequence[SlidingPatch], proxies: Mapping[str, SurfaceMap] = NO_PROXIES
) -> PoseProblem:
    """The problem in which the named contacts meet sliding targets instead of fixed points.

    proxies: by surface, the map to the proxy that its patches run on: roots are then on the proxy.
    Raises InvalidInput for a contact that is not there, or one on what moves or bends.
    """
    contacts = {contact.name: contact for contact in problem.contacts}
    wanted = {patch.contact: patch for patch in patches}
    for name in wanted:
        if name not in contacts:
            raise InvalidInput(f"the problem has no contact {name!r} whose target could slide.")
    by_surface: dict[str, list[str]] = {}
    for name, contact in contacts.items():  # in the problem's order, in which bodies are asked for their points
        if name in wanted:
            by_surface.setdefault(contact.object, []).append(name)
    bodies, free = list(problem.bodies), dict(problem.free or {})
    for surface, names in by_surface.items():
        targets = _targets(problem, surface, [wanted[name] for name in names], proxies.get(surface))
        bodies.append(Body.evaluated(surface + SLIDING, targets))
        free[surface + SLIDING] = [dof.name for dof in targets.dofs]
        contacts |= {name: replace(contacts[name], object=surface + SLIDING) for name in names}
    return replace(
        problem,
        bodies=tuple(bodies),
        contacts=tuple(contacts.values()),
        free=None if problem.free is None else free,
        length=problem.manipulator_length,
    )


def _targets(
    problem: PoseProblem, surface: str, patches: Sequence[SlidingPatch], seen: SurfaceMap | None
) -> SlidingTargets:
    index = problem.body_index(surface)
    owner = problem.bodies[index]
    if len(owner.rig.joints) > 1 or len(problem.free_of_body[index]):
        raise InvalidInput(f"{surface!r} moves or bends; contacts slide on bodies that stay.")
    world = problem.start_state.world[int(problem.bone_offsets[index])] @ np.linalg.inv(owner.rig.bind_world[0])
    meant = {contact.name: contact.object_points for contact in problem.contacts}
    walked = owner.rig.surface if seen is None else seen.proxy
    return SlidingTargets(walked, patches, world, [meant[patch.contact] for patch in patches], seen)


def solve_sliding(
    solver: PoseSolver,
    problem: PoseProblem,
    patches: Sequence[SlidingPatch],
    options: SolveOptions | None = None,
    progress: Progress = NO_PROGRESS,
    solids: Solids | None = None,
    proxies: Mapping[str, SurfaceMap] = NO_PROXIES,
) -> SlidSolution:
    """Solve the pose with fixed targets first, then pose and slides together from there, no deeper than there.

    options: of the first solve, and of the second from where that ended. solids: closed meshes by body that skin
    stays out of; by default the surfaces of rigid bodies. The deepest skin vertex is then no deeper than before,
    and no more of the skin's area is inside; where no slide keeps to that, nothing slides. proxies: see
    `sliding_problem`.
    """
    fixed = solver.solve(problem, options, progress.part(0.0, 0.5, "before sliding"))
    together = sliding_problem(problem.at(fixed.theta), patches, proxies)
    options = options or SolveOptions()
    settings = replace(options, max_iterations=min(options.max_iterations, ITERATIONS), candidates=("current",))
    if fixed.status is SolveStatus.CANCELLED:
        return SlidSolution(fixed, _still(together, fixed), {})
    solution = _no_deeper(solver, together, fixed, settings, progress.part(0.5, 1.0, "sliding"), solids)
    roots: dict[str, Root] = {}
    for index, body in enumerate(together.bodies):
        if isinstance(body.black_box, SlidingTargets):
            roots |= body.black_box.roots(together.full_theta(index, solution.theta))
    return SlidSolution(fixed, solution, roots)


def _no_deeper(
    solver: PoseSolver,
    problem: PoseProblem,
    fixed: PoseSolution,
    options: SolveOptions,
    progress: Progress,
    solids: Solids | None,
) -> PoseSolution:
    """The solution of a problem with no skin deeper in the solids than at its start, which is `fixed`.

    Where the walls gave way they are moved, and the pose alone goes on: it is smooth, while points jump where the
    path to them passes a vertex.
    """
    bound, begin, rounds = DepthBound.of(problem, solids), problem, list[PoseSolution]()
    for number in range(ROUNDS):
        wall = bound.term()
        part = progress.part(number / ROUNDS, (number + 1) / ROUNDS)
        found = solver.solve(replace(begin, terms=(*problem.terms, wall)), options, part)
        theta = problem.theta_of(found.poses) if rounds else found.theta  # later rounds solve for the pose alone
        rounds.append(found)
        now = measured(problem, theta, bound.solids)
        if found.status is SolveStatus.CANCELLED or bound.holds(now):
            value = found.value - found.terms[wall.name]
            return _in_all(
                rounds, replace(found, problem=problem, theta=theta, value=value, start_value=fixed.value)
            )
        slid = {name: pose.joints for name, pose in found.poses.items() if name.endswith(SLIDING)}
        begin, bound = replace(problem.at(theta), held={**(problem.held or {}), **slid}), bound.tightened(now)
    note = f"After {ROUNDS} rounds skin was still deeper than before, so the contacts stay where they are."
    return _in_all(rounds, replace(_still(problem, fixed), notes=(*fixed.notes, note)))


def _still(problem: PoseProblem, fixed: PoseSolution) -> PoseSolution:
    """The solution of a sliding problem in which nothing slides."""
    return replace(fixed, problem=problem, theta=problem.start, start_value=fixed.value)


def _in_all(rounds: Sequence[PoseSolution], answer: PoseSolution) -> PoseSolution:
    """An answer with what all rounds took."""
    return replace(
        answer,
        trace=tuple(value for found in rounds for value in found.trace),
        evaluations=sum(found.evaluations for found in rounds),
        seconds=sum(found.seconds for found in rounds),
    )
