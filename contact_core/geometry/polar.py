"""The polar decomposition of an object's world matrix: a rigid motion, and the stretch that shapes its surface.

Every host decomposes with this function, so that one scene gives one surface, and one digest, in all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.errors import InvalidInput

_MIRROR = np.diag([-1.0, 1.0, 1.0])
_ROUNDING = 2e-6  # of the largest scale: turning an object in float32 (noise 2e-7) must not change its digest


@dataclass(frozen=True, eq=False)
class PolarDecomposition:
    """world_from_local = world_from_surface @ surface_from_local.

    world_from_surface: (4, 4) rigid and proper. surface_from_local: (3, 3) scale, shear and mirror.
    """

    world_from_surface: FloatArray
    surface_from_local: FloatArray

    @property
    def mirrored(self) -> bool:
        """Whether the surface's triangles must be turned round to stay counter-clockwise."""
        return bool(np.linalg.det(self.surface_from_local) < 0)

    @property
    def uniform_scale(self) -> float | None:
        """The factor of a stretch that is a positive multiple of the identity; else None."""
        factor = float(self.surface_from_local[0, 0])
        return factor if factor > 0 and np.array_equal(self.surface_from_local, factor * np.eye(3)) else None

    def surface_points(self, points: Any) -> FloatArray:
        """(n, 3) points of the object in surface space; the very same numbers where there is no stretch."""
        local = np.asarray(points, np.float64)
        if self.uniform_scale is not None:
            return local * self.uniform_scale
        return local @ self.surface_from_local.T


def split_world_from_local(world_from_local: Any) -> PolarDecomposition:
    """Split an affine matrix (4, 4) by polar decomposition (Higham 1986): turn and shift, stretch and mirror.

    The stretch is symmetric; of a mirrored object it is a mirror along the object's x after a symmetric stretch.
    Moving or turning the object in the world changes only world_from_surface. Raises InvalidInput when the matrix
    is not affine or flattens the object.
    """
    matrix = frozen(world_from_local, np.float64, (4, 4), "world_from_local")
    if not np.allclose(matrix[3], [0.0, 0.0, 0.0, 1.0], atol=1e-9):
        raise InvalidInput(f"a world matrix has the last row 0 0 0 1, but got {matrix[3].tolist()}.")
    left, scales, right = np.linalg.svd(matrix[:3, :3])
    if not scales[-1] > 1e-9 * scales[0]:
        raise InvalidInput(f"the object is scaled flat, by {scales.tolist()}: there is no surface to paint on.")
    turn, stretch = left @ right, (right.T * scales) @ right  # (3, 3), (3, 3) symmetric
    if np.linalg.det(turn) < 0:
        turn, stretch = turn @ _MIRROR, _MIRROR @ stretch
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = turn, matrix[:3, 3]
    return PolarDecomposition(
        frozen(rigid, np.float64, (4, 4), "world_from_surface"),
        frozen(_rounded(stretch, float(scales[0])), np.float64, (3, 3), "surface_from_local"),
    )


def _rounded(stretch: FloatArray, largest: float) -> FloatArray:
    """To multiples of 1, 2 or 5 times a power of ten, so that scales as people write them stay as they are."""
    wanted = _ROUNDING * largest * (1 + 1e-6)  # a little more, so that 0.5 and 0.49999999 get the same step
    decimals = -int(np.floor(np.log10(wanted)))
    step = max(m for m in (1, 2, 5) if m * 10.0**-decimals <= wanted) * 10.0**-decimals
    return np.asarray(np.round(np.round(stretch / step) * step, decimals) + 0.0)
