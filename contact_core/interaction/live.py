"""The hand follows: the pose solved again for what a gesture previews, from where the last solve left it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro
from contact_core.edit.commands import SetPose
from contact_core.plugins.registry import POSE_SOLVERS, POSE_TERMS
from contact_core.rig.rig import Pose
from contact_core.scene.problem import Objective, poses_of, problem_of
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.solver import PoseSolver, SolveOptions
from contact_core.solve.terms import PoseTerm, paper_terms

if TYPE_CHECKING:
    from contact_core.interaction.desk import Desk


class LiveSolve:
    """The solve that follows one gesture: each from the pose before, so the newest state costs a few steps.

    milliseconds: of the last solve. solves: how many there were; tests guard the cost by counting.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._start: Mapping[str, Pose] = dict(desk.document.poses)
        self._last = self._start
        self._seen: tuple[object, ...] = self._asked_of(desk.document)
        self._done: Command | None = None
        self._pinned: tuple[PoseTerm, ...] = ()
        self.milliseconds, self.solves = 0.0, 0

    @property
    def is_due(self) -> bool:
        """Whether the gesture previews something that no solve has followed yet."""
        desk = self._desk
        follows = desk.settings.live and not desk.settled and desk.command not in (None, self._done)
        return follows or (bool(desk.pins) and desk.pins is not self._pinned)

    def follow(self) -> bool:
        """Solve for what is previewed, and preview the pose with it; whether there was anything to solve.

        Raises InvalidInput for settings and plugins that do not fit the problem.
        """
        if not self.is_due:
            return False
        edit = None if self._desk.command is self._done else self._desk.command
        self._done, self._pinned = self._desk.command, self._desk.pins
        asked = self._asked_of(self._desk.document)
        if _same(asked, self._seen) and self._last is self._start:
            return False  # nothing that a pair sees has changed
        self._seen = asked
        began = time.perf_counter()
        poses = self._solved(self._desk.document)
        if not poses:
            return False
        self._last = {**self._last, **poses}
        posing = tuple(SetPose(name, pose) for name, pose in poses.items())
        title = "Pose " + ", ".join(poses) if edit is None else edit.label()
        self._done = Macro(title, (*(() if edit is None else (edit,)), *posing))
        self._desk.stroke.do(self._done)
        self.milliseconds, self.solves = 1e3 * (time.perf_counter() - began), self.solves + 1
        return True

    def _asked_of(self, document: ContactDocument) -> tuple[object, ...]:
        """What a solve depends on, by identity: points of paired patches, weights, where surfaces stand, pins."""
        derived = self._desk.session.derived
        asked: list[object] = [*document.pairs.values(), *document.surfaces.values(), *self._desk.pins]
        for pair in document.pairs.values():
            for end in (pair.manipulator, pair.object):
                if document.surface(document.patch(end).surface).digest in derived.known_meshes:
                    asked += [derived.patch(document, end), document.shape_of(end).weights]
        return tuple(asked)

    def _solved(self, document: ContactDocument) -> dict[str, Pose]:
        """Poses by surface for a document, none where nothing pulls on a rig."""
        problem = self._problem(document)
        if problem is None or not len(problem.start):
            return {}
        options = SolveOptions(max_iterations=self._desk.settings.iterations, candidates=("current",))
        return poses_of(self._solver().solve(problem, options), self._desk.session.rigs)

    def _problem(self, document: ContactDocument) -> PoseProblem | None:
        desk, rigs = self._desk, self._desk.session.rigs
        posed = replace(document, poses=document.poses.updated(dict(self._last)))
        pulled = tuple(name for name in _bodies(desk.pins) if name in rigs)
        if not document.pairs and not pulled:
            return None
        objective = Objective(prior=self._prior(), bodies=pulled)
        problem = problem_of(
            desk.session.geometry.of(posed), rigs, objective, meters_per_unit=desk.scene.meters_per_unit
        )
        return replace(problem, terms=self._terms(problem), held=self._held(problem))

    def _prior(self) -> Literal["rest", "current"] | Mapping[str, Pose]:
        kind = self._desk.settings.prior
        return self._start if kind == "start" else kind

    def _terms(self, problem: PoseProblem) -> tuple[PoseTerm, ...]:
        settings, plugins = self._desk.settings, self._desk.session.plugins
        terms = paper_terms(prior=settings.prior_weight) + self._desk.pins
        rigid = any(len(body.rig.joints) == 1 and body.black_box is None for body in problem.bodies)
        if settings.penetration and settings.penetration_weight > 0.0 and rigid and plugins.offers(POSE_TERMS):
            name = plugins.name_for(POSE_TERMS, "depth")
            terms += (plugins.make(POSE_TERMS, name, weight=settings.penetration_weight),)
        return terms

    def _held(self, problem: PoseProblem) -> dict[str, tuple[str, ...]]:
        """The joints that are held, by the bodies that have them."""
        held = (*self._desk.settings.held, *self._desk.held)
        return {body.name: tuple(j for j in held if j in body.rig.joints) for body in problem.bodies}

    def _solver(self) -> PoseSolver:
        name = self._desk.settings.solver
        if name is None:
            return LevenbergMarquardt()
        found: PoseSolver = self._desk.made(POSE_SOLVERS, name)
        return found


def _bodies(pins: tuple[Any, ...]) -> tuple[str, ...]:
    """The bodies that terms name as theirs, by their attribute `bodies`."""
    return tuple(name for pin in pins for name in getattr(pin, "bodies", ()))


def _same(first: tuple[object, ...], second: tuple[object, ...]) -> bool:
    return len(first) == len(second) and all(a is b for a, b in zip(first, second, strict=True))
