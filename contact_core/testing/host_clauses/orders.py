"""What comes in one order, whichever host it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from contact_core.document.asset import Asset
from contact_core.testing.contract import needs
from contact_core.testing.host_clauses.ground import HostGround
from contact_core.testing.host_scenes import arm_rig


class OrderClauses(HostGround):
    """What comes in one order, whichever host it is."""

    @needs("rigs", "writing")
    def test_h38_joints_come_in_one_order(self, host: Any) -> None:
        """Joints of rigs and poses come depth first, children in the order in which they were made."""
        made = arm_rig()  # whose joints are named anew here, as of a tree that is written breadth first
        broad = replace(made, joints=("root", "z", "a", "tip of z"), parents=np.array([-1, 0, 0, 1]))
        space = host.space()
        asset = Asset("broad", broad.surface, broad, meters_per_unit=space.meters_per_unit, up_axis=space.up_axis)
        key = host.add(asset)
        rig, pose = host.read_rig(key).rig, host.read_pose(key)
        assert rig.joints == pose.joints == ("root", "z", "tip of z", "a")
        place = [broad.joints.index(name) for name in rig.joints]
        np.testing.assert_allclose(rig.rest_local, broad.rest_local[place], atol=1e-5)
        np.testing.assert_allclose(pose.local, broad.rest_local[place], atol=1e-5)
        np.testing.assert_allclose(rig.surface.points, broad.surface.points, atol=1e-5)
