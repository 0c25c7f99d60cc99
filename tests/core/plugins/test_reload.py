"""A plugin with a command can be taken out, edited, reloaded: nothing of it is left in the process."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from contact_core.edit.summaries import history_lines
from contact_core.errors import FileRefused
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import COMMANDS
from contact_core.session import Session

SOURCE = """
from dataclasses import dataclass
from typing import ClassVar

from contact_core.edit.command import BaseCommand
from contact_core.edit.commands import SetExtra
from contact_core.plugins import hookimpl


@dataclass(frozen=True, eq=False)
class Approve(BaseCommand):
    json_id: ClassVar[str] = "studio.approve"
    by: str

    def label(self):
        return f"{LABEL} ({{self.by}})"

    def apply(self, document):
        return SetExtra("approved", self.by).apply(document)


@hookimpl
def contact_commands():
    return [Approve]
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    (tmp_path / "reloaded_plugin.py").write_text(SOURCE.replace("{LABEL}", "Approve"))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield importlib.import_module("reloaded_plugin")
    sys.modules.pop("reloaded_plugin", None)


def edited(plugin: ModuleType) -> ModuleType:
    """The module after its author changed it, as a host reloads an add-on."""
    Path(str(plugin.__file__)).write_text(SOURCE.replace("{LABEL}", "Sign off"))
    importlib.invalidate_caches()
    return importlib.reload(plugin)


def interrupted(plugin: ModuleType, path: Path) -> None:
    """A session that edits with the plugin's command and ends without saving."""
    with Session.open(path, plugins=[plugin], discover=False) as session:
        session.do(plugin.Approve("Ada"))


def test_a_reloaded_plugin_replays_a_journal_with_its_command(plugin: ModuleType, tmp_path: Path) -> None:
    """Before: "two commands call themselves 'studio.approve'", until the process ended."""
    path = tmp_path / "document.json"
    interrupted(plugin, path)
    again = edited(plugin)
    with Session.open(path, plugins=[again], discover=False) as session:
        assert session.document.extras["approved"] == "Ada"
        assert type(session.history.steps[-1].command) is again.Approve
        session.do(again.Approve("Grace"))
        session.undo()
        assert session.document.extras["approved"] == "Ada"


def test_one_manager_takes_a_plugin_out_and_in_again(plugin: ModuleType) -> None:
    manager = PluginManager(discover=False)
    remove = manager.register(plugin)
    old = manager.offers(COMMANDS)["studio.approve"]
    remove()
    assert "studio.approve" not in manager.offers(COMMANDS)
    again = edited(plugin)
    manager.register(again)
    assert manager.offers(COMMANDS)["studio.approve"] is again.Approve is not old


def test_two_sessions_with_two_editions_of_a_plugin_disturb_each_other_nowhere(
    plugin: ModuleType, tmp_path: Path
) -> None:
    old_class = plugin.Approve
    with Session(plugins=[plugin], discover=False) as old:
        again = edited(plugin)
        with Session(plugins=[again], discover=False) as new:
            assert new.plugins.offers(COMMANDS)["studio.approve"] is again.Approve
            old.do(old_class("Ada"))
            new.do(again.Approve("Grace"))
        assert old.document.extras["approved"] == "Ada"


def test_a_session_without_the_plugin_says_what_is_missing(plugin: ModuleType, tmp_path: Path) -> None:
    """A command that another session of the process knows is not known here."""
    path = tmp_path / "document.json"
    interrupted(plugin, path)
    assert any("'studio.approve'" in line for line in history_lines(path))
    with Session.open(path, discover=False) as session:
        assert "approved" not in session.document.extras
        assert any("'studio.approve'" in note or "kept as" in note for note in session.notes)
    with pytest.raises(FileRefused):
        history_lines(tmp_path / "none.json")
