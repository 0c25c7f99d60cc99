"""Every broken kind of job and proxy maker is caught at the clause that it breaks."""

from __future__ import annotations

from pathlib import Path

from contact_core.testing.mutants import judge


def test_every_mutant_is_caught_where_it_is_broken() -> None:
    complaints = judge(Path(__file__).with_name("mutant_jobs.py"))
    assert len(complaints) >= 20
    assert not {name: complaint for name, complaint in complaints.items() if complaint}
