"""The contact algebra: identity on the same surface on every mesh family, closed forms on plane and cylinder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact_core.arrays import FloatArray
from contact_core.contact.axis import draw_axis, parameterize_axis, reconstruct_axis, root_from_point
from contact_core.contact.linkage import follow_link, link_to
from contact_core.contact.patch import parameterize_patch, points_from_axis, reconstruct_patch, transfer_patch
from contact_core.contact.placement import Root
from contact_core.contact.shape import PatchShape
from contact_core.contact.transfer import transported
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tangent import direction_to_heading
from contact_core.geometry.tracing import trace_chains
from contact_core.testing import meshes
from contact_core.testing.strategies import cached_family

FAMILIES = sorted(meshes.FAMILIES)


def region(mesh: TriangleMesh, seed: int, count: int = 40, reach: float = 0.2) -> SurfacePoints:
    """Random points round a random face: in faces, on edges, on vertices."""
    rng = np.random.default_rng(seed)
    centres = mesh.points[mesh.faces].mean(axis=1)
    centre = centres[rng.integers(len(centres))]
    near = np.flatnonzero(np.linalg.norm(centres - centre, axis=1) <= reach * mesh.bounding_box_diagonal)
    weights = rng.dirichlet(np.ones(3), count)
    weights[: count // 4, 0] = 0.0
    weights[: count // 8] = np.eye(3)[1]
    return SurfacePoints(rng.choice(near, count), weights / weights.sum(axis=1, keepdims=True))


def shape_of(
    mesh: TriangleMesh, points: SurfacePoints, picks: SurfacePoints, dense: bool
) -> tuple[PatchShape, Root]:
    axis_shape, axis = draw_axis(mesh, picks, 1.0 + 0j, dense=dense)
    coordinates = parameterize_patch(mesh, axis, points)
    return PatchShape(axis_shape, coordinates, np.ones(len(points))), axis.root()


def off(mesh: TriangleMesh, a: SurfacePoints, b: SurfacePoints) -> float:
    """Largest distance of two batches of points, relative to the bounding box."""
    moved = np.linalg.norm(a.positions(mesh) - b.positions(mesh), axis=1)
    return float(moved.max()) / mesh.bounding_box_diagonal


@pytest.mark.parametrize("family", FAMILIES)
@settings(max_examples=12)
@given(seed=st.integers(0, 10**6), picks=st.integers(1, 4), dense=st.booleans())
def test_taken_apart_and_put_together_it_is_the_same(family: str, seed: int, picks: int, dense: bool) -> None:
    """Un-mirrored transfer onto the same surface at the same root is the identity: 1e-9, slivers 1e-5."""
    mesh = cached_family(family)
    points = region(mesh, seed)
    shape, root = shape_of(mesh, points, points[-picks:], dense)
    again = reconstruct_patch(mesh, shape, root)
    assert off(mesh, points, again.points) <= (1e-5 if family == "sliver" else 1e-9)
    assert not again.ran_off.any()
    bound = 1e-9 * mesh.bounding_box_diagonal
    assert again.remaining.max() <= bound and again.axis.remaining.max() <= bound


@pytest.mark.parametrize("family", FAMILIES)
@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), which=st.floats(0.0, 1.0))
def test_an_axis_can_be_held_by_any_of_its_points(family: str, seed: int, which: float) -> None:
    """Walking back from any axis point and its tangent finds the root."""
    mesh = cached_family(family)
    shape, axis = draw_axis(mesh, region(mesh, seed, 12)[-3:])
    k = round(which * (len(axis) - 1))
    root, cut = root_from_point(mesh, shape, k, axis.points[k], complex(axis.tangents[k]))
    assert cut <= 1e-9 * mesh.bounding_box_diagonal
    tolerance = 1e-5 if family == "sliver" else 1e-9
    assert off(mesh, root.point(), axis.points[0]) <= tolerance
    again = reconstruct_axis(mesh, shape, root)
    assert off(mesh, again.points, axis.points) <= tolerance


@pytest.mark.parametrize("family", FAMILIES)
@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), mirrored=st.booleans())
def test_a_link_leads_back_to_the_child(family: str, seed: int, mirrored: bool) -> None:
    mesh = cached_family(family)
    points = region(mesh, seed, 24, 0.3)
    _, parent = draw_axis(mesh, points[[20, 21]])
    _, child = draw_axis(mesh, points[[22, 23]])
    at = len(parent) // 2
    link = link_to(mesh, "parent", parent, child.points[0], complex(child.tangents[0]), parent_point=at)
    assert link.mirrored().mirrored() == link
    point, tangent, cut = follow_link(mesh, parent, link)
    tolerance = 1e-5 if family == "sliver" else 1e-9
    assert off(mesh, point, child.points[0]) <= tolerance and cut <= tolerance
    if point.same_as(child.points[0]):  # the same frame: headings compare
        assert abs(tangent - complex(child.tangents[0])) <= 1e-6


@pytest.mark.parametrize("family", FAMILIES)
@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), angle=st.floats(-3.0, 3.0), mirrored=st.booleans())
def test_a_child_keeps_its_place_relative_to_a_parent_that_moved(
    family: str, seed: int, angle: float, mirrored: bool
) -> None:
    """Wherever the parent goes, the way back from the child has the link's lengths and angles: 1e-9."""
    mesh = cached_family(family)
    points = region(mesh, seed, 24, 0.3)
    shape, parent = draw_axis(mesh, points[[20, 21]])
    _, child = draw_axis(mesh, points[[22, 23]])
    link = link_to(
        mesh, "parent", parent, child.points[0], complex(child.tangents[0]), parent_point=len(parent) - 1
    )
    link = link.mirrored() if mirrored else link
    moved = transported(mesh, parent.root(), points[5])
    turned = moved.heading_to(moved.heading * np.exp(1j * angle))
    there = reconstruct_axis(mesh, shape.transformed(mirrored=mirrored), turned)
    point, tangent, cut = follow_link(mesh, there, link)
    if cut > 0.0 or there.remaining.any():
        return  # a boundary was in the way, and that is reported
    arriving = tangent * np.exp(-1j * link.heading)
    back = trace_chains(
        mesh, point, [-arriving * link.lengths[-1]], [0, len(link.turns)], [-t for t in link.turns[::-1]],
        link.lengths[-2::-1] if link.turns else [],
    )  # fmt: skip
    tolerance = 1e-5 if family == "sliver" else 1e-9
    assert off(mesh, back.points, there.points[len(parent) - 1]) <= tolerance


def flat_coordinates(mesh: TriangleMesh, points: SurfacePoints, surface: str) -> FloatArray:
    """(k, 2) isometric plane coordinates: x and y of a plane, arc and height of a cylinder."""
    where = points.positions(mesh)
    if surface == "plane":
        return where[:, :2]
    return unrolled(mesh, points)


def unrolled(mesh: TriangleMesh, points: SurfacePoints) -> FloatArray:
    """(k, 2) the polyhedral cylinder rolled out: arc along its polygon, and height. Isometric."""
    where = points.positions(mesh)
    columns = np.unique(np.round(np.arctan2(mesh.points[:, 1], mesh.points[:, 0]), 9))
    sides = len(columns)
    radius = float(np.linalg.norm(mesh.points[0, :2]))
    step, start = 2.0 * np.pi / sides, float(columns[0])
    turned = np.arctan2(where[:, 1], where[:, 0]) - start
    side = np.floor(turned / step + 1e-9)
    middle = (side + 0.5) * step + start
    across = -where[:, 0] * np.sin(middle) + where[:, 1] * np.cos(middle)
    side_length = 2.0 * radius * np.sin(step / 2.0)
    return np.column_stack([(side + 0.5) * side_length + across, where[:, 2]])


CLOSED = {
    "plane": (meshes.plane(14), np.array([0.5, 0.5, 0.0]), 0.18, np.array([1.0, 0.0, 0.0])),
    "cylinder": (meshes.cylinder(24, 14), np.array([0.5, 0.05, 1.0]), 0.25, np.array([0.0, 1.0, 0.0])),
}


def setting(surface: str, seed: int) -> tuple[TriangleMesh, PatchShape, Root, SurfacePoints]:
    """A patch with an axis of one bend on an isometric surface, well away from boundary and seam."""
    mesh, centre, radius, _ = CLOSED[surface]
    rng = np.random.default_rng(seed)
    centres = mesh.points[mesh.faces].mean(axis=1)
    near = np.flatnonzero(np.linalg.norm(centres - centre, axis=1) <= radius)
    points = SurfacePoints(rng.choice(near, 30), rng.dirichlet(np.ones(3), 30))
    shape, root = shape_of(mesh, points, points[[3, 9, 17]], True)
    return mesh, shape, root, points


def rigid(
    before: FloatArray, turn: complex, pivot: FloatArray, goal: FloatArray, mirror: bool = False
) -> FloatArray:
    """(k, 2) turned (and mirrored first) about a pivot that goes to `goal`."""
    z = (before - pivot) @ np.array([1.0, 1j])
    z = (np.conj(z) if mirror else z) * turn + goal @ np.array([1.0, 1j])
    return np.column_stack([z.real, z.imag])


@pytest.mark.parametrize("surface", sorted(CLOSED))
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), angle=st.floats(-3.0, 3.0))
def test_rotation_is_rigid_where_the_surface_is_flat(surface: str, seed: int, angle: float) -> None:
    mesh, shape, root, points = setting(surface, seed)
    turned = reconstruct_patch(mesh, shape, root.heading_to(root.heading * np.exp(1j * angle)))
    pivot = flat_coordinates(mesh, root.point(), surface)[0]
    wanted = rigid(flat_coordinates(mesh, points, surface), np.exp(1j * angle), pivot, pivot)
    ok = ~turned.ran_off
    assert ok.any()
    error = flat_coordinates(mesh, turned.points, surface)[ok] - wanted[ok]
    assert np.abs(error).max() <= 1e-9


@pytest.mark.parametrize("surface", sorted(CLOSED))
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), target=st.integers(0, 29))
def test_translation_is_rigid_where_the_surface_is_flat(surface: str, seed: int, target: int) -> None:
    mesh, shape, root, points = setting(surface, seed)
    moved = reconstruct_patch(mesh, shape, transported(mesh, root, points[target]))
    flat = flat_coordinates(mesh, points, surface)
    wanted = rigid(flat, 1.0, flat_coordinates(mesh, root.point(), surface)[0], flat[target])
    ok = ~moved.ran_off
    assert ok.any()
    error = flat_coordinates(mesh, moved.points, surface)[ok] - wanted[ok]
    assert np.abs(error).max() <= 1e-9


@pytest.mark.parametrize("surface", sorted(CLOSED))
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), angle=st.floats(-1.0, 1.0), where=st.floats(0.0, 1.0))
def test_a_bend_turns_the_part_behind_it_and_nothing_else(
    surface: str, seed: int, angle: float, where: float
) -> None:
    mesh, shape, root, points = setting(surface, seed)
    inner = len(shape.axis.turning_angles)
    point = 1 + round(where * (inner - 1))
    bent = shape.with_axis(shape.axis.bent(point, float(shape.axis.turning_angles[point - 1]) + angle))
    result = reconstruct_patch(mesh, bent, root)
    flat = flat_coordinates(mesh, points, surface)
    axis = reconstruct_axis(mesh, shape.axis, root)
    pivot = flat_coordinates(mesh, axis.points[point], surface)[0]
    behind = shape.coordinates.anchors >= point
    wanted = np.where(behind[:, None], rigid(flat, np.exp(1j * angle), pivot, pivot), flat)
    ok = ~result.ran_off
    error = flat_coordinates(mesh, result.points, surface)[ok] - wanted[ok]
    assert np.abs(error).max() <= 1e-9


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), angle=st.floats(-3.0, 3.0), unit=st.sampled_from([1.0, 0.5, 2.0]))
def test_transfer_from_plane_to_cylinder_is_the_mirror_image(seed: int, angle: float, unit: float) -> None:
    """Between surfaces that unroll into the plane a transfer is exactly a reflection, in the target's units."""
    mesh, shape, root, points = setting("plane", seed)
    cylinder, centre, _, arc = CLOSED["cylinder"]
    near = int(np.argmin(np.linalg.norm(cylinder.points[cylinder.faces].mean(axis=1) - centre, axis=1)))
    point = SurfacePoints([near], [[0.3, 0.3, 0.4]])
    face_arc = arc - arc @ cylinder.face_normals[near] * cylinder.face_normals[near]
    along_arc = complex(direction_to_heading(cylinder, point, face_arc[None])[0])
    goal = Root.at(point, along_arc * np.exp(1j * angle))
    placed = reconstruct_patch(cylinder, shape, goal, shape.axis.transformed(mirrored=True, unit=unit))
    flat = flat_coordinates(mesh, points, "plane")
    axis = reconstruct_axis(mesh, shape.axis, root)
    ahead = flat_coordinates(mesh, axis.points[:2], "plane")
    start = (ahead[1] - ahead[0]) @ np.array([1.0, 1j])
    turn = np.exp(1j * angle) * start / abs(start)  # conj(z) turns by the angle of the axis itself
    wanted = rigid(unit * flat, turn, unit * ahead[0], unrolled(cylinder, point)[0], mirror=True)
    ok = ~placed.ran_off
    assert ok.any()
    assert np.abs(unrolled(cylinder, placed.points)[ok] - wanted[ok]).max() <= 1e-9


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), along=st.floats(0.5, 1.5), spread=st.floats(0.5, 1.5))
def test_along_and_spread_stretch_a_straight_patch_exactly(seed: int, along: float, spread: float) -> None:
    mesh, _, _, points = setting("plane", seed)
    shape, root = shape_of(mesh, points, points[[3, 17]], True)
    scaled = shape.with_axis(replace(shape.axis, along=along, spread=spread))
    result = reconstruct_patch(mesh, scaled, root)
    flat = flat_coordinates(mesh, points, "plane")
    start, end = flat[3], flat[17]
    direction = (end - start) @ np.array([1.0, 1j])
    direction /= abs(direction)
    z = ((flat - start) @ np.array([1.0, 1j])) / direction
    z = (z.real * along + 1j * z.imag * spread) * direction + start @ np.array([1.0, 1j])
    ok = ~result.ran_off
    error = flat_coordinates(mesh, result.points, "plane")[ok] - np.column_stack([z.real, z.imag])[ok]
    assert np.abs(error).max() <= 1e-9


def sphere_error(subdivisions: int, edit: str) -> float:
    """How far an edit on a polyhedral sphere is from the same edit on the round one (radius 1)."""
    mesh = meshes.icosphere(subdivisions)

    def at(*direction: float) -> SurfacePoints:
        d = np.array(direction) / np.linalg.norm(direction)
        return Locator(mesh).cast(np.zeros((1, 3)), d[None]).points

    start, north = np.array([1.0, 0.2, 0.1]), np.array([0.3, -0.1, 1.0])
    start, north = start / np.linalg.norm(start), north / np.linalg.norm(north)
    points = SurfacePoints.concatenate([at(1.0, 0.2 + a, 0.1 + b) for a in (0.05, 0.2) for b in (-0.1, 0.12)])
    shape, root = shape_of(mesh, points, SurfacePoints.concatenate([at(*start), at(1.0, 0.35, 0.2)]), True)
    before = points.positions(mesh) / np.linalg.norm(points.positions(mesh), axis=1, keepdims=True)
    if edit == "rotate":
        angle = 0.8
        after = reconstruct_patch(mesh, shape, root.heading_to(root.heading * np.exp(1j * angle)))
        wanted = before @ rotation(start, angle).T
    else:
        goal = np.array([0.7, 0.7, 0.3]) / np.linalg.norm([0.7, 0.7, 0.3])
        after = reconstruct_patch(mesh, shape, transported(mesh, root, at(*goal)))
        axis = np.cross(start, goal)
        angle = float(np.arctan2(np.linalg.norm(axis), start @ goal))
        wanted = before @ rotation(axis / np.linalg.norm(axis), angle).T
    there = after.points.positions(mesh)
    there = there / np.linalg.norm(there, axis=1, keepdims=True)
    return float(np.linalg.norm(there - wanted, axis=1).max())


def rotation(axis: FloatArray, angle: float) -> FloatArray:
    """(3, 3) Rodrigues."""
    k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


@pytest.mark.parametrize("edit", ["rotate", "translate"])
def test_edits_converge_on_refined_spheres(edit: str) -> None:
    """The error against the round sphere falls at first order of the edge length at least, over three halvings."""
    errors = [sphere_error(level, edit) for level in (2, 3, 4, 5)]
    order = np.log2(errors[0] / errors[-1]) / 3.0
    assert order >= 1.0, f"errors {errors}, order {order:.2f}"


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_points_bound_by_hand_are_where_they_were(seed: int) -> None:
    """Any anchors give the same points; the closest are only the default."""
    mesh = cached_family("noisy")
    points = region(mesh, seed, 20)
    shape, axis = draw_axis(mesh, points[[0, 5]])
    rng = np.random.default_rng(seed)
    anchors = rng.integers(-1, len(axis), len(points))
    coordinates = parameterize_patch(mesh, axis, points, anchors=anchors)
    chosen = anchors >= 0
    assert np.array_equal(coordinates.anchors[chosen], anchors[chosen])
    again = points_from_axis(mesh, coordinates, axis, shape)
    assert off(mesh, again.points, points) <= 1e-9


def test_what_runs_off_is_reported_and_not_dropped() -> None:
    mesh, shape, root, points = setting("plane", 3)
    corner = Root(0, (1.0, 0.0, 0.0), root.heading)
    result = reconstruct_patch(mesh, shape, corner)
    assert len(result.points) == len(points) and result.ran_off.any()
    flat = flat_coordinates(mesh, points, "plane")
    axis_end = np.abs(flat).max()
    assert 0.0 < result.remaining.max() < 3.0 * axis_end


def test_mistakes_are_answered_in_words() -> None:
    mesh = cached_family("plane")
    points = region(mesh, 0, 4)
    with pytest.raises(InvalidInput, match="at least one point"):
        draw_axis(mesh, points[[]])
    with pytest.raises(InvalidInput, match="needs a heading"):
        draw_axis(mesh, points[0])
    two = TriangleMesh(
        np.concatenate([mesh.points, mesh.points + np.array([3.0, 0.0, 0.0])]),
        np.concatenate([mesh.faces, mesh.faces + len(mesh.points)]),
    )
    apart = SurfacePoints([0, len(mesh.faces)], np.full((2, 3), 1 / 3))
    with pytest.raises(InvalidInput, match="not connected"):
        draw_axis(two, apart)
    _, axis = draw_axis(two, apart[0], 1j)
    with pytest.raises(InvalidInput, match=r"patch point 1 .*Split the patch"):
        parameterize_patch(two, axis, apart)
    with pytest.raises(InvalidInput, match="no path"):
        transported(two, axis.root(), apart[1])


@pytest.mark.parametrize("family", FAMILIES)
def test_the_papers_operations_by_name_agree_with_their_parts(family: str) -> None:
    """An axis taken apart is put together again (Algorithms 1 and 3); transfer (5) is a patch's mirror image."""
    mesh, target = cached_family(family), meshes.icosphere(3)
    points = region(mesh, 3)
    picks = points[-3:]
    shape, axis = draw_axis(mesh, picks, dense=False)
    whole = reconstruct_axis(mesh, parameterize_axis(mesh, picks), axis.root())
    away = whole.points.positions(mesh)[:, None] - picks.positions(mesh)  # (m, 3, 3): saddles may lie between
    bound = 1e-5 if family == "sliver" else 1e-9
    assert np.linalg.norm(away, axis=2).min(axis=0).max() <= bound * mesh.bounding_box_diagonal
    there = Root.at(SurfacePoints([5], [[0.2, 0.3, 0.5]]), 1.0 + 0j)
    patch = PatchShape(shape, parameterize_patch(mesh, axis, points), np.ones(len(points)))
    placed = transfer_patch(mesh, axis, shape, points, target, there)
    alone = reconstruct_patch(target, patch, there, shape.transformed(mirrored=True))
    assert off(target, placed.points, alone.points) <= 1e-12
