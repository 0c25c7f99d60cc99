"""The table of commands: which classes stand behind the names in a journal.

A table is a value that its readers are given. The built-in commands are the default; a session reads with the table
of its own plugin manager (`plugins.offers(COMMANDS)`), so that a plugin which was reloaded, or which only another
session has, changes nothing here.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

from contact_core.document.codec import MAX_DEPTH, from_json
from contact_core.edit import commands as built_in
from contact_core.edit.command import Command, Macro
from contact_core.errors import FileRefused

CommandTable: TypeAlias = Mapping[str, type[Command]]  # by json_id
_KINDS: tuple[type[Command], ...] = tuple(getattr(built_in, name) for name in built_in.__all__)
BUILT_IN_COMMANDS: CommandTable = MappingProxyType({kind.json_id: kind for kind in _KINDS})


def command_from_json(data: Any, commands: CommandTable = BUILT_IN_COMMANDS, depth: int = 0) -> Command:
    """The command that data stands for, of the kinds in a table.

    Raises FileRefused for unknown kinds and fields that do not fit.
    """
    if depth > MAX_DEPTH:
        raise FileRefused(f"groups of commands lie at most {MAX_DEPTH} deep within one another, but got more.")
    if not isinstance(data, Mapping):
        raise FileRefused(f"a command is an object, but got {str(data)[:60]!r}.")
    fields = dict(data)
    json_id = fields.pop("command", None)
    if json_id == Macro.json_id:
        title, parts = fields.get("title"), fields.get("commands")
        if not isinstance(title, str) or not isinstance(parts, list):
            raise FileRefused("a group of commands needs a title and a list of commands.")
        return Macro(title, tuple(command_from_json(part, commands, depth + 1) for part in parts))
    cls = commands.get(json_id) if isinstance(json_id, str) else None
    if cls is None:
        raise FileRefused(f"no command is called {json_id!r}: the plugin that brings it is absent, or it is newer.")
    command: Command = from_json(cls, fields, json_id or "")
    return command
