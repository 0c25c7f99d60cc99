"""The hand follows: the pose solved again for what a gesture previews, from where the last solve left it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from contact_core.arrays import FloatArray
from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command
from contact_core.edit.commands import SetPose
from contact_core.grasping.filled import KeepOutOfHollowsTerm
from contact_core.interaction.work import Worker
from contact_core.plugins.registry import POSE_SOLVERS, POSE_TERMS
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective, contact_of, poses_of, problem_of, world_from_surface
from contact_core.solve.body import PairedPoints
from contact_core.solve.levenberg_marquardt import FIRST_DAMPING, few_steps
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolution, PoseSolver, SolveOptions, SolveStatus
from contact_core.solve.stretch import SkinStretchTerm
from contact_core.solve.term import PoseTerm
from contact_core.solve.terms import paper_terms

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk
    from contact_core.interaction.settings import InteractionSettings
    from contact_core.plugins.manager import PluginManager
    from contact_core.session import Session

_STEPS_AT_RELEASE = 40
_MOST_IDLE = 5  # steps without any gain, while the damping grows, after which the pose counts as settled
_WORTH = 1e-4  # of the objective: a step that gains less is not seen, and the pose counts as settled


class LiveSolve:
    """The solve that follows one gesture.

    The problem stays warm: bodies, charts, what a term needs of the skin, and the contacts that are not dragged are
    kept from step to step (`PoseProblem.continued`), and each step starts from the pose before. So a step makes a
    few iterations, and the next one goes on until the pose has settled.

    beside: steps are made on a thread, one at a time: `follow` begins one for the newest preview and takes it over
    when it is done, and never waits. Rigs that only their host evaluates are asked on the session's thread all the
    same. milliseconds: of the last step. solves: how many there were; tests guard the cost by counting.
    """

    def __init__(self, desk: Desk, *, beside: bool = False) -> None:
        self._desk, self._worker = desk, Worker() if beside else None
        self._start: Mapping[str, Pose] = dict(desk.document.poses)
        self._last = self._start
        self._contacts = KeptContacts(desk.session)
        self._seen: tuple[object, ...] = self._asked_of(desk.document)
        self._done: Command | None = None
        self._pinned: tuple[PoseTerm, ...] = ()
        self._warm: tuple[tuple[object, ...], PoseProblem] | None = None
        self._theta: FloatArray | None = None
        self._settled = self._converged = True
        self._damping, self._idle, self._to_the_end = FIRST_DAMPING, 0, False
        self.milliseconds, self.solves = 0.0, 0

    @property
    def is_due(self) -> bool:
        """Whether the gesture previews something that no solve has followed yet, or to the end."""
        desk = self._desk
        if self._is_under_way or (desk.pins and (desk.pins is not self._pinned or not self._settled)):
            return True
        if not desk.settings.live or desk.settled or desk.edit is None:
            return False
        return desk.edit is not self._done or not self._settled

    def finish(self) -> None:
        """Follow until the pose has settled, or for as many iterations as a solve beside the window may make.

        The problem is made anew for it: what a term keeps while contacts are dragged (which hollows are filled) is
        then as a solve after the gesture has it.
        """
        if self._worker is not None:
            self._worker.wait()
            self._worker.poll()
            self._worker = None
        self._to_the_end = True
        self._settled = self._settled and self._converged and not self.solves
        self._warm = None
        for _ in range(_STEPS_AT_RELEASE):
            if not self.follow():
                return

    def close(self) -> None:
        """The gesture is over: no step goes on."""
        if self._worker is not None:
            self._worker.close()

    def follow(self) -> bool:
        """Preview the pose of a step that is done, and go on with one for what is previewed now; whether there was
        anything to show.

        Raises InvalidInput for settings and plugins that do not fit the problem.
        """
        shown = self._worker is not None and self._worker.poll()
        if self._is_under_way or not self.is_due:
            return shown
        return self._begin() or shown

    @property
    def _is_under_way(self) -> bool:
        return self._worker is not None and self._worker.status is not None

    def _begin(self) -> bool:
        """Make a step for what is previewed now, or let the thread make it; whether a pose is shown already."""
        desk, began = self._desk, time.perf_counter()
        self._done, self._pinned = desk.edit, desk.pins
        asked = self._asked_of(desk.document)
        if _same(asked, self._seen) and self._settled:
            return self._preview({n: p for n, p in self._last.items() if p is not self._start.get(n)})
        self._seen = asked
        problem = self._problem(desk.document)
        if problem is None or not len(problem.start):
            self._settled = self._converged = True
            return False
        step = self._step(problem)
        if self._worker is None or any(body.black_box is not None for body in problem.bodies):
            return self._take(step(), began)

        def take(found: tuple[PoseSolution, float]) -> None:
            self._take(found, began)

        self._worker.begin("Follow", lambda _: step(), take)
        return False

    def _take(self, found: tuple[PoseSolution, float], began: float) -> bool:
        """Preview what a step found; whether there is any pose."""
        solution, self._damping = found
        self._theta = solution.theta
        gained = solution.start_value - solution.value
        little = (
            not self._to_the_end and 0.0 < gained <= _WORTH * solution.start_value
        )  # no gain at all: the steps were too bold
        self._idle = 0 if gained > 0.0 else self._idle + 1
        self._converged = solution.status is not SolveStatus.STOPPED
        self._settled = self._converged or little or self._idle >= _MOST_IDLE
        poses = poses_of(solution, self._desk.session.rigs)
        self._last = {**self._last, **poses}
        shown = self._preview(poses)
        self.milliseconds, self.solves = 1e3 * (time.perf_counter() - began), self.solves + 1
        return shown

    def _preview(self, poses: Mapping[str, Pose]) -> bool:
        """Let poses follow the edit; whether there are any."""
        if poses:
            self._desk.stroke.follow(tuple(SetPose(name, pose) for name, pose in poses.items()))
        return bool(poses)

    def _asked_of(self, document: ContactDocument) -> tuple[object, ...]:
        """What a solve depends on, by identity: contacts, where surfaces stand, pins."""
        return (*self._contacts.of(document), *document.surfaces.values(), *self._desk.pins)

    def _step(self, problem: PoseProblem) -> Callable[[], tuple[PoseSolution, float]]:
        """What makes the step, of values only: the solution, and the damping to go on with."""
        settings, damping = self._desk.settings, self._damping
        if settings.solver is None:
            return lambda: few_steps(problem, settings.iterations, damping)
        solver: PoseSolver = self._desk.made(POSE_SOLVERS, settings.solver)
        options = SolveOptions(max_iterations=settings.iterations, candidates=("current",))
        return lambda: (solver.solve(problem, options), damping)

    def _problem(self, document: ContactDocument) -> PoseProblem | None:
        """The problem of a document: that of the last step with what is new, or made anew where it is another."""
        desk, contacts = self._desk, self._contacts.of(document)
        pulled = tuple(name for name in _bodies(desk.pins) if name in desk.session.rigs)
        if not contacts and not pulled:
            return None
        bodies = dict.fromkeys(n for each in contacts for n in (each.manipulator, each.object))
        bodies.update(dict.fromkeys(pulled))
        kind = (*bodies, desk.held, desk.settings)
        if self._warm is not None and self._warm[0] == kind and self._theta is not None:
            before = self._warm[1]
            own = tuple(term for term in before.terms if not getattr(term, "bodies", ()))
            moved = tuple(
                replace(b, world_from_rig=world_from_surface(document, b.name, desk.scene.meters_per_unit))
                for b in before.bodies
            )
            problem = before.continued(self._theta, contacts, own + desk.pins, moved)
        else:
            problem = self._made(document, contacts, pulled)
        if all(body.black_box is None for body in problem.bodies):
            self._warm = kind, problem
        return problem

    def before_any_contact(self) -> tuple[PoseProblem, ...]:
        """For each hand the problem of a drag, but for its contacts: what its terms keep can be built with it.

        Rigs that only the host can evaluate are left out.
        """
        scene, rigs = self._desk.scene.surfaces, self._desk.session.rigs
        things = tuple(name for name in scene if name not in rigs and len(scene[name].rest.faces))
        made = (self._made(self._desk.document, (), (name, *things)) for name in scene if name in rigs)
        return tuple(each for each in made if all(body.black_box is None for body in each.bodies))

    def _made(
        self, document: ContactDocument, contacts: tuple[PairedPoints, ...], pulled: tuple[str, ...]
    ) -> PoseProblem:
        desk = self._desk
        posed = replace(document, poses=document.poses.updated(dict(self._last)))
        pairs = tuple(contact.name for contact in contacts)
        objective = Objective(prior=self._prior(), bodies=pulled, pairs=pairs)
        evaluated = desk.session.binding.evaluated(sorted(document.surfaces)) if desk.session.host else None
        problem = problem_of(
            desk.session.geometry.of(posed), desk.session.rigs, objective, evaluated, desk.scene.meters_per_unit
        )
        return replace(problem, contacts=contacts, terms=self._terms(problem), held=self._held(problem))

    def _prior(self) -> Literal["rest", "current"] | Mapping[str, Pose]:
        kind = self._desk.settings.prior
        return self._start if kind == "start" else kind

    def _terms(self, problem: PoseProblem) -> tuple[PoseTerm, ...]:
        terms = paper_terms(prior=self._desk.settings.prior_weight) + self._desk.pins
        rigid = any(len(body.rig.joints) == 1 and body.black_box is None for body in problem.bodies)
        return terms + body_terms(self._desk, rigid=rigid)

    def _held(self, problem: PoseProblem) -> dict[str, tuple[str, ...]]:
        """The joints that are held, by the bodies that have them."""
        held = (*self._desk.settings.held, *self._desk.held)
        return {body.name: tuple(j for j in held if j in body.rig.joints) for body in problem.bodies}


class KeptContacts:
    """The pairs of a document as contacts; a pair none of whose patches changed is the same object again."""

    def __init__(self, session: Session) -> None:
        self._geometry, self._known = session.geometry, session.derived.known_meshes
        self._kept: dict[str, tuple[tuple[object, ...], PairedPoints]] = {}
        self._of: tuple[ContactDocument | None, tuple[PairedPoints, ...]] = None, ()

    def of(self, document: ContactDocument) -> tuple[PairedPoints, ...]:
        """The contacts of pairs on surfaces whose meshes are loaded, in the order of the document."""
        if self._of[0] is not document:
            found = (self._contact(document, name) for name in document.pairs)
            self._of = document, tuple(contact for contact in found if contact is not None)
        return self._of[1]

    def _contact(self, document: ContactDocument, name: str) -> PairedPoints | None:
        pair = document.pairs[name]
        made_of: list[object] = [pair]
        for end in (pair.manipulator, pair.object):
            for patch in (end, *document.ancestors(end)):
                made_of += [document.patch(patch), document.shape_of(patch)]
            if document.surface(document.patch(end).surface).digest not in self._known:
                return None
        kept = self._kept.get(name)
        if kept is not None and _same(kept[0], tuple(made_of)):
            return kept[1]
        found = self._geometry.of(document).pair(name)
        contact = contact_of(found)
        if kept is not None:  # the end that did not change keeps its identity, and so its track
            before, now = kept[1], contact
            mine = before.manipulator_points.same_as(now.manipulator_points)
            theirs = before.object_points.same_as(now.object_points)
            contact = replace(
                now,
                manipulator_points=before.manipulator_points if mine else now.manipulator_points,
                object_points=before.object_points if theirs else now.object_points,
            )
        self._kept[name] = tuple(made_of), contact
        return contact


def body_terms(desk: Desk, *, rigid: bool = True) -> tuple[PoseTerm, ...]:
    """The terms that keep a hand a hand, as the settings want them: skin stays out of solids, and is not torn.

    They are the same while a hand follows as in the solve after it, or the one would lead to poses that the other
    does not find out of again (a thumb drawn through a cup's thin wall). rigid: whether there is anything solid.
    """
    settings, plugins = desk.settings, desk.session.plugins
    terms: list[PoseTerm] = []
    if settings.stretch_weight > 0.0:
        terms.append(SkinStretchTerm(weight=settings.stretch_weight))
    if rigid and settings.penetration and settings.penetration_weight > 0.0 and plugins.offers(POSE_TERMS):
        terms.append(_depth_term(settings, plugins))
    return tuple(terms)


def _depth_term(settings: InteractionSettings, plugins: PluginManager) -> PoseTerm:
    if settings.hollows:
        return KeepOutOfHollowsTerm(weight=settings.penetration_weight)
    name = plugins.name_for(POSE_TERMS, "depth")
    term: PoseTerm = plugins.make(POSE_TERMS, name, weight=settings.penetration_weight)
    return term


def _bodies(pins: tuple[Any, ...]) -> tuple[str, ...]:
    """The bodies that terms name as theirs, by their attribute `bodies`."""
    return tuple(name for pin in pins for name in getattr(pin, "bodies", ()))


def _same(first: tuple[object, ...], second: tuple[object, ...]) -> bool:
    """Whether two lists hold the same objects, or values that are equal (patches, pairs, pins)."""
    return len(first) == len(second) and all(a is b or a == b for a, b in zip(first, second, strict=True))
