"""Where things stand before a solve: objects as the recipe lays them, the open hand away from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.transform import transform_points
from contact_core.job.recipe import ManipulatorSpec, ObjectSpec
from contact_core.rig.rig import Pose, Rig
from contact_core.strict_table import Vector


def world_from_manipulator(spec: ManipulatorSpec) -> FloatArray:
    """(4, 4) rigid: the rig turned about its origin, which goes to `position`."""
    placed = _turned(spec.rotation)
    placed[:3, 3] = spec.position
    return placed


def world_from_object(spec: ObjectSpec, mesh: TriangleMesh) -> FloatArray:
    """(4, 4) rigid: the object turned about the middle of its bounding box, which goes to `center`."""
    used = mesh.points[np.unique(mesh.faces)]
    middle = 0.5 * (used.min(axis=0) + used.max(axis=0))
    placed = _turned(spec.rotation)
    placed[:3, 3] = np.asarray(spec.center) - placed[:3, :3] @ middle
    return placed


def backed_off(
    rig: Rig, objects: Sequence[tuple[FloatArray, TriangleMesh]], direction: FloatArray, clear: float
) -> tuple[Pose, float]:
    """The open hand (rest pose), backed off along `direction` (rig space) until `clear` of all objects; and how
    clear it is (surface units).

    objects: each with object_from_rig (4, 4). Closest distances are 1-Lipschitz, so each step of what is missing is
    safe.
    """
    back = direction / np.linalg.norm(direction)
    locators = [(into, Locator.of(mesh)) for into, mesh in objects]
    travelled, nearest = 0.0, 0.0
    for _ in range(200):
        points = rig.surface.points + travelled * back
        nearest = min(
            (float(locator.closest(transform_points(into, points)).distance.min()) for into, locator in locators),
            default=clear,
        )
        if nearest >= clear * (1.0 - 1e-6):
            break
        travelled += max(clear - nearest, 1e-3 * clear)
    local = rig.rest_local.copy()
    local[rig.parents < 0, :3, 3] += travelled * back
    return Pose(rig.joints, local), nearest


def _turned(degrees: Vector) -> FloatArray:
    """(4, 4) turned about x, y and z of the world, in this order."""
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    return turned
