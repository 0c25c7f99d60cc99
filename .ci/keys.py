"""Write the table of actions and keys into docs/interaction.md and docs/app.md, and for Blender.

python .ci/keys.py
"""

from __future__ import annotations

import runpy
from pathlib import Path

from contact_core.interaction.actions import actions_of, key_table
from contact_core.interaction.tool import TOOLS
from contact_core.plugins.manager import PluginManager

PAGE = Path(__file__).resolve().parents[1] / "docs" / "interaction.md"
APP = PAGE.with_name("app.md")
BLENDER = Path(__file__).resolve().parents[1] / "adapters" / "blender" / "tool_table.py"
BEGIN, END = "<!-- keys -->\n", "<!-- end of keys -->\n"


def page_with_table(text: str) -> str:
    """The page with the table of the tools that come with the product."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return before + BEGIN + "\n" + table() + "\n" + END + after


def app_with_table(text: str) -> str:
    """The application's page, whose table is the only one under its keys."""
    head, rest = text.split("\n| keys |")
    return head + "\n" + table() + "\n" + rest.split("\n\n", 1)[1]


def table() -> str:
    """The table of the tools that come with the product."""
    import contact_builtins

    return key_table(actions_of(PluginManager([contact_builtins], discover=False).offers(TOOLS).values()))


if __name__ == "__main__":
    PAGE.write_text(page_with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    APP.write_text(app_with_table(APP.read_text(encoding="utf-8")), encoding="utf-8")
    runpy.run_path(str(BLENDER), run_name="__main__")
