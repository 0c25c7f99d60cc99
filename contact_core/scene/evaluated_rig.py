"""A host's rig for a solve: analytic where that is exact, else evaluated by the host itself, and said in words.

found = evaluated_by_host(host, "hand")    # None: the analytic rig is exact
body = found.body("hand", pose, world)      # for a PoseProblem; `scene.problem` does this for a whole document
found.notes                                 # why the host evaluates
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.transform import transform_points
from contact_core.rig.chart import Chart
from contact_core.rig.poses import posed_points
from contact_core.rig.rig import Pose, Rig
from contact_core.scene.host import RigReading, SceneReading
from contact_core.solve.black_box import BlackBoxDof, DeformedSkin, dof_pose
from contact_core.solve.body import Body

TOLERANCE = 1e-4  # of the skin's diagonal: single precision of hosts stays well below
PROBES = 3  # bent poses that are compared
BEND = 0.5  # radians
SHIFT = 0.05  # of the skin's diagonal
_STEP = 1e-3  # radians, or of the rig's size: well above what single precision makes of a vertex


class EvaluatingHost(SceneReading, RigReading, Protocol):
    """A host that evaluates skins."""


@dataclass(frozen=True, eq=False)
class SkinCheck:
    """The analytic skin against the host's own. largest: distance (surface units) over all probes, at `vertex`.

    share: of the diagonal of the skin at rest.
    """

    largest: float
    vertex: int
    share: float

    @property
    def is_exact(self) -> bool:
        """Whether linear skinning reproduces what the host evaluates."""
        return self.share <= TOLERANCE


@dataclass(frozen=True, eq=False)
class HostRig:
    """A rig whose skin only the host can evaluate. notes: sentences on why."""

    host: EvaluatingHost
    object_id: str
    check: SkinCheck
    notes: tuple[str, ...]

    def body(self, name: str, pose: Pose | None, world_from_rig: FloatArray) -> Body:
        """The body of a solve that starts in a pose of the joints, by default the one in the scene."""
        box = EvaluatedRig(self.host, self.object_id, pose, world_from_rig)
        return Body.evaluated(name, box, pose=box.start)


def evaluated_by_host(host: EvaluatingHost, object_id: str) -> HostRig | None:
    """The rig as the host evaluates it, None where linear blend skinning is exact; compares skins once
    (`check_skin`)."""
    check = check_skin(host, object_id)
    if check.is_exact:
        return None
    name = host.read_rig(object_id).name
    note = (
        f"the skin of {name} is not linear blend skinning of its joints: the host puts vertex {check.vertex}"
        f" {check.largest:.3g} away ({100.0 * check.share:.2g} % of the skin's size). The host evaluates it"
        " during the solve, which is slower."
    )
    return HostRig(host, object_id, check, (note,))


def check_skin(host: RigReading, object_id: str) -> SkinCheck:
    """Compare skins in the pose of the scene and in bent poses within the limits. The scene is left as it was.

    Raises InvalidInput where the host's skin has other vertices.
    """
    asset = host.read_rig(object_id)
    assert asset.rig is not None
    largest, vertex = 0.0, 0
    for pose in (host.read_pose(object_id), *probes(asset.rig)):
        theirs, ours = host.skin_points(object_id, pose), skin_in(asset.rig, pose)
        if theirs.shape != ours.shape:
            raise InvalidInput(f"the host evaluates {len(theirs)} vertices of {asset.name}, and reads {len(ours)}.")
        away = np.linalg.norm(theirs - ours, axis=1)
        if len(away) and away.max() > largest:
            largest, vertex = float(away.max()), int(away.argmax())
    return SkinCheck(largest, vertex, largest / (asset.rig.surface.bounding_box_diagonal or 1.0))


def probes(rig: Rig) -> tuple[Pose, ...]:
    """Poses that bend and shift every free joint a little, within its limits; the same at each call."""
    chart, random = Chart(rig), np.random.default_rng(1)
    start, leftover = chart.theta_of(Pose.rest(rig))
    shift = SHIFT * (rig.surface.bounding_box_diagonal or 1.0)
    reach = np.where(chart.is_translation, shift, BEND)
    poses = []
    for _ in range(PROBES):
        theta = start + reach * random.uniform(-1.0, 1.0, chart.size)
        theta = np.where(chart.locked, start, np.clip(theta, chart.lower, chart.upper))
        poses.append(Pose(rig.joints, chart.local(theta, leftover)))
    return tuple(poses)


def skin_in(rig: Rig, pose: Pose) -> FloatArray:
    """(n, 3) the analytic skin in a pose, rig space."""
    return posed_points(rig, pose)


class EvaluatedRig(DeformedSkin):
    """The dofs of the rig that the host reads, unlocked ones only; points in the world from `skin_points`.

    pose: of the joints, where it starts and where locked dofs stay; by default that of the scene. world_from_rig:
    (4, 4) where it stands; by default as in the scene.
    """

    def __init__(
        self,
        host: EvaluatingHost,
        object_id: str,
        pose: Pose | None = None,
        world_from_rig: FloatArray | None = None,
    ) -> None:
        asset = host.read_rig(object_id)
        assert asset.rig is not None  # read_rig fills it
        self.chart = Chart(asset.rig)
        self._free = np.flatnonzero(~self.chart.locked)
        found = host.read_pose(object_id) if pose is None else pose
        self._start, self._leftover = self.chart.theta_of(found)
        place = host.placement(object_id) if world_from_rig is None else world_from_rig
        size = asset.rig.surface.bounding_box_diagonal

        def deform(theta: FloatArray) -> FloatArray:
            points = host.skin_points(object_id, self._pose_at(theta))
            return transform_points(place, points)

        scale = float(np.cbrt(abs(np.linalg.det(place[:3, :3]))))
        dofs = [self._dof(int(q), size) for q in self._free]
        super().__init__(asset.rig.surface, dofs, deform, size * scale)

    @property
    def start(self) -> Pose:
        """Its dofs by name, where it starts."""
        return dof_pose([dof.name for dof in self.dofs], self._start[self._free])

    def pose(self, solved: Pose) -> Pose:
        """The joints' pose out of what a solver returns for a black box: its dofs by name."""
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
