"""Affine matrices applied to points."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray


def is_rigid(matrix: FloatArray) -> bool:
    """Whether a matrix (4, 4) turns and moves, and does nothing else."""
    turn = matrix[:3, :3]
    turns = np.abs(turn).max() < 1.1 and np.abs(turn @ turn.T - np.eye(3)).max() <= 1e-6
    return bool(turns and np.linalg.det(turn) >= 0.0 and np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max() <= 1e-9)


def transform_points(matrix: Any, points: Any) -> FloatArray:
    """Points (..., 3) mapped by an affine matrix (4, 4) that acts on columns: `b_from_a` takes points of a to b."""
    matrix = np.asarray(matrix)
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])
