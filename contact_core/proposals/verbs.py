"""The verbs of a session that propose: the result is shown as a ghost until it is accepted or dismissed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from contact_core.document.document import ContactDocument
from contact_core.document.timeline import address
from contact_core.edit.derived import Derived
from contact_core.errors import CommandRejected
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.proposals import PENALTY, REACH, ROUNDS, SLACK, TURN

if TYPE_CHECKING:
    from contact_core.edit.command import Command
    from contact_core.edit.verbs import Film
    from contact_core.motion.detection import DetectionOptions
    from contact_core.plugins.manager import PluginManager
    from contact_core.proposals.detection import Detection
    from contact_core.proposals.draft import Draft
    from contact_core.proposals.motion import MotionSettings
    from contact_core.proposals.proposal import Ghost, Proposal, SolveSettings
    from contact_core.rig.pose_keys import PoseKeys
    from contact_core.rig.rig import Pose, Rig
    from contact_core.scene.binding import Binding
    from contact_core.scene.problem import Objective
    from contact_core.scene.surfaces import SceneSurfaces
    from contact_core.solve.layout import Limits
    from contact_core.solve.problem import PoseProblem
    from contact_core.solve.solver import SolveOptions
    from contact_core.solve.term import PoseTerm


class ProposingSession(ABC):
    """Solve, settle, slide, accept, dismiss. rigs: by surface."""

    rigs: dict[str, Rig]
    surfaces: SceneSurfaces
    timeline: Film

    @property
    @abstractmethod
    def timed_document(self) -> ContactDocument:
        """The document with its tracks and spans, of which `document` is a frame."""

    @property
    @abstractmethod
    def document(self) -> ContactDocument:
        """The document that proposals start from."""

    @property
    @abstractmethod
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""

    @property
    @abstractmethod
    def plugins(self) -> PluginManager:
        """The plugins of the session."""

    @property
    @abstractmethod
    def binding(self) -> Binding:
        """Which objects of the scene stand behind the surfaces."""

    @property
    @abstractmethod
    def revision(self) -> int:
        """Revision of the committed document."""

    @abstractmethod
    def show_ghost(self, ghost: Ghost | None) -> None:
        """Tell listeners of a preview; None: back to the document."""

    @abstractmethod
    def do(
        self,
        command: Command,
        *,
        origin: str = "user",
        merge: bool = False,
        keys: Mapping[float, Mapping[str, Pose]] | None = None,
        curves: Mapping[str, PoseKeys] | None = None,
    ) -> None:
        """Commit a command and key poses in the scene, as one undo step of document and scene."""

    def solve(
        self,
        *,
        frames: Sequence[float] | None = None,
        solver: str | None = None,
        solver_settings: Mapping[str, Any] | None = None,
        terms: Iterable[str | PoseTerm] | None = None,
        free: Mapping[str, Iterable[str]] | None = None,
        held: Mapping[str, Iterable[str]] | None = None,
        prior: Literal["rest", "current"] | Mapping[str, Pose] = "rest",
        limits: Limits = "rig",
        pairs: Iterable[str] | None = None,
        options: SolveOptions | None = None,
        progress: Progress = NO_PROGRESS,
        settings: SolveSettings | None = None,
        motion: MotionSettings | None = None,
    ) -> Proposal:
        """Propose the pose that brings all pairs together, from where things stand in the scene now.

        frames: solve a motion through all these frames at once, and key it when it is accepted (a MotionProposal);
        None is the scene as it stands, not keyed. `timeline.window()` are the frames round a key that was dragged.
        motion: how frames hang together, and how near few keys come to them.
        solver: a name; None leaves the choice to the plugins. solver_settings: its own.
        terms: terms, or names of registered ones that are added to the paper's three; the paper's by default.
        free, held: joints or single dofs by surface that may move, and that may not. prior: what the prior pulls
        to. pairs: names of those that count; all by default.
        settings: all that comes before it but the frames, in one value. Nothing is committed:
        `accept` does that. Where it is cancelled, what was best so far is proposed, with the
        status CANCELLED. Raises InvalidInput without a pair of a rig that can be posed.
        """
        from contact_core.proposals.motion import MotionSettings, propose_motion
        from contact_core.proposals.proposal import SolveSettings, solve
        from contact_core.scene.problem import Objective

        if settings is None:
            chosen = None if pairs is None else self._known_pairs(tuple(pairs))
            objective = Objective(self._terms(terms), limits, free, held, prior, chosen)
            own = dict(solver_settings or {})
            settings = SolveSettings(solver, options, objective, progress, solver_settings=own)
        if frames is None:
            found = solve(self.document, self._draft(), self.plugins, self.revision, settings)
        else:
            found = propose_motion(
                self.timed_document, self.timeline.frame, frames, self._draft, self.plugins, self.revision,
                settings, motion or MotionSettings(), self.binding if self.binding.has_scene else None,
            )  # fmt: skip
        self.show_ghost(found)
        return found

    def problem(self, objective: Objective | None = None) -> PoseProblem:
        """The pose problem of the document as the scene has it now: what `solve` gives to a solver."""
        return self._draft().problem(objective)

    def detect(
        self,
        frames: Sequence[float] | None = None,
        *,
        options: DetectionOptions | None = None,
        progress: Progress = NO_PROGRESS,
    ) -> Detection:
        """Propose the contacts of an animation: skin that is close to an object and slow over it becomes patches,
        pairs and spans.

        frames: by default all of the timeline. The animation is that of the scene, or of the document's own keys.
        Raises InvalidInput without a rig or an object, and Cancelled.
        """
        from contact_core.proposals.detection import detect

        chosen = self.timeline.settings.frames() if frames is None else frames
        found = detect(
            self.timed_document, self.timeline.frame, chosen, self._draft, self.derived, self.rigs, self.revision,
            options, progress,
        )  # fmt: skip
        self.show_ghost(found)
        return found

    def settle(
        self, *, rounds: int = ROUNDS, reach: float = REACH, settings: SolveSettings | None = None
    ) -> Proposal:
        """Propose every contact at the closest point of its object that faces it, the pose solved again, in rounds.

        Needs a placer that is the default for "settle". reach: contacts farther away than this stay, in manipulator
        lengths. Raises InvalidInput without a pair to settle, and Cancelled.
        """
        from contact_core.proposals.proposal import SolveSettings, settle

        settings = settings or SolveSettings()
        found = settle(self.document, self._draft(), self.plugins, self.revision, settings, rounds, reach)
        self.show_ghost(found)
        return found

    def slide(
        self,
        *,
        slack: float = SLACK,
        turn: float = TURN,
        penalty: float = PENALTY,
        settings: SolveSettings | None = None,
    ) -> Proposal:
        """Propose pose and contacts solved together, each contact free within its slack on its surface.

        slack: in manipulator lengths. turn: radians, of the headings. penalty: of a slide by the whole slack.
        Raises InvalidInput without a pair that can slide, and Cancelled.
        """
        from contact_core.proposals.proposal import SolveSettings, slide

        settings = settings or SolveSettings()
        found = slide(self.document, self._draft(), self.plugins, self.revision, settings, slack, turn, penalty)
        self.show_ghost(found)
        return found

    def accept(self, proposal: Ghost) -> None:
        """Commit a proposal: contacts and poses of the document, poses and keys of the scene, as one undo step.

        Raises CommandRejected when the document has changed since.
        """
        if proposal.revision != self.revision:
            raise CommandRejected("the document has changed since this was proposed: propose again.")
        self.do(proposal.command, keys=proposal.keys, curves=proposal.curves)

    def dismiss(self, proposal: Ghost) -> None:
        """Take the ghost away; nothing was committed."""
        if proposal.revision == self.revision:
            self.show_ghost(None)

    def scene_at(self, frame: float) -> ContactDocument:
        """The document at a frame, without time, with things placed and posed as the scene has them there; what has
        keys of its own place in the document stands as those say."""
        still = self.timed_document.at(frame)
        read = self.binding.read(still, frame)
        placed = (name for name in still.surfaces if address("place", name) in self.timed_document.tracks)
        surfaces = read.surfaces.updated({name: still.surfaces[name] for name in placed})
        return read if surfaces is read.surfaces else replace(read, surfaces=surfaces)

    def _draft(self, frame: float | None = None) -> Draft:
        """The document as the scene has it at a frame, to work on."""
        from contact_core.proposals.draft import Draft

        self.surfaces.follow_freedoms()
        document = self.binding.read(self.document, None) if frame is None else self.scene_at(frame)
        posed = {
            document.patch(end).surface
            for pair in document.pairs.values()
            for end in (pair.manipulator, pair.object)
        }
        return Draft(document, self.derived, self.rigs, self.binding.evaluated(sorted(posed)))

    def _terms(self, terms: Iterable[str | PoseTerm] | None) -> tuple[PoseTerm, ...]:
        """The paper's terms, and those named; terms that are given as values replace the paper's."""
        from contact_core.plugins.registry import POSE_TERMS
        from contact_core.solve.terms import paper_terms

        asked = list(terms or ())
        values = tuple(term for term in asked if not isinstance(term, str))
        named = tuple(self.plugins.make(POSE_TERMS, term) for term in asked if isinstance(term, str))
        return (values or paper_terms()) + named

    def _known_pairs(self, names: tuple[str, ...]) -> tuple[str, ...]:
        from contact_core.document.document import named

        for name in names:
            named(self.document.pairs, name, "pair")
        return names
