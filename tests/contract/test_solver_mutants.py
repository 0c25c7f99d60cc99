"""The solver contract is itself tested: broken solvers fail, each first at the clause named for it."""

from __future__ import annotations

from pathlib import Path

from contact_core.testing.mutants import judge


def test_every_mutant_is_caught_where_it_is_broken() -> None:
    complaints = judge(Path(__file__).with_name("mutant_solvers.py"))
    assert len(complaints) == 9
    assert not {name: complaint for name, complaint in complaints.items() if complaint}
