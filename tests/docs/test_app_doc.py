"""The page of the application: its table of keys is that of the code."""

from __future__ import annotations

from pathlib import Path

from contact_core.interaction.actions import actions_of, key_table
from contact_core.interaction.tool import TOOLS
from contact_core.plugins.manager import PluginManager


def test_the_table_of_keys_is_that_of_the_code(repository: Path) -> None:
    page = (repository / "docs" / "app.md").read_text(encoding="utf-8")
    tools = PluginManager(discover=True, environ={}).offers(TOOLS).values()
    assert key_table(actions_of(tools)) in page


def test_its_pictures_are_there_and_small(repository: Path) -> None:
    images = repository / "docs" / "images"
    pictures = list(images.glob("app-*.jpg"))
    assert len(pictures) >= 3 and all(picture.stat().st_size < 300_000 for picture in pictures)
    assert (images / "app-workflow.gif").stat().st_size < 3_000_000  # the film of `.ci/app_film.py`
