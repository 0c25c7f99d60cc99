"""The example of docs/posing.md runs as it stands, and names only solvers and terms that exist."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import contact_builtins
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import POSE_SOLVERS, POSE_TERMS
from contact_core.solve.solver import SolveStatus


def test_the_example_runs(repository: Path) -> None:
    text = (repository / "docs" / "posing.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(example, "docs/posing.md", "exec"), names)
    assert names["solution"].status is SolveStatus.CONVERGED
    assert names["solution"].patches["palm"].mean < 0.1 * names["problem"].manipulator_length


def test_all_solvers_and_terms_are_named(repository: Path) -> None:
    text = (repository / "docs" / "posing.md").read_text(encoding="utf-8")
    manager = PluginManager([contact_builtins], discover=False)
    for name in [*manager.offers(POSE_SOLVERS), *manager.offers(POSE_TERMS)]:
        assert f"`{name}`" in text, name
