"""adapters/README.md holds the host contract's clauses word for word."""

from __future__ import annotations

from pathlib import Path

from contact_core.testing.contract import clause_table
from contact_core.testing.host_contract import HostContract


def test_the_readme_holds_every_clause(repository: Path) -> None:
    assert clause_table(HostContract) in (repository / "adapters" / "README.md").read_text(encoding="utf-8")
