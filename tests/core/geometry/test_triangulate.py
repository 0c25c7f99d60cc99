"""Laws of ear clipping: area, winding, coverage and the way back, on any simple polygon."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.geometry.triangulate import triangulate


def star_polygon(seed: int, corners: int) -> np.ndarray:
    """A simple, usually concave polygon (corners, 3), star-shaped about the origin, in a random plane."""
    random = np.random.default_rng(seed)
    angles = (np.arange(corners) + random.uniform(0.0, 0.9, corners)) * 2 * np.pi / corners
    radii = random.uniform(0.15, 1.0, corners)
    flat = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(corners)], axis=1)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return flat @ (turn * np.sign(np.linalg.det(turn))).T + random.normal(size=3)


def vector_area(polygon: np.ndarray) -> np.ndarray:
    return 0.5 * np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0)


@settings(max_examples=150)
@given(seed=st.integers(0, 2**32 - 1), corners=st.integers(3, 24))
def test_triangles_cover_a_simple_polygon_once(seed: int, corners: int) -> None:
    points = star_polygon(seed, corners)
    triangles, source, notes = triangulate([corners], np.arange(corners), points)
    assert len(triangles) == corners - 2 and set(source) == {0} and notes == ()
    normal = vector_area(points) / np.linalg.norm(vector_area(points))
    signed = np.array([vector_area(points[t]) @ normal for t in triangles])
    assert signed.min() > -1e-12  # no triangle is turned over, so equal sums mean no overlap
    assert np.isclose(signed.sum(), np.linalg.norm(vector_area(points)), rtol=1e-9)


def test_the_concave_pentagon_that_a_fan_gets_wrong() -> None:
    points = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0]], float)
    triangles, _, _ = triangulate([5], range(5), points)
    areas = 0.5 * np.linalg.norm(
        np.cross(
            points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
        ),
        axis=1,
    )
    assert np.isclose(areas.sum(), 10.0)


@given(seed=st.integers(0, 2**32 - 1))
def test_shared_edges_stay_shared(seed: int) -> None:
    """A closed polyhedron of n-gons stays closed: every directed edge meets its reverse once."""
    random = np.random.default_rng(seed)
    corners = int(random.integers(5, 12))
    base = star_polygon(seed, corners)
    up = vector_area(base) / np.linalg.norm(vector_area(base))
    points = np.concatenate([base, base + up])
    bottom, top = np.arange(corners)[::-1], np.arange(corners) + corners
    sides = [[i, (i + 1) % corners, corners + (i + 1) % corners, corners + i] for i in range(corners)]
    sizes = [corners, corners] + [4] * corners
    triangles, source, _ = triangulate(sizes, np.concatenate([bottom, top, np.ravel(sides)]), points)
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    assert len(edges) == 3 * len(triangles)
    assert all((b, a) in edges for a, b in edges)
    assert np.array_equal(np.bincount(source), np.array(sizes) - 2)
    volume = np.einsum("ij,ij->i", points[triangles[:, 0]], np.cross(*points[triangles[:, 1:]].swapaxes(0, 1)))
    assert np.isclose(volume.sum() / 6, np.linalg.norm(vector_area(base)))


@pytest.mark.parametrize("corners", [5, 6, 8, 12, 17])
def test_a_regular_polygon_is_cut_alike_however_it_is_turned(corners: int) -> None:
    """All its ears are alike but for rounding, which is no reason to choose one, and differs with processors."""
    round_ = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    polygon = np.c_[np.cos(round_), np.sin(round_), np.zeros(corners)]
    wanted, _, _ = triangulate([corners], np.arange(corners), polygon)
    random = np.random.default_rng(corners)
    for _ in range(20):
        turned = polygon @ np.linalg.qr(random.normal(size=(3, 3)))[0] * random.uniform(0.01, 100.0)
        assert np.array_equal(triangulate([corners], np.arange(corners), turned)[0], wanted)


def test_a_polygon_of_very_many_corners_is_covered_once() -> None:
    """A star of 20,000 corners, as a logo's outline has; cutting it took 22 s."""
    round_ = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    far = 1.0 + 0.3 * np.cos(500.0 * round_)
    points = np.c_[far * np.cos(round_), far * np.sin(round_), np.zeros(len(round_))]
    triangles, _, notes = triangulate([len(points)], np.arange(len(points)), points)
    areas = (
        0.5
        * np.cross(
            points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
        )[:, 2]
    )
    x, y = points[:, 0], points[:, 1]
    wanted = 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert not notes and areas.min() > -1e-12 and np.isclose(areas.sum(), wanted)


def test_a_dart_is_not_cut_along_its_shorter_outer_diagonal() -> None:
    """A quad whose diagonal outside of it is the shorter one, from each of its corners."""
    dart = np.array([[0, 0, 0], [3, -1, 0], [2.9, 0, 0], [3, 1, 0]], float)
    for first in range(4):
        triangles, _, _ = triangulate([4], np.roll(range(4), first), dart)
        areas = [vector_area(dart[t])[2] for t in triangles]
        assert min(areas) > 0 and np.isclose(sum(areas), vector_area(dart)[2])


def test_collinear_corners_cost_no_area() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 2, 0], [1.5, 2, 0], [0, 2, 0]], float)
    triangles, _, notes = triangulate([7], range(7), points)
    areas = [np.linalg.norm(vector_area(points[t])) for t in triangles]
    assert min(areas) > 0.1 and np.isclose(sum(areas), 6.0) and notes == ()


def test_what_is_no_polygon_is_dropped_and_said() -> None:
    points = np.random.default_rng(1).normal(size=(6, 3))
    sizes, indices = [2, 3, 3, 4, 4], [0, 1, 0, 1, 1, 0, 1, 2, 3, 3, 4, 3, 2, 2, 3, 4]
    triangles, source, notes = triangulate(sizes, indices, points)
    assert set(source.tolist()) == {2, 4} and len(triangles) == 2
    assert "3 faces" in notes[0]


def test_a_self_crossing_polygon_is_named() -> None:
    angles = np.arange(5) * 4 * np.pi / 5
    points = np.stack([np.cos(angles), np.sin(angles), np.zeros(5)], axis=1)
    bow = np.array([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0], [1, 3, 0], [3, -1, 0]], float)
    assert len(triangulate([5], range(5), points)[0]) == 3
    triangles, _, notes = triangulate([6], range(6), bow)
    assert len(triangles) == 4 and any("cross" in note for note in notes)


@pytest.mark.parametrize(
    ("sizes", "indices", "word"),
    [
        ([3], [0, 1], "add up to 3"),
        ([3], [0, 1, 9], "corner 2 is 9"),
        ([-1], [], "negative"),
        ([3], [0, 1, -1], "-1"),
    ],
)
def test_bad_input_is_a_sentence(sizes: list[int], indices: list[int], word: str) -> None:
    with pytest.raises(InvalidInput, match=word):
        triangulate(sizes, indices, np.zeros((3, 3)))
