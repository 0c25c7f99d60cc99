"""A signed distance field on a grid: how deep a point is inside an object, and in which direction out lies.

Negative inside. In a band of two cells round the surface a node's distance is exact (closest point on the
triangles) and its sign is the generalised winding number's (> 0.5 is inside), so small holes and self-overlaps
of scans do no harm; every other node takes the closest point and the sign of its nearest node in the band
(a feature transform: an upper bound of the distance, off by less than a cell). Between nodes values are
trilinear and the gradient is that of the trilinear interpolant, so that a solver sees a function and its
true derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import distance_transform_edt

from contact_core.arrays import FloatArray, frozen
from contact_core.cache import cached_arrays
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator

BAND = 2.0  # cells
MOST = 20_000_000  # nodes of a box
VERSION = 1  # of the cached fields: raise it when the values change


@dataclass(frozen=True, eq=False)
class DistanceField:
    """origin: (3,) position of node (0, 0, 0). spacing: cell size. values: (x, y, z) signed distances at nodes."""

    origin: FloatArray
    spacing: float
    values: FloatArray
    _of_mesh: ClassVar[WeakKeyDictionary[TriangleMesh, dict[str, DistanceField]]] = WeakKeyDictionary()

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", frozen(self.origin, np.float64, (3,), "origin"))
        object.__setattr__(self, "values", frozen(self.values, np.float64, (None, None, None), "values"))
        if min(self.values.shape) < 2:
            raise InvalidInput(f"a distance field needs 2 nodes along each axis, but got {self.values.shape}.")

    @classmethod
    def of(cls, mesh: TriangleMesh, *, resolution: int = 64, margin: float = 0.15) -> DistanceField:
        """The field of a mesh: `resolution` nodes along the longest side of its box widened by `margin` of its
        diagonal. Kept with the mesh, and on disk by content; raises InvalidInput for a mesh without faces or a bad
        resolution."""
        if not 4 <= resolution <= 256:
            raise InvalidInput(f"a distance field needs 4 to 256 nodes a side, but {resolution} were asked for.")
        settings = f"{resolution}-{margin:g}-v{VERSION}"
        kept = cls._of_mesh.setdefault(mesh, {})
        if settings not in kept:
            kept[settings] = cls._made(mesh, resolution, margin, f"{mesh.digest}-{settings}")
        return kept[settings]

    @classmethod
    def within(cls, mesh: TriangleMesh, low: FloatArray, high: FloatArray, spacing: float) -> DistanceField | None:
        """The field in a box of corners (3,) alone, as fine as is wanted; None where the surface is not near it.

        For a hand on a thing that is much larger than it; nothing is kept.
        """
        shape = tuple(int(n) for n in np.ceil((high - low) / spacing).astype(int) + 1)
        if min(shape) < 2 or np.prod(shape, dtype=float) > MOST:
            raise InvalidInput(f"a box needs 2 nodes a side and {MOST:.0e} in all at most, but has {shape}.")
        if (
            not Locator.of(mesh)
            .closest(0.5 * (low + high)[None], max_distance=float(np.linalg.norm(high - low)))
            .found[0]
        ):
            return None
        values = _signed_distances(mesh, low, spacing, shape)
        return cls(low, spacing, values) if np.isfinite(values).all() else None

    @classmethod
    def _made(cls, mesh: TriangleMesh, resolution: int, margin: float, key: str) -> DistanceField:
        used = mesh.points[mesh.used_points]
        if not len(used):
            raise InvalidInput("a distance field needs a mesh with faces, but it has none.")
        pad = margin * mesh.bounding_box_diagonal
        low, high = used.min(axis=0) - pad, used.max(axis=0) + pad
        spacing = float((high - low).max() / (resolution - 1))
        shape = tuple(int(n) for n in np.ceil((high - low) / spacing).astype(int) + 1)

        def make() -> dict[str, FloatArray]:
            values = _signed_distances(mesh, low, spacing, shape)
            return {"values": values.astype(np.float32)}

        values = cached_arrays("distance-fields", key, make)["values"]
        return cls(low, spacing, values)

    def distances(self, points: FloatArray) -> FloatArray:
        """(k,) signed distance at points (k, 3), that of `sample`."""
        return self._sampled(points, np.empty((0, 3)))

    def sample(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signed distance (k,) and gradient (k, 3) at points (k, 3).

        Outside the grid: the value at the nearest point of the grid's box plus the distance to it.
        """
        gradients = np.empty((len(points), 3))
        return self._sampled(points, gradients), gradients

    def _sampled(self, points: FloatArray, gradients: FloatArray) -> FloatArray:
        from contact_core.geometry import field_kernels

        distances = np.empty(len(points))
        plain = np.require(points, np.float64, ("C", "W"))
        field_kernels.sample(plain, self.origin, self.spacing, self.values, distances, gradients)
        return distances


def _signed_distances(mesh: TriangleMesh, low: FloatArray, spacing: float, shape: tuple[int, ...]) -> FloatArray:
    """Signed distances (x, y, z) at the nodes of a grid."""
    axes = [low[k] + spacing * np.arange(shape[k]) for k in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    locator = Locator.of(mesh)
    near = locator.closest(nodes, max_distance=BAND * np.sqrt(3.0) * spacing)
    band = near.found
    feature = np.zeros_like(nodes)
    feature[band] = near.points[band].positions(mesh)
    sign = np.ones(len(nodes))
    sign[band] = np.where(locator.winding_number(nodes[band]) > 0.5, -1.0, 1.0)
    nearest = distance_transform_edt(~band.reshape(shape), return_distances=False, return_indices=True)
    source = np.ravel_multi_index(tuple(nearest), shape).ravel()  # (nodes,) a band node each
    distance = np.linalg.norm(nodes - feature[source], axis=1)
    return (sign[source] * distance).reshape(shape)
