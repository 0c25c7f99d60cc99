"""A stroke: one drag of the artist, previewed from the document at its start, committed once or not at all."""

from __future__ import annotations

from collections.abc import Callable

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, apply_command
from contact_core.edit.derived import Derived
from contact_core.edit.verbs import Verbs
from contact_core.errors import CommandRejected
from contact_core.rig.rig import Rig


class Stroke(Verbs):
    """All verbs, none of which commits: each replaces the preview by what it makes of the starting document.

    Nothing accumulates, so a drag there and back ends where it began. When the `with` block of
    `Session.stroke` ends, the last command is committed as one step; when it raises, nothing has happened.
    """

    def __init__(
        self,
        start: ContactDocument,
        revision: int,
        derived: Derived,
        rigs: dict[str, Rig],
        preview: Callable[[ContactDocument], None],
    ) -> None:
        self.rigs = rigs
        self._start = start
        self._revision = revision
        self._derived = derived
        self._preview = preview
        self._command: Command | None = None
        self._shown = start
        self._open = True

    @property
    def document(self) -> ContactDocument:
        """The document at the start of the stroke: what every verb starts from."""
        return self._start

    @property
    def preview_document(self) -> ContactDocument:
        """The document as the stroke shows it now."""
        return self._shown

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    @property
    def command(self) -> Command | None:
        """What would be committed now."""
        return self._command

    def submit(self, command: Command, *, origin: str = "user") -> int:
        """Preview a command in place of the one before. Raises CommandRejected; then the old preview stays."""
        if not self._open:
            raise CommandRejected("this stroke is over.")
        self._shown = apply_command(command, self._start)
        self._command = command
        self._preview(self._shown)
        return self._revision

    def cancel(self) -> None:
        """Back to the start; nothing will be committed unless another verb comes."""
        self._command, self._shown = None, self._start
        self._preview(self._start)

    def abandon(self) -> None:
        """End it with nothing to commit, nor to show."""
        self._command, self._shown, self._open = None, self._start, False

    def end(self) -> Command | None:
        """Close the stroke; answers what is to be committed."""
        self._open = False
        return self._command
