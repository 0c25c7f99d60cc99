"""Rotations in batches: the exponential map with its derivative, and the nearest rotation."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from contact_core.arrays import FloatArray


def cross_matrices(v: FloatArray) -> FloatArray:
    """(k, 3, 3) matrices with cross_matrices(v) @ u = v x u, of v (k, 3)."""
    result = np.zeros((len(v), 3, 3))
    result[:, 2, 1] = v[:, 0]
    result[:, 1, 2] = -v[:, 0]
    result[:, 0, 2] = v[:, 1]
    result[:, 2, 0] = -v[:, 1]
    result[:, 1, 0] = v[:, 2]
    result[:, 0, 1] = -v[:, 2]
    return result


def exponential(v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation matrices of rotation vectors v (k, 3), and their left Jacobians, both (k, 3, 3).

    R(v + dv) = exp(left(v) dv) R(v) to first order. Series below 1e-4 rad, where the quotients cancel.
    """
    square = np.einsum("ki,ki->k", v, v)
    angle = np.sqrt(square)
    small = angle < 1e-4
    t = np.where(small, 1.0, angle)
    sine, cosine = np.sin(t), np.cos(t)
    a = np.where(small, 1.0 - square / 6.0, sine / t)[:, None, None]
    b = np.where(small, 0.5 - square / 24.0, (1.0 - cosine) / (t * t))[:, None, None]
    c = np.where(small, 1.0 / 6.0 - square / 120.0, (t - sine) / (t * t * t))[:, None, None]
    k = cross_matrices(v)
    kk = k @ k
    identity = np.eye(3)
    return identity + a * k + b * kk, identity + b * k + c * kk


@lru_cache(maxsize=64)
def axis_numbers(order: str) -> tuple[int, int, int]:
    """(0, 1, 2) of "XYZ"."""
    first, second, third = ("XYZ".index(letter) for letter in order)
    return first, second, third


def nearest_rotations(matrices: FloatArray) -> FloatArray:
    """(k, 3, 3) the rotations nearest to matrices (k, 3, 3); the identity where a determinant is not positive."""
    u, _, vt = np.linalg.svd(matrices)
    rotations = u @ vt
    lost = (np.linalg.det(matrices) <= 0.0) | (np.linalg.det(rotations) <= 0.0)
    rotations[lost] = np.eye(3)
    return rotations
