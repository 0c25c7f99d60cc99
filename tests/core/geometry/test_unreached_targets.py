"""A target that no source reaches is said to be so: never a wild anchor, never a crash."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes


@pytest.mark.parametrize("repeat", range(5))
@pytest.mark.parametrize("max_distance", [None, 0.05])
def test_targets_on_another_component_or_out_of_reach(repeat: int, max_distance: float | None) -> None:
    mesh = meshes.copies(meshes.icosphere(2), 2)
    half = len(mesh.faces) // 2
    np.full(50_000 + repeat, 2**62 + repeat)  # dirty the heap: unset results must not come out right by luck
    inside = [[0.3, 0.3, 0.4]] * 3
    log = log_map(mesh, SurfacePoints([0], inside[:1]), SurfacePoints([half + 3, 1, 0], inside), max_distance)
    expected = [-1, 0 if max_distance is None else -1, 0]
    np.testing.assert_array_equal(log.anchor, expected)
    np.testing.assert_array_equal(np.isinf(log.distance), [anchor < 0 for anchor in expected])
    np.testing.assert_array_equal(log.coordinates[log.anchor < 0], 0.0)
