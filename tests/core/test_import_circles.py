"""No module imports one that imports it: at its top, for type checkers alone, or within a function."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Mapping, Set
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest


def sources(root: Path) -> dict[str, str]:
    """The source of every module in the packages of the wheel, by name."""
    config = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    folders = [root / name for name in config["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]
    return {
        name_of(path, folder): path.read_text(encoding="utf-8")
        for folder in folders
        for path in folder.rglob("*.py")
    }


def name_of(path: Path, package: Path) -> str:
    """The name of a module, as imports spell it."""
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


def imported(source: str, known: Set[str]) -> set[str]:
    """Which of the known modules a source imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"modules are imported by their full names, but got: {ast.unparse(node)}"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found.add(full if full in known else str(node.module))
    return found & known


def circle(modules: Mapping[str, str]) -> list[str]:
    """The names along one circle of imports; none where there is no circle."""
    try:
        TopologicalSorter({name: imported(text, modules.keys()) for name, text in modules.items()}).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_import_goes_in_a_circle(repository: Path) -> None:
    modules = sources(repository)
    assert {"contact_core.session", "contact_builtins", "contact_viewer.panel"} <= modules.keys()
    assert circle(modules) == []


@pytest.mark.parametrize(
    "back",
    [
        "import house.below",
        "from house import below, other",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.below import Thing",
        "def later():\n    from house.below import Thing",
    ],
)
def test_a_circle_is_found_by_whatever_way(back: str) -> None:
    modules = {"house": "", "house.below": "from house.above import other", "house.above": back}
    assert set(circle(modules)) == {"house.below", "house.above"}
    assert circle({**modules, "house.above": "import ast"}) == []
