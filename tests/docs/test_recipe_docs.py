"""docs/recipes.md names every key that the recipe reader knows, and no other."""

from __future__ import annotations

import dataclasses
import inspect
import re
from pathlib import Path

from contact_builtins.placers import from_pose
from contact_core.recipe import reader


def test_every_key_is_documented_and_no_other(repository: Path) -> None:
    source = inspect.getsource(reader)
    calls = r"\.(?:raw|text|choice|flag|number|count|vector|vectors|texts|counts|table|tables)\(\s*\"(\w+)\""
    known = set(re.findall(calls, source))
    known |= {
        key for group in re.findall(r"exactly_one\(([^)]*)\)", source) for key in re.findall(r"\"(\w+)\"", group)
    }
    known |= {field.name for field in dataclasses.fields(from_pose.FromPose)}  # a placer's settings are keys
    assert {"schema", "center", "disk", "sha256", "approach", "aim"} <= known
    page = (repository / "docs" / "recipes.md").read_text()
    documented = set(re.findall(r"[`]+\[*(\w+)", page))
    assert known <= documented, known - documented
    rows = re.findall(r"^\|[^|]*\|([^|]*)\|", page, re.MULTILINE)
    listed = {key for row in rows for key in re.findall(r"`(\w+)`", row)}
    assert listed <= known, listed - known
