"""The history: every step keeps the document before and after it, so undo is a pointer and never an inverse."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, apply_command
from contact_core.errors import CommandRejected


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One committed command. revision: of `after`, never used twice. origin: who did it ("user", "host", ...).

    merged: it took the place of the step before it, whose command is part of its own.
    """

    revision: int
    command: Command
    before: ContactDocument
    after: ContactDocument
    origin: str
    merged: bool = False


class History:
    """Steps from a base document, and a cursor among them.

    Documents share structure, so a step costs a few kilobytes. A new command after an undo drops the undone
    steps; their revision numbers are not used again.
    """

    def __init__(self, document: ContactDocument, revision: int = 0) -> None:
        self._base = document
        self._base_revision = revision
        self._steps: list[Step] = []
        self._cursor = 0  # how many steps are done
        self._last_revision = revision
        self._clean: int | None = revision

    @property
    def document(self) -> ContactDocument:
        """The current document."""
        return self._steps[self._cursor - 1].after if self._cursor else self._base

    @property
    def base(self) -> ContactDocument:
        """The document before the first step."""
        return self._base

    @property
    def base_revision(self) -> int:
        """Revision of the base document."""
        return self._base_revision

    @property
    def revision(self) -> int:
        """Revision of the current document."""
        return self._steps[self._cursor - 1].revision if self._cursor else self._base_revision

    @property
    def steps(self) -> tuple[Step, ...]:
        """All steps, done and undone, in order."""
        return tuple(self._steps)

    @property
    def done(self) -> tuple[Step, ...]:
        """The steps that led to the current document."""
        return tuple(self._steps[: self._cursor])

    @property
    def can_undo(self) -> bool:
        """Whether a step lies behind the cursor."""
        return self._cursor > 0

    @property
    def can_redo(self) -> bool:
        """Whether a step lies ahead of the cursor."""
        return self._cursor < len(self._steps)

    @property
    def is_clean(self) -> bool:
        """Whether the current document is the one last marked clean (saved)."""
        return self._clean == self.revision

    def mark_clean(self) -> None:
        """Remember the current document as saved."""
        self._clean = self.revision

    def mark_saved(self, revision: int | None) -> None:
        """Remember the document of a revision as the saved one; None: no revision that undo can reach is."""
        self._clean = revision

    def prepare(self, command: Command, origin: str = "user", *, merge: bool = False) -> Step:
        """The step that `commit` would take; nothing changes yet. Raises CommandRejected.

        With `merge`, and where the command before it agrees, the two become one step.
        """
        after = apply_command(command, self.document)
        step = Step(self._last_revision + 1, command, self.document, after, origin)
        last = self._steps[self._cursor - 1] if merge and self._cursor and not self.is_clean else None
        joined = last.command.merge(command) if last and last.origin == origin else None
        if last is None or joined is None:
            return step
        return Step(step.revision, joined, last.before, after, origin, merged=True)

    def commit(self, step: Step) -> Step:
        """Take a prepared step: undone steps are dropped, a merged step takes the place of the last."""
        follows = self._steps[self._cursor - 1].before if step.merged and self._cursor else self.document
        if step.before is not follows or step.revision <= self._last_revision:
            raise CommandRejected("this step was prepared on another document.")
        self._cursor -= step.merged
        del self._steps[self._cursor :]
        self._steps.append(step)
        self._cursor += 1
        self._last_revision = step.revision
        return step

    def do(self, command: Command, origin: str = "user", *, merge: bool = False) -> Step:
        """Apply and commit. Raises CommandRejected; then nothing has changed."""
        return self.commit(self.prepare(command, origin, merge=merge))

    def do_as(self, command: Command, origin: str, revision: int, *, merged: bool = False) -> Step:
        """Apply and commit under the revision number that a journal gave it, in place of the last step if `merged`.

        Raises CommandRejected; then nothing has changed.
        """
        if revision <= self._last_revision:
            raise CommandRejected(f"revision {revision} comes after revision {self._last_revision} already.")
        if merged and not self.can_undo:
            raise CommandRejected("there is no step that this one could take the place of.")
        before = self._steps[self._cursor - 1].before if merged else self.document
        return self.commit(Step(revision, command, before, apply_command(command, before), origin, merged))

    def undo(self) -> Step:
        """Step back; returns the step that was undone. Raises CommandRejected at the beginning."""
        if not self.can_undo:
            raise CommandRejected("there is nothing to undo.")
        self._cursor -= 1
        return self._steps[self._cursor]

    def redo(self) -> Step:
        """Step forward again; returns the step. Raises CommandRejected at the end."""
        if not self.can_redo:
            raise CommandRejected("there is nothing to redo.")
        self._cursor += 1
        return self._steps[self._cursor - 1]

    def goto(self, revision: int) -> ContactDocument:
        """Make the document of `revision` current. Raises CommandRejected where the history does not hold it."""
        self._cursor = self._position(revision)
        return self.document

    def holds(self, revision: int) -> bool:
        """Whether `goto(revision)` would succeed."""
        position = bisect_left(self._steps, revision, key=lambda step: step.revision)
        at_step = position < len(self._steps) and self._steps[position].revision == revision
        return at_step or revision == self._base_revision

    def document_at(self, revision: int) -> ContactDocument:
        """The document of `revision`, without going there. Raises CommandRejected."""
        position = self._position(revision)
        return self._steps[position - 1].after if position else self._base

    def _position(self, revision: int) -> int:
        """How many steps are done at `revision`."""
        if not self.holds(revision):
            last = self._steps[-1].revision if self._steps else self._base_revision
            raise CommandRejected(
                f"the history holds no revision {revision}; it runs from {self._base_revision} to {last}"
                f" and forgets what was undone and then replaced."
            )
        if revision == self._base_revision:
            return 0
        return bisect_left(self._steps, revision, key=lambda step: step.revision) + 1
