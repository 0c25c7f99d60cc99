"""The kernel of distance fields (see distance_field.py)."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.jit import kernel


@kernel
def sample(
    points: FloatArray,
    origin: FloatArray,
    spacing: float,
    values: FloatArray,
    distances: FloatArray,
    out: FloatArray,
) -> None:
    """Write trilinear values (k,) at points (k, 3), and their gradients to out (k, 3), unless that is (0, 3).

    Outside the grid: the value at the nearest point of the grid's box plus the distance to it.
    """
    for i in range(len(points)):
        gx, gy, gz = (
            (points[i, 0] - origin[0]) / spacing,
            (points[i, 1] - origin[1]) / spacing,
            (points[i, 2] - origin[2]) / spacing,
        )
        cx = min(max(gx, 0.0), values.shape[0] - 1.0)
        cy = min(max(gy, 0.0), values.shape[1] - 1.0)
        cz = min(max(gz, 0.0), values.shape[2] - 1.0)
        # what is no number has no cell either, and memory outside of the grid is not read
        x = max(min(np.int64(cx), values.shape[0] - 2), 0)
        y = max(min(np.int64(cy), values.shape[1] - 2), 0)
        z = max(min(np.int64(cz), values.shape[2] - 2), 0)
        u, v, w = cx - x, cy - y, cz - z
        bx, by, bz = (gx - cx) * spacing, (gy - cy) * spacing, (gz - cz) * spacing
        away = np.sqrt(bx * bx + by * by + bz * bz)
        near, far = values[x, y], values[x + 1, y]  # rows along z
        near_y, far_y = values[x, y + 1], values[x + 1, y + 1]
        dx00, dx01 = far[z] - near[z], far[z + 1] - near[z + 1]
        dx10, dx11 = far_y[z] - near_y[z], far_y[z + 1] - near_y[z + 1]
        a00, a01 = near[z] + dx00 * u, near[z + 1] + dx01 * u
        a10, a11 = near_y[z] + dx10 * u, near_y[z + 1] + dx11 * u
        low, high = a00 + (a10 - a00) * v, a01 + (a11 - a01) * v
        distances[i] = low + (high - low) * w + away
        if len(out):
            dx0, dx1 = dx00 + (dx10 - dx00) * v, dx01 + (dx11 - dx01) * v
            dy0, dy1 = a10 - a00, a11 - a01
            # Where a coordinate is clamped the value does not vary with it, but the distance to the box does.
            out[i, 0] = (dx0 + (dx1 - dx0) * w) / spacing if bx == 0.0 else bx / away
            out[i, 1] = (dy0 + (dy1 - dy0) * w) / spacing if by == 0.0 else by / away
            out[i, 2] = (high - low) / spacing if bz == 0.0 else bz / away
