"""Laws of making polygons sound: what is manifold stays so, seams close, closed surfaces face outwards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.report import report
from contact_core.geometry.sound import SoundPolygons, sound_polygons
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family, family_names

CLOSED = ["sphere", "torus", "noisy", "blocks"]


def made_sound(points: FloatArray, faces: IntArray, **options: Any) -> tuple[TriangleMesh, SoundPolygons]:
    sound = sound_polygons(
        np.asarray(points, float), np.full(len(faces), 3), np.asarray(faces, np.int64).ravel(), **options
    )
    return TriangleMesh(points[sound.first], sound.indices.reshape(-1, 3)), sound


def soup(mesh: TriangleMesh, order: IntArray | None = None) -> tuple[FloatArray, IntArray]:
    faces = mesh.faces if order is None else mesh.faces[order]
    return mesh.points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


def volume_of(*parts: TriangleMesh) -> float:
    return sum(report(part).volume or 0.0 for part in parts)


def same_surface(ours: TriangleMesh, original: TriangleMesh) -> None:
    """As many of everything, and of one volume."""
    one, other = report(ours), report(original)
    for fact in ("vertices", "faces", "components", "boundary_edges", "boundary_loops", "euler_characteristic"):
        assert getattr(one, fact) == getattr(other, fact), fact
    assert one.is_manifold and one.genus == other.genus
    if other.volume is not None:
        assert one.volume is not None and np.isclose(one.volume, other.volume)


@settings(max_examples=40)
@given(name=family_names(), seed=st.integers(0, 2**32 - 1))
def test_a_soup_of_a_manifold_mesh_becomes_that_mesh(name: str, seed: int) -> None:
    mesh = cached_family(name)
    random = np.random.default_rng(seed)
    points, faces = soup(mesh, random.permutation(len(mesh.faces)))
    ours, _ = made_sound(points, np.array([np.roll(face, random.integers(3)) for face in faces]))
    same_surface(ours, mesh)


@settings(max_examples=150)
@given(
    cells=st.integers(1, 2**18 - 1), seed=st.integers(0, 2**32 - 1), split=st.floats(0.0, 1.0), exact=st.booleans()
)
def test_joining_never_makes_a_manifold_mesh_non_manifold(cells: int, seed: int, split: float, exact: bool) -> None:
    """Solids of cubes that touch in edges and corners as they like, with corners split off at random: whatever is
    manifold as the file says it, is so afterwards; and nothing that could be joined at whole solids stays open."""
    solid = np.array([bool(cells >> k & 1) for k in range(18)]).reshape(3, 3, 2)
    mesh = meshes.blocks(solid)
    random = np.random.default_rng(seed)
    flat = mesh.faces.ravel().copy()
    off = random.random(len(flat)) < split
    flat[off] = len(mesh.points) + np.arange(np.count_nonzero(off))
    points = np.concatenate([mesh.points, mesh.points[mesh.faces.ravel()[off]]])
    before = report(meshes.without_unused(points, flat.reshape(-1, 3)))
    ours, _ = made_sound(points, flat.reshape(-1, 3), exact=exact)
    after = report(ours)
    assert after.faces == before.faces
    assert not after.non_manifold_edges or before.non_manifold_edges
    assert len(after.non_manifold_edges) <= len(before.non_manifold_edges)
    assert len(after.non_manifold_vertices) <= len(before.non_manifold_vertices)
    if before.is_manifold:
        assert after.is_manifold
    assert after.boundary_edges <= before.boundary_edges
    if split == 1.0:
        assert np.isclose(after.area, before.area)


@settings(max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), spots=st.integers(3, 7), count=st.integers(1, 24))
def test_nothing_gets_worse_in_any_heap_of_triangles(seed: int, spots: int, count: int) -> None:
    """Random triangles over few places: every kind of crowded edge and vertex, all at once."""
    random = np.random.default_rng(seed)
    places = random.normal(size=(spots, 3))
    corners = np.array([random.permutation(spots)[:3] for _ in range(count)])
    twins = random.integers(1, 3)
    faces = corners * twins + random.integers(0, twins, corners.shape)
    points = np.repeat(places, twins, axis=0)
    for indexed, drawn in ((points, faces), soup(TriangleMesh(places, corners))):
        before = report(TriangleMesh(indexed, drawn))
        ours, sound = made_sound(indexed, drawn)
        after = report(ours)
        if before.is_manifold:
            assert after.is_manifold
        assert np.array_equal(indexed[sound.first][sound.point_of], indexed)
        if after.is_manifold:
            assert report(made_sound(ours.points, ours.faces)[0]).is_manifold


@settings(max_examples=40)
@given(name=family_names(), seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.49), loose=st.booleans())
def test_mixed_winding_is_made_consistent(name: str, seed: int, share: float, loose: bool) -> None:
    mesh = cached_family(name)
    points, faces = soup(mesh) if loose else (mesh.points, mesh.faces.copy())
    turned = np.random.default_rng(seed).random(len(faces)) < share
    faces[turned] = faces[turned][:, ::-1]
    ours, sound = made_sound(points, faces)
    same_surface(ours, mesh)
    right = np.einsum("fi,fi->f", ours.face_normals, mesh.face_normals) > 0
    assert right.all() or (np.count_nonzero(turned) * 2 >= len(faces) and not right.any())
    assert bool(turned.any()) == any("turned round" in note for note in sound.notes)


@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("loose", [False, True])
def test_a_closed_surface_wound_inwards_is_turned_with_a_note(name: str, loose: bool) -> None:
    mesh = cached_family(name)
    points, faces = soup(mesh) if loose else (mesh.points, mesh.faces)
    ours, sound = made_sound(points, faces[:, ::-1])
    same_surface(ours, mesh)
    assert any("face outwards" in note for note in sound.notes)
    clockwise, untouched = made_sound(points, faces[:, ::-1], clockwise=True)
    assert np.isclose(report(clockwise).volume or 0.0, -(report(mesh).volume or 0.0)) and not any(
        "turned" in note for note in untouched.notes
    )


def test_a_hollow_keeps_its_inner_wall_and_is_turned_as_a_whole() -> None:
    outer, inner = meshes.icosphere(2), meshes.icosphere(1, 0.5)
    points = np.concatenate([outer.points, inner.points])
    hollow = np.concatenate([outer.faces, inner.faces[:, ::-1] + len(outer.points)])
    for faces in (hollow, hollow[:, ::-1]):
        assert np.isclose(volume_of(made_sound(points, faces)[0]), volume_of(outer) - volume_of(inner))
    kernel = np.concatenate([outer.faces, inner.faces + len(outer.points)])  # a solid within a solid stays one
    assert np.isclose(volume_of(made_sound(points, kernel)[0]), volume_of(outer, inner))
    beside = np.concatenate([outer.points, inner.points + 5.0])  # beside one another each is judged by itself
    assert np.isclose(volume_of(made_sound(beside, hollow)[0]), volume_of(outer, inner))


def test_a_hand_open_at_the_wrist_has_an_outside_and_a_bowl_has_none() -> None:
    ball = meshes.icosphere(3)
    height = ball.points[ball.faces].mean(axis=1)[:, 2]
    for limit, decided in ((-0.9, True), (0.0, False)):
        part = meshes.without_unused(ball.points, ball.faces[height > limit])
        ours, _ = made_sound(part.points, part.faces[:, ::-1])
        assert bool((np.einsum("fi,fi->f", ours.face_normals, part.face_normals) > 0).all()) is decided


@pytest.mark.parametrize("name", [*CLOSED, "plane", "holes"])
@pytest.mark.parametrize("how", ["same points", "loose", "own points", "turned", "turned and loose"])
def test_each_face_twice_is_each_face_once(name: str, how: str) -> None:
    mesh = cached_family(name)
    second = mesh.faces[:, ::-1] if how.startswith("turned") else mesh.faces
    if how.endswith("loose"):
        points, faces = soup(TriangleMesh(mesh.points, np.concatenate([mesh.faces, second])))
    else:
        points = np.concatenate([mesh.points, mesh.points]) if how == "own points" else mesh.points
        faces = np.concatenate([mesh.faces, second + (len(mesh.points) if how == "own points" else 0)])
    ours, sound = made_sound(points, faces)
    same_surface(meshes.without_unused(ours.points, ours.faces), mesh)
    assert any(f"{len(mesh.faces)} faces lay on another face" in note for note in sound.notes)


def test_a_flat_bag_that_the_file_closes_keeps_both_sheets() -> None:
    sheet = meshes.plane(4)
    rim = np.unique(report_border(sheet))
    other = np.arange(len(sheet.points)) + len(sheet.points)
    other[rim] = rim
    faces = np.concatenate([sheet.faces, other[sheet.faces][:, ::-1]])
    ours, _ = made_sound(np.concatenate([sheet.points, sheet.points]), faces)
    assert len(ours.faces) == 2 * len(sheet.faces)


def report_border(mesh: TriangleMesh) -> IntArray:
    ends = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    return edges[uses == 1]


def test_one_sided_surfaces_stay_open_where_they_were_joined() -> None:
    turns = np.linspace(0.0, 2.0 * np.pi, 25)
    strip = np.stack(
        [
            [np.cos(t) * (2 + w * np.cos(t / 2)), np.sin(t) * (2 + w * np.cos(t / 2)), w * np.sin(t / 2)]
            for t in turns
            for w in (-0.5, 0.0, 0.5)
        ]
    ).reshape(-1, 3)
    strip[-3:] = strip[2::-1]  # the end lies on the beginning, upside down
    band = TriangleMesh(strip, meshes.grid_faces(25, 3))
    for points, faces in ((band.points, band.faces), soup(band)):
        ours, _ = made_sound(points, faces)
        found = report(ours)
        assert found.is_manifold and found.components == 1 and found.vertices == 75


def test_two_solids_that_touch_in_an_edge_or_a_corner_stay_two() -> None:
    for second in ((1, 1, 0), (1, 1, 1)):
        solid = np.zeros((2, 2, 2), bool)
        solid[0, 0, 0] = solid[second] = True
        ours, _ = made_sound(*soup(meshes.blocks(solid)))
        found = report(ours)
        assert found.is_watertight and found.components == 2 and found.volume == 2.0


def test_an_edge_that_has_its_faces_takes_no_third() -> None:
    """A nail whose border lies on whole edges of the finger: merging such points spoiled 27 edges of a hand."""
    finger = meshes.icosphere(2)
    own = finger.faces[finger.points[finger.faces].mean(axis=1)[:, 2] > 0.6]
    rim = np.unique(report_border(TriangleMesh(finger.points, own)))
    lift = np.full(len(finger.points), 1.05)  # the nail stands off the finger, but for its border
    lift[rim] = 1.0
    points = np.concatenate([finger.points, finger.points * lift[:, None]])
    faces = np.concatenate([finger.faces, own + len(finger.points)])
    for exact in (True, False):
        ours, _ = made_sound(points, faces, exact=exact)
        assert report(ours).is_manifold and report(ours).components == 2
        loose, _ = made_sound(*soup(TriangleMesh(points, faces)), exact=exact)
        assert report(loose).is_manifold


@pytest.mark.parametrize("far", ["quad", "stray triangle"])
@pytest.mark.parametrize("distance", [1e3, 5e3, 1e6])
@pytest.mark.parametrize("loose", [False, True])
def test_what_lies_far_away_eats_no_detail(far: str, distance: float, loose: bool) -> None:
    """A mug beside a ground of two kilometres (before: 15,236 of 16,386 faces were lost)."""
    mug = meshes.icosphere(4, 0.05)
    points, faces = soup(mug) if loose else (mug.points, mug.faces)
    points = points.astype(np.float32).astype(float)
    if far == "quad":
        more = np.array([[-distance, 0, -distance], [distance, 0, -distance], [distance, 0, distance]])
    else:
        more = np.array([[distance, 0, 0], [distance + 1, 0, 0], [distance, 1, 0]])
    ours, _ = made_sound(np.concatenate([points, more]), np.concatenate([faces, [len(points) + np.arange(3)]]))
    found = report(ours)
    assert found.faces == len(mug.faces) + 1 and found.vertices == len(mug.points) + 3
    assert found.components == 2 and found.is_manifold


@pytest.mark.parametrize("place", [0.0, 3.0, 2000.0])
def test_copies_that_float32_rounded_apart_are_joined(place: float) -> None:
    mesh = meshes.icosphere(2, 0.3)
    points, faces = soup(mesh)
    random = np.random.default_rng(1)
    wobble = 2.0**-24 * max(place, 0.3) * random.uniform(-1, 1, points.shape)
    ours, _ = made_sound((points + place + wobble), faces)
    assert report(ours).is_watertight and len(ours.points) == len(mesh.points)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from(["sphere", "torus", "noisy", "plane", "holes"]),
    quads=st.booleans(),
)
def test_noise_on_a_soup_is_bridged_with_a_note(seed: int, name: str, quads: bool) -> None:
    """Two micrometres on a thing of a metre: far above rounding, far below any edge."""
    mesh = cached_family(name)
    points, faces = soup(mesh)
    if quads:  # patches of some faces each: noise between the patches alone
        part = np.random.default_rng(seed).integers(0, 6, len(mesh.faces))
        keys, flat = np.unique(np.stack([np.repeat(part, 3), mesh.faces.ravel()], 1), axis=0, return_inverse=True)
        points, faces = mesh.points[keys[:, 1]], flat.reshape(-1, 3)
    noisy = points + np.random.default_rng(seed).uniform(-2e-6, 2e-6, points.shape)
    ours, sound = made_sound(noisy, faces)
    after = report(ours)
    assert after.is_manifold and after.components == report(mesh).components
    if name in CLOSED:
        assert after.is_watertight and after.vertices == len(mesh.points)
        assert any("open edges met another one" in note for note in sound.notes)


@pytest.mark.parametrize("how", ["mixed", "inwards", "twice"])
def test_noise_comes_together_with_other_faults(how: str) -> None:
    mesh = meshes.torus()
    faces = mesh.faces.copy()
    if how == "mixed":
        faces[::3] = faces[::3, ::-1]
    elif how == "inwards":
        faces = faces[:, ::-1]
    else:
        faces = np.concatenate([faces, faces])
    points, loose = soup(TriangleMesh(mesh.points, faces))
    ours, _ = made_sound(points + np.random.default_rng(3).normal(0.0, 2e-6, points.shape), loose)
    found = report(ours)
    assert found.is_watertight and found.genus == 1 and found.faces == len(mesh.faces)
    assert np.isclose(found.volume or 0.0, volume_of(mesh), rtol=1e-4)


def test_a_heap_whose_edges_do_not_meet_is_noted() -> None:
    leaves = meshes.copies(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), 200)
    _, sound = made_sound(leaves.points, leaves.faces)
    assert any("200 pieces whose edges do not meet" in note for note in sound.notes)


def test_two_layers_of_cloth_a_tenth_of_a_millimetre_apart_stay_two() -> None:
    sheet = meshes.plane(10, 0.1)
    points = np.concatenate([sheet.points, sheet.points + np.array([0, 0, 1e-4])])
    ours, sound = made_sound(points, np.concatenate([sheet.faces, sheet.faces + len(sheet.points)]))
    assert report(ours).components == 2 and not sound.notes


def test_points_of_different_labels_stay_apart() -> None:
    mesh = meshes.icosphere(1)
    points, faces = soup(mesh)
    label = (points[:, 2] > 0).astype(np.int64)
    own = np.repeat(points.reshape(-1, 3, 3).mean(axis=1)[:, 2] > 0, 3).astype(np.int64)
    assert report(made_sound(points, faces, apart=label)[0]).is_watertight  # equal points, equal labels
    assert report(made_sound(points, faces, apart=own)[0]).components == 2


@given(st.integers(1, 30), st.lists(st.tuples(st.integers(0, 29), st.integers(0, 29)), max_size=60))
def test_pieces_are_those_of_a_graph(faces: int, joined: list[tuple[int, int]]) -> None:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    from contact_core.geometry.side_kernels import number_pieces

    a, b = (
        np.array([pair for pair in joined if max(pair) < faces] or np.zeros((0, 2)), np.int64)
        .reshape(-1, 2)
        .T.copy()
    )
    piece = np.arange(faces)
    count, wanted = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(faces, faces)), directed=False)
    assert number_pieces(a, b, piece) == count
    assert (piece == wanted).all()


def test_a_hundred_thousand_leaves_of_a_book_are_told_apart() -> None:
    """Faces round one edge whose outer corners lie close together: every pair of them was compared."""
    leaves = 100_000
    round_ = np.linspace(0.0, 2.0 * np.pi, leaves, endpoint=False)
    points = np.concatenate([[[0, 0, 0], [0, 0, 1]], np.c_[np.cos(round_), np.sin(round_), np.full(leaves, 0.5)]])
    faces = np.c_[np.zeros(leaves, np.int64), np.ones(leaves, np.int64), np.arange(2, leaves + 2)]
    twice = np.concatenate([faces, faces[:10, [1, 2, 0]]])
    sound = sound_polygons(points, np.full(len(twice), 3), twice.ravel())
    assert sound.face_of.tolist() == list(range(leaves)) and "10 faces lay on another face" in sound.notes[0]
