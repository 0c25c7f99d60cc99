"""Affine matrices applied to points."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray


def transform_points(matrix: Any, points: Any) -> FloatArray:
    """Points (..., 3) mapped by an affine matrix (4, 4) that acts on columns: `b_from_a` takes points of a to b."""
    matrix = np.asarray(matrix)
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])
