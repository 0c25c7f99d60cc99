"""Faces without area: three distinct corners on one line, with angles of rounding noise.

A search cannot see through a flat face from its middle corner: a window from there leaves through the one point of
the long edge that the corner lies on. So where it matters the edges of flat faces are made a little longer. Then
every triangle has angles, both sides of an edge agree, and searches and walks see one surface. Source: intrinsic
mollification (Sharp and Crane 2020, section 4.5), only where it is needed.
"""

from __future__ import annotations

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray

FLAT = 1e-9  # a face no higher than this part of an edge is flat above it
LONGER = 2e-12  # of the longest edge of any flat face; flat faces become about 1e-6 of their longest edge high


def mollify(twin: IntArray, shape: FloatArray, bending: BoolArray) -> bool:
    """Lengthen the edges of flat faces where it matters; returns whether there were such.

    Writes lengths and apexes of all faces that have one of these edges. A flat face beside no other, with a middle
    corner that no path bends round, stays: it is crossed as the line that it is.
    twin: (3m,).  shape: (3m, 4), as in Topology.  bending: (3m,) whether paths can bend round a halfedge's tail.
    """
    lengths = shape[:, 0].reshape(-1, 3)  # (m, 3), a view
    flat = (shape[:, 2].reshape(-1, 3) <= FLAT * lengths).any(axis=1) & (lengths > 0.0).all(axis=1)  # (m,)
    beside = np.where(twin >= 0, np.repeat(flat, 3)[twin], False).reshape(-1, 3).any(axis=1)
    middle = 3 * np.arange(len(lengths)) + (lengths.argmax(axis=1) + 2) % 3  # leaves the corner between the others
    flat &= beside | bending[middle]
    step = LONGER * lengths[flat].max(initial=0.0)
    flat[flat] = _slack(lengths[flat]) < step  # a needle is no face without area: its short edge has a length
    if not flat.any():
        return False
    while True:
        longer = np.repeat(flat, 3)  # (3m,)
        longer[twin[longer & (twin >= 0)]] = True
        touched = np.flatnonzero(longer.reshape(-1, 3).any(axis=1))  # (t,)
        trial = lengths[touched] + step * longer.reshape(-1, 3)[touched]  # (t, 3)
        flattened = _slack(trial) < 0.5 * step  # neighbours of which only the longest edge was lengthened
        if flat[touched[flattened]].all():
            break
        flat[touched[flattened]] = True
    _write(touched, trial, shape)
    return True


def _slack(lengths: FloatArray) -> FloatArray:
    """(k,) by how much the two shorter edges of triangles (k, 3) are longer than the longest."""
    return np.asarray(lengths.sum(axis=1) - 2.0 * lengths.max(axis=1))


def _write(faces: IntArray, lengths: FloatArray, shape: FloatArray) -> None:
    """Write lengths (t, 3) of faces (t,) and the apexes that follow from them into shape."""
    z, y, x = np.sort(lengths, axis=1).T
    double_area = 0.5 * np.sqrt((x + (y + z)) * (z - (x - y)) * (z + (x - y)) * (x + (y - z)))  # Kahan's formula
    for k in range(3):
        a, b, c = lengths[:, k], lengths[:, (k + 1) % 3], lengths[:, (k + 2) % 3]
        h = 3 * faces + k
        shape[h, 0], shape[h, 1], shape[h, 2] = a, 0.5 * (a + (c - b) * (c + b) / a), double_area / a
