"""A rig that Blender itself evaluates, whatever it is made of: for solves where linear skinning is not exact.

    black_box = EvaluatedRig(host, "hand")
    problem = PoseProblem(bodies=(Body.evaluated("hand", black_box), ...), ...)
    pose = black_box.pose(solution.poses["hand"])

Every evaluation poses the bones, lets the dependency graph run and takes the pose back: a few milliseconds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.pose.black_box import BlackBoxDof, DeformedSkin
from contact_core.pose.chart import Chart
from contact_core.pose.rig import Pose

if TYPE_CHECKING:
    from contact_blender.host import BlenderHost

_STEP = 1e-3  # radians, or of the rig's size: well above what single precision makes of a vertex


class EvaluatedRig(DeformedSkin):
    """The dofs of the rig that the host reads, unlocked ones only; points in the world from `skin_points`."""

    def __init__(self, host: BlenderHost, object_id: str) -> None:
        asset = host.read_rig(object_id)
        assert asset.rig is not None  # read_rig fills it
        self.chart = Chart(asset.rig)
        self._free = np.flatnonzero(~self.chart.locked)
        self._start, self._leftover = self.chart.theta_of(host.read_pose(object_id))
        place, size = host.placement(object_id), asset.rig.surface.bounding_box_diagonal

        def deform(theta: FloatArray) -> FloatArray:
            points = host.skin_points(object_id, self._pose_at(theta))
            return np.asarray(points @ place[:3, :3].T + place[:3, 3])

        super().__init__(asset.rig.surface, [self._dof(int(q), size) for q in self._free], deform, size)

    def pose(self, solved: Pose) -> Pose:
        """The joints' pose out of what a solver answers for a black box: its dofs by name."""
        value = dict(zip(solved.joints, solved.local[:, 0, 3].tolist(), strict=True))
        return self._pose_at(np.array([value[dof.name] for dof in self.dofs]))

    def _pose_at(self, theta: FloatArray) -> Pose:
        """theta: (free,); locked dofs stay where they were found."""
        whole = self._start.copy()
        whole[self._free] = theta
        return Pose(self.chart.rig.joints, self.chart.local(whole, self._leftover))

    def _dof(self, q: int, size: float) -> BlackBoxDof:
        chart, length = self.chart, bool(self.chart.is_translation[q])
        return BlackBoxDof(
            chart.dof_names[q],
            float(chart.lower[q]),
            float(chart.upper[q]),
            float(chart.prior_weight[q]),
            is_translation=length,
            is_root=bool(chart.is_root[q]),
            step=_STEP * (size if length else 1.0),
        )
