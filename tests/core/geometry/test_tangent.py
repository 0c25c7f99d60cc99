"""Laws of tangent frames: directions in space and headings are two ways to say the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, Topology, trace_geodesic
from contact_core.geometry.tangent import direction_to_heading, heading_to_direction
from contact_core.testing.strategies import cached_family, family_names, headings, surface_points

OPEN = ("plane", "cylinder", "holes", "creased", "saddle", "sliver", "lattice")  # headings at a rim may leave them


@settings(max_examples=150)
@given(st.data(), family_names(without=OPEN), headings())
def test_heading_to_direction_and_back(data: st.DataObject, name: str, heading: complex) -> None:
    mesh = cached_family(name)
    at = data.draw(surface_points(mesh))
    direction = heading_to_direction(mesh, at, [heading])
    assert np.linalg.norm(direction[0]) == pytest.approx(1.0, abs=1e-14)
    assert abs(direction_to_heading(mesh, at, direction)[0] - heading) <= 1e-12


@pytest.mark.parametrize("name", ["sphere", "torus", "noisy"])
@pytest.mark.parametrize("beside", [1e-9, -1e-9, 3e-11])
def test_a_direction_hardly_beside_an_edge_keeps_its_angle(name: str, beside: float) -> None:
    mesh = cached_family(name)
    topology = Topology.of(mesh)
    vertices = np.arange(len(mesh.points))
    at = SurfacePoints.at_vertices(mesh, vertices)
    for turn in range(3):  # the edges that leave a vertex, in turn
        edges = topology.first
        for _ in range(turn):
            edges = topology.twin[edges - 1 + 3 * (edges % 3 == 0)]
        angles = topology.shape[edges, 3] * 2.0 * np.pi / topology.angle_sum + beside
        wanted = np.exp(1j * angles)
        found = direction_to_heading(mesh, at, heading_to_direction(mesh, at, wanted))
        assert np.abs(found - wanted).max() <= 1e-12


@settings(max_examples=150)
@given(st.data(), family_names(), headings())
def test_direction_is_where_the_walk_goes(data: st.DataObject, name: str, heading: complex) -> None:
    mesh = cached_family(name)
    at = data.draw(surface_points(mesh))
    step = 1e-6 * mesh.bounding_box_diagonal
    end = trace_geodesic(mesh, at, [heading * step])
    if end.remaining[0] == 0.0:
        moved = (end.points.positions(mesh) - at.positions(mesh))[0] / step
        assert np.abs(moved - heading_to_direction(mesh, at, [heading])[0]).max() <= 1e-6


def test_no_direction_is_refused() -> None:
    mesh = cached_family("plane")
    with pytest.raises(InvalidInput, match="number 1"):
        direction_to_heading(mesh, SurfacePoints([0, 1], [[1, 0, 0]] * 2), [[1, 0, 0], [0, 0, 0]])
