"""Kernels of distance fields (see distance_field.py)."""

from __future__ import annotations

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.geometry.jit import inlined, kernel
from contact_core.geometry.kernel_arrays import Grid


@inlined
def distance_and_gradient(grid: Grid, px: float, py: float, pz: float) -> tuple[float, float, float, float]:
    """The trilinear value at a point, and its gradient, which costs nothing where it is not used.

    Outside the grid: the value at the nearest point of the grid's box plus the distance to it.
    """
    values, spacing = grid.values, grid.spacing
    gx, gy, gz = (px - grid.origin[0]) / spacing, (py - grid.origin[1]) / spacing, (pz - grid.origin[2]) / spacing
    cx = min(max(gx, 0.0), values.shape[0] - 1.0)
    cy = min(max(gy, 0.0), values.shape[1] - 1.0)
    cz = min(max(gz, 0.0), values.shape[2] - 1.0)
    # what is no number has no cell either, and memory outside of the grid is not read
    x = max(min(np.int64(cx), values.shape[0] - 2), 0)
    y = max(min(np.int64(cy), values.shape[1] - 2), 0)
    z = max(min(np.int64(cz), values.shape[2] - 2), 0)
    u, v, w = cx - x, cy - y, cz - z
    bx, by, bz = gx - cx, gy - cy, gz - cz
    beyond = np.sqrt(bx * bx + by * by + bz * bz)  # the box of the grid, in cells
    near, far = values[x, y], values[x + 1, y]  # rows along z
    near_y, far_y = values[x, y + 1], values[x + 1, y + 1]
    dx00, dx01 = far[z] - near[z], far[z + 1] - near[z + 1]
    dx10, dx11 = far_y[z] - near_y[z], far_y[z + 1] - near_y[z + 1]
    a00, a01 = near[z] + dx00 * u, near[z + 1] + dx01 * u
    a10, a11 = near_y[z] + dx10 * u, near_y[z + 1] + dx11 * u
    low, high = a00 + (a10 - a00) * v, a01 + (a11 - a01) * v
    dx0, dx1 = dx00 + (dx10 - dx00) * v, dx01 + (dx11 - dx01) * v
    dy0, dy1 = a10 - a00, a11 - a01
    # Where a coordinate is clamped the value does not vary with it, but the distance to the box does.
    slope_x = (dx0 + (dx1 - dx0) * w) / spacing if bx == 0.0 else bx / beyond
    slope_y = (dy0 + (dy1 - dy0) * w) / spacing if by == 0.0 else by / beyond
    slope_z = (high - low) / spacing if bz == 0.0 else bz / beyond
    return low + (high - low) * w + beyond * spacing, slope_x, slope_y, slope_z


@kernel
def sample(
    points: FloatArray,
    origin: FloatArray,
    spacing: float,
    values: FloatArray,
    distances: FloatArray,
    out: FloatArray,
) -> None:
    """Write values (k,) at points (k, 3), and their gradients to out (k, 3), unless that is (0, 3)."""
    grid = Grid(values, origin, spacing)
    if len(out) == 0:
        for i in range(len(points)):
            distances[i] = distance_and_gradient(grid, points[i, 0], points[i, 1], points[i, 2])[0]
        return
    for i in range(len(points)):
        distances[i], out[i, 0], out[i, 1], out[i, 2] = distance_and_gradient(
            grid, points[i, 0], points[i, 1], points[i, 2]
        )
