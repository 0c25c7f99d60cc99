"""A macro while it is being made: commands that will be one step."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from contact_core.document.document import ContactDocument
from contact_core.edit.command import Command, Macro, apply_command
from contact_core.errors import CommandRejected


class OpenMacro:
    """Commands done so far on a document of its own; `end` returns the one command that they make."""

    def __init__(self, title: str, document: ContactDocument) -> None:
        self.title = title
        self.document = document
        self.abandoned = False
        self._commands: list[Command] = []

    def do(self, command: Command) -> None:
        """Do one more command. Raises CommandRejected; then nothing has changed."""
        self._check()
        self.document = apply_command(command, self.document)
        self._commands.append(command)

    @contextlib.contextmanager
    def part(self) -> Iterator[None]:
        """A macro within the macro: all of what is done inside, or none of it."""
        document, count = self.document, len(self._commands)
        try:
            yield
        except BaseException:
            self.document = document
            del self._commands[count:]
            raise

    def abandon(self) -> None:
        """The document that it started from is no longer the current one: nothing will come of it."""
        self.abandoned = True

    def end(self) -> Command | None:
        """The command to commit, None where nothing was done. Raises CommandRejected for an abandoned macro."""
        self._check()
        if len(self._commands) <= 1:
            return self._commands[0] if self._commands else None
        return Macro(self.title, tuple(self._commands))

    def _check(self) -> None:
        if self.abandoned:
            raise CommandRejected(
                f"the host went to another document during {self.title!r}: nothing of it is done."
            )
