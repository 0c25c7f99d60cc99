"""A draft of a document: verbs work on it one after the other, and nothing is committed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.edit.derived import Derived
from contact_core.edit.document_geometry import DocumentGeometry
from contact_core.edit.editor import Editor, Makers
from contact_core.rig.rig import Rig


class DocumentDraft:
    """An editor of a document of its own that remembers what was done to it, so that all of it can be committed as
    one step.

    rigs: by surface. timed: the document with tracks and spans, of which `document` is a frame; the same by
    default.
    """

    def __init__(
        self,
        document: ContactDocument,
        derived: Derived,
        rigs: Mapping[str, Rig],
        makers: Makers | None = None,
        timed: ContactDocument | None = None,
    ) -> None:
        self._document = document
        self._timed = None if timed is document else timed
        self._derived = derived
        self.rigs = dict(rigs)
        self.makers = makers or Makers()
        self.geometry = DocumentGeometry(lambda: self._document, derived, self.rigs)
        self.commands: tuple[Command, ...] = ()

    @staticmethod
    def of(editor: Editor) -> DocumentDraft:
        """A draft of what an editor has now."""
        return DocumentDraft(editor.document, editor.derived, editor.rigs, editor.makers, editor.timed_document)

    @property
    def document(self) -> ContactDocument:
        """The document as the draft has it now."""
        return self._document

    @property
    def timed_document(self) -> ContactDocument:
        """The same with its tracks and spans, where the draft is of a frame."""
        return self._document if self._timed is None else self._timed

    @property
    def derived(self) -> Derived:
        """Reconstructed geometry, cached."""
        return self._derived

    def do(self, command: Command, *, origin: str = "user") -> None:
        """Take a command into the draft. Raises CommandRejected; then nothing has changed."""
        document = apply_command(command, self._document)
        if self._timed is not None:  # what a frame shows keys nothing by itself
            self._timed = apply_command(command, self._timed)
            document = replace(document, tracks=self._document.tracks)
        self._document = document
        self.commands = (*self.commands, command)

    def command(self, title: str) -> Command | None:
        """The one command that does all of it; None where nothing was done."""
        if len(self.commands) <= 1:
            return self.commands[0] if self.commands else None
        return Macro(title, self.commands)
