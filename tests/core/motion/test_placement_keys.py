"""Placements over time: exact at keys, continuous between, and patches that slide calmly."""

from __future__ import annotations

import cmath
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from contact_core.contact.axis import draw_axis
from contact_core.contact.patch import parameterize_patch, reconstruct_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.contact.tracer import ShapedPatch
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import heading_to_direction
from contact_core.geometry.tracing import trace_geodesic
from contact_core.motion.placement_keys import PlacementKey, PlacementKeys, Way
from contact_core.motion.sliding import CALM, SlidingPatch
from contact_core.testing import meshes

SURFACES = ("plane", "saddle", "sphere", "torus", "noisy", "lattice")


def root_on(mesh: TriangleMesh, seed: int) -> Root:
    random = np.random.default_rng(seed)
    point = SurfacePoints([int(random.integers(len(mesh.faces)))], [random.dirichlet(np.ones(3))])
    return Root.at(point, cmath.exp(1j * random.uniform(-math.pi, math.pi)))


def keys_on(mesh: TriangleMesh, seed: int, *interpolations: Any) -> PlacementKeys:
    """Keys at 0, 10, 25 ... with random roots; one more than interpolations."""
    frames = np.cumsum([0.0, *(10.0 + 5.0 * k for k in range(len(interpolations)))])
    kinds = (*interpolations, "smooth")
    return PlacementKeys.of(mesh, [(f, root_on(mesh, seed + k), kinds[k]) for k, f in enumerate(frames)])


def place(mesh: TriangleMesh, root: Root) -> tuple[np.ndarray, np.ndarray]:
    point = root.point()
    return point.positions(mesh)[0], heading_to_direction(mesh, point, [root.heading])[0]


@pytest.mark.parametrize("name", SURFACES)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=15)
def test_a_walk_arrives_where_the_next_key_is_with_its_heading(name: str, seed: int) -> None:
    mesh = meshes.family(name)
    keys = keys_on(mesh, seed, "linear", "smooth")
    for index, key in enumerate(keys.keys[:-1]):
        assert keys.at(mesh, key.frame) is key.root
        then = keys.keys[index + 1]
        assert key.way is not None
        points, headings = keys.sampled(mesh, [then.frame - 1e-9 * (then.frame - key.frame)])
        assert np.allclose(
            points.positions(mesh)[0], place(mesh, then.root)[0], atol=1e-6 * mesh.bounding_box_diagonal
        )
        arrived = Root.at(points, complex(headings[0]))
        if min(arrived.barycentric) > 1e-3 and arrived.face == then.root.face:
            assert abs(arrived.heading / then.root.heading - 1.0) < 1e-5


@pytest.mark.parametrize("name", SURFACES)
def test_roots_move_and_turn_continuously(name: str) -> None:
    """Finer sampling gives smaller steps, over edges, past saddle vertices and through keys."""
    mesh = meshes.family(name)
    for seed in range(4):
        keys = keys_on(mesh, 100 * seed, "smooth", "linear", "smooth")
        length = sum(key.way.length for key in keys.keys if key.way is not None)
        frames = np.linspace(0.0, keys.frames[-1], 2001)
        points, headings = keys.sampled(mesh, frames.tolist())
        positions = points.positions(mesh)
        assert np.linalg.norm(np.diff(positions, axis=0), axis=1).max() < 4.0 * length / 2000
        if name == "lattice":
            continue  # its ways pass corners with a quarter turn too much, where no heading goes straight on
        # the heading, carried over each edge by turning about it, turns by no more than the twist at an even pace
        twist = max(abs(key.way.twist) for key in keys.keys if key.way is not None)
        directions, normals = heading_to_direction(mesh, points, headings), mesh.face_normals[points.faces]
        fold = np.cross(normals[:-1], normals[1:])
        sine = np.linalg.norm(fold, axis=1, keepdims=True)
        angle = np.arctan2(sine, np.einsum("ki,ki->k", normals[:-1], normals[1:])[:, None])
        carried = Rotation.from_rotvec(fold / np.maximum(sine, 1e-300) * angle).apply(directions[:-1].copy())
        corners = mesh.faces[points.faces]
        shared = (corners[:-1, :, None] == corners[1:, None, :]).any(axis=2).sum(axis=1) >= 2
        turned = np.linalg.norm(carried - directions[1:], axis=1)[shared]
        assert turned.max() < 8.0 * twist / 500 + 1e-6


@given(st.lists(st.floats(0.0, 3.0), min_size=2, max_size=5), st.lists(st.integers(1, 9), min_size=5, max_size=5))
def test_smooth_shares_rise_and_speeds_run_on_through_keys(lengths: list[float], gaps: list[int]) -> None:
    root = Root(0, (0.5, 0.25, 0.25), 1.0 + 0.0j)
    frames = np.cumsum([0, *gaps])[: len(lengths) + 1].astype(float)
    ways = [Way(0.0, (length,), (), 0.0) for length in lengths]
    keys = PlacementKeys(tuple(map(PlacementKey, frames, itertools.repeat(root), [*ways, None])))

    def distance(frame: float) -> float:
        index, share = keys.share(frame)
        return sum(lengths[:index]) + share * (lengths[index] if index < len(lengths) else 0.0)

    at = np.linspace(0.0, frames[-1], 400)
    along = np.array([distance(float(f)) for f in at])
    assert (np.diff(along) >= -1e-12).all()
    assert along[-1] == pytest.approx(sum(lengths))
    h = 1e-5
    for frame in frames[1:-1]:
        before, after = (distance(frame) - distance(frame - h)) / h, (distance(frame + h) - distance(frame)) / h
        assert before == pytest.approx(after, abs=1e-3)


def test_held_keys_stay_and_linear_ones_are_even() -> None:
    mesh = meshes.plane()
    keys = keys_on(mesh, 3, "hold", "linear")
    assert keys.at(mesh, 9.9) == keys.keys[0].root
    steps = np.diff(keys.sampled(mesh, [10.0, 13.0, 16.0, 19.0, 22.0, 25.0])[0].positions(mesh), axis=0)
    assert np.allclose(np.linalg.norm(steps, axis=1), np.linalg.norm(steps[0]))
    assert keys.at(mesh, -5.0) == keys.keys[0].root
    assert keys.at(mesh, 99.0) == keys.keys[-1].root


def test_a_turn_on_the_spot() -> None:
    mesh = meshes.plane()
    root = root_on(mesh, 1)
    keys = PlacementKeys.of(mesh, [(0.0, root, "linear"), (10.0, root.heading_to(root.heading * cmath.exp(2.0j)))])
    half = keys.at(mesh, 5.0)
    assert half.point().positions(mesh) == pytest.approx(root.point().positions(mesh))
    assert cmath.phase(half.heading / root.heading) == pytest.approx(1.0)


def test_edits_find_only_the_ways_beside_them() -> None:
    mesh = meshes.torus()
    keys = keys_on(mesh, 7, "smooth", "linear", "smooth", "smooth")
    edited = keys.with_key(mesh, 12.0, root_on(mesh, 77), "linear")
    assert edited.frames == tuple(sorted([*keys.frames, 12.0]))
    assert edited.keys[0] is keys.keys[0]
    assert edited.keys[-2:] == keys.keys[-2:]
    assert edited.keys[1].way != keys.keys[1].way
    assert edited.without_key(mesh, 12.0) == keys
    replaced = keys.with_key(mesh, keys.frames[1], root_on(mesh, 5))
    assert len(replaced.keys) == len(keys.keys)
    first = keys.without_key(mesh, 0.0)
    assert first.keys == keys.keys[1:]
    assert keys.without_key(mesh, keys.frames[-1]).keys[-1].way is None


def patch_at(mesh: TriangleMesh, start: SurfacePoints, radius: float) -> tuple[PatchShape, Root]:
    """A disk of 200 points with its axis from the middle to the rim."""
    random = np.random.default_rng(1)
    rim = trace_geodesic(mesh, start, [radius + 0j]).points
    shape, axis = draw_axis(mesh, SurfacePoints.concatenate([start, rim]))
    vectors = radius * np.sqrt(random.uniform(size=200)) * np.exp(2j * np.pi * random.uniform(size=200))
    points = trace_geodesic(mesh, start[np.zeros(200, int)], vectors).points
    return PatchShape(shape, parameterize_patch(mesh, axis, points), np.ones(200)), axis.root()


def slide(mesh: TriangleMesh, seed: int) -> tuple[SlidingPatch, float]:
    """A patch of a twentieth of the mesh that slides four of its radii, and as far again another way, in 2 s."""
    radius = 0.05 * mesh.bounding_box_diagonal
    start = root_on(mesh, seed).point()
    shape, root = patch_at(mesh, start, radius)
    keys: list[tuple[float, Root]] = [(0.0, root)]
    for k in range(2):
        leg = trace_geodesic(
            mesh, keys[-1][1].point(), [4.0 * radius * keys[-1][1].heading * cmath.exp(1j * (seed + k))]
        )
        keys.append((24.0 * (k + 1), Root.at(leg.points, complex(leg.headings[0]))))
    return SlidingPatch(mesh, ShapedPatch(shape), PlacementKeys.of(mesh, keys)), radius


def check_calm(mesh: TriangleMesh, seed: int) -> None:
    sliding, radius = slide(mesh, seed)
    frames = np.arange(-3.0, 52.0)
    seen = np.array([sliding.points(frame).positions(mesh) for frame in frames])
    roots = sliding.keys.sampled(mesh, frames.tolist())[0].positions(mesh)
    fastest = np.linalg.norm(np.diff(roots, axis=0), axis=1).max()
    centre = np.linalg.norm(np.diff(seen.mean(axis=1), axis=0), axis=1).max()
    assert centre <= CALM * fastest
    assert sliding.calm(5.0) <= CALM
    assert np.linalg.norm(np.diff(seen, axis=0), axis=2).max() <= 1.5 * radius  # a point that hops over a fold
    for key in sliding.keys.keys:
        exact = reconstruct_patch(mesh, sliding.patch.shape, key.root).points
        assert np.array_equal(sliding.points(key.frame).positions(mesh), exact.positions(mesh))


@pytest.mark.parametrize("name", ["sphere", "torus", "noisy"])
@pytest.mark.parametrize("seed", range(3))
def test_a_sliding_patch_is_calm_and_exact_at_its_keys(name: str, seed: int) -> None:
    check_calm(meshes.noisy(3) if name == "noisy" else meshes.family(name), seed)


@pytest.mark.assets
@pytest.mark.parametrize("seed", range(4))
def test_a_patch_sliding_over_the_bunny_is_calm(seed: int, assets: Path) -> None:
    import trimesh

    scan: Any = trimesh.load(assets / "objects" / "stanford_bunny_35k.obj", process=False)
    check_calm(TriangleMesh(scan.vertices, scan.faces), seed)


def test_smoothing_is_what_calms_it() -> None:
    """Without it the same slide leaps: the law above can fail."""
    leaps = []
    for seed in range(3):
        sliding, _ = slide(meshes.noisy(3), seed)
        frames = np.arange(0.0, 49.0)
        raw = np.array([sliding.traced(frame).positions(sliding.mesh).mean(axis=0) for frame in frames])
        roots = sliding.keys.sampled(sliding.mesh, frames.tolist())[0].positions(sliding.mesh)
        leap, fastest = (np.linalg.norm(np.diff(p, axis=0), axis=1).max() for p in (raw, roots))
        leaps.append(leap / fastest)
    assert max(leaps) > 1.1 * CALM


def test_a_held_patch_jumps_once_and_is_exact_meanwhile() -> None:
    mesh = meshes.torus()
    sliding, _ = slide(mesh, 0)
    keys = sliding.keys
    held = PlacementKeys.of(
        mesh, [(k.frame, k.root, kind) for k, kind in zip(keys.keys, ("smooth", "hold", "smooth"), strict=True)]
    )
    patch = SlidingPatch(mesh, sliding.patch, held)
    at_key = patch.points(24.0).positions(mesh)
    assert np.array_equal(patch.points(47.5).positions(mesh), at_key)
    assert not np.array_equal(patch.points(48.0).positions(mesh), at_key)
    assert patch.calm(30.0) == 0.0


def test_what_does_not_fit_is_refused_in_words() -> None:
    mesh, root = meshes.plane(), Root(0, (0.5, 0.25, 0.25), 1.0 + 0.0j)
    two = meshes.copies(meshes.plane(), 2)
    far = Root(len(two.faces) - 1, (0.5, 0.25, 0.25), 1.0 + 0.0j)
    cases = [
        (lambda: PlacementKeys(()), "at least one"),
        (lambda: PlacementKeys((PlacementKey(0.0, root), PlacementKey(1.0, root))), "way to the next"),
        (lambda: PlacementKeys.of(two, [(0.0, root), (1.0, far)]), "not connected"),
        (lambda: PlacementKey(0.0, root, None, "jump"), "smooth"),  # type: ignore[arg-type]
        (lambda: PlacementKey(math.nan, root), "finite"),
        (lambda: Way(0.0, (1.0,), (1.0,), 0.0), "one length more"),
        (lambda: Way(0.0, (-1.0,), (), 0.0), "not negative"),
        (lambda: Way(math.inf, (1.0,), (), 0.0), "finite"),
        (lambda: PlacementKeys.of(mesh, [(0.0, root)]).without_key(mesh, 0.0), "besides another"),
    ]
    for make, words in cases:
        with pytest.raises(InvalidInput, match=words):
            make()
