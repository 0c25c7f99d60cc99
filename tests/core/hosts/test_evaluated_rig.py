"""A host's rig is compared once with its own evaluation; what differs is evaluated by the host, and says so."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.rig.chart import Chart
from contact_core.rig.poses import blend
from contact_core.rig.rig import Pose
from contact_core.scene.evaluated_rig import BEND, EvaluatedRig, body_of, check_skin, probes
from contact_core.scene.memory_host import MemoryHost
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.testing import rigs
from contact_core.testing.host_scenes import arm_rig


class Swollen(MemoryHost):
    """A host whose skin swells where the rig bends, as muscles do."""

    by = 0.0

    def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
        points = super().skin_points(object_id, pose)
        rig = self.read_rig(object_id).rig
        assert rig is not None
        bent = float(((pose.local[1:, :3, :3] - rig.rest_local[1:, :3, :3]) ** 2).sum())
        middle = points.mean(axis=0)
        return np.asarray(middle + (1.0 + self.by * bent) * (points - middle))


def host(by: float) -> tuple[Swollen, str]:
    result, rig = Swollen(), arm_rig()
    result.by = by
    name = result.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    return result, name


def test_a_linear_skin_is_analytic() -> None:
    scene, name = host(0.0)
    found = body_of(scene, name)
    assert found.check.is_exact and found.check.largest <= 1e-12
    assert found.body.black_box is None and not found.notes


@pytest.mark.parametrize("by", [0.002, 0.2])
def test_another_skin_is_evaluated_by_its_host(by: float) -> None:
    """At rest both agree; the difference shows in bent poses only, and its size is what was put in."""
    scene, name = host(by)
    rest = scene.skin_points(name, scene.read_pose(name))
    assert np.abs(rest - arm_rig().surface.points).max() <= 1e-12
    found = body_of(scene, name)
    assert not found.check.is_exact and isinstance(found.body.black_box, EvaluatedRig)
    assert str(found.check.vertex) in found.notes[0] and "evaluates" in found.notes[0]
    smaller = check_skin(*host(0.5 * by))
    assert smaller.largest == pytest.approx(0.5 * found.check.largest, rel=1e-6)


@pytest.mark.parametrize("by", [0.0, 0.1])
def test_a_solve_answers_a_pose_of_the_host(by: float) -> None:
    """Contacts on the skin that the host shows in a bent pose: the pose written back brings it there."""
    scene, name = host(by)
    rig = arm_rig()
    goal = blend(rig, Pose.rest(rig), probes(rig)[0], 0.5)
    where = scene.skin_points(name, goal)
    target = Body.rigid("target", rig.surface.with_points(where))
    every = rigs.SurfacePoints(np.arange(len(rig.faces)), np.full((len(rig.faces), 3), 1.0 / 3.0))
    found = body_of(scene, name)
    contact = PairedPoints("skin", found.body.name, every, "target", every)
    terms = rigs.PoseProblem((target,), ()).terms[:1]  # distances alone
    solution = LevenbergMarquardt().solve(PoseProblem((found.body, target), (contact,), terms))
    scene.write_pose(name, found.pose(solution))
    away = np.linalg.norm(scene.skin_points(name, scene.read_pose(name)) - where, axis=1)
    assert away.max() <= 0.01 * rig.surface.bounding_box_diagonal


def test_probes_bend_within_the_limits() -> None:
    rig = rigs.hand_like(rigs.limited_freedom)
    chart = Chart(rig)
    for pose in probes(rig):
        theta, _ = chart.theta_of(pose)
        inner = ~chart.is_root & ~chart.is_translation
        assert (theta >= chart.lower - 1e-9)[inner].all() and (theta <= chart.upper + 1e-9)[inner].all()
        assert 0.1 < np.abs(theta[inner]).max() <= BEND + 1e-9


def test_a_skin_of_other_vertices_is_refused() -> None:
    class Cut(Swollen):
        def skin_points(self, object_id: str, pose: Pose) -> FloatArray:
            return super().skin_points(object_id, pose)[1:]

    scene, rig = Cut(), arm_rig()
    name = scene.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    with pytest.raises(InvalidInput, match="vertices"):
        check_skin(scene, name)
