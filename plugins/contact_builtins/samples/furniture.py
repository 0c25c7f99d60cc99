"""Things to sit on, stand on and hold on to: a chair, a floor, a pole. Metres, y up, standing on y = 0."""

from __future__ import annotations

import numpy as np

from contact_builtins.samples.fields import Field, box, chain, cylinder, round_cone, union
from contact_builtins.samples.modelling import surface_of
from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.triangulate import triangulate
from contact_core.geometry.weld import close_points


def pole() -> Asset:
    """An upright pole 1.2 m tall and 6 cm thick, its ends rounded, centred on the y axis."""
    field = cylinder([0, 0.6, 0], 0.03, 0.6, rounding=0.012)
    mesh = surface_of(field, [-0.05, -0.03, -0.05], [0.05, 1.23, 0.05], 0.01, 0.0125)
    return Asset(name="pole", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def chair() -> Asset:
    """A wooden chair, seat at 45 cm, its back towards -z, so that who sits looks along +z."""
    mesh = surface_of(_chair(), [-0.28, -0.03, -0.34], [0.28, 0.98, 0.29], 0.0125, 0.018)
    return Asset(name="chair", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def floor() -> Asset:
    """A floor slab of 3 m by 3 m, 10 cm thick, its upper side at y = 0."""
    mesh = grid_box(np.array([3.0, 0.1, 3.0]), np.array([0.0, -0.05, 0.0]), 0.1)
    return Asset(name="floor", mesh=mesh, meters_per_unit=1.0, up_axis="Y")


def grid_box(size: FloatArray, centre: FloatArray, cell: float) -> TriangleMesh:
    """A closed box of square cells about `cell` wide, each cut in two."""
    counts = np.maximum(np.round(size / cell).astype(int), 1)
    corners = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = (grid.ravel() for grid in np.meshgrid(np.arange(counts[u]), np.arange(counts[v])))
        for side in (0, 1):
            steps = ((0, 0), (1, 0), (1, 1), (0, 1)) if side else ((0, 0), (0, 1), (1, 1), (1, 0))
            quads = np.empty((len(i), 4, 3), int)  # lattice coordinates
            for k, (du, dv) in enumerate(steps):
                quads[:, k, axis], quads[:, k, u], quads[:, k, v] = side * counts[axis], i + du, j + dv
            corners.append(quads)
    lattice = np.concatenate(corners).reshape(-1, 3)
    index = close_points(lattice / counts - 0.5, np.zeros(len(lattice)))
    points = (lattice / counts - 0.5)[np.unique(index, return_index=True)[1]]
    triangles, _, _ = triangulate(np.full(len(lattice) // 4, 4), index, points)
    return TriangleMesh(points * size + centre, triangles)


def _chair() -> Field:
    """Seat, four splayed legs, rungs, and a back of two posts, a top rail and three spindles."""
    seat = box([0, 0.435, 0], [0.225, 0.022, 0.215], rounding=0.02)
    parts: list[Field] = []
    for x in (-1.0, 1.0):
        parts.append(round_cone([x * 0.18, 0.43, 0.17], [x * 0.205, 0.016, 0.195], 0.022, 0.016))
        parts.append(round_cone([x * 0.18, 0.43, -0.17], [x * 0.205, 0.016, -0.225], 0.022, 0.016))
        parts.append(round_cone([x * 0.193, 0.2, 0.183], [x * 0.193, 0.2, -0.2], 0.0135, 0.0135))
        post = np.array([[x * 0.185, 0.43, -0.185], [x * 0.19, 0.68, -0.225], [x * 0.19, 0.93, -0.285]])
        parts.append(chain(list(post), [0.021, 0.019, 0.018]))
    parts.append(round_cone([-0.193, 0.2, 0], [0.193, 0.2, 0], 0.0135, 0.0135))
    bow = np.linspace(-1.0, 1.0, 9)
    rail = np.stack([0.19 * bow, 0.885 + 0.02 * (1 - bow**2), -0.275 - 0.022 * (1 - bow**2)], axis=1)
    parts.append(chain(list(rail), [0.022] * 9))
    for x in (-0.095, 0.0, 0.095):
        top = 0.885 + 0.02 * (1 - (x / 0.19) ** 2)
        parts.append(round_cone([x, 0.44, -0.185], [x, top, -0.29], 0.013, 0.0125))
    return union([seat, *parts], 0.014)
