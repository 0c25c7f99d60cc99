"""How what a recipe names stands in the world: objects in the units of the manipulators, each where it is laid."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.hull import convex_hull
from contact_core.geometry.mesh import TriangleMesh
from contact_core.recipe.recipe import ManipulatorSpec, ObjectSpec
from contact_core.strict_table import Vector

_MOST_LENGTHS = 1e4  # that an object is larger or smaller than the manipulator: a hand holds a pin, and a hull


def object_mesh(asset: Asset, spec: ObjectSpec, meters_per_unit: float, length: float) -> TriangleMesh:
    """The object's surface in the manipulator's units (`meters_per_unit`), the recipe's scale applied.

    length: of the manipulator. Raises InvalidInput for an object of a size that only a wrong unit explains.
    """
    factor = spec.scale * (1.0 if asset.meters_per_unit is None else asset.meters_per_unit / meters_per_unit)
    share = factor * asset.mesh.bounding_box_diagonal / length
    if not 1.0 / _MOST_LENGTHS <= share <= _MOST_LENGTHS:
        raise InvalidInput(
            f"the object {asset.name} is {share:.2g} lengths of the manipulator across; mend object.scale, or the"
            " units of one of the two files (`contact inspect` tells them), or leave its ground out of the file."
        )
    return asset.mesh if factor == 1.0 else TriangleMesh(asset.mesh.points * factor, asset.mesh.faces)


def solids_of(mesh: TriangleMesh, spec: ObjectSpec) -> tuple[TriangleMesh, ...]:
    """The closed surfaces whose inside counts as inside the object."""
    made = {"surface": lambda: mesh, "hull": lambda: convex_hull(mesh, spec.fill_low, spec.fill_high)}
    return tuple(made[kind]() for kind in spec.solids)


def world_from_manipulator(spec: ManipulatorSpec) -> FloatArray:
    """(4, 4) rigid: the rig turned about its origin, which goes to `position`."""
    placed = _turned(spec.rotation)
    placed[:3, 3] = spec.position
    return placed


def world_from_object(spec: ObjectSpec, mesh: TriangleMesh) -> FloatArray:
    """(4, 4) rigid: the object turned about the middle of its bounding box, which goes to `center`."""
    used = mesh.points[mesh.used_points]
    middle = 0.5 * (used.min(axis=0) + used.max(axis=0))
    placed = _turned(spec.rotation)
    placed[:3, 3] = np.asarray(spec.center) - placed[:3, :3] @ middle
    return placed


def _turned(degrees: Vector) -> FloatArray:
    """(4, 4) turned about x, y and z of the world, in this order."""
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    return turned
