"""A host's rig is compared once with its own evaluation; what differs is evaluated by the host, and says so."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.chart import Chart
from contact_core.rig.poses import blend
from contact_core.rig.rig import Pose
from contact_core.scene.evaluated_rig import BEND, EvaluatedRig, HostRig, check_skin, evaluated_by_host, probes
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.problem import poses_of
from contact_core.session import Session
from contact_core.solve.body import Body, PairedPoints
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.problem import PoseProblem
from contact_core.solve.terms import DistanceTerm
from contact_core.testing import meshes, rigs
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
    check = check_skin(scene, name)
    assert check.is_exact and check.largest <= 1e-12
    assert evaluated_by_host(scene, name) is None


@pytest.mark.parametrize("by", [0.002, 0.2])
def test_another_skin_is_evaluated_by_its_host(by: float) -> None:
    """At rest both agree; the difference shows in bent poses only, and its size is what was put in."""
    scene, name = host(by)
    rest = scene.skin_points(name, scene.read_pose(name))
    assert np.abs(rest - arm_rig().surface.points).max() <= 1e-12
    found = evaluated_by_host(scene, name)
    assert found is not None and not found.check.is_exact
    assert str(found.check.vertex) in found.notes[0] and "evaluates" in found.notes[0]
    smaller = check_skin(*host(0.5 * by))
    assert smaller.largest == pytest.approx(0.5 * found.check.largest, rel=1e-6)


@pytest.mark.parametrize("by", [0.0, 0.1])
def test_a_solve_returns_a_pose_of_the_host(by: float) -> None:
    """Contacts on the skin that the host shows in a bent pose: the pose written back brings it there."""
    scene, name = host(by)
    rig = arm_rig()
    goal = blend(rig, Pose.rest(rig), probes(rig)[0], 0.5)
    where = scene.skin_points(name, goal)
    target = Body.rigid("target", rig.surface.with_points(where))
    every = rigs.SurfacePoints(np.arange(len(rig.faces)), np.full((len(rig.faces), 3), 1.0 / 3.0))
    found = HostRig(scene, name, check_skin(scene, name), ()).body(name, None, np.eye(4))
    contact = PairedPoints("skin", name, every, "target", every)
    solution = LevenbergMarquardt().solve(PoseProblem((found, target), (contact,), terms=(DistanceTerm(),)))
    scene.write_pose(name, poses_of(solution, {name: rig})[name])
    away = np.linalg.norm(scene.skin_points(name, scene.read_pose(name)) - where, axis=1)
    assert away.max() <= 0.01 * rig.surface.bounding_box_diagonal


def test_a_session_poses_what_only_the_host_can_evaluate() -> None:
    """Accepting the solve brings the host's own skin to the contacts; one undo takes pose and document back."""
    scene, name = host(0.1)
    small = meshes.icosphere(2)
    ball = TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    scene.add(Asset("ball", ball, meters_per_unit=1.0))
    with Session(host=scene, objects=None, discover=False) as session:
        arm = session.geometry.mesh(name)
        tip = int(np.argmax(arm.points[:, 1] + arm.points[:, 0]))
        near = np.argsort(np.linalg.norm(arm.points - arm.points[tip], axis=1))[:6]
        points = SurfacePoints.at_vertices(arm, near)
        session.patches.paint("tip", points, surface=name, axis=points[[0]], heading=1.0)
        side = SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 0]))])
        session.pairs.add("tip", session.patches.transfer("tip", "ball", side, heading=1.0))
        assert isinstance(session.problem().bodies[0].black_box, EvaluatedRig)
        before, rest = session.document, scene.read_pose(name)
        (pair,) = session.geometry.pairs()

        def gap() -> float:
            skin = arm.with_points(scene.skin_points(name, scene.read_pose(name)))
            away = pair.manipulator_points.positions(skin) - pair.object_points.positions(ball)
            return float(np.linalg.norm(away, axis=1).mean())

        apart = gap()
        session.accept(session.solve())
        assert gap() < 0.3 * apart
        session.undo()
        assert session.document is before and np.array_equal(scene.read_pose(name).local, rest.local)


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
