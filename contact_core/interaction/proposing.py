"""Solve, settle, slide and suggest beside the window: found on a thread, shown as a ghost, then accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from contact_core.document.document import ContactDocument
from contact_core.errors import CommandRejected
from contact_core.grasping.slots import GRASP_SAMPLERS
from contact_core.interaction.live import body_terms
from contact_core.interaction.overlay import Ghost, Overlay
from contact_core.interaction.seen import SeenScene, SeenSurface
from contact_core.interaction.work import Worker
from contact_core.progress import Progress
from contact_core.proposals.draft import Draft
from contact_core.scene.problem import Objective
from contact_core.solve.solver import SolveStatus
from contact_core.solve.terms import paper_terms

if TYPE_CHECKING:
    from contact_core.grasping.finishing import Suggestion
    from contact_core.grasping.scene import GraspScene
    from contact_core.interaction.desk import Desk
    from contact_core.proposals.proposal import Proposal, SolveSettings

_GHOST = (0.55, 0.75, 1.0)
_COINCIDES = 0.01  # of the surface's diagonal: a ghost that is so near to what it is the ghost of is not drawn
_SUGGEST = "Suggest"
Find = Callable[[ContactDocument, Draft, "SolveSettings"], "Proposal"]


class Proposing:
    """What is proposed now, and the work that finds it. The worker gets documents and meshes, never the session."""

    def __init__(self, desk: Desk, worker: Worker) -> None:
        self._desk, self._worker = desk, worker
        self.proposal: Proposal | None = None
        self.suggestions: tuple[Suggestion, ...] = ()  # found so far, in the order in which they came
        self._drawn: tuple[SeenScene, ContactDocument, Overlay] | None = (
            None  # what it was made of, and what is shown
        )

    @property
    def summary(self) -> str:
        """What is proposed, in a few words; "" for nothing."""
        if self.proposal is None:
            return ""
        if self.suggestions:
            return self._suggested
        what = "stopped, the best so far" if self.is_cut_short else "proposed"
        return f"{what}: contacts within {self.proposal.nearness}; Enter keeps it, Escape leaves it"

    @property
    def is_cut_short(self) -> bool:
        """Whether what is proposed is what a solve had when it was cancelled."""
        return self.proposal is not None and self.proposal.after.status is SolveStatus.CANCELLED

    @property
    def _suggested(self) -> str:
        place = self._place
        one, count = self.suggestions[place], len(self.suggestions)
        fails = "" if one.is_grasp else f", but {one.verdict.failures[0]}"
        others = "Down and Up show others, " if count > 1 else ""
        return f"grasp {place + 1} of {count}: {one.kind}{fails}; {others}Enter keeps it, Escape leaves it"

    @property
    def _place(self) -> int:
        return next(n for n, one in enumerate(self.suggestions) if one.proposal is self.proposal)

    def solve(self) -> None:
        """Begin to solve the pose."""
        from contact_core.proposals.proposal import solve

        plugins, revision = self._desk.session.plugins, self._desk.session.revision
        self._begin("Solve", lambda start, draft, settings: solve(start, draft, plugins, revision, settings))

    def settle(self) -> None:
        """Begin to settle the contacts and solve the pose."""
        from contact_core.proposals.proposal import settle

        plugins, revision = self._desk.session.plugins, self._desk.session.revision
        self._begin("Settle", lambda start, draft, settings: settle(start, draft, plugins, revision, settings))

    def slide(self) -> None:
        """Begin to let contacts slide with the pose."""
        from contact_core.proposals.proposal import slide

        plugins, revision = self._desk.session.plugins, self._desk.session.revision
        self._begin("Slide", lambda start, draft, settings: slide(start, draft, plugins, revision, settings))

    def suggest(self) -> None:
        """Begin to look for grasps of the selected object by the selected hand, or of the only ones; the first is
        shown when it comes. Raises CommandRejected where it is not clear which are meant, InvalidInput."""
        from contact_core.grasping.searching import GraspSettings
        from contact_core.grasping.suggest import suggest

        desk, plugins = self._desk, self._desk.session.plugins
        scene = self.scene_of_those_meant()
        sampler = plugins.name_for(GRASP_SAMPLERS, "grasp")
        settings = GraspSettings(
            desk.settings.suggestions, sampler=sampler, sampler_settings=desk.given(GRASP_SAMPLERS, sampler)
        )
        self.dismiss()
        self._worker.begin_some(_SUGGEST, lambda progress: suggest(scene(), settings, progress), self._take)

    def scene_of_those_meant(self) -> Callable[[], GraspScene]:
        """`grasp_scene_of` for the hand and the object that are meant. Raises CommandRejected, InvalidInput."""
        from contact_core.grasping.verbs import grasp_scene_of

        return grasp_scene_of(self._desk.session, self._meant(hand=True), self._meant(hand=False))

    def _meant(self, hand: bool) -> str:
        """The hand, or the object, that is selected: by itself, by the active patch, or as the only one."""
        session, selection = self._desk.session, self._desk.selection
        names = [name for name in session.document.surfaces if (name in session.rigs) == hand]
        patches = (session.document.patch(name).surface for name in reversed(selection.patches))
        meant = next((name for name in (selection.surface, *patches) if name in names), None)
        if meant is not None or len(names) == 1:
            return meant or names[0]
        what = "hand" if hand else "object"
        raise CommandRejected(
            f"there are several: select the {what} that is meant, or a patch on it."
            if names
            else f"there is no {what} here: open one first."
        )

    def _take(self, found: Suggestion) -> None:
        """One more; the first is shown, and the others wait until they are asked for."""
        if found.proposal.revision != self._desk.session.revision:
            self._stop_looking()
            raise CommandRejected("the document has changed since this was begun: suggest again.")
        self.suggestions += (found,)
        if self.proposal is None:
            self.show(found.proposal)

    def take(self, found: Sequence[Suggestion]) -> None:
        """Show the first of several that came at once. Raises CommandRejected where the document has changed."""
        for one in found:
            self._take(one)

    def step(self, by: int) -> None:
        """Show the suggestion that comes `by` places after that which is shown, round and round.

        Raises CommandRejected where there is none.
        """
        if not self.suggestions:
            raise CommandRejected("no grasp has been suggested: Suggest looks for some.")
        self.show(self.suggestions[(self._place + by) % len(self.suggestions)].proposal)

    def _stop_looking(self) -> None:
        if self._worker.status is not None and self._worker.status.title == _SUGGEST:
            self._worker.drop()

    def _begin(self, title: str, find: Find) -> None:
        from contact_core.proposals.proposal import SolveSettings

        session, settings = self._desk.session, self._desk.settings
        self._check_pairs()
        self.dismiss()
        objective, solver = self.objective(), settings.solver
        start, derived, rigs = session.document, session.derived.apart(), dict(session.rigs)
        read = session.binding.read(start)  # as the scene has it; the host is asked here and not on the thread

        def work(progress: Progress) -> Proposal:
            draft = Draft(read, derived, rigs)
            return find(start, draft, SolveSettings(solver, objective=objective, progress=progress))

        self._worker.begin(title, work, self.show)

    def solve_film(self, frames: Sequence[float] | None = None) -> None:
        """Begin to solve the film, or some of its frames, as a whole. Raises CommandRejected without a range."""
        film = self._desk.session.timeline
        if film.settings.first == film.settings.last:
            raise CommandRejected("the film has one frame: say its last frame first.")
        self.solve_frames(film.settings.frames() if frames is None else frames)

    def solve_frames(self, frames: Sequence[float]) -> None:
        """Begin to solve frames as a whole, whether or not they are the film's.

        Raises CommandRejected without a pair.
        """
        from contact_core.interaction.film_solving import film_work

        session = self._desk.session
        self._check_pairs()
        self.dismiss()
        work = film_work(session, tuple(frames), self.objective(), self._desk.settings.solver)
        self._worker.begin("Solve the film", work, self.show)

    def objective(self) -> Objective:
        """What a pose is solved for, as the settings say: the paper's terms, and those that keep a hand a hand."""
        settings = self._desk.settings
        terms = paper_terms(prior=settings.prior_weight) + body_terms(self._desk)
        if settings.prior == "rest":
            return Objective(terms)
        return Objective(terms, prior=dict(self._desk.session.document.poses))

    def _check_pairs(self) -> None:
        if not self._desk.session.document.pairs:
            raise CommandRejected("there is no pair yet, so nothing pulls on the hand: pair two patches first.")

    def show(self, proposal: Proposal) -> None:
        """Show a proposal in place of the document, until it is accepted or dismissed.

        Raises CommandRejected where the document has changed since it was begun, or where a locked patch moves.
        """
        if proposal.revision != self._desk.session.revision:
            raise CommandRejected("the document has changed since this was begun: solve again.")
        self._desk.locks.check(self._desk.session.document, proposal.ghost)
        self.proposal, self._desk.ghost = proposal, proposal.ghost
        self._desk.session.show_ghost(proposal)

    def accept(self) -> None:
        """Commit what is proposed, as one step. Raises CommandRejected where nothing is."""
        proposal = self.proposal
        if proposal is None:
            raise CommandRejected("nothing is proposed: solve first.")
        self._desk.locks.check(self._desk.session.document, proposal.ghost)
        self._stop_looking()
        self.forget()
        self._desk.session.accept(proposal)

    def dismiss(self) -> None:
        """Back to the document."""
        if self.proposal is not None:
            proposal = self.proposal
            self.forget()
            self._desk.session.dismiss(proposal)

    def forget(self) -> None:
        """The document moved on: what was proposed for another is nothing now."""
        self.proposal, self._desk.ghost, self.suggestions, self._drawn = None, None, (), None

    def overlay(self) -> Overlay:
        """The hand as it was, behind the one that is proposed."""
        if self.proposal is None:
            return Overlay()
        session, desk = self._desk.session, self._desk
        if self._drawn is None or self._drawn[0] is not desk.scene or self._drawn[1] is not desk.base:
            before = desk.scene.following(desk.base, session.derived.known_meshes, session.rigs, desk.hidden)
            moved = sorted(before.moved_since(desk.scene) & before.surfaces.keys())
            ghosts = (ghost_of(before.surfaces[name], desk.scene.surfaces.get(name)) for name in moved)
            self._drawn = desk.scene, desk.base, Overlay(ghosts=tuple(ghost for ghost in ghosts if ghost))
        return self._drawn[2]


def ghost_of(before: SeenSurface, now: SeenSurface | None) -> Ghost | None:
    """What a surface was before, without the faces that hardly moved: there two skins would show in patches, each
    through the other. None where all of it stayed."""
    points, faces = before.points, before.mesh.faces
    if now is not None and len(now.points) == len(points):
        away = np.linalg.norm(now.points - points, axis=1)
        nearest = _COINCIDES * before.scale * before.rest.bounding_box_diagonal
        faces = faces[(away[faces] > nearest).any(axis=1)]
    return Ghost(points, faces, _GHOST, surface=before.name) if len(faces) else None
