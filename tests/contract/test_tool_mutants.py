"""Every broken tool is caught at the clause that it breaks, and beyond it only where it says."""

from __future__ import annotations

from pathlib import Path

from contact_core.testing.mutants import judge


def test_every_mutant_tool_is_caught_where_it_is_broken() -> None:
    complaints = judge(Path(__file__).with_name("mutant_tools.py"))
    assert len(complaints) >= 12
    assert not {name: complaint for name, complaint in complaints.items() if complaint}
