"""The scene of a job: where the object lies in the coarse hand, the coarse pose, and the open hand far away.

World space is the manipulator's rig space. The object stands still; the hand starts away from it.
"""

from __future__ import annotations

from fnmatch import fnmatchcase

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.job.recipe import CoarseSpec
from contact_core.rig.chart import Chart
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin


def world_from_object(spec: CoarseSpec, mesh: TriangleMesh) -> FloatArray:
    """(4, 4) rigid: the object turned about the middle of its bounding box, which goes to `object_center`."""
    used = mesh.points[np.unique(mesh.faces)]
    middle = 0.5 * (used.min(axis=0) + used.max(axis=0))
    placed = np.eye(4)
    for axis, degrees in enumerate(spec.object_rotation):
        placed[:3, :3] = _turn(axis, np.radians(degrees)) @ placed[:3, :3]
    placed[:3, 3] = np.asarray(spec.object_center) - placed[:3, :3] @ middle
    return placed


def coarse_pose(rig: Rig, spec: CoarseSpec) -> Pose:
    """The rest pose with the recipe's angles put in. Raises InvalidInput for joints or angles that do not exist.

    A single angle curls (the last rotation dof); several are all rotation dofs in order (twist, spread, flexion).
    """
    chart = Chart(rig)
    theta = np.zeros(chart.size)
    for pattern, degrees in spec.pose.items():
        joints = [j for j, name in enumerate(rig.joints) if fnmatchcase(name, pattern)]
        if not joints:
            raise InvalidInput(f"coarse.pose: no joint of {rig.name} matches {pattern!r}.")
        for joint in joints:
            dofs = np.arange(chart.size)[chart.rotation_slices[joint]]
            wanted = dofs[-1:] if len(degrees) == 1 else dofs
            if len(wanted) != len(degrees):
                raise InvalidInput(
                    f"coarse.pose: joint {rig.joints[joint]!r} has {len(dofs)} angles, but got {len(degrees)}."
                )
            theta[wanted] = np.clip(np.radians(degrees), chart.lower[wanted], chart.upper[wanted])
    return Pose(rig.joints, chart.local(theta))


def shifted(rig: Rig, pose: Pose, shift: FloatArray) -> Pose:
    """The pose with its root joints moved by `shift` (3,) in rig space."""
    local = pose.local.copy()
    local[rig.parents < 0, :3, 3] += shift
    return Pose(pose.joints, local)


def away_pose(
    rig: Rig, placed: FloatArray, mesh: TriangleMesh, direction: FloatArray, clear: float
) -> tuple[Pose, float]:
    """The open hand (rest pose), backed off along `direction` until `clear` of the object; and how clear it is.

    placed: (4, 4) world_from_object. Closest distances are 1-Lipschitz, so each step of what is missing is safe.
    """
    way = direction / np.linalg.norm(direction)
    rest = rig.surface.points
    into_object = np.linalg.inv(placed)
    locator = Locator.of(mesh)
    travelled, nearest = 0.0, 0.0
    for _ in range(200):
        points = transform_points(into_object, rest + travelled * way)
        nearest = float(locator.closest(points).distance.min())
        if nearest >= clear * (1.0 - 1e-6):
            break
        travelled += max(clear - nearest, 1e-3 * clear)
    return shifted(rig, Pose.rest(rig), travelled * way), nearest


def posed_world(rig: Rig, pose: Pose) -> FloatArray:
    """(j, 4, 4) world_from_joint of a pose that names all joints of the rig, in any order."""
    order = [pose.joints.index(name) for name in rig.joints]
    return forward_kinematics(rig.parents, pose.local[order])


def posed_skin(rig: Rig, pose: Pose, placed: FloatArray | None = None) -> TriangleMesh:
    """The deformed skin; in the object's surface space when `placed`, world_from_object, is given."""
    points = skin(rig, posed_world(rig, pose))
    if placed is not None:
        into_object = np.linalg.inv(placed)
        points = transform_points(into_object, points)
    return TriangleMesh(points, rig.faces)


def moved(mesh: TriangleMesh, matrix: FloatArray) -> TriangleMesh:
    """A mesh under a rigid motion (4, 4)."""
    return TriangleMesh(transform_points(matrix, mesh.points), mesh.faces)


def _turn(axis: int, angle: float) -> FloatArray:
    """(3, 3) turn about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i] = turn[j, j] = c
    turn[i, j], turn[j, i] = -s, s
    return turn
