"""The table of actions and keys is the code's, and its keys are told apart."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from contact_core.interaction.actions import actions_of
from contact_core.testing.artist import ball_and_hand

ROOT = Path(__file__).resolve().parents[2]


def test_the_table_of_keys_is_current() -> None:
    spec = importlib.util.spec_from_file_location("keys", ROOT / ".ci" / "keys.py")
    assert spec is not None and spec.loader is not None
    keys = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(keys)
    text = keys.PAGE.read_text(encoding="utf-8")
    assert keys.page_with_table(text) == text, "run python .ci/keys.py"


def test_no_key_does_two_things() -> None:
    tools = ball_and_hand().hands.tools
    table = actions_of(tools)
    keys = [key for action in table for key in action.keys]
    assert len(set(keys)) == len(keys) and len({action.id for action in table}) == len(table)
    assert all(action.keys for action in table if action.id.startswith("tool.")), "a tool of ours has no key"
