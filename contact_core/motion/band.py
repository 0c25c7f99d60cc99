"""A symmetric matrix of blocks that reach two frames far, and the bounded minimiser of a quadratic with it.

The unknowns of a motion are theta (n, d), d numbers at each of n frames, and nothing couples frames more than two
apart: accelerations span three frames. So the matrix is block pentadiagonal, its Cholesky factor too, and a step
costs n d^3, linear in the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from contact_core.arrays import BoolArray, FloatArray

ROUNDS = 12  # of block pivoting
ROUNDING = 1e-12  # of the largest slope: what counts as none


@dataclass(eq=False)
class BlockBand:
    """own: (n, d, d) blocks on the diagonal. next: (n - 1, d, d), [f] couples frame f + 1 (rows) with f. after:
    (n - 2, d, d), [f] couples frame f + 2 with f. The blocks are added to in place while a model is built."""

    own: FloatArray
    next: FloatArray
    after: FloatArray

    @classmethod
    def zeros(cls, n: int, d: int) -> BlockBand:
        """The zero matrix of n frames of d unknowns."""
        return cls(np.zeros((n, d, d)), np.zeros((max(n - 1, 0), d, d)), np.zeros((max(n - 2, 0), d, d)))

    @property
    def diagonal(self) -> FloatArray:
        """(n, d)"""
        return np.einsum("fii->fi", self.own)

    def times(self, x: FloatArray) -> FloatArray:
        """(n, d) the matrix times x (n, d)."""
        result = np.einsum("fij,fj->fi", self.own, x)
        for reach, blocks in ((1, self.next), (2, self.after)):
            result[reach:] += np.einsum("fij,fj->fi", blocks, x[: len(blocks)])
            result[: len(blocks)] += np.einsum("fij,fi->fj", blocks, x[reach:])
        return np.asarray(result)

    def lower_band(self) -> FloatArray:
        """(3 d, n d) the lower diagonals, as LAPACK stores them: entry (r + c, c) of the matrix at [r, c]."""
        n, d, _ = self.own.shape
        band = np.zeros((3 * d, n, d))
        row, column = np.indices((d, d))
        for reach, blocks in enumerate((self.own, self.next, self.after)):
            offset = reach * d + row - column
            low = offset >= 0
            band[offset[low], : len(blocks), column[low]] = blocks[:, row[low], column[low]].T
        return band.reshape(3 * d, n * d)


def bounded_minimum(
    matrix: BlockBand, damping: float, gradient: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray | None:
    """(n, d) the s in lower <= s <= upper with the least g.s + s.(A + damping D) s / 2, with D = diag A.

    Block principal pivoting as in `solve.box`. Unknowns with lower == upper never move. None where rounding keeps
    the matrix from being positive definite, or the pivoting does not settle: damp more.
    """
    band = matrix.lower_band()
    floor = 1e-9 * max(float(band[0].max(initial=0.0)), 1e-30)  # unknowns that nothing holds stay put
    band[0] *= 1.0 + damping
    band[0] += floor
    shape, g = gradient.shape, gradient.ravel()
    low, high = lower.ravel(), upper.ravel()
    still = low >= high
    rounding = ROUNDING * float(np.abs(g).max(initial=0.0))
    held = np.where((low >= 0.0) & (g > 0.0), -1, np.where((high <= 0.0) & (g < 0.0), 1, 0))
    held[still] = -1
    for _ in range(ROUNDS):
        free = held == 0
        step = np.where(free, 0.0, np.where(held < 0, low, high))
        try:
            step = step + _newton(band, g + _product(band, step), free)
        except LinAlgError:
            return None
        slope = g + _product(band, step)
        below, above = free & (step < low), free & (step > high)
        released = ~still & (((held < 0) & (slope < -rounding)) | ((held > 0) & (slope > rounding)))
        wrong = below | above | released
        if not wrong.any():
            return step.reshape(shape)
        held[wrong] = (above.astype(int) - below.astype(int))[wrong]
    return None


def _newton(band: FloatArray, slope: FloatArray, free: BoolArray) -> FloatArray:
    """The step of the free unknowns that ends their slope; the others stay."""
    if free.all():
        return np.asarray(solveh_banded(band, -slope, lower=True, check_finite=False))
    width, size = band.shape
    padded = np.concatenate([free, np.zeros(width, bool)])
    rows = np.lib.stride_tricks.sliding_window_view(padded, size)[:width]  # [r, c]: whether unknown r + c is free
    kept = np.where(rows & free, band, 0.0)
    kept[0, ~free] = 1.0
    return np.asarray(solveh_banded(kept, np.where(free, -slope, 0.0), lower=True, check_finite=False))


def _product(band: FloatArray, x: FloatArray) -> FloatArray:
    """The banded symmetric matrix times x."""
    if not x.any():
        return np.zeros(len(x))
    from scipy.linalg.blas import dsbmv

    return np.asarray(dsbmv(band.shape[0] - 1, 1.0, band, x, lower=1))
