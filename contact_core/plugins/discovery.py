"""Where plugins come from: entry points of installed distributions, and the variable CONTACT_PLUGINS."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.metadata import Distribution, distributions
from typing import Literal

from contact_core.errors import InvalidInput
from contact_core.plugins.slot import resolve

GROUP = "contact_core.plugins"
VARIABLE = "CONTACT_PLUGINS"
Origin = Literal["built-in", "entry point", "environment", "session"]  # the last one wins
_OWN_DISTRIBUTION = "contact-core"


@dataclass(frozen=True)
class Candidate:
    """A plugin that was found and not yet imported. load: imports it; may raise whatever its author left in."""

    name: str
    origin: Origin
    source: str  # "studio-contact 1.2" or "CONTACT_PLUGINS=studio.contact"
    load: Callable[[], object]


def discovered(environ: Mapping[str, str] | None = None) -> list[Candidate]:
    """Every plugin to be tried, lowest precedence first. CONTACT_PLUGINS is a list of module names, parted by
    commas; "no:NAME" in it leaves out the plugin of that name."""
    variables = os.environ if environ is None else environ
    words = [word.strip() for word in variables.get(VARIABLE, "").split(",")]
    left_out = {word.removeprefix("no:") for word in words if word.startswith("no:")}
    named = [word for word in words if word and not word.startswith("no:")]
    found = [*_from_entry_points(), *(_from_variable(word) for word in named)]
    return [candidate for candidate in found if candidate.name not in left_out]


def _from_variable(word: str) -> Candidate:
    load = (lambda: resolve(word)) if ":" in word else (lambda: import_module(word))
    return Candidate(word, "environment", f"{VARIABLE}={word}", load)


def _from_entry_points() -> list[Candidate]:
    """Built-ins first, then the others by distribution and name; a distribution found twice counts once."""
    found: dict[tuple[bool, str, str], Candidate] = {}
    for distribution, name, load in _entries():
        owner = _distribution_name(distribution)
        foreign = owner != _OWN_DISTRIBUTION
        origin: Origin = "entry point" if foreign else "built-in"
        candidate = Candidate(name or owner, origin, f"{owner} {distribution.version or '?'}", load)
        found.setdefault((foreign, owner, name), candidate)
    return [found[key] for key in sorted(found)]


def _entries() -> Iterator[tuple[Distribution, str, Callable[[], object]]]:
    """Entry points of our group, one distribution at a time: a damaged one must not hide the others."""
    for distribution in distributions():
        try:
            text = distribution.read_text("entry_points.txt") or ""
        except Exception:  # whether it has something for us cannot be known
            continue
        if GROUP in text:  # most have none: reading the text is cheaper than parsing it
            try:
                entries = tuple(distribution.entry_points.select(group=GROUP))
            except Exception as error:
                yield distribution, "", partial(_unreadable, error)
            else:
                yield from ((distribution, entry.name, entry.load) for entry in entries)


def _unreadable(error: Exception) -> object:
    raise InvalidInput(f"its entry_points.txt cannot be read, {error}") from error


def _distribution_name(distribution: Distribution) -> str:
    try:
        return re.sub(r"[-_.]+", "-", distribution.metadata["Name"] or "?").lower()
    except Exception:  # metadata without a name: the plugin may still work
        return "?"
