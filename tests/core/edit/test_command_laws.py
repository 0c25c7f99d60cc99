"""The laws of the command stack over every registered command, and over random histories of 500 steps."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.contact.placement import Link, Root
from contact_core.document.document import ContactDocument, Patch, Surface
from contact_core.document.schema import dump_document, parse_document
from contact_core.edit import commands
from contact_core.edit.command import BaseCommand, Command, command_to_json
from contact_core.edit.command_table import BUILT_IN_COMMANDS, command_from_json
from contact_core.edit.commands import AddSurface, Bend, LinkPatch, Paint, Recolor, SetExtra
from contact_core.edit.history import History
from contact_core.errors import CommandRejected, FileRefused, InvalidInput
from contact_core.plugins import hookimpl
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import COMMANDS
from contact_core.testing.command_contract import CommandCase, CommandContract
from contact_core.testing.random_commands import MAKERS, random_command, random_history, try_to_do
from contact_core.testing.random_values import random_shape


@cache
def cases_of(json_id: str, seeds: range = range(12)) -> list[CommandCase]:
    """Documents of random histories, each with a command of the kind and one to follow it."""
    found = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 7])
        history = random_history(seed, 30)
        command = random_command(history.document, rng, json_id)
        if command is None or not try_to_do(history, command):
            continue
        later = follower(command, history.document, rng)
        found.append(CommandCase(history.document_at(history.steps[-2].revision), command, later))
    return found


def follower(command: Command, document: ContactDocument, rng: np.random.Generator) -> Command | None:
    """Another command of the kind, of the same patch where the kind says so: what a drag would bring next."""
    for _ in range(30):
        later = random_command(document, rng, command.json_id)
        if later is not None and command.merge(later) is not None and try_to_do(History(document), later):
            return later
    return None


@pytest.mark.parametrize("json_id", sorted(BUILT_IN_COMMANDS))
class TestEveryRegisteredCommand(CommandContract):
    @pytest.fixture
    def cases(self, json_id: str) -> Sequence[CommandCase]:
        return cases_of(json_id)


def test_no_command_escapes_the_laws() -> None:
    for found in pkgutil.iter_modules(commands.__path__):
        for kind in vars(importlib.import_module(f"{commands.__name__}.{found.name}")).values():
            if isinstance(kind, type) and issubclass(kind, BaseCommand) and hasattr(kind, "json_id"):
                assert BUILT_IN_COMMANDS[kind.json_id] is kind
    assert set(BUILT_IN_COMMANDS) == set(MAKERS) and len(BUILT_IN_COMMANDS) == len(commands.__all__)


def test_drags_merge() -> None:
    """The kinds that a drag repeats do merge, or the merge law would hold of nothing."""
    merging = {j for j in MAKERS for case in cases_of(j, range(6)) if case.later is not None}
    assert merging >= {
        "contact.translate", "contact.rotate", "contact.bend", "contact.scale", "contact.mirror",
        "contact.recolor", "contact.pair", "document.extra", "pose.set", "surface.place",
        "timeline.keys", "timeline.set", "timeline.spans",
    }  # fmt: skip


@settings(max_examples=4)
@given(seed=st.integers(0, 10**6))
def test_a_random_history_of_500_equals_its_replay(seed: int) -> None:
    rng = np.random.default_rng(seed)
    history = random_history(seed, 0)
    log: list[tuple[str, object]] = [("do", command_to_json(step.command)) for step in history.steps]
    while len(log) < 500:
        action = rng.choice(["do", "do", "do", "do", "undo", "redo", "goto"])
        if action == "do":
            command = random_command(history.document, rng)
            if command is not None and try_to_do(history, command):
                log.append(("do", command_to_json(command)))
        elif action == "undo" and history.can_undo:
            history.undo()
            log.append(("undo", None))
        elif action == "redo" and history.can_redo:
            history.redo()
            log.append(("redo", None))
        elif action == "goto" and history.steps:
            revision = history.steps[int(rng.integers(len(history.steps)))].revision
            history.goto(revision)
            log.append(("goto", revision))
    replayed = History(ContactDocument())
    for action, what in log:
        if action == "do":
            replayed.do(command_from_json(what))
        elif action == "goto":
            replayed.goto(what)  # type: ignore[arg-type]
        else:
            getattr(replayed, action)()
    assert replayed.revision == history.revision
    assert dump_document(replayed.document) == dump_document(history.document)
    assert dump_document(parse_document(dump_document(history.document))) == dump_document(history.document)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_undo_and_redo_walk_through_the_very_same_documents(seed: int) -> None:
    history = random_history(seed, 40)
    forward = [history.base, *(step.after for step in history.steps)]
    for document in reversed(forward[:-1]):
        history.undo()
        assert history.document is document
    assert not history.can_undo
    for document in forward[1:]:
        history.redo()
        assert history.document is document
    for position in np.random.default_rng(seed).permutation(len(forward)):
        revision = history.base_revision if position == 0 else history.steps[position - 1].revision
        assert history.goto(revision) is forward[position]


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_a_merged_drag_is_one_step_that_equals_all_of_it(seed: int) -> None:
    history = random_history(seed, 15)
    rng = np.random.default_rng(seed)
    patch = next(iter(history.document.patches))
    history.do(Recolor((patch,), (0.0, 0.0, 0.0)))
    steps, before = len(history.steps), history.steps[-1].before
    for _ in range(5):
        history.do(Recolor((patch,), tuple(rng.uniform(0, 1, 3).tolist())), merge=True)
    assert len(history.steps) == steps
    history.undo()
    assert history.document is before


def test_a_clean_document_is_not_merged_away() -> None:
    history = random_history(3, 5)
    history.do(SetExtra("a", 1))
    history.mark_clean()
    history.do(SetExtra("a", 2), merge=True)
    assert not history.is_clean
    history.undo()
    assert history.is_clean and history.document.extras["a"] == 1


def test_a_new_step_drops_what_was_undone_and_never_reuses_its_revision() -> None:
    history = random_history(5, 10)
    gone = history.revision
    history.undo()
    history.do(SetExtra("a", 1))
    assert not history.can_redo and history.revision > gone
    with pytest.raises(CommandRejected, match=f"no revision {gone}"):
        history.goto(gone)


def test_origins_do_not_merge_with_one_another() -> None:
    history = random_history(5, 3)
    history.do(SetExtra("a", 1), "user")
    history.do(SetExtra("a", 2), "host", merge=True)
    assert [step.origin for step in history.steps[-2:]] == ["user", "host"]


def test_unknown_commands_and_fields_are_refused_in_words() -> None:
    with pytest.raises(FileRefused, match=r"no command is called 'contact\.fold'"):
        command_from_json({"command": "contact.fold"})
    with pytest.raises(FileRefused, match="no field 'speed'"):
        command_from_json({"command": "contact.bend", "patch": "a", "point": 1, "angle": 0.1, "speed": 2})
    with pytest.raises(FileRefused, match="lacks the field 'angle'"):
        command_from_json({"command": "contact.bend", "patch": "a", "point": 1})
    with pytest.raises(FileRefused, match=r"contact\.bend\.point wants int"):
        command_from_json({"command": "contact.bend", "patch": "a", "point": 1.5, "angle": 0.1})
    with pytest.raises(FileRefused, match="finite"):
        command_from_json({"command": "contact.bend", "patch": "a", "point": 1, "angle": float("nan")})


def test_two_commands_of_one_name_are_refused() -> None:
    class Other(Bend):
        pass

    class Offering:
        @hookimpl
        def contact_commands(self) -> list[type[Command]]:
            return [Other]

    manager = PluginManager(discover=False)
    with pytest.raises(InvalidInput, match=r"'contact\.bend' is refused: contact-core itself offers one"):
        manager.register(Offering)
    assert manager.offers(COMMANDS)["contact.bend"] is Bend


def test_cycles_are_refused() -> None:
    """No sequence of links makes a patch hang on itself, however long the way round."""
    rng = np.random.default_rng(0)
    history = History(ContactDocument())
    history.do(AddSurface(Surface("hand", "digest", "topology", 50, 90)))
    for number in range(4):
        shape = random_shape(rng)
        root = Root(number, (1.0, 0.0, 0.0), 1j)
        history.do(Paint(Patch(f"p{number}", "hand", f"p{number}", root), shape))
    for number in range(3):
        history.do(LinkPatch(f"p{number + 1}", Link(f"p{number}", 0.0, (1.0,), (), 0.0)))
    for child, parent in (("p0", "p1"), ("p0", "p2"), ("p0", "p3"), ("p1", "p3"), ("p2", "p2")):
        with pytest.raises(CommandRejected, match="tree has no"):
            history.do(LinkPatch(child, Link(parent, 0.0, (1.0,), (), 0.0)))
    assert list(history.document.descendants("p0")) == ["p1", "p2", "p3"]
