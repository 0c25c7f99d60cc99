"""Proposals: solve the pose, settle the contacts, or let them slide with the pose.

None is ever silent: each returns a `Proposal`, a ghost that a person looks at and accepts as one undo step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command
from contact_core.errors import Cancelled, InvalidInput, NotManifold
from contact_core.plugins.registry import PLACERS, POSE_SOLVERS
from contact_core.plugins.slots import PlacementRequest
from contact_core.plugins.solving import PluginSolver
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals import PENALTY, REACH, ROUNDS, SLACK, TURN
from contact_core.proposals.draft import Draft, change
from contact_core.proposals.sliding import solve_sliding
from contact_core.proposals.sliding_targets import SlidingPatch
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective, world_from_surface
from contact_core.solve.body import uniform_scale
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.penetration import Solids
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, SolveStatus

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager

AGAIN = ("current",)  # starting candidates once there is a pose


@dataclass(frozen=True, eq=False)
class Ghost:
    """Something that is shown and not yet committed.

    command: what accepting commits. ghost: the document with it, which adapters show. revision: of the document
    that it was made for. keys: by frame, the poses by surface that accepting keys in the scene. curves: by surface,
    cubic keys that it gets where it has curves.
    """

    command: Command
    ghost: ContactDocument
    revision: int
    keys: Mapping[float, Mapping[str, Pose]] = field(default_factory=dict, kw_only=True)
    curves: Mapping[str, PoseKeys] = field(default_factory=dict, kw_only=True)


@dataclass(frozen=True, eq=False)
class Proposal(Ghost):
    """A pose, perhaps with contacts moved, not yet committed.

    before, after: solutions with the contacts where they were, and as proposed; the same where no contact moves.
    left_out: pairs that stay where they are, with the reason. solutions: one for each frame.
    """

    before: PoseSolution
    after: PoseSolution
    left_out: Mapping[str, str] = field(default_factory=dict)
    solutions: tuple[PoseSolution, ...] = ()

    @property
    def poses(self) -> Mapping[str, Pose]:
        """By surface, the poses that it proposes (those of the last frame)."""
        return self.ghost.poses

    @property
    def nearness(self) -> str:
        """How near 95 % of the points of the pair that is worst came, with a unit: "4.2 mm"."""
        worst = max((each.p95 for each in self.after.patches.values()), default=0.0)
        return self.ghost.surface(self.after.problem.bodies[0].name).told(worst)  # whose units the problem has


@dataclass(frozen=True, eq=False)
class SolveSettings:
    """How to solve. solver: a name; None leaves the choice to the plugins. objective: terms, limits, what is free.
    solver_settings: the solver's own.

    solids: closed meshes by surface, in its space, whose inside is out of bounds; by default each surface that
    does not bend is its own. Give filled bodies of what is hollow.
    """

    solver: str | None = None
    options: SolveOptions | None = None
    objective: Objective = field(default_factory=Objective)
    progress: Progress = NO_PROGRESS
    solids: Solids | None = None
    solver_settings: Mapping[str, Any] = field(default_factory=dict)

    def solver_of(self, plugins: PluginManager) -> PoseSolver:
        """The solver; the core's own where no plugin offers any."""
        by_plugin = self.solver is not None or plugins.offers(POSE_SOLVERS)
        return PluginSolver(plugins, self.solver, self.solver_settings) if by_plugin else LevenbergMarquardt()

    def options_of(self, draft: Draft) -> SolveOptions:
        """The options; by default a rig that has a pose starts from it alone."""
        posed = any(name in draft.rigs for name in draft.document.poses)
        return self.options or (SolveOptions(candidates=AGAIN) if posed else SolveOptions())


def solve(
    start: ContactDocument, draft: Draft, plugins: PluginManager, revision: int, settings: SolveSettings
) -> Proposal:
    """The pose that brings the pairs of the draft together. start: the document that accepting changes; the draft's
    may have things placed and posed as the scene has them."""
    problem = _problem(draft, settings, "solving")
    solution = settings.solver_of(plugins).solve(problem, settings.options_of(draft), settings.progress)
    draft.take(solution)
    command = change(start, draft.document, "Solve")
    return Proposal(command, draft.document, revision, solution, solution, solutions=(solution,))


def settle(
    start: ContactDocument,
    draft: Draft,
    plugins: PluginManager,
    revision: int,
    settings: SolveSettings,
    rounds: int = ROUNDS,
    reach: float = REACH,
) -> Proposal:
    """Rounds of: every contact to the closest point that faces it on its object, then solve again.

    The round with the lowest objective is proposed, only a pose where none improves on contacts left alone. reach:
    contacts farther away than this stay, in manipulator lengths.
    """
    solver, options = settings.solver_of(plugins), settings.options_of(draft)
    problem = _problem(draft, settings, "settling")
    parts = [settings.progress.part(k / (rounds + 1), (k + 1) / (rounds + 1)) for k in range(rounds + 1)]
    before = after = _solved(draft, solver, problem, options, parts[0])
    best, left_out = draft.document, dict[str, str]()
    for part in parts[1:]:
        left_out = _place_all(draft, plugins, reach, settings.solids or {})
        again = replace(options, candidates=AGAIN)
        moved = draft.problem(settings.objective)
        solution = _solved(draft, solver, moved, again, part)
        if solution.value < after.value:
            best, after = draft.document, solution
    command = change(start, best, "Settle contacts")
    return Proposal(command, best, revision, before, after, left_out)


def slide(
    start: ContactDocument,
    draft: Draft,
    plugins: PluginManager,
    revision: int,
    settings: SolveSettings,
    slack: float = SLACK,
    turn: float = TURN,
    penalty: float = PENALTY,
) -> Proposal:
    """The pose and all contacts solved together: each may move on its surface within a slack, and skin gets no
    deeper into what is solid than with the contacts left alone (see `sliding`).

    slack: in manipulator lengths. turn: radians.
    """
    unmoved = draft.document
    problem, options = _problem(draft, settings, "sliding"), settings.options_of(draft)
    patches, left_out = _sliding_patches(draft, problem, slack, turn, penalty)
    solver, proxies = settings.solver_of(plugins), draft.geometry.proxies
    slid = solve_sliding(solver, problem, patches, options, settings.progress, settings.solids, proxies)
    _raise_if_cancelled(slid.solution)
    for contact, root in slid.roots.items():
        name = unmoved.pairs[contact].object
        if root != draft.geometry.root(name):
            draft.patches.put(name, root)
    draft.take(slid.solution)
    command = change(start, draft.document, "Slide contacts")
    return Proposal(command, draft.document, revision, slid.fixed, slid.solution, left_out)


def _problem(draft: Draft, settings: SolveSettings, act: str) -> PoseProblem:
    problem = draft.problem(settings.objective) if draft.document.pairs else None
    if problem is None or not any(body.name in draft.rigs for body in problem.bodies):
        raise InvalidInput(f"{act} needs contact pairs with a rig that can be posed: pair patches first.")
    return problem


def _solved(
    draft: Draft, solver: PoseSolver, problem: PoseProblem, options: SolveOptions, progress: Progress
) -> PoseSolution:
    solution = solver.solve(problem, options, progress)
    _raise_if_cancelled(solution)
    draft.take(solution)
    return solution


def _raise_if_cancelled(solution: PoseSolution) -> None:
    if solution.status is SolveStatus.CANCELLED:
        raise Cancelled("it was cancelled; nothing is proposed.")


def _bends(draft: Draft, contact: str) -> str:
    """Why a contact cannot move on its object, empty where it can."""
    pair = draft.document.pairs[contact]
    surfaces = [draft.document.patch(end).surface for end in (pair.manipulator, pair.object)]
    if surfaces[1] in draft.rigs:
        return f"{surfaces[1]} bends, and contacts only move on surfaces that stay as they are"
    return "" if surfaces[0] in draft.rigs else f"{surfaces[0]} has no rig that is posed"


def _place_all(draft: Draft, plugins: PluginManager, reach: float, solids: Solids) -> dict[str, str]:
    """One round: contacts to their closest facing points; answers those that stay, with the reason."""
    left_out = {name: why for name in draft.document.pairs if (why := _bends(draft, name))}
    groups: dict[tuple[str, str], list[str]] = {}
    for name, pair in draft.document.pairs.items():
        if name not in left_out:
            ends = draft.document.patch(pair.manipulator).surface, draft.document.patch(pair.object).surface
            groups.setdefault(ends, []).append(name)
    for (hand, thing), names in groups.items():
        pairs = {name: draft.document.pairs[name] for name in names}
        world = {name: world_from_surface(draft.document, name) for name in (hand, thing)}
        request = PlacementRequest(
            rig=draft.rigs[hand],
            pose=draft.document.poses[hand],
            object_mesh=draft.geometry.mesh(thing),
            object_from_rig=np.asarray(np.linalg.inv(world[thing]) @ world[hand]),
            patch_points={name: draft.geometry.points(pair.manipulator) for name, pair in pairs.items()},
            patch_axes={name: draft.geometry.axis_points(pair.manipulator) for name, pair in pairs.items()},
            reach=reach,
            solids=tuple(solids.get(thing, ())),
        )
        result = plugins.get(PLACERS, plugins.name_for(PLACERS, "settle")).place(request)
        for name, place in result.placed.items():
            try:
                draft.patches.place(pairs[name].object, place.root, direction=place.direction)
            except NotManifold as error:  # one broken edge costs the contact beside it, not the others
                left_out[name] = str(error)
        left_out.update(result.left_out)
    return left_out


def _sliding_patches(
    draft: Draft, problem: PoseProblem, slack: float, turn: float, penalty: float
) -> tuple[list[SlidingPatch], dict[str, str]]:
    document, patches, left_out = draft.document, [], {}
    for contact, pair in document.pairs.items():
        patch, reason = document.patch(pair.object), _bends(draft, contact)
        if not reason and patch.shape != document.patch(pair.manipulator).shape:
            reason = "its two patches were painted apart, and share no shape"
        if reason:
            left_out[contact] = reason
            continue
        body = problem.bodies[problem.body_index(patch.surface)]
        patches.append(
            SlidingPatch(
                contact,
                document.shapes[patch.shape],
                draft.geometry.root(pair.object),
                slack * problem.manipulator_length / uniform_scale(body.world_from_rig),
                turn=turn,
                penalty=penalty,
                axis=document.surface_axis(pair.object),
            )
        )
    return patches, left_out
