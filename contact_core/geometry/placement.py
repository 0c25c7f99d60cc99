"""Where an object stands: its matrix split into a rigid placement and the scale that shapes its surface.

Every host splits with this function, so that one scene gives one surface, and one digest, in all of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, frozen
from contact_core.errors import InvalidInput

SIGNIFICANT = 6  # decimal digits kept of the scale: turning an object in float32 must not change its digest


def split_placement(world_from_object: Any) -> tuple[FloatArray, FloatArray]:
    """Rigid world_from_surface (4, 4) and surface_from_object (3, 3) of an affine matrix (4, 4).

    Polar decomposition (Higham 1986): the scale and shear is symmetric, and negative definite where the object
    is mirrored, so that the rotation is proper and uniform scale, mirrored or not, is a multiple of the identity.
    Moving or turning the object in the world changes only world_from_surface. Raises InvalidInput when the matrix
    is singular or not affine.
    """
    matrix = frozen(world_from_object, np.float64, (4, 4), "world_from_object")
    if not np.allclose(matrix[3], [0.0, 0.0, 0.0, 1.0], atol=1e-9):
        raise InvalidInput(f"world_from_object must be affine, but its last row is {matrix[3].tolist()}.")
    left, scales, right = np.linalg.svd(matrix[:3, :3])
    if not scales[-1] > 1e-9 * scales[0]:
        raise InvalidInput(
            f"the object's scale is {scales.tolist()}: it is flat, and a flat object has no surface to paint on."
        )
    sign = np.sign(np.linalg.det(left @ right))
    scale = sign * (right.T * scales) @ right  # (3, 3) symmetric
    digits = SIGNIFICANT - 1 - int(np.floor(np.log10(scales[0])))
    rigid = np.eye(4)
    rigid[:3, :3] = sign * left @ right
    rigid[:3, 3] = matrix[:3, 3]
    return rigid, np.round(scale, digits) + 0.0
