"""What a command is, and the command made of commands.

A command is a frozen dataclass that holds results, never a request to compute: applying it needs no mesh, no
plugin and no clock. So undo, redo, replay and a bug report all give the same document.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, ClassVar, Protocol, runtime_checkable

from contact_core.document.codec import to_json
from contact_core.document.document import ContactDocument
from contact_core.errors import CommandRejected, ContactError


@runtime_checkable
class Command(Protocol):
    """A pure edit of the document."""

    json_id: ClassVar[str]

    def label(self) -> str:
        """The artist's words for it: "Rotate thumb tip"."""
        ...

    def apply(self, document: ContactDocument) -> ContactDocument:
        """The edited document. Raises CommandRejected; the input is never changed."""
        ...

    def merge(self, later: Command) -> Command | None:
        """One command equal to this and then `later`, or None where they are two steps."""
        ...


class BaseCommand:
    """Common behaviour of commands: two commands are two undo steps unless a command says otherwise."""

    json_id: ClassVar[str]

    def merge(self, later: Command) -> Command | None:
        """None: these stay two steps."""
        return None


def apply_command(command: Command, document: ContactDocument) -> ContactDocument:
    """`command.apply`, with whatever it finds wrong as a CommandRejected."""
    try:
        return command.apply(document)
    except CommandRejected:
        raise
    except ContactError as error:
        raise CommandRejected(f"{command.label()}: {error}") from error


def command_to_json(command: Command) -> dict[str, Any]:
    """JSON-able data; `command` names the kind."""
    if isinstance(command, Macro):
        parts = [command_to_json(part) for part in command.commands]
        return {"command": command.json_id, "title": command.title, "commands": parts}
    return {"command": command.json_id, **to_json(command)}


@dataclasses.dataclass(frozen=True, eq=False)
class Macro(BaseCommand):
    """Several commands as one undo step; all of them or none."""

    json_id: ClassVar[str] = "macro"
    title: str
    commands: tuple[Command, ...]

    def label(self) -> str:
        return self.title

    def apply(self, document: ContactDocument) -> ContactDocument:
        for command in self.commands:
            document = command.apply(document)
        return document

    def flat(self) -> Iterator[Command]:
        """The commands of it and of macros within it."""
        for command in self.commands:
            if isinstance(command, Macro):
                yield from command.flat()
            else:
                yield command
