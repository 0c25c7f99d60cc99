"""`contact demo` and `contact pose` on the command line: lists, refuses in one sentence, exits with 2."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from contact_builtins.demos import DEFAULT, demo_names, demo_recipe
from contact_core.cli import main


def test_the_demos_are_listed_with_their_titles(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--list", "--json"]) == 0
    titles = json.loads(capsys.readouterr().out)
    assert tuple(titles) == demo_names()
    assert titles[DEFAULT] == "Hand on mug"
    assert len(titles) >= 5


def test_an_unknown_demo_is_one_sentence_and_writes_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["demo", "juggling", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "there is no demo 'juggling'; there are mug, " in said.err
    assert len(said.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["schema = 1", "not toml [", "\x00", 'schema = 1\nname = "x"\nmanipulator = 3'])
def test_a_bad_recipe_is_one_sentence_with_its_name(
    text: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    recipe = tmp_path / "bad.toml"
    recipe.write_text(text)
    assert main(["pose", str(recipe), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err.strip()
    assert said.startswith("contact: bad.toml") and len(said.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_demos_name_no_file() -> None:
    for name in demo_names():
        recipe = demo_recipe(name)
        assert recipe.manipulators[0].source.file is None and recipe.objects[0].source.file is None
