"""The kit itself: clauses are numbered, declined with reasons, reported, and mutants are judged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from contact_core.errors import InvalidInput
from contact_core.testing import SUITES
from contact_core.testing.contract import Contract, clause_table, needs
from contact_core.testing.mutants import judge
from contact_core.testing.report import ContractReport

TOY = '''
import pytest
from contact_core.testing.contract import Contract, needs
from contact_core.testing.mutants import Mutant

class ThingContract(Contract):
    about, letter = "thing", "X"
    def test_x01_is_small(self, thing):
        """It is small."""
        assert thing < 10
    @needs("evenness")
    def test_x02_is_even(self, thing):
        """It is even."""
        assert thing % 2 == 0
    @pytest.mark.parametrize("k", [3, 5])
    def test_x03_is_no_multiple(self, thing, k):
        """It is a multiple of neither 3 nor 5."""
        assert thing % k
'''

SUBJECTS = """
class TestTwo(ThingContract):
    @pytest.fixture
    def thing(self): return 2
class TestFive(ThingContract):
    subject = "the five"
    cannot = {"evenness": "odd by nature"}
    @pytest.fixture
    def thing(self): return 5
    def test_of_its_own(self, thing): assert thing == 5
"""

MUTANTS = """
class TestCaught(Mutant, ThingContract):
    breaks = "X02"
    @pytest.fixture
    def thing(self): return 7
class TestUncaught(Mutant, ThingContract):
    breaks = "X02"
    @pytest.fixture
    def thing(self): return 4
class TestOtherFirst(Mutant, ThingContract):
    breaks = "X02"
    @pytest.fixture
    def thing(self): return 11
class TestUndeclared(Mutant, ThingContract):
    breaks = "X02"
    @pytest.fixture
    def thing(self): return 9
class TestDeclared(Mutant, ThingContract):
    breaks = "X02"
    consequences = ("X03",)
    @pytest.fixture
    def thing(self): return 9
"""


def test_the_report_tells_kept_broken_and_declined(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_toy=TOY + SUBJECTS)
    run = pytester.runpytest_subprocess(
        "--contact-report", "--contact-report-file", "report.json", "-p", "no:xdist"
    )
    assert run.parseoutcomes() == {"passed": 7, "failed": 1, "skipped": 1}
    written = json.loads((pytester.path / "report.json").read_text())
    assert written["broken"] == {"Two": [], "the five": ["X03"]}
    assert written["declined"] == [["thing", "the five", "X02", "odd by nature"]]
    run.stdout.fnmatch_lines(
        ["thing*Two*the five*", "*X02*kept*declined*It is even.", "the five declines X02: odd by nature"]
    )


def test_collecting_alone_tells_what_is_promised(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_toy=TOY + SUBJECTS)
    pytester.runpytest_subprocess("--collect-only", "--contact-report-file", "report.md")
    text = (pytester.path / "report.md").read_text()
    assert "| X02 | It is even. | kept | declined |" in text
    assert "- the five, X02: odd by nature" in text


def test_mutants_are_judged_by_what_they_declare(tmp_path: Path) -> None:
    file = tmp_path / "mutant_things.py"
    file.write_text(TOY + MUTANTS, encoding="utf-8")
    verdicts = judge(file)
    assert verdicts.pop("Caught") == verdicts.pop("Declared") == ""
    assert verdicts.pop("Uncaught") == "was not caught; X02 should fail"
    assert verdicts.pop("OtherFirst").startswith("fails first at X01, not at X02")
    assert verdicts.pop("Undeclared") == "also fails at ['X03'], which it does not declare"
    assert not verdicts


def test_a_file_without_mutants_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "mutant_none.py"
    file.write_text(TOY, encoding="utf-8")
    with pytest.raises(InvalidInput, match="holds no class of both"):
        judge(file)


class ThingContract(Contract):
    about, letter = "thing", "X"

    @needs("evenness")
    def test_x01_is_even(self, thing: int) -> None:
        """It is even, always."""


def test_clauses_carry_number_slug_sentence_and_needs() -> None:
    (clause,) = ThingContract.clauses()
    assert (clause.id, clause.slug, clause.needs) == ("X01", "is_even", ("evenness",))
    assert clause.text == "It is even, always."


@pytest.mark.parametrize("key", ["X01", "is_even", "evenness"])
def test_a_clause_is_declined_by_number_slug_or_need(key: str) -> None:
    subject = type("TestOdd", (ThingContract,), {"cannot": {key: "odd"}})
    assert subject.declined(ThingContract.clauses()[0]) == "odd"
    assert subject.subject == "Odd"


def test_mistakes_of_a_subject_are_told() -> None:
    with pytest.raises(InvalidInput, match="no clause, slug or capability of this contract; there are: is_even"):
        type("TestOdd", (ThingContract,), {"cannot": {"is_evn": "odd"}})
    with pytest.raises(InvalidInput, match="needs a reason in words"):
        type("TestOdd", (ThingContract,), {"cannot": {"X01": " "}})
    with pytest.raises(InvalidInput, match="overrides the clause test_x01_is_even"):
        type("TestOdd", (ThingContract,), {"test_x01_is_even": lambda self: None})


def test_mistakes_of_a_suite_are_told() -> None:
    def spoken(self: object) -> None:
        """Said."""

    with pytest.raises(InvalidInput, match=r"test_y01_ was expected, but got test_y02_b"):
        type("Y", (Contract,), {"letter": "Y", "test_y02_b": spoken})
    with pytest.raises(InvalidInput, match="needs a docstring"):
        type("Y", (Contract,), {"letter": "Y", "test_y01_b": lambda self: None})


def test_the_worst_of_several_runs_counts() -> None:
    report = ContractReport()
    for outcome in ("passed", "failed", "passed"):
        report.ran("thing", "it", "X01", "It is.", None, outcome=outcome, when="call")
    assert report.broken() == {"it": ["X01"]}


def test_every_suite_is_numbered_from_one_and_has_its_own_letter() -> None:
    from importlib import import_module

    letters = set()
    for name in SUITES:
        module = import_module(f"contact_core.testing.{name}_contract")
        suite = getattr(module, "".join(word.title() for word in name.split("_")) + "Contract")
        ids = [clause.id for clause in suite.clauses()]
        assert ids == [f"{suite.letter}{number:02d}" for number in range(1, len(ids) + 1)]
        assert len(ids) >= 5
        assert clause_table(suite).count("\n") == len(ids) + 2
        letters.add(suite.letter)
    assert len(letters) == len(SUITES)
