"""A scene file that was cut or changed is refused in one sentence that says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from contact_core.errors import FileRefused
from contact_core.scene.host import SceneSpace
from contact_core.scene.memory_scene import MemoryScene, load_scene, save_scene


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.9])
def test_a_scene_that_was_cut_says_what_to_do(share: float, tmp_path: Path) -> None:
    path = tmp_path / "cut.contactscene"
    save_scene(MemoryScene(SceneSpace(1.0, "Y")), path)
    assert load_scene(path).objects == {}
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(FileRefused, match="take an earlier copy") as refusal:
        load_scene(path)
    assert "\n" not in str(refusal.value)
