"""What is known of one plugin, and how it is borne when it raises."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from contact_core.errors import MissingExtra
from contact_core.interrupts import noticing_interrupts
from contact_core.plugins.discovery import Origin


class Offer(NamedTuple):
    """A sound object of a plugin. factory: what it is made of again with other settings, its class or itself.
    replaces: names of objects whose place it takes."""

    name: str
    made: Any
    factory: Any
    replaces: tuple[str, ...]


@dataclass
class PluginRecord:
    """What is known of one plugin. source: distribution and version, or where else it came from.

    problems: sentences, empty when all is well.  absent: sentences on what a library that is not installed would
    bring; that is no problem.  offers: noun of a slot -> names, filled as slots are asked for.
    """

    name: str
    origin: Origin
    source: str
    plugin: object | None = None  # None: it could not be used at all
    replaces: tuple[str, ...] = ()
    problems: list[str] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)
    offers: dict[str, list[str]] = field(default_factory=dict)
    collected: dict[str, list[Offer]] = field(default_factory=dict, repr=False)  # hook -> sound objects

    def complain(self, sentence: str) -> None:
        """Write a problem down, once."""
        if sentence not in self.problems:
            self.problems.append(sentence)

    @contextmanager
    def bearing(self, what: str, missing: str = "") -> Iterator[None]:
        """Whatever a plugin raises inside is written down after `what`, and the program goes on.

        Whatever: a module may end in SystemExit, or in pytest's Skipped, which is no Exception either. Only Ctrl+C
        is the user's and goes through. A missing optional library is told after `missing`, and is no problem. A
        recursion limit that was lowered is restored: the program needs its own.
        """
        limit = sys.getrecursionlimit()
        with noticing_interrupts() as by_user:
            try:
                try:
                    yield
                finally:  # first of all: what follows makes calls
                    lowered = sys.getrecursionlimit() < limit
                    if lowered:
                        sys.setrecursionlimit(limit)
            except KeyboardInterrupt as error:
                if by_user():
                    raise
                self.complain(f"{what} {spell(error)}.")
            except MissingExtra as error:
                self.absent.append(f"{missing}{error}")
            except BaseException as error:
                self.complain(f"{what} {spell(error)}.{_remedy(error)}")
        if lowered:
            self.complain("it lowered the recursion limit of Python, which is restored.")


def spell(error: BaseException) -> str:
    """One line: the kind of the error and what it said."""
    try:
        said = " ".join(str(error).split())
    except Exception:  # an error of a plugin may fail even to say what it is
        said = ""
    return f"{type(error).__name__}: {said}".rstrip(": .")


def _remedy(error: BaseException) -> str:
    """What to do where a plugin asks the core for a name that it does not have."""
    if not (isinstance(error, ImportError) and str(error.name).partition(".")[0] == "contact_core"):
        return ""
    return (
        " It was written for another contact-core: CHANGELOG.md says what was renamed; follow it, or install the"
        " version that the plugin was written for."
    )
