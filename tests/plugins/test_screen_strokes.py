"""Strokes drawn on the screen: brushes mark only where the pointer was, on surfaces as the artist sees them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from contact_builtins.brushes.curve import CurveBrush
from contact_builtins.brushes.disk import DiskBrush, Eraser
from contact_builtins.brushes.lasso import LassoBrush
from contact_builtins.brushes.vertices import VertexBrush
from contact_core.arrays import FloatArray
from contact_core.contact.brush import Brush, BrushGesture
from contact_core.contact.pointer import gestures_along, strokes
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, TriangleMesh, log_map
from contact_core.geometry.raycast import Locator
from contact_core.geometry.thinning import first_of_each
from contact_core.rig.rig import Rig, forward_kinematics, skin
from contact_core.rig.rotations import exponential
from contact_core.session import Session
from contact_core.testing import meshes, rigs
from contact_core.testing.brush_contract import drawn, same_up_to_order

SCALE = 100.0  # pixels per surface unit
ABOUT = 1.06  # the reference is thinned, and its rays end a little before a silhouette
NOWHERE = SurfacePoints.concatenate([])


def looking(direction: FloatArray, far: float) -> tuple[FloatArray, object]:
    """An orthographic view along a direction (3,): (3, 2) what projects to pixels, and the callable of rays."""
    ahead = direction / np.linalg.norm(direction)
    side = np.cross(ahead, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(ahead, side)], axis=-1)  # (3, 2)

    def rays(screen: FloatArray) -> tuple[FloatArray, FloatArray]:
        return screen / SCALE @ axes.T - far * ahead, np.tile(ahead, (len(screen), 1))

    return SCALE * axes, rays


def across(mesh: TriangleMesh, seed: int, radius: float, *, seen: TriangleMesh | None = None) -> BrushGesture:
    """Six reported positions of a pointer, from one side of a surface to the other, past whatever is between."""
    random = np.random.default_rng(seed)
    surface = seen or mesh
    size = surface.bounding_box_diagonal
    axes, rays = looking(random.normal(size=3), 2.0 * size + np.abs(surface.points).max())
    flat = surface.points @ axes
    low, high = flat.min(axis=0), flat.max(axis=0)
    share = np.stack([np.linspace(-0.05, 1.05, 6), random.uniform(0.3, 0.7, 6)], axis=-1)
    screen = low + share * (high - low)
    return BrushGesture(
        mesh, NOWHERE, radius=radius, spacing=radius / 3.0, screen=screen, rays=rays, seed=seed, seen=seen
    )  # fmt: skip


def passed(gesture: BrushGesture, samples: int = 200_000) -> SurfacePoints:
    """Where the pointer was, by plain dense rays along the line on the screen, independent of the code here.

    So many, because at a silhouette the surface runs along the rays; then thinned to a fiftieth of the radius.
    """
    at = np.linspace(0.0, len(gesture.screen) - 1.0, samples)
    number = np.arange(len(gesture.screen))
    places = np.stack([np.interp(at, number, gesture.screen[:, axis]) for axis in (0, 1)], -1)
    hits = Locator.of(gesture.seen or gesture.mesh).cast(*gesture.rays(places))
    points = hits.points[hits.found]
    return points[first_of_each(points.positions(gesture.mesh), 0.02 * gesture.radius)]


def share_beyond(gesture: BrushGesture, points: SurfacePoints, reach: float) -> float:
    """The share of points farther than `reach`, over the surface, from where the pointer was."""
    return float((log_map(gesture.mesh, passed(gesture), points).distance > reach).mean())


SURFACES = {"torus": meshes.torus, "bumps": lambda: meshes.noisy(3, 0.1), "hand": lambda: rigs.hand_like().surface}


@pytest.mark.parametrize("brush", [DiskBrush(), Eraser(), VertexBrush()], ids=lambda brush: brush.name)
@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("seed", range(2))
def test_no_point_where_the_pointer_never_was(brush: Brush, name: str, seed: int) -> None:
    """Every mark lies within the radius, over the surface, of what the pointer passed over."""
    mesh = SURFACES[name]()
    gesture = across(mesh, seed, 0.05 * mesh.bounding_box_diagonal)
    marked = brush.mark(gesture).points
    assert share_beyond(gesture, marked, ABOUT * gesture.radius) == 0.0
    assert len(marked) > 10


def test_a_stroke_through_space_goes_where_the_pointer_never_was() -> None:
    """The law above can fail: the reported points alone, joined through space, mark what nobody saw."""
    mesh = rigs.hand_like().surface
    gesture = across(mesh, 1, 0.05 * mesh.bounding_box_diagonal)
    hits = Locator.of(mesh).cast(*gesture.rays(gesture.screen))
    corners = hits.points[hits.found]
    joined = replace(gesture, path=corners)
    assert share_beyond(gesture, DiskBrush().mark(joined).points, ABOUT * gesture.radius) > 0.05


@pytest.mark.parametrize("name", SURFACES)
def test_the_disk_covers_all_that_the_pointer_passed_over(name: str) -> None:
    mesh = SURFACES[name]()
    gesture = across(mesh, 2, 0.05 * mesh.bounding_box_diagonal)
    marked = DiskBrush().mark(gesture).points
    gap = log_map(mesh, marked, passed(gesture)).distance
    assert gap.max() <= 2.0 * gesture.spacing


@pytest.mark.parametrize("name", SURFACES)
def test_cut_gestures_do_for_any_brush_what_the_brushes_do_alone(name: str) -> None:
    """A brush that knows only paths marks nothing else; parts are dense, and none jumps."""
    mesh = SURFACES[name]()
    gesture = across(mesh, 0, 0.05 * mesh.bounding_box_diagonal)
    parts = gestures_along(gesture, 0.25 * gesture.radius)
    assert len(parts) > 1
    for part in parts:
        at = part.path.positions(mesh)
        assert (np.linalg.norm(np.diff(at, axis=0), axis=1) <= 0.25 * gesture.radius).all()
        marked = DiskBrush().mark(replace(part, screen=None, rays=None)).points
        assert share_beyond(gesture, marked, ABOUT * gesture.radius) == 0.0
        hits = Locator.of(mesh).cast(*part.rays(part.screen[[0, -1]]))
        ends = hits.points[hits.found].positions(mesh)
        np.testing.assert_allclose(ends, at[[0, -1]], atol=1e-6 * mesh.bounding_box_diagonal)


def test_parts_are_one_step_of_a_session() -> None:
    mesh = meshes.torus()
    parts = gestures_along(across(mesh, 3, 0.12), 0.03)
    with Session() as session:
        session.surfaces.add("ring", mesh)
        revision = session.revision
        session.patches.brush("disk", "pad", *parts, surface="ring", generator="principal")
        assert session.revision == revision + 1


def posed_hand(rig: Rig, seed: int) -> TriangleMesh:
    """The skin with every joint turned by half a radian or so."""
    local = rig.rest_local.copy()
    turns = exponential(np.random.default_rng(seed).normal(0.0, 0.3, (len(local), 3)))[0]
    local[:, :3, :3] = local[:, :3, :3] @ turns
    return rig.surface.with_points(skin(rig, forward_kinematics(rig.parents, local)))


@pytest.mark.parametrize("seed", range(3))
def test_a_curve_on_a_posed_hand_lands_where_the_artist_sees_it(seed: int) -> None:
    """Within an edge length of the line on the screen, and in the open; rays at the rest mesh miss it by far."""
    rig = rigs.hand_like()
    seen = posed_hand(rig, seed)
    gesture = replace(across(rig.surface, seed, 1.0, seen=seen), spacing=0.4)
    straight = gesture.screen[[0, -1]]  # a straight spline: its projection is a line
    gesture = replace(gesture, screen=straight)
    edge = np.linalg.norm(np.diff(seen.points[seen.faces[:, :2]], axis=1), axis=2).mean()

    def off(points: SurfacePoints) -> FloatArray:
        """(n,) the distance in space of points as seen from the nearest point that the pointer passed over."""
        at, line = points.positions(seen), passed(gesture).positions(seen)
        return np.linalg.norm(at[:, None] - line[None], axis=2).min(axis=1)

    drawn_now = off(CurveBrush().mark(gesture).points)
    assert len(drawn_now) > 10 and drawn_now.max() < edge
    at_rest = replace(gesture, seen=None)
    with suppress(InvalidInput):  # the line may not even meet the hand at rest
        assert off(CurveBrush().mark(at_rest).points).max() > 2.0 * edge


@pytest.mark.parametrize("seed", range(3))
def test_the_disk_on_a_posed_hand_stays_where_the_pointer_was(seed: int) -> None:
    rig = rigs.hand_like()
    gesture = across(rig.surface, seed, 0.9, seen=posed_hand(rig, seed))
    assert share_beyond(gesture, DiskBrush().mark(gesture).points, ABOUT * gesture.radius) == 0.0


def test_what_stands_before_hides_the_surface() -> None:
    """A blind over the right half: nothing is drawn there, and the stroke is cut."""
    sheet = meshes.plane(16, 2.0)
    blind = TriangleMesh([[1.0, -1, 0.5], [3, -1, 0.5], [3, 3, 0.5], [1.0, 3, 0.5]], [[0, 1, 2], [0, 2, 3]])
    circle = replace(drawn(sheet, np.array([1.0, 1.0])), path=NOWHERE, before=(blind,))
    at = CurveBrush().mark(circle).points.positions(sheet)
    assert len(at) > 10 and at[:, 0].max() <= 1.0 + 1e-9
    assert len(strokes(replace(circle, before=()), 0.05, closed=True)) == 1
    assert all(run.points.positions(sheet)[:, 0].max() <= 1.0 + 1e-9 for run in strokes(circle, 0.05, closed=True))


def test_a_lasso_on_the_screen_fills_what_it_fills_on_the_surface() -> None:
    circle = drawn(meshes.saddle(16), np.zeros(2))
    by_path = LassoBrush().mark(replace(circle, screen=None, rays=None)).points.positions(circle.mesh)
    on_screen = LassoBrush().mark(replace(circle, path=NOWHERE)).points.positions(circle.mesh)
    assert len(on_screen) == pytest.approx(len(by_path), rel=0.1)
    assert np.linalg.norm(on_screen[:, :2], axis=1).max() <= 0.4 + 1e-6


def test_a_moved_view_of_a_moved_pose_marks_the_same_points() -> None:
    """Pose, view and rays turned together: the artist sees the same, and the marks are the same."""
    gesture = across(meshes.torus(), 5, 0.15)
    turn = exponential(np.array([[0.4, -1.1, 0.3]]))[0][0]
    moved = replace(
        gesture,
        seen=gesture.mesh.with_points(gesture.mesh.points @ turn.T + 3.0),
        rays=lambda screen: (gesture.rays(screen)[0] @ turn.T + 3.0, gesture.rays(screen)[1] @ turn.T),
    )
    here, there = (CurveBrush().mark(each).points.positions(gesture.mesh) for each in (gesture, moved))
    assert same_up_to_order(here, there, 1e-6)


def test_what_cannot_be_seen_is_said() -> None:
    mesh = meshes.torus()
    gesture = across(mesh, 0, 0.1)
    with pytest.raises(InvalidInput, match=r"mesh\.with_points"):
        replace(gesture, seen=meshes.icosphere(1))
    with pytest.raises(InvalidInput, match="but got none"):
        DiskBrush().mark(replace(gesture, screen=gesture.screen + 1e5))
    with pytest.raises(InvalidInput, match="rays"):
        strokes(replace(gesture, rays=None), 0.1)
