"""Kernels of tracks: products with a sparse matrix whose entries are short rows, one a bone (see track.py)."""

from __future__ import annotations

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.jit import kernel


@kernel
def carry(starts: IntArray, bones: IntArray, entries: FloatArray, carrier: FloatArray, result: FloatArray) -> None:
    """Write what bones carry (k, 3). bones: of each entry, the first of its rows of the carrier (width j, 3)."""
    for i in range(len(starts) - 1):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(starts[i], starts[i + 1]):
            for a in range(entries.shape[1]):
                value, row = entries[e, a], bones[e] + a
                x += value * carrier[row, 0]
                y += value * carrier[row, 1]
                z += value * carrier[row, 2]
        result[i, 0], result[i, 1], result[i, 2] = x, y, z


@kernel
def times(starts: IntArray, bones: IntArray, entries: FloatArray, dense: FloatArray, result: FloatArray) -> None:
    """Add the track times a dense matrix (width b, m) to result (k, m)."""
    width = entries.shape[1]
    for i in range(len(starts) - 1):
        for e in range(starts[i], starts[i + 1]):
            for a in range(width):
                value, row = entries[e, a], width * bones[e] + a
                for c in range(dense.shape[1]):
                    result[i, c] += value * dense[row, c]


@kernel
def gather(starts: IntArray, bones: IntArray, entries: FloatArray, rows: FloatArray, result: FloatArray) -> None:
    """Add the transposed track times rows (k, 3) to result (width b, 3)."""
    width = entries.shape[1]
    for i in range(len(starts) - 1):
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        for e in range(starts[i], starts[i + 1]):
            for a in range(width):
                value, row = entries[e, a], width * bones[e] + a
                result[row, 0] += value * x
                result[row, 1] += value * y
                result[row, 2] += value * z


@kernel
def gram(starts: IntArray, bones: IntArray, entries: FloatArray, weights: FloatArray, result: FloatArray) -> None:
    """Add sum_i w_i h_i h_i^T over the rows h_i of the track to result (width b, width b)."""
    width = entries.shape[1]
    for i in range(len(starts) - 1):
        for e in range(starts[i], starts[i + 1]):
            for a in range(width):
                value, row = weights[i] * entries[e, a], width * bones[e] + a
                for f in range(starts[i], starts[i + 1]):
                    first = width * bones[f]
                    for c in range(width):
                        result[row, first + c] += value * entries[f, c]
