"""Blender keeps the host contract, without a window."""

from __future__ import annotations

from typing import Any

import pytest

from contact_core.scene.host import SceneSpace
from contact_core.testing.host_contract import Build, HostContract


class TestBlenderHost(HostContract):
    subject = "blender"
    spaces = (SceneSpace(1.0, "Z"), SceneSpace(0.01, "Z"))  # Blender's up axis is Z
    cannot = {
        "picking": "rays belong to one 3D view of a window, of which Blender may have many or none;"
        " a tool in a view casts its own with bpy_extras.view3d_utils",
    }

    @pytest.fixture
    def build(self, scenes: Any) -> Build:
        return scenes.build

    def choice_of(self, group: str) -> str:
        return f"collection:{group}"

    def foreign_edit(self, host: Any) -> None:
        import bpy

        bpy.data.objects["plain"].location.x += 1.0
        bpy.ops.ed.undo_push(message="Move")

    def scene_state(self, host: Any) -> Any:
        import blender_scenes

        return [super().scene_state(host), blender_scenes.whole_state()]
