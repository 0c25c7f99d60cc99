"""The clay and the chisel: fields, remeshing and bone heat, on shapes with known answers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_builtins.samples import fields
from contact_builtins.samples.binding import bone_heat_weights, cotangent_laplacian, strongest
from contact_builtins.samples.modelling import collapse_short_edges, flip_towards_delaunay, level_set, surface_of
from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.report import report
from contact_core.testing import meshes


def torus(p: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(np.hypot(p[:, 0], p[:, 2]) - 1.0, p[:, 1]) - 0.4)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_round_cone_is_the_nearest_of_the_balls_along_it(seed: int) -> None:
    random = np.random.default_rng(seed)
    a, b = random.normal(size=(2, 3))
    ra, rb = random.uniform(0.05, 0.6, 2)
    p = random.normal(size=(50, 3)) * 2
    t = np.linspace(0, 1, 2001)[:, None]
    centres, radii = a + t * (b - a), (ra + t * (rb - ra))[:, 0]
    nearest = (np.linalg.norm(p[:, None] - centres, axis=2) - radii).min(axis=1)
    assert np.allclose(fields.round_cone(a, b, ra, rb)(p), nearest, atol=2e-3)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_slab_is_the_nearest_of_the_balls_over_its_triangle(seed: int) -> None:
    random = np.random.default_rng(seed)
    corners = random.normal(size=(3, 3))
    p = random.normal(size=(30, 3)) * 2
    u, v = (g.ravel() for g in np.meshgrid(np.linspace(0, 1, 61), np.linspace(0, 1, 61)))
    inside = u + v <= 1.0 + 1e-12
    samples = np.stack([1 - u - v, u, v], axis=1)[inside] @ corners
    nearest = np.linalg.norm(p[:, None] - samples, axis=2).min(axis=1) - 0.1
    reach = 0.6 * np.linalg.norm(np.diff(corners, axis=0), axis=1).max() / 60
    found = fields.slab(*corners, radius=0.1)(p)
    assert (found <= nearest + 1e-9).all() and (found >= nearest - 2 * reach).all()


@pytest.mark.parametrize(
    ("field", "exact"),
    [
        (fields.cylinder([0, 0, 0], 1.0, 0.5), lambda p: np.hypot(p[:, 0], p[:, 2]) - 1.0),
        (fields.box([0, 0, 0], [1, 1, 1]), lambda p: np.abs(p).max(axis=1) - 1.0),
        (fields.half_space([0, 1, 0], [0, 2, 0]), lambda p: p[:, 1] - 1.0),
    ],
)
def test_signs_agree_with_the_definition(field: fields.Field, exact: fields.Field) -> None:
    p = np.random.default_rng(0).uniform(-2, 2, (400, 3)) * [1, 0.2, 1]
    clear = np.abs(exact(p)) > 1e-6
    assert np.array_equal(np.sign(field(p))[clear], np.sign(exact(p))[clear])


@given(x=st.floats(-2, 2), y=st.floats(-2, 2), blend=st.floats(0.01, 1))
def test_smooth_min_lies_below_both_and_within_a_quarter(x: float, y: float, blend: float) -> None:
    value = float(fields.smooth_min(np.array([x]), np.array([y]), blend)[0])
    assert min(x, y) - blend / 4 - 1e-12 <= value <= min(x, y)
    assert value == pytest.approx(float(fields.smooth_min(np.array([y]), np.array([x]), blend)[0]))


@pytest.mark.parametrize("edge", [None, 0.35])
def test_a_torus_is_a_torus_with_even_triangles(edge: float | None) -> None:
    mesh = surface_of(torus, [-1.6, -0.6, -1.6], [1.6, 0.6, 1.6], 0.2, edge)
    facts = report(mesh)
    assert facts.is_watertight and facts.genus == 1 and facts.components == 1
    assert np.abs(torus(mesh.points)).max() < 1e-3
    assert facts.area == pytest.approx(4 * np.pi**2 * 0.4, rel=0.05)
    sides = np.linalg.norm(mesh.points[mesh.faces] - mesh.points[np.roll(mesh.faces, 1, axis=1)], axis=2)
    a, b, c = np.sort(sides, axis=1).T
    assert np.degrees(np.arccos((b**2 + c**2 - a**2) / (2 * b * c))).min() > 25
    if edge is not None:
        assert 0.7 * edge < np.median(sides) < 1.1 * edge


def test_a_thin_wall_survives() -> None:
    """A hollow ball with a wall of 1.6 cells: two sheets, neither torn nor folded into the other."""
    shell = fields.without(fields.ball([0, 0, 0], 1.0), fields.ball([0, 0, 0], 0.84))
    opened = fields.without(shell, fields.half_space([0, 0.4, 0], [0, -1, 0]))
    mesh = surface_of(opened, [-1.2] * 3, [1.2] * 3, 0.1, 0.14)
    facts = report(mesh)
    assert facts.is_watertight and facts.genus == 0 and facts.components == 1
    assert np.abs(opened(mesh.points)).max() < 5e-3
    outside = fields.gradient(opened, mesh.points[mesh.faces].mean(axis=1), 1e-4)
    assert np.percentile(np.einsum("ij,ij->i", outside, mesh.face_normals), 2) > 0.5


def test_far_points_may_be_guessed_without_changing_the_surface() -> None:
    """Counting: the field is asked for far fewer points than the lattice has, and the level set is the same."""
    asked: list[int] = []

    def counted(p: FloatArray) -> FloatArray:
        asked.append(len(p))
        return fields.ball([0.1, 0, 0], 0.5)(p)

    mesh = level_set(counted, [-3, -3, -3], [3, 3, 3], 0.15)
    assert sum(asked) < 0.2 * 2 * (6 / 0.15) ** 3
    assert report(mesh).is_watertight
    assert np.abs(np.linalg.norm(mesh.points - [0.1, 0, 0], axis=1) - 0.5).max() < 0.02


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_flips_and_collapses_keep_the_manifold(seed: int) -> None:
    random = np.random.default_rng(seed)
    base = meshes.torus(18, 12)
    points = base.points + random.normal(size=base.points.shape) * 0.02
    flipped = flip_towards_delaunay(points, np.array(base.faces))
    before, after = report(TriangleMesh(points, base.faces)), report(TriangleMesh(points, flipped))
    assert after.is_watertight and after.genus == before.genus == 1 and after.faces == before.faces
    fewer, faces = collapse_short_edges(points, flipped, 0.6)
    collapsed = report(TriangleMesh(fewer, faces))
    assert collapsed.is_watertight and collapsed.genus == 1 and collapsed.vertices < before.vertices


def test_a_thin_ring_is_never_pinched() -> None:
    """Three vertices round the tube: no face joins them, so none of their edges may collapse."""
    ring = meshes.torus(24, 3)
    points, faces = np.array(ring.points), np.array(ring.faces)
    for _ in range(12):
        points, faces = collapse_short_edges(points, faces, 10.0)
    facts = report(TriangleMesh(points, faces))
    assert facts.is_watertight and facts.genus == 1


@settings(max_examples=60)
@given(x=st.floats(-0.4, 1.4), y=st.floats(-0.4, 1.4), height=st.floats(0.001, 0.5))
def test_a_flip_never_doubles_an_edge(x: float, y: float, height: float) -> None:
    """In a tetrahedron each edge that a flip would make is there already, however flat it is."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [x, y, height]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert np.array_equal(flip_towards_delaunay(points, faces), faces)


def test_bone_heat_on_a_rod_is_even_and_ordered() -> None:
    """Two bones in a rod: weights are 1 at its ends, a half in the middle, and fall without a bump."""
    rod = meshes.cylinder(16, 40)
    z = rod.points[:, 2]
    middle = 0.5 * (z.min() + z.max())
    owner = (z > middle).astype(np.int64)
    weights = bone_heat_weights(rod, owner, np.full(len(z), 0.1 * np.ptp(z)), 2)
    assert np.allclose(weights.sum(axis=1), 1) and weights.min() >= 0
    order = np.argsort(z)
    assert np.corrcoef(weights[order, 1], z[order])[0, 1] > 0.7
    assert weights[z < z.min() + 1e-9, 0].min() > 0.95 and weights[z > z.max() - 1e-9, 1].min() > 0.95
    rings = [weights[np.isclose(z, level), 1].mean() for level in np.unique(np.round(z, 9))]
    assert (np.diff(rings) > -0.02).all()


def test_the_laplacian_knows_constants_and_area() -> None:
    ball = meshes.icosphere(2)
    laplacian, mass = cotangent_laplacian(ball)
    assert np.abs(laplacian @ np.ones(len(ball.points))).max() < 1e-9
    assert mass.sum() == pytest.approx(ball.face_areas.sum())
    # on the unit sphere, the coordinates are eigenfunctions of eigenvalue 2
    x = ball.points[:, 0] / np.linalg.norm(ball.points, axis=1)
    assert (x @ (laplacian @ x)) / (x @ (mass * x)) == pytest.approx(2.0, rel=0.05)


def test_the_strongest_influences_are_kept_and_renormalised() -> None:
    weights = np.array([[0.5, 0.1, 0.0, 0.4], [0.0, 0.0, 1.0, 0.0]])
    joints, kept = strongest(weights, 2)
    assert joints[0].tolist() == [0, 3] and np.allclose(kept[0], [5 / 9, 4 / 9])
    assert joints[1, 0] == 2 and kept[1].tolist() == [1.0, 0.0]
