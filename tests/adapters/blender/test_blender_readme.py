"""The script in adapters/blender/README.md runs, and its words are true; so does the example."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pytest


def test_the_script_runs(bpy: Any, empty: Any, repository: Path) -> None:
    text = (repository / "adapters" / "blender" / "README.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(script, "README.md", "exec"), names)
    session = names["session"]
    assert list(session.document.patches) == ["grip"]
    assert names["host"].stored_stamp().revision == session.revision


def test_the_example_runs(
    bpy: Any, empty: Any, repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(repository / "examples" / "16_blender.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} >= {"hand.blend", "blender.png"}
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "hand.blend"))
    bones = bpy.data.objects[next(o.name for o in bpy.data.objects if o.type == "ARMATURE")]
    assert bones.animation_data.action is not None
    bpy.ops.wm.read_factory_settings(use_empty=True)
