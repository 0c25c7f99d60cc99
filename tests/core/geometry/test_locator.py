"""Laws of the locator: no ray leaks, nothing is closer than the closest, winding numbers count."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.errors import InvalidInput
from contact_core.geometry import box_tree
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing.meshes import FAMILIES
from contact_core.testing.strategies import cached_family, family_names, surface_points

CLOSED = ("sphere", "torus", "noisy", "blocks")
seeds = st.integers(0, 2**32 - 1)


def brute_force_distance(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    """Distance to the surface by projecting on every face, edge and vertex: no tree, other formulas."""
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    best = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        for i, p in enumerate(points):
            t = np.clip(np.einsum("fi,fi->f", p - start, along) / np.einsum("fi,fi->f", along, along), 0, 1)
            best[i] = min(best[i], np.linalg.norm(start + t[:, None] * along - p, axis=1).min())
    normal = mesh.face_normals
    for i, p in enumerate(points):
        height = np.einsum("fi,fi->f", p - a, normal)
        foot = p - height[:, None] * normal
        inside = np.ones(len(a), bool)
        for start, end in ((a, b), (b, c), (c, a)):
            inside &= np.einsum("fi,fi->f", np.cross(end - start, foot - start), normal) >= 0
        if inside.any():
            best[i] = min(best[i], np.abs(height[inside]).min())
    return best


@given(name=family_names(), seed=seeds)
@settings(max_examples=40)
def test_closest_equals_brute_force(name: str, seed: int) -> None:
    mesh = cached_family(name)
    random = np.random.default_rng(seed)
    centre, size = mesh.points.mean(axis=0), mesh.bounding_box_diagonal
    queries = centre + 0.6 * size * random.standard_normal((6, 3))
    found = Locator.of(mesh).closest(queries)
    np.testing.assert_allclose(found.distance, brute_force_distance(mesh, queries), atol=1e-12 * size)
    reached = np.linalg.norm(found.points.positions(mesh) - queries, axis=1)
    np.testing.assert_allclose(reached, found.distance, atol=1e-12 * size)


@given(data=st.data(), name=family_names())
@settings(max_examples=60)
def test_a_point_of_the_surface_is_its_own_closest(data: st.DataObject, name: str) -> None:
    mesh = cached_family(name)
    points = data.draw(surface_points(mesh, count=3))
    found = Locator.of(mesh).closest(points.positions(mesh))
    limit = 1e-11 if name == "sliver" else 1e-14  # cross products of a sliver 1:1000 cancel three digits
    assert found.distance.max() <= limit * mesh.bounding_box_diagonal


def on_silhouette(mesh: TriangleMesh, point: SurfacePoints, ray: np.ndarray) -> bool:
    """Whether the faces round a surface point do not all turn the same side to a ray."""
    corners = mesh.faces[point.faces[0]][point.barycentric[0] > 1e-9]
    around = np.isin(mesh.faces, corners).sum(axis=1) == len(corners)  # (m,)
    facing = mesh.face_normals[around] @ ray / np.linalg.norm(ray)
    return bool(facing.min() < 1e-6 and facing.max() > -1e-6)


@given(data=st.data(), name=family_names(), seed=seeds)
@settings(max_examples=60)
def test_a_ray_to_a_surface_point_stops_there_or_before(data: st.DataObject, name: str, seed: int) -> None:
    mesh = cached_family(name)
    points = data.draw(surface_points(mesh, count=4))
    goals = points.positions(mesh)
    origin = mesh.points.mean(axis=0) + 2.0 * mesh.bounding_box_diagonal * np.random.default_rng(
        seed
    ).standard_normal((4, 3))
    hits = Locator.of(mesh).cast(origin, goals - origin)
    # A goal on a silhouette is left out of necessity: the ray to it touches the solid in that one point, and the
    # rounded position of the goal may lie outside of the solid, where nothing is to hit (227 of 24000 rays).
    for k, (hit, distance) in enumerate(zip(hits.found, hits.distance, strict=True)):
        rim = on_silhouette(mesh, points[k], goals[k] - origin[k])
        assert (hit and distance <= 1.0 + 1e-9) or rim or name not in CLOSED
    on_ray = origin[hits.found] + hits.distance[hits.found, None] * (goals - origin)[hits.found]
    gap = np.linalg.norm(hits.points[hits.found].positions(mesh) - on_ray, axis=1)
    assert gap.max(initial=0.0) <= 1e-12 * 10 * mesh.bounding_box_diagonal


@pytest.mark.parametrize("name", ["sphere", "noisy"])
def test_no_ray_from_inside_leaks_through_edges_or_vertices(name: str) -> None:
    mesh = cached_family(name)
    ends = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges = np.unique(ends, axis=0)
    aims = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    hits = Locator.of(mesh).cast(np.zeros_like(aims), aims)
    assert hits.found.all()
    np.testing.assert_allclose(hits.distance, 1.0, atol=1e-12)


@given(seed=seeds, name=st.sampled_from(CLOSED))
@settings(max_examples=20)
def test_winding_number_counts_and_its_tree_agrees_with_the_exact_sum(seed: int, name: str) -> None:
    mesh = cached_family(name)
    locator = Locator.of(mesh)
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (50, 3))
    points = points[locator.closest(points).distance > 1e-3]
    exact = locator.winding_number(points, accuracy=np.inf)
    np.testing.assert_allclose(exact, np.round(exact), atol=1e-10)
    np.testing.assert_array_equal(locator.winding_number(points) > 0.5, exact > 0.5)
    np.testing.assert_allclose(locator.winding_number(points), exact, atol=0.05)
    far = locator.winding_number(np.array([[50.0, 0.0, 0.0]]), accuracy=np.inf)
    np.testing.assert_allclose(far, 0.0, atol=1e-10)


def test_answers_do_not_depend_on_the_order_of_faces() -> None:
    mesh = cached_family("holes")
    random = np.random.default_rng(3)
    order = random.permutation(len(mesh.faces))
    shuffled = TriangleMesh(mesh.points, mesh.faces[order])
    queries = random.standard_normal((200, 3))
    first, second = Locator(mesh).closest(queries), Locator(shuffled).closest(queries)
    np.testing.assert_allclose(first.distance, second.distance, rtol=1e-14)
    down = np.tile([0.01, 0.02, -1.0], (200, 1))
    one, two = Locator(mesh).cast(queries, down), Locator(shuffled).cast(queries, down)
    np.testing.assert_array_equal(one.found, two.found)
    np.testing.assert_allclose(one.distance, two.distance, rtol=1e-13)


def test_facing_leaves_out_faces_that_look_away() -> None:
    mesh = cached_family("sphere")
    facing = np.array([[0.0, 0.0, 1.0]])
    found = Locator.of(mesh).closest(np.array([[0.0, 0.0, 0.95]]), facing=facing)
    assert mesh.face_normals[found.points.faces[0]] @ facing[0] <= -0.3
    assert not Locator.of(mesh).closest(np.zeros((1, 3)), max_distance=0.5).found[0]


def test_a_mesh_builds_one_locator_however_often_it_is_asked() -> None:
    mesh = FAMILIES["torus"]()
    before = Locator.builds
    for _ in range(3):
        Locator.of(mesh).closest(np.zeros((1, 3)))
    assert Locator.builds == before + 1


def test_one_face_and_bad_input() -> None:
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    locator = Locator.of(mesh)
    hits = locator.cast([[0.2, 0.2, 1.0]], [[0.0, 0.0, -1.0]])
    assert hits.found.tolist() == [True]
    np.testing.assert_allclose(hits.points.positions(mesh), [[0.2, 0.2, 0.0]], atol=1e-15)
    np.testing.assert_allclose(hits.distance, 1.0)
    with pytest.raises(InvalidInput, match="ray 0"):
        locator.cast([[0, 0, 0]], [[0, 0, 0]])
    with pytest.raises(InvalidInput, match="finite"):
        locator.closest([[np.nan, 0, 0]])
    with pytest.raises(InvalidInput, match="faces"):
        Locator(TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), int)))


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ray_along_an_axis_onto_a_vertex_hits(axis: int, scale: float) -> None:
    """Such a ray runs in the faces of boxes: those are a little wider than what they hold."""
    mesh = cached_family("sphere")
    mesh = mesh.with_points(scale * mesh.points)
    away = 3.0 * scale * np.eye(3)[axis]
    assert Locator.of(mesh).cast(mesh.points + away, np.tile(-np.eye(3)[axis], (len(mesh.points), 1))).found.all()


def test_a_tree_is_smaller_than_its_mesh() -> None:
    tree = box_tree.build((mesh := cached_family("noisy")).points, mesh.faces)
    assert tree.points is mesh.points and tree.faces is mesh.faces
    assert tree.order.nbytes + tree.boxes.nbytes <= mesh.faces.nbytes + 24


def test_far_from_the_origin_nothing_else_is_closest() -> None:
    mesh = cached_family("sphere")
    far = mesh.with_points(np.round(mesh.points * 2**20) / 2**20 + 2.0**20)  # moved without rounding
    near = mesh.with_points(far.points - 2.0**20)
    queries = np.random.default_rng(2).integers(-(2**21), 2**21, (40, 3)) / 2**20
    here, there = Locator.of(near).closest(queries), Locator.of(far).closest(queries + 2.0**20)
    np.testing.assert_array_equal(here.points.faces, there.points.faces)
    np.testing.assert_array_equal(here.distance, there.distance)


@pytest.mark.parametrize("corners", [[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, 0]])
def test_a_face_with_equal_corners_is_a_segment(corners: list[int]) -> None:
    mesh = TriangleMesh([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [corners])
    expected = 1.0 if 1 in corners else np.sqrt(2.0)
    assert Locator.of(mesh).closest([[1.0, 1.0, 0.0]]).distance[0] == pytest.approx(expected)
