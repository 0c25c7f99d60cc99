"""The contract of commands. Subclass it and give the fixture `cases`: documents, each with commands for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from contact_core.document.codec import pretty
from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_to_json, inconsistencies
from contact_core.edit.command import (
    Command,
    apply_command,
    command_to_json,
)
from contact_core.edit.command_table import BUILT_IN_COMMANDS, CommandTable, command_from_json
from contact_core.edit.history import History
from contact_core.errors import CommandRejected
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import COMMANDS
from contact_core.testing.contract import Contract


@dataclass(frozen=True, eq=False)
class CommandCase:
    """A document, a command that applies to it, and one to try after it (a second step of the same drag)."""

    document: ContactDocument
    command: Command
    later: Command | None = None


class CommandContract(Contract):
    """Fixture: `cases`, a sequence of CommandCase."""

    about, letter = "command", "C"

    def test_c01_a_plugin_can_offer_it(self, cases: Sequence[CommandCase]) -> None:
        """Is a frozen dataclass that a plugin manager takes under its json_id."""
        assert cases, "no case to try"
        table = table_of(cases)
        for case in cases:
            kind = type(case.command)
            assert table.get(kind.json_id) is kind, f"{kind.json_id!r} is the name of another command"

    def test_c02_has_a_label(self, cases: Sequence[CommandCase]) -> None:
        """Says in the artist's words what it does, on one line."""
        for case in cases:
            label = case.command.label()
            assert label.strip() == label != "" and "\n" not in label, repr(label)

    def test_c03_leaves_its_input_alone(self, cases: Sequence[CommandCase]) -> None:
        """Applying it leaves the document bit-identical, and holds no array that can be written to."""
        for case in cases:
            before = written(case.document)
            apply_command(case.command, case.document)
            assert written(case.document) == before, command_to_json(case.command)
            assert not writable_arrays(case.command), f"{case.command.json_id} holds writable arrays"

    def test_c04_result_is_immutable_and_consistent(self, cases: Sequence[CommandCase]) -> None:
        """The document that it makes contradicts itself nowhere and holds no array that can be written to."""
        for case in cases:
            after = apply_command(case.command, case.document)
            assert list(inconsistencies(after)) == [], command_to_json(case.command)
            assert not writable_arrays(after)

    def test_c05_is_deterministic(self, cases: Sequence[CommandCase]) -> None:
        """Applied twice to one document it makes equal documents."""
        for case in cases:
            once, again = (written(apply_command(case.command, case.document)) for _ in range(2))
            assert once == again, command_to_json(case.command)

    def test_c06_undo_returns_the_same_object(self, cases: Sequence[CommandCase]) -> None:
        """Undo gives back the very same document object, and redo the very same result."""
        for case in cases:
            history = History(case.document)
            after = history.do(case.command).after
            history.undo()
            assert history.document is case.document
            history.redo()
            assert history.document is after

    def test_c07_replays_from_json(self, cases: Sequence[CommandCase]) -> None:
        """Stored as JSON and read back, it is the same command and makes an equal document."""
        table = table_of(cases)
        for case in cases:
            stored = command_to_json(case.command)
            again = command_from_json(stored, table)
            assert type(again) is type(case.command)
            assert command_to_json(again) == stored
            wanted = written(apply_command(case.command, case.document))
            assert written(apply_command(again, case.document)) == wanted, stored

    def test_c08_merges_into_both(self, cases: Sequence[CommandCase]) -> None:
        """Where it merges with a later command, the merged one equals the one after the other."""
        for case in cases:
            merged = case.command.merge(case.later) if case.later is not None else None
            if case.later is None or merged is None:
                continue
            one_by_one = apply_command(case.later, apply_command(case.command, case.document))
            at_once = apply_command(merged, case.document)
            assert written(at_once) == written(one_by_one), command_to_json(merged)

    def test_c09_rejects_in_words(self, cases: Sequence[CommandCase]) -> None:
        """On a document that it does not fit, it raises CommandRejected with a sentence, or it fits after all."""
        empty = ContactDocument()
        for case in cases:
            try:
                apply_command(case.command, empty)
            except CommandRejected as error:
                assert len(str(error).split()) >= 3, str(error)
            except Exception as error:  # the clause is that this never happens
                pytest.fail(f"{case.command.json_id} raised {type(error).__name__}: {error}")
            assert written(empty) == written(ContactDocument())


def table_of(cases: Sequence[CommandCase]) -> CommandTable:
    """The table of a session whose one plugin offers the commands of the cases. Raises InvalidInput."""
    kinds = {type(case.command) for case in cases} - set(BUILT_IN_COMMANDS.values())

    class Offering:
        @hookimpl
        def contact_commands(self) -> list[type[Command]]:
            return sorted(kinds, key=lambda kind: kind.__qualname__)

    return PluginManager([Offering], discover=False).offers(COMMANDS)


def written(document: ContactDocument) -> str:
    """The whole text of a document, nothing of it remembered: what was changed in place shows."""
    return pretty(document_to_json(document))


def writable_arrays(value: Any, seen: set[int] | None = None) -> list[str]:
    """Where in a value arrays hide that can be written to."""
    seen = set() if seen is None else seen
    if id(value) in seen:
        return []
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return [f"array of shape {value.shape}"] if value.flags.writeable else []
    if is_dataclass(value) and not isinstance(value, type):
        inner: list[Any] = [getattr(value, item.name) for item in fields(value)]
    elif hasattr(value, "values"):
        inner = list(value.values())
    else:
        inner = list(value) if isinstance(value, (tuple, list)) else []
    return [found for item in inner for found in writable_arrays(item, seen)]
