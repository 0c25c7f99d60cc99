"""A rim holds every point that lies on it, whichever way rounding bends a straight side."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.contact.area import measure_area
from contact_core.contact.shape import AxisShape, PatchCoordinates, PatchShape


@pytest.mark.parametrize("seed", range(40))
def test_the_boundary_of_a_turned_grid_is_its_whole_rim(seed: int) -> None:
    random = np.random.default_rng(seed)
    rows, columns = random.integers(3, 12, 2)
    row, column = (index.ravel() for index in np.indices((rows, columns)))
    steps, turn = random.uniform(0.7, 1.4, 2), np.exp(1j * random.uniform(0.0, 7.0))
    layout = (row * steps[0] + 1j * column * steps[1]) * turn * random.uniform(0.01, 100.0) + random.normal()
    n = len(layout)
    around_one_point = PatchCoordinates(
        np.zeros(n, np.int64), layout, np.zeros(n + 1, np.int64), np.zeros(0), np.zeros(0)
    )
    shape = PatchShape(AxisShape(np.zeros(0), np.zeros(0)), around_one_point, np.ones(n))
    area = measure_area(shape, np.column_stack([layout.real, layout.imag, np.zeros(n)]))
    rim = (row == 0) | (row == rows - 1) | (column == 0) | (column == columns - 1)
    assert [sorted(loop) for loop in area.boundary] == [np.flatnonzero(rim).tolist()]


@pytest.mark.parametrize("seed", range(10))
def test_the_loops_hold_every_edge_of_one_triangle_once(seed: int) -> None:
    """Of scattered points with gaps: counted edge by edge."""
    random = np.random.default_rng(seed)
    layout = random.uniform(0.0, 1.0, 300) + 1j * random.uniform(0.0, 1.0, 300)
    layout = layout[np.abs(layout - 0.5 - 0.5j) > 0.2]
    n = len(layout)
    scattered = PatchCoordinates(np.zeros(n, np.int64), layout, np.zeros(n + 1, np.int64), np.zeros(0), np.zeros(0))
    shape = PatchShape(AxisShape(np.zeros(0), np.zeros(0)), scattered, np.ones(n))
    area = measure_area(shape, np.column_stack([layout.real, layout.imag, np.zeros(n)]))
    sides = [(t[k], t[(k + 1) % 3]) for t in area.triangles.tolist() for k in range(3)]
    rim = sorted(side for side in sides if side[::-1] not in sides)
    looped = [(loop[k - 1], loop[k]) for loop in area.boundary for k in range(len(loop))]
    assert sorted(looped) == rim
