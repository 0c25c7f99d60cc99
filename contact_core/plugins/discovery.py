"""Where plugins come from: entry points of installed distributions, and the variable CONTACT_PLUGINS."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import Distribution, EntryPoint, distributions
from typing import Literal

from contact_core.plugins.registry import resolve

GROUP = "contact_core.plugins"
VARIABLE = "CONTACT_PLUGINS"
Origin = Literal["built-in", "entry point", "environment", "session"]
PRECEDENCE: tuple[Origin, ...] = ("built-in", "entry point", "environment", "session")  # the last one wins
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
    words = [word.strip() for word in (environ or os.environ).get(VARIABLE, "").split(",")]
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
    for distribution, entry in _entries():
        owner = _distribution_name(distribution)
        foreign = owner != _OWN_DISTRIBUTION
        origin: Origin = "entry point" if foreign else "built-in"
        candidate = Candidate(entry.name, origin, f"{owner} {distribution.version or '?'}", entry.load)
        found.setdefault((foreign, owner, entry.name), candidate)
    return [found[key] for key in sorted(found)]


def _entries() -> Iterator[tuple[Distribution, EntryPoint]]:
    """Entry points of our group, one distribution at a time: a damaged one must not hide the others."""
    for distribution in distributions():
        try:
            text = distribution.read_text("entry_points.txt") or ""
            if GROUP in text:  # most have none: reading the text is cheaper than parsing it
                yield from ((distribution, entry) for entry in distribution.entry_points.select(group=GROUP))
        except Exception:  # foreign metadata may be broken in any way and is not ours to report
            continue


def _distribution_name(distribution: Distribution) -> str:
    try:
        return re.sub(r"[-_.]+", "-", distribution.metadata["Name"] or "?").lower()
    except Exception:  # metadata without a name: the plugin may still work
        return "?"
