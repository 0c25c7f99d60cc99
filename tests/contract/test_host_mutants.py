"""The host contract catches every host that breaks one promise, at the clause named for it."""

from __future__ import annotations

from pathlib import Path

from contact_core.testing.host_contract import HostContract
from contact_core.testing.mutants import judge

MUTANTS = Path(__file__).with_name("mutant_hosts.py")


def test_every_mutant_is_caught_at_its_clause() -> None:
    complaints = judge(MUTANTS)
    assert {name: text for name, text in complaints.items() if text} == {}
    assert len(complaints) >= 30


def test_every_clause_catches_a_mutant() -> None:
    text = MUTANTS.read_text(encoding="utf-8")
    missing = [clause.id for clause in HostContract.clauses() if f'breaks = "{clause.id}"' not in text]
    assert missing == []
