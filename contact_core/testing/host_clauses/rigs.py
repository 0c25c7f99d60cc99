"""Rigs as the host skins them, poses and keys."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.geometry.transform import transform_points
from contact_core.rig.rig import Pose, forward_kinematics, skin
from contact_core.testing.contract import needs
from contact_core.testing.host_checks import ACCURACY, dense_weights, is_rigid, object_id, pose_error
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import arm_rig, bent, contract_scene


class RigClauses(HostGround):
    """Rigs as the host skins them, poses and keys."""

    @needs("rigs")
    def test_h12_reads_the_rig(self, host: Any) -> None:
        """Joint names, their tree, rest frames and skin weights are those of the host's rig; weights sum to 1."""
        rig, made = host.read_rig(object_id(host, "arm")).rig, arm_rig()
        assert sorted(rig.joints) == sorted(made.joints)
        order = [rig.joint_index(name) for name in made.joints]
        parent_names = [None if rig.parents[k] < 0 else rig.joints[rig.parents[k]] for k in order]
        assert parent_names == [None, "shoulder", "elbow", "elbow"]
        np.testing.assert_allclose(rig.rest_world[order], made.rest_world, atol=1e-5)
        np.testing.assert_allclose(dense_weights(rig)[:, order], dense_weights(made), atol=1e-5)

    @needs("rigs")
    def test_h13_skins_as_the_host_does(self, host: Any) -> None:
        """The analytic rig's skin is the host's own evaluation to 1e-5 of its size, in rest and far from it."""
        for name in ("arm", "half_arm"):
            rig_id = object_id(host, name)
            rig = host.read_rig(rig_id).rig
            size = rig.surface.bounding_box_diagonal
            for pose in (Pose.rest(rig), bent(rig, 1), bent(rig, 2)):
                ours = skin(rig, forward_kinematics(rig.parents, pose.local))
                assert np.abs(ours - host.skin_points(rig_id, pose)).max() < ACCURACY * size

    @needs("rigs")
    def test_h14_scales_the_rig_with_its_object(self, host: Any) -> None:
        """A rig's scale in the scene is in its surface and joints, and its placement is rigid."""
        scene = contract_scene(self.spaces[0])
        asset = host.read_rig(object_id(host, "half_arm"))
        placement = host.placement(object_id(host, "half_arm"))
        world = scene.world_of("half_arm")
        made = arm_rig()
        points = transform_points(world, made.surface.points)
        ours = transform_points(placement, asset.mesh.points)
        np.testing.assert_allclose(ours, points, atol=1e-5)
        assert is_rigid(placement)
        wrist = (placement @ asset.rig.rest_world[asset.rig.joint_index("wrist")])[:3, 3]
        np.testing.assert_allclose(wrist, (world @ made.rest_world[2])[:3, 3], atol=1e-5)

    @needs("rigs")
    def test_h15_asking_for_skin_poses_nothing(self, host: Any) -> None:
        """`skin_points` leaves the pose in the scene, its keys and the rest of the scene as they were."""
        rig_id = object_id(host, "arm")
        before = self.scene_state(host)
        host.skin_points(rig_id, bent(host.read_rig(rig_id).rig, 3))
        assert self.scene_state(host) == before

    @needs("poses")
    def test_h16_reads_the_pose_that_was_written(self, host: Any) -> None:
        """A pose comes back as it was written, also of a scaled rig, and the skin follows it."""
        for name in ("arm", "half_arm"):
            rig_id = object_id(host, name)
            rig = host.read_rig(rig_id).rig
            host.write_pose(rig_id, bent(rig, 4))
            assert pose_error(host.read_pose(rig_id), bent(rig, 4)) < ACCURACY
            assert host.read_rig(rig_id).mesh.digest == rig.surface.digest  # still the rest pose

    @needs("poses")
    def test_h17_poses_only_named_joints(self, host: Any) -> None:
        """A pose that names some joints leaves the others where they were."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        host.write_pose(rig_id, bent(rig, 4))
        elbow, other = rig.joint_index("elbow"), bent(rig, 5)
        host.write_pose(rig_id, Pose(("elbow",), other.local[elbow : elbow + 1]))
        mixed = bent(rig, 4).local.copy()
        mixed[elbow] = other.local[elbow]
        assert pose_error(host.read_pose(rig_id), Pose(rig.joints, mixed)) < ACCURACY

    @needs("keys")
    def test_h18_keys_land_on_their_frames(self, host: Any) -> None:
        """A keyed pose is at its frame and at no other; keys before and after it stay, frames between move."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        assert host.pose_keys(rig_id) == ()
        for frame, seed in ((12.0, 6), (4.0, 7)):
            host.write_pose(rig_id, bent(rig, seed), frame)
        assert host.pose_keys(rig_id) == (4.0, 12.0)
        assert pose_error(host.read_pose(rig_id, 4.0), bent(rig, 7)) < ACCURACY
        assert pose_error(host.read_pose(rig_id, 12.0), bent(rig, 6)) < ACCURACY
        between = host.read_pose(rig_id, 8.0)
        assert min(pose_error(between, bent(rig, 6)), pose_error(between, bent(rig, 7))) > 1e-2
