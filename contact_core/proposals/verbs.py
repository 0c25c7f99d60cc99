"""The verbs of a session that propose: the answer is shown as a ghost until it is accepted or dismissed."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING

from contact_core.edit.verbs import SurfaceVerbs, Verbs
from contact_core.errors import CommandRejected
from contact_core.proposals import PENALTY, REACH, ROUNDS, SLACK, TURN

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager
    from contact_core.proposals.draft import Draft
    from contact_core.proposals.proposal import Proposal, ProposalSettings


class ProposalVerbs(Verbs, SurfaceVerbs):
    """Settle, slide, accept, dismiss."""

    @property
    @abstractmethod
    def plugins(self) -> PluginManager:
        """The plugins of the session."""

    @property
    @abstractmethod
    def revision(self) -> int:
        """Revision of the committed document."""

    @abstractmethod
    def show_ghost(self, ghost: Proposal | None) -> None:
        """Tell listeners of a preview; None: back to the document."""

    def settle(
        self, *, rounds: int = ROUNDS, reach: float = REACH, settings: ProposalSettings | None = None
    ) -> Proposal:
        """Propose every contact at the closest point of its object that faces it, the pose solved again, in rounds.

        Needs a placer called "from pose". reach: contacts farther away than this stay, in manipulator lengths.
        Raises InvalidInput without a pair to settle, and Cancelled.
        """
        from contact_core.proposals.proposal import ProposalSettings, settle

        found = settle(self._draft(), self.plugins, self.revision, settings or ProposalSettings(), rounds, reach)
        self.show_ghost(found)
        return found

    def slide(
        self,
        *,
        slack: float = SLACK,
        turn: float = TURN,
        penalty: float = PENALTY,
        settings: ProposalSettings | None = None,
    ) -> Proposal:
        """Propose pose and contacts solved together, each contact free within its slack on its surface.

        slack: in manipulator lengths. turn: radians, of the headings. penalty: of a slide by the whole slack.
        Raises InvalidInput without a pair that can slide, and Cancelled.
        """
        from contact_core.proposals.proposal import ProposalSettings, slide

        settings = settings or ProposalSettings()
        found = slide(self._draft(), self.plugins, self.revision, settings, slack, turn, penalty)
        self.show_ghost(found)
        return found

    def accept(self, proposal: Proposal) -> int:
        """Commit a proposal as one undo step. Raises CommandRejected when the document has changed since."""
        if proposal.revision != self.revision:
            raise CommandRejected("the document has changed since this was proposed: propose again.")
        return self.submit(proposal.command)

    def dismiss(self, proposal: Proposal) -> None:
        """Take the ghost away; nothing was committed."""
        if proposal.revision == self.revision:
            self.show_ghost(None)

    def _draft(self) -> Draft:
        from contact_core.proposals.draft import Draft

        return Draft(self.document, self.derived, self.rigs)
