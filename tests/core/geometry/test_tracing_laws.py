"""Laws of the exponential map, over every mesh family."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput, NotManifold
from contact_core.geometry import SurfacePoints, TriangleMesh, trace_geodesic
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family, family_names, headings, surface_points

LENGTHS = st.floats(1e-6, 1.5)


@settings(max_examples=150)
@given(st.data(), family_names(), headings(), LENGTHS)
def test_forward_then_reverse_closes(data: st.DataObject, name: str, heading: complex, length: float) -> None:
    mesh = cached_family(name)
    start = data.draw(surface_points(mesh))
    there = trace_geodesic(mesh, start, [heading * length])
    walked = length - there.remaining[0]
    back = trace_geodesic(mesh, there.points, -there.headings * walked)
    gap = np.linalg.norm(back.points.positions(mesh) - start.positions(mesh))
    assert gap <= 1e-10 * mesh.bounding_box_diagonal
    if walked > 1e-3 and there.remaining[0] == 0.0:
        assert abs(back.headings[0] + heading) <= 1e-9


@settings(max_examples=100)
@given(st.data(), family_names(), headings(), LENGTHS)
def test_chord_is_no_longer_than_walk(data: st.DataObject, name: str, heading: complex, length: float) -> None:
    mesh = cached_family(name)
    start = data.draw(surface_points(mesh))
    end = trace_geodesic(mesh, start, [heading * length])
    chord = np.linalg.norm(end.points.positions(mesh) - start.positions(mesh))
    assert chord <= length - end.remaining[0] + 1e-11 * mesh.bounding_box_diagonal


@settings(max_examples=100)
@given(st.data(), family_names(), headings(), LENGTHS, st.floats(0.0, 1.0))
def test_two_steps_are_one(
    data: st.DataObject, name: str, heading: complex, length: float, fraction: float
) -> None:
    mesh = cached_family(name)
    start = data.draw(surface_points(mesh, inside_only=True))
    whole = trace_geodesic(mesh, start, [heading * length])
    first = trace_geodesic(mesh, start, [heading * length * fraction])
    rest = trace_geodesic(mesh, first.points, first.headings * length * (1.0 - fraction))
    if fraction * length < 1e-12 or first.remaining[0] > 0.0:
        return
    gap = np.linalg.norm(whole.points.positions(mesh) - rest.points.positions(mesh))
    assert gap <= 1e-9 * mesh.bounding_box_diagonal


@settings(max_examples=60)
@given(st.data(), headings(), LENGTHS)
def test_on_a_plane_a_trace_is_a_straight_line(data: st.DataObject, heading: complex, length: float) -> None:
    mesh = cached_family("plane")
    start = data.draw(surface_points(mesh, inside_only=True))
    end = trace_geodesic(mesh, start, [heading * length])
    a, b = mesh.points[mesh.faces[start.faces[0]][:2]]
    axis = complex(*(b - a)[:2]) / np.linalg.norm(b - a)  # the face frame's x axis, in the plane
    step = heading * axis * (length - end.remaining[0])
    expected = start.positions(mesh)[0] + [step.real, step.imag, 0.0]
    assert np.abs(end.points.positions(mesh)[0] - expected).max() <= 1e-12
    if end.remaining[0] > 0.0:
        assert min(*expected[:2], *(1.0 - expected[:2])) <= 1e-9  # it stopped at the rim


@settings(max_examples=60)
@given(st.data(), family_names(), headings(), LENGTHS)
def test_polyline_is_the_walk(data: st.DataObject, name: str, heading: complex, length: float) -> None:
    mesh = cached_family(name)
    start = data.draw(surface_points(mesh, count=3))
    plain = trace_geodesic(mesh, start, [heading * length] * 3)
    drawn = trace_geodesic(mesh, start, [heading * length] * 3, polyline=True)
    assert drawn.points.same_as(plain.points)
    assert plain.polylines is None
    assert drawn.polylines is not None
    for k in range(3):
        way = drawn.polylines[k]
        assert way[0].same_as(start[k])
        assert way[-1].same_as(drawn.points[k])
        pieces = np.linalg.norm(np.diff(way.positions(mesh), axis=0), axis=1)
        assert abs(pieces.sum() - (length - drawn.remaining[k])) <= 1e-10 * mesh.bounding_box_diagonal
        assert (way.barycentric[1:-1].min(axis=1) <= 1e-15).all()  # crossings lie on edges


@pytest.mark.parametrize("name", meshes.FAMILIES)
def test_no_vector_stays_where_it_is(name: str) -> None:
    mesh = cached_family(name)
    start = SurfacePoints([0, 0, 0], [[1, 0, 0], [0.5, 0.5, 0], [0.2, 0.3, 0.5]])
    end = trace_geodesic(mesh, start, np.zeros(3))
    assert end.points.same_as(start)
    assert (end.headings == 1.0).all()
    assert (end.remaining == 0.0).all()


def test_straight_through_a_vertex_halves_the_angle() -> None:
    cone = TriangleMesh(
        [[0, 0, 1], [2, 0, 0], [0, 2, 0], [-2, 0, 0], [0, -2, 0]], [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]
    )
    start = SurfacePoints([0], [[0.5, 0.5, 0.0]])  # half way down the ridge to point 1
    up = -1.0 * np.sqrt(5.0)
    end = trace_geodesic(cone, start, [up])  # along the edge 0-1, towards the apex, its whole length
    assert np.allclose(end.points.positions(cone)[0], [-1.0, 0.0, 0.5], atol=1e-12)


def test_a_boundary_stops_the_walk() -> None:
    square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    end = trace_geodesic(square, SurfacePoints([0], [[0.5, 0.25, 0.25]]), [3.0 + 0.0j])
    assert np.allclose(end.points.positions(square)[0], [1.0, 0.25, 0.0], atol=1e-15)
    assert end.remaining[0] == pytest.approx(2.5, abs=1e-15)
    along_the_rim = trace_geodesic(square, SurfacePoints([0], [[0.5, 0.5, 0.0]]), [0.25])
    assert np.allclose(along_the_rim.points.positions(square)[0], [0.75, 0.0, 0.0], atol=1e-15)
    outwards = trace_geodesic(square, SurfacePoints([0], [[0.5, 0.5, 0.0]]), [-1j])
    assert outwards.remaining[0] == 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, np.nan)])
def test_what_is_not_a_number_is_refused(bad: complex) -> None:
    mesh = cached_family("plane")
    with pytest.raises(InvalidInput, match="vectors must be finite"):
        trace_geodesic(mesh, SurfacePoints([0], [[0.2, 0.3, 0.5]]), [bad])


def test_a_face_that_is_not_there_is_refused_by_name() -> None:
    mesh = cached_family("plane")
    with pytest.raises(InvalidInput, match=r"point 1 names face 9999"):
        trace_geodesic(mesh, SurfacePoints([0, 9999], [[1, 0, 0]] * 2), [1.0, 1.0])


def test_a_length_without_sense_is_refused_and_does_not_hang() -> None:
    mesh = cached_family("sphere")
    with pytest.raises(InvalidInput, match="check the units"):
        trace_geodesic(mesh, SurfacePoints([0], [[0.2, 0.3, 0.5]]), [1e200])


def test_only_the_region_walked_over_need_be_manifold() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0], [1, 0.5, 1]]
    fin = TriangleMesh(points, [[0, 1, 2], [1, 3, 2], [1, 4, 3], [4, 5, 3], [1, 3, 6]])
    start = SurfacePoints([0], [[0.4, 0.3, 0.3]])
    assert trace_geodesic(fin, start, [0.5]).remaining[0] == 0.0
    with pytest.raises(NotManifold, match="edge 1-3"):
        trace_geodesic(fin, start, [1.5])
