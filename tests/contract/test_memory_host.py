"""The reference host keeps every clause of the host contract."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.memory_host import MemoryHost
from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene


def build_in_memory(scene: HostScene, host_type: type[MemoryHost] = MemoryHost) -> MemoryHost:
    """The contract's scene in a fresh memory host, with nothing left to undo."""
    made = MemoryHost(space=scene.space)
    for mesh in scene.meshes:
        world = scene.world_of(mesh.name)
        key = made.add_polygons(mesh.name, mesh.points, mesh.face_sizes, mesh.face_indices, world)
        for name, vertices in mesh.selections.items():
            made.select(key, name, vertices)
    for rig in scene.rigs:
        unscaled = np.linalg.norm(rig.world_from_local[:3, 0])
        asset = Asset(rig.name, rig.rig.surface, rig.rig, meters_per_unit=scene.space.meters_per_unit * unscaled)
        world = rig.world_from_local.copy()
        world[:3, :3] /= unscaled
        made.add(asset, world)
    return host_type(scene=made.scene)


class TestMemoryHost(HostContract):
    subject = "memory"

    @pytest.fixture
    def build(self) -> Build:
        return build_in_memory

    def foreign_edit(self, host: MemoryHost) -> None:
        farther = host.placement("plain").copy()
        farther[0, 3] += 1.0
        host.move("plain", farther)
