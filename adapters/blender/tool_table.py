"""Write what Blender's toolbar, keymap and search are made of: `python adapters/blender/tool_table.py`.

The extension registers without loading the core, so the table of tools, settings and actions (that which
`contact_core.interaction` offers) lies beside it as JSON. A test compares the two.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from contact_core.interaction.actions import actions_of
from contact_core.interaction.settings import InteractionSettings
from contact_core.interaction.tool import TOOLS
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES, POSE_SOLVERS
from contact_core.settings import Setting, settings_of

TABLE = Path(__file__).parent / "contact_blender" / "extension" / "tools.json"


def table() -> dict[str, Any]:
    """Tools, actions and settings that come with the product, as plain values."""
    import contact_builtins

    plugins = PluginManager([contact_builtins], discover=False)
    tools = plugins.offers(TOOLS).values()
    offers = {
        "brush": sorted(plugins.offers(BRUSHES)),
        "generator": sorted(plugins.offers(AXIS_GENERATORS)),
        "solver": sorted(plugins.offers(POSE_SOLVERS)),
    }
    return {
        "tools": [
            {
                "name": tool.name,
                "summary": tool.summary,
                "hint": tool.hint,
                "settings": [_plain(each, offers) for each in settings_of(tool)],
            }
            for tool in tools
        ],
        "actions": [asdict(action) for action in actions_of(tools)],
        "settings": [_plain(each, offers) for each in settings_of(InteractionSettings)],
    }


def _plain(setting: Setting, offers: dict[str, list[str]]) -> dict[str, Any]:
    """A setting; one that names a plugin has the names as choices."""
    found = asdict(setting)
    if setting.name in offers and setting.kind == "text":
        found |= {"kind": "choice", "choices": offers[setting.name]}
    return found


def text() -> str:
    """The table as it stands in the file."""
    return json.dumps(table(), indent=1) + "\n"


if __name__ == "__main__":
    TABLE.write_text(text(), encoding="utf-8")
