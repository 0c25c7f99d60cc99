"""Locator: rays to surface points and closest surface points, batched, over one small tree of boxes.

The tree is implicit: faces are sorted by medians, each time along the longest axis, and cut into 2^k equal
runs, the leaves; node i has the children 2i + 1 and 2i + 2. So it is built by selection and reductions, has no
pointers, and serves rays, closest points and winding numbers. docs/adr/0080 compares it with Embree.

Rays use the watertight test of Woop, Benthin and Wald ("Watertight Ray/Triangle Intersection", JCGT 2013): no
ray slips between two faces. Closest points follow Ericson, "Real-Time Collision Detection", 5.1.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar
from weakref import WeakKeyDictionary

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry import box_kernels, box_tree
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints


@dataclass(frozen=True, eq=False)
class RayHits:
    """First hits of k rays. points: (k) on the mesh. distance: (k,) in lengths of the given direction vectors.
    found: (k,), False for a miss (there `points` holds an arbitrary point and distance is inf)."""

    points: SurfacePoints
    distance: FloatArray
    found: BoolArray


@dataclass(frozen=True, eq=False)
class Closest:
    """Closest surface points of k queries. points: (k) on the mesh. distance: (k,) surface units. found: (k,),
    False where no face passed the filter within the radius (there `points` holds an arbitrary point and distance is
    inf)."""

    points: SurfacePoints
    distance: FloatArray
    found: BoolArray


class Locator:
    """Spatial queries on one mesh. Build once (`Locator.of(mesh)` keeps it with the mesh), query in batches."""

    builds: ClassVar[int] = 0  # how many trees this process built: tests guard the cost by counting
    _of_mesh: ClassVar[WeakKeyDictionary[TriangleMesh, Locator]] = WeakKeyDictionary()

    def __init__(self, mesh: TriangleMesh, *, like: Locator | None = None) -> None:
        """like: the locator of the same faces in another shape, whose tree is then fitted to this one."""
        if not len(mesh.faces):
            raise InvalidInput("spatial queries need a mesh with faces, but it has none.")
        if like is None:
            Locator.builds += 1
            self._tree = box_tree.build(mesh.points, mesh.faces)
        else:
            self._tree = box_tree.refitted(like._tree, mesh.points, mesh.faces)
        self._dipoles: box_tree.Dipoles | None = None

    @classmethod
    def of(cls, mesh: TriangleMesh) -> Locator:
        """The mesh's locator, built at the first call; that of a posed mesh is its rest shape's, refitted."""
        if mesh not in cls._of_mesh:
            rest = mesh.posed_from
            cls._of_mesh[mesh] = cls(mesh, like=None if rest is None else cls.of(rest))
        return cls._of_mesh[mesh]

    def cast(self, origins: Any, directions: Any, max_distance: float = np.inf) -> RayHits:
        """First hits of rays from origins (k, 3) along directions (k, 3), from both sides of the surface.

        Distances are in lengths of the direction vectors, so a segment is a ray with max_distance 1. Among
        hits at the same distance the lowest face wins. Raises InvalidInput.
        """
        origins, directions = _rows(origins, "origins"), _rows(directions, "directions")
        if len(origins) != len(directions):
            raise InvalidInput(
                f"rays need as many directions as origins, but got {len(directions)} for {len(origins)}."
            )
        zero = ~directions.any(axis=1)
        if zero.any():
            raise InvalidInput(f"directions must not be zero, but that of ray {int(np.argmax(zero))} is.")
        faces, barycentric, distance = box_kernels.cast(self._tree, origins, directions, float(max_distance))
        found = faces >= 0
        return RayHits(SurfacePoints(np.where(found, faces, 0), barycentric), distance, found)

    def closest(
        self, points: Any, *, max_distance: float = np.inf, facing: Any = None, facing_limit: float = -0.3
    ) -> Closest:
        """Closest surface points of points (k, 3).

        facing: optional directions (k, 3), unit; then only faces whose normal n has n . facing <= facing_limit
        count, such as the near wall of a cup for a finger pad with normal `facing`. Raises InvalidInput.
        """
        points = _rows(points, "points")
        directions = np.zeros((0, 3)) if facing is None else _rows(facing, "facing")
        if facing is not None and len(directions) != len(points):
            raise InvalidInput(
                f"facing needs one direction per point, but got {len(directions)} for {len(points)} points."
            )
        limits = float(facing_limit), float(max_distance)
        faces, barycentric, distance = box_kernels.closest(self._tree, points, directions, *limits)
        found = faces >= 0
        return Closest(SurfacePoints(np.where(found, faces, 0), barycentric), distance, found)

    def winding_number(self, points: Any, accuracy: float = 2.5) -> FloatArray:
        """(k,) generalised winding number: about 1 inside a closed surface, 0 outside, between near holes.

        Jacobson et al. 2013, by the dipole tree of Barill et al. 2018; accuracy is how many radii away a
        cluster counts as one dipole (inf: exact sum of solid angles).
        """
        points = _rows(points, "points")
        if self._dipoles is None:
            self._dipoles = box_tree.dipoles(self._tree)
        return box_kernels.winding(self._tree, self._dipoles, points, float(accuracy))


def _rows(values: Any, name: str) -> FloatArray:
    return frozen(np.atleast_2d(np.asarray(values, dtype=np.float64)), np.float64, (None, 3), name)
