"""The base of every contract suite: numbered clauses, and what a subject declines to promise.

A suite sets `about` and `letter`; each of its test methods is one clause. The method's name holds the clause's
number and slug, its docstring's first line is the clause in words:

    class BrushContract(Contract):
        about, letter = "brush", "B"

        @needs("radius")
        def test_b02_stays_within_radius(self, brush: Brush) -> None:
            '''No point lies farther from the stroke than the radius.'''

A subject (`class TestMyBrush(BrushContract)`) gives the fixtures that the suite names and may decline clauses by
id ("B02"), by slug ("stays_within_radius") or by a capability that clauses need ("radius"), each with a reason.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from contact_core.errors import InvalidInput

F = TypeVar("F", bound=Callable[..., Any])
_CLAUSE_NAME = re.compile(r"test_([a-z])(\d\d)_(\w+)")


@dataclass(frozen=True)
class Clause:
    """One numbered promise. id: "B02". test: the method's name. text: one sentence. needs: capabilities."""

    id: str
    test: str
    slug: str
    text: str
    needs: tuple[str, ...]


def needs(*capabilities: str) -> Callable[[F], F]:
    """Mark a clause with the capabilities that a subject may decline as a whole."""

    def mark(function: F) -> F:
        function.__dict__["contact_needs"] = capabilities
        return function

    return mark


class Contract:
    """Base of the suites; see the module's docstring. Mistakes in a suite or subject raise InvalidInput on import.

    about: what is tested ("host").  letter: the first letter of the clause ids.  subject: the name in reports,
    by default the class's name without "Test".  cannot: declined clause, slug or capability -> reason.
    """

    about: ClassVar[str] = ""
    letter: ClassVar[str] = ""
    subject: ClassVar[str] = ""
    cannot: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if "letter" in cls.__dict__:
            _check_suite(cls)
        else:
            _check_subject(cls)
        if "subject" not in cls.__dict__:
            cls.subject = cls.__name__.removeprefix("Test")

    @classmethod
    def clauses(cls) -> tuple[Clause, ...]:
        """The clauses in order of their numbers."""
        found: dict[str, Clause] = {}
        for base in reversed(cls.__mro__):
            for name, function in vars(base).items():
                match = _CLAUSE_NAME.fullmatch(name)
                if match and callable(function):
                    text = " ".join((function.__doc__ or "").strip().split("\n\n")[0].split())
                    tags = function.__dict__.get("contact_needs", ())
                    found[name] = Clause(match[1].upper() + match[2], name, match[3], text, tags)
        return tuple(sorted(found.values(), key=lambda clause: clause.id))

    @classmethod
    def clause_of(cls, test: str) -> Clause | None:
        """The clause that a test method proves; None for a subject's own extra tests."""
        return next((clause for clause in cls.clauses() if clause.test == test), None)

    @classmethod
    def declined(cls, clause: Clause) -> str | None:
        """The reason why this subject does not promise the clause; None where it does."""
        keys = (clause.id, clause.slug, *clause.needs)
        return next((cls.cannot[key] for key in keys if key in cls.cannot), None)


def clause_table(suite: type[Contract]) -> str:
    """The suite's clauses as a Markdown table; adapters/README.md holds it word for word, and a test compares."""
    rows = [
        f"| {clause.id} | {clause.text} | {', '.join(f'`{tag}`' for tag in clause.needs)} |"
        for clause in suite.clauses()
    ]
    return "\n".join(["| clause | promise | may be declined as |", "|---|---|---|", *rows]) + "\n"


def _check_suite(suite: type[Contract]) -> None:
    """Every test of a suite is a clause with a sentence, numbered 1, 2, 3 ... in the order in which they are run:
    those of its bases from the last to the first, then its own."""
    tests = {
        name: test for base in reversed(suite.__mro__) for name, test in vars(base).items() if name[:5] == "test_"
    }
    for number, (name, test) in enumerate(tests.items(), start=1):
        expected = f"test_{suite.letter.lower()}{number:02d}_"
        if not (name.startswith(expected) and _CLAUSE_NAME.fullmatch(name)):
            raise InvalidInput(
                f"{suite.__name__}: clauses count up in the order of the file; a name starting with"
                f" {expected} was expected, but got {name}."
            )
        if not (test.__doc__ or "").strip():
            raise InvalidInput(f"{suite.__name__}.{name} needs a docstring: its clause in words.")


def _check_subject(subject: type[Contract]) -> None:
    """A subject declines only what exists, says why, and never overrides a clause."""
    clauses = subject.clauses()
    known = {key for clause in clauses for key in (clause.id, clause.slug, *clause.needs)}
    for key, reason in subject.cannot.items():
        if key not in known:
            near = difflib.get_close_matches(key, sorted(known), n=3) or sorted(known)
            raise InvalidInput(
                f"{subject.__name__}.cannot names {key!r}, which is no clause, slug or capability of this"
                f" contract; there are: {', '.join(near)}."
            )
        if not reason.strip():
            raise InvalidInput(f"{subject.__name__}.cannot[{key!r}] needs a reason in words.")
    overridden = [clause.test for clause in clauses if clause.test in vars(subject)]
    if overridden and not subject.__dict__.get("letter"):
        raise InvalidInput(
            f"{subject.__name__} overrides the clause {overridden[0]}; a clause is kept or declined in `cannot`."
        )
