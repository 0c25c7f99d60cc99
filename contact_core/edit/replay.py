"""Replaying a journal, also a damaged one: what can be replayed after a lost line is, and what cannot is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_digest
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable, command_from_json
from contact_core.edit.history import History
from contact_core.edit.journal_file import ID_DIGITS, JournalContents, Line, whole_number
from contact_core.errors import ContactError, FileRefused

MOST_TOLD = 3  # sentences on single events


@dataclass(frozen=True, eq=False)
class Replayed:
    """history: what came of a journal. dropped: how many events could not be replayed. after_loss: steps that were
    replayed although something before them is lost. trouble: sentences on both, for the artist; none where the
    journal is sound."""

    history: History
    dropped: int
    after_loss: int
    trouble: tuple[str, ...]


def replay(
    contents: JournalContents, commands: CommandTable = BUILT_IN_COMMANDS, saved: ContactDocument | None = None
) -> Replayed:
    """The history that a journal records.

    commands: the kinds that it may hold. saved: the document file beside it. Where lines are lost, the history
    begins with it if a later line says that it was saved then, or if it is the document of the lost first line;
    steps before it cannot be undone. Steps after a lost line are applied to what there is without it, and can be
    undone. Raises FileRefused where it is not known what to begin with.
    """
    history, after = _start(contents, saved)
    run = _Run(history, after, commands)
    for line in contents.lines:
        if line.number > after:
            run.take(line)
    trouble = list(run.told[:MOST_TOLD])
    if run.dropped > MOST_TOLD:
        trouble.append(f"{run.dropped - MOST_TOLD} more cannot be replayed.")
    if run.after_loss:
        steps = "1 step" if run.after_loss == 1 else f"{run.after_loss} steps"
        trouble.append(f"Replayed without what is lost before: {steps}; check the result, or undo.")
    return Replayed(run.history, run.dropped, run.after_loss, tuple(trouble))


def _start(contents: JournalContents, saved: ContactDocument | None) -> tuple[History, int]:
    """The history to begin with, and the number of the last line that is part of it already."""
    if contents.damage is None and contents.base is not None:
        return History(contents.base, contents.base_revision), 1
    digest = None if saved is None else document_digest(saved)
    if saved is not None:
        lost_until = _first_after_loss(contents)
        for line in reversed(contents.saves):
            if line.event["file"] == digest and line.number >= lost_until:
                return History(saved, whole_number(line.event, "saved")), line.number
    if contents.base is not None:
        return History(contents.base, contents.base_revision), 1
    for candidate in (saved, ContactDocument()):
        if candidate is not None and document_digest(candidate)[:ID_DIGITS] == contents.journal_id:
            first = next((line.event.get("at") for line in contents.lines if "at" in line.event), 1)
            return History(candidate, first - 1 if isinstance(first, int) and first > 0 else 0), 1
    raise FileRefused("the first line of the journal is lost, and no document is known that it could begin with.")


def _first_after_loss(contents: JournalContents) -> int:
    """Number of the first line that follows a lost one; past the end where none does."""
    number = 0 if contents.base is None else 1
    for line in contents.lines:
        if line.number != number + 1:
            return line.number
        number = line.number
    return contents.last_number + 1


class _Run:
    """Replays line by line. _lost: whether anything is lost so far; _fresh: since the last event replayed."""

    def __init__(self, history: History, number: int, commands: CommandTable) -> None:
        self._commands = commands
        self.history = history
        self.told: list[str] = []
        self.dropped = self.after_loss = 0
        self._number = number
        self._lost = self._fresh = False

    def take(self, line: Line) -> None:
        if line.number != self._number + 1:
            self._lost = self._fresh = True
        self._number = line.number
        try:
            changed = self._apply(line.event)
        except ContactError as error:
            self._lost = self._fresh = True
            self.dropped += 1
            if len(self.told) < MOST_TOLD:
                self.told.append(f"the event on line {line.number} cannot be replayed: {error}")
            return
        if changed:
            self.after_loss += self._lost
            self._fresh = False

    def _apply(self, event: dict[str, Any]) -> bool:
        """Returns whether the event made a step or moved among the steps."""
        for kind, act in _KINDS.items():
            if kind in event:
                act(self, event)
                return kind != "saved"
        return False

    def _do(self, event: dict[str, Any]) -> None:
        command = command_from_json(event["do"], self._commands)
        # The recorded command is the merged one; where the step whose place it took is lost, it is a step itself.
        merged = bool(event.get("merged")) and not self._fresh
        self.history.do_as(command, str(event.get("origin")), whole_number(event, "at"), merged=merged)

    def _goto(self, event: dict[str, Any]) -> None:
        revision = whole_number(event, "goto")
        if self._lost and not self.history.holds(revision):  # the nearest before it lacks only what is lost
            held = [step.revision for step in self.history.steps if step.revision < revision]
            revision = held[-1] if held else self.history.base_revision
        self.history.goto(revision)

    def _saved(self, event: dict[str, Any]) -> None:
        if not (isinstance(event.get("file"), str) and whole_number(event, "saved") >= 0):
            raise FileRefused("it names no document file.")


_KINDS: dict[str, Callable[[_Run, dict[str, Any]], None]] = {
    "do": _Run._do,
    "goto": _Run._goto,
    "saved": _Run._saved,
}
