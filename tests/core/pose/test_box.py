"""The minimum of a convex quadratic within a box meets the conditions that only the minimum meets."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from contact_core.arrays import FloatArray
from contact_core.solve.box import box_minimum


def box_problem(seed: int, dofs: int, rows: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Matrix, gradient, limits as Levenberg-Marquardt meets them: fewer rows (residuals) than dofs leave a matrix
    that only damping holds; scales apart; limits at 0, at a distance and at infinity."""
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(rows, dofs)) * np.exp(random.normal(0.0, 2.0, dofs))
    matrix = jacobian.T @ jacobian
    matrix += np.diag(10.0 ** random.uniform(-8, 0) * np.diagonal(matrix) + 1e-9 * np.diagonal(matrix).max())
    lower, upper = -np.exp(random.normal(0.0, 1.5, dofs)), np.exp(random.normal(0.0, 1.5, dofs))
    lower[random.random(dofs) < 0.3] = 0.0
    upper[random.random(dofs) < 0.3] = 0.0
    lower[random.random(dofs) < 0.1], upper[random.random(dofs) < 0.1] = -np.inf, np.inf
    return matrix, jacobian.T @ random.normal(size=rows), lower, upper


@given(seed=st.integers(0, 2**32 - 1), dofs=st.integers(1, 50), rows=st.integers(1, 80))
def test_nothing_within_the_box_is_lower(seed: int, dofs: int, rows: int) -> None:
    """Karush, Kuhn, Tucker: within the limits; no slope where a dof is free, none that leads inward at a limit."""
    matrix, gradient, lower, upper = box_problem(seed, dofs, rows)
    step = box_minimum(matrix, gradient, lower, upper)
    assert (step >= lower).all()
    assert (step <= upper).all()
    slope = gradient + matrix @ step
    inward = np.where(step <= lower, np.minimum(slope, 0.0), np.where(step >= upper, np.maximum(slope, 0.0), slope))
    inward[lower == upper] = 0.0
    assert np.abs(inward).max() <= 1e-7 * np.abs(gradient).max()
    assert gradient @ step + 0.5 * step @ matrix @ step <= 0.0
