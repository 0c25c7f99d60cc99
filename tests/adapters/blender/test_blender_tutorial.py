"""Every block of docs/tutorial-blender.md runs in Blender, and ends in a keyed pose that touches."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest


def test_its_steps_end_in_a_pose_on_the_timeline(
    bpy: Any, repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from contact_blender import extension
    from contact_core.cli import main
    from contact_core.grasping.judging import verdict

    bpy.ops.wm.read_factory_settings(use_empty=True)
    monkeypatch.chdir(tmp_path)
    for name, file in (("human_hand", "hand.glb"), ("baseball", "ball.glb")):
        assert main(["samples", name, "--out", file]) == 0
    extension.register()
    try:
        text = (repository / "docs" / "tutorial-blender.md").read_text(encoding="utf-8")
        names: dict[str, Any] = {}
        for number, block in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL), 1):
            exec(compile(block, f"tutorial-blender.md, block {number}", "exec"), names)
            if number == 4:
                near = dict(extension.shared.held().residuals)
                judged = verdict(extension.shared.session())
        assert len(near) == 3 and max(near.values()) < 0.005, near  # the page says 4 mm
        assert judged.is_grasp, judged.failures
        assert (tmp_path / "grasp.blend").is_file()
        session = extension.shared.session()
        assert len(session.document.pairs) == 3
        rigged = next(iter(session.rigs))
        keys = session.host.pose_keys(session.binding.surfaces[rigged].object_id)
        assert len(keys) >= 1, keys
    finally:
        extension.unregister()
