"""The script in adapters/blender/README.md runs, and its words are true."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any


def test_the_script_runs(bpy: Any, empty: Any, repository: Path) -> None:
    text = (repository / "adapters" / "blender" / "README.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(script, "README.md", "exec"), names)
    session = names["session"]
    assert list(session.document.patches) == ["grip"]
    assert names["host"].stored_stamp().revision == session.revision
