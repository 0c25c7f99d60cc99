"""What a command is, the registry of commands, and the command made of commands.

A command is a frozen dataclass that holds results, never a request to compute: applying it needs no mesh, no
plugin and no clock. So undo, redo, replay and a bug report all give the same document.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Protocol, TypeVar, runtime_checkable

from contact_core.document.codec import MAX_DEPTH, from_json, to_json
from contact_core.document.document import ContactDocument
from contact_core.errors import CommandRejected, ContactError, FileRefused, InvalidInput


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


C = TypeVar("C", bound=type)
_REGISTRY: dict[str, type[Any]] = {}


def register_command(cls: C) -> C:
    """Class decorator: makes a command known by its json_id. Raises InvalidInput on a clash or a missing part."""
    json_id = getattr(cls, "json_id", None)
    if not (isinstance(json_id, str) and json_id) or not dataclasses.is_dataclass(cls):
        raise InvalidInput(f"{cls.__name__} is no command: it needs to be a frozen dataclass with a json_id.")
    missing = [name for name in ("label", "apply", "merge") if not callable(getattr(cls, name, None))]
    if missing:
        raise InvalidInput(f"{cls.__name__} is no command: it lacks {', '.join(missing)}.")
    known = _REGISTRY.get(json_id)
    if known is not None and known is not cls:
        raise InvalidInput(
            f"two commands call themselves {json_id!r}: {known.__qualname__} and {cls.__qualname__}."
        )
    _REGISTRY[json_id] = cls
    return cls


def unregister_command(json_id: str) -> None:
    """Forget a command that a plugin brought."""
    _REGISTRY.pop(json_id, None)


def registered_commands() -> Mapping[str, type[Any]]:
    """All known commands by json_id."""
    return dict(_REGISTRY)


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


def command_from_json(data: Any, depth: int = 0) -> Command:
    """The command that data stands for. Raises FileRefused for unknown kinds and fields that do not fit."""
    if depth > MAX_DEPTH:
        raise FileRefused(f"groups of commands lie at most {MAX_DEPTH} deep within one another, but more came.")
    if not isinstance(data, Mapping):
        raise FileRefused(f"a command is an object, but {str(data)[:60]!r} came.")
    fields = dict(data)
    json_id = fields.pop("command", None)
    if json_id == Macro.json_id:
        title, parts = fields.get("title"), fields.get("commands")
        if not isinstance(title, str) or not isinstance(parts, list):
            raise FileRefused("a group of commands needs a title and a list of commands.")
        return Macro(title, tuple(command_from_json(part, depth + 1) for part in parts))
    cls = _REGISTRY.get(json_id) if isinstance(json_id, str) else None
    if cls is None:
        raise FileRefused(f"no command is called {json_id!r}: the plugin that brings it is absent, or it is newer.")
    command: Command = from_json(cls, fields, json_id or "")
    return command


@register_command
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
