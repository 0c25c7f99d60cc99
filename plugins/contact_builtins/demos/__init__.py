"""Recipes that come with the package and need nothing but its samples: what `contact demo` runs."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from contact_core.errors import InvalidInput
from contact_core.job.job import JobResult
from contact_core.job.run import run
from contact_core.plugins.manager import PluginManager
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.recipe.reader import parse_recipe
from contact_core.recipe.recipe import Recipe

DEFAULT = "mug"


def demo_names() -> tuple[str, ...]:
    """Names of the demos, the default first."""
    found = sorted(entry.name[:-5] for entry in files(__package__).iterdir() if entry.name.endswith(".toml"))
    return (DEFAULT, *(name for name in found if name != DEFAULT))


def demo_recipe(name: str = DEFAULT) -> Recipe:
    """The recipe of a demo. Raises InvalidInput naming those that exist."""
    if name not in demo_names():
        raise InvalidInput(f"there is no demo {name!r}; there are {', '.join(demo_names())}.")
    return parse_recipe((files(__package__) / f"{name}.toml").read_text(encoding="utf-8"), name=f"demo {name}")


def run_demo(
    name: str, out: Path | str, *, plugins: PluginManager | None = None, progress: Progress = NO_PROGRESS
) -> JobResult:
    """Run a demo and write its results into `out`. Raises ContactError."""
    return run(demo_recipe(name), out, plugins=plugins, progress=progress)
