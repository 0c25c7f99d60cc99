"""The reference host keeps every clause of the host contract."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose
from contact_core.scene.memory_host import MemoryHost
from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene, arm_rig

NO_ANIMATION = {
    "curves": "keys are whole poses, joined by straight blends",
    "bones": "its rigs have no bones but those that are posed",
}


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
    cannot = NO_ANIMATION

    @pytest.fixture
    def build(self) -> Build:
        return build_in_memory

    def foreign_edit(self, host: MemoryHost) -> None:
        farther = host.placement("plain").copy()
        farther[0, 3] += 1.0
        host.move("plain", farther)


def test_frames_and_places_that_are_no_numbers_are_refused() -> None:
    host = MemoryHost()
    rig = arm_rig()
    key = host.add(Asset("arm", rig.surface, rig))
    for frame in (np.nan, np.inf, -np.inf):
        for call in (
            host.placement,
            host.read_pose,
            lambda key, frame: host.write_pose(key, Pose.rest(rig), frame),
        ):
            with pytest.raises(InvalidInput, match="a frame is a number"):
                call(key, frame)
    with pytest.raises(InvalidInput, match="world_from_surface must be finite"):
        host.add(Asset("arm", rig.surface), np.full((4, 4), np.nan))
    assert host.pose_keys(key) == () and len(host.objects()) == 1
