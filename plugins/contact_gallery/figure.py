"""The figures of the gallery: each is a script that draws a sheet."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass

from contact_core.errors import InvalidInput
from contact_gallery.figures import ORDER
from contact_gallery.sheet import Sheet


@dataclass(frozen=True)
class Figure:
    """A figure: its title and text, what of the paper it is, and what draws it."""

    name: str
    title: str
    text: str
    paper: str
    draw: Callable[[Sheet], None]
    source: str


def names() -> tuple[str, ...]:
    """The names of all figures, in the paper's order."""
    return ORDER


def figure(name: str) -> Figure:
    """A figure by name. Raises InvalidInput naming those that exist."""
    if name not in ORDER:
        raise InvalidInput(f"there is no figure {name!r}; there are {', '.join(ORDER)}.")
    module = importlib.import_module(f"contact_gallery.figures.{name}")
    title, _, text = inspect.cleandoc(module.__doc__ or "").partition("\n")
    return Figure(name, title.rstrip("."), text.strip(), module.PAPER, module.draw, inspect.getsource(module))
