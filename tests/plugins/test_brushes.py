"""Every built-in brush keeps the contract; and the laws that are its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_builtins.brushes.curve import CurveBrush
from contact_builtins.brushes.disk import DiskBrush, Eraser
from contact_builtins.brushes.lasso import LassoBrush
from contact_builtins.brushes.vertices import SelectionBrush, VertexBrush
from contact_core.contact.brush import Brush, BrushGesture
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints, log_map
from contact_core.geometry.raycast import Locator
from contact_core.testing import meshes
from contact_core.testing.brush_contract import BrushContract, drawn, gesture


class TestDisk(BrushContract):
    @pytest.fixture
    def brush(self) -> Brush:
        return DiskBrush()


class TestEraser(BrushContract):
    @pytest.fixture
    def brush(self) -> Brush:
        return Eraser()


class TestVertices(BrushContract):
    cannot = {"spacing": "it takes the vertices that the mesh has"}

    @pytest.fixture
    def brush(self) -> Brush:
        return VertexBrush()


class TestSelection(BrushContract):
    cannot = {
        "radius": "the host's selection is taken as it is",
        "spacing": "the host's selection is taken as it is",
    }

    @pytest.fixture
    def brush(self) -> Brush:
        return SelectionBrush()


class TestCurve(BrushContract):
    cannot = {"radius": "a curve has no width"}

    @pytest.fixture
    def brush(self) -> Brush:
        return CurveBrush()


class TestLasso(BrushContract):
    cannot = {"radius": "it fills a closed curve"}

    @pytest.fixture
    def brush(self) -> Brush:
        return LassoBrush()


@pytest.mark.parametrize("falloff", ["linear", "smooth"])
def test_strength_falls_off_with_the_distance_over_the_surface(falloff: str) -> None:
    stroke = replace(gesture("saddle"), path=gesture("saddle").path[0])
    mark = DiskBrush(falloff=falloff).mark(stroke)  # type: ignore[arg-type]
    distance = log_map(stroke.mesh, stroke.path, mark.points).distance
    order = np.argsort(distance)
    assert (np.diff(mark.strength[order]) <= 1e-9).all()
    assert mark.strength[order[0]] == pytest.approx(1.0) and mark.strength[order[-1]] < 0.2


def test_an_unknown_falloff_lists_those_that_there_are() -> None:
    with pytest.raises(InvalidInput, match="none, linear, smooth, but got 'cubic'"):
        DiskBrush(falloff="cubic")  # type: ignore[arg-type]


def test_a_disk_in_one_huge_face_gets_as_many_points_as_anywhere() -> None:
    coarse = meshes.plane(1, 100.0)
    path = Locator.of(coarse).closest([[30.0, 20.0, 0.0]]).points
    mark = DiskBrush().mark(BrushGesture(coarse, path, radius=0.5, spacing=0.1))
    square = 0.1**2 * np.sqrt(3.0) / 2.0
    assert 0.5 < len(mark.points) * square / (np.pi * 0.25) < 1.0  # of the densest packing


def test_a_spacing_without_sense_is_refused_before_memory_is() -> None:
    with pytest.raises(InvalidInput, match="use a larger spacing"):
        DiskBrush().mark(replace(gesture("flat"), spacing=1e-6))


def test_vertices_are_all_and_only_those_in_reach() -> None:
    stroke = gesture("saddle")
    line = replace(stroke, path=stroke.path[[3]])
    mark = VertexBrush().mark(line)
    vertices = SurfacePoints.at_vertices(stroke.mesh, np.arange(len(stroke.mesh.points)))
    within = log_map(stroke.mesh, line.path, vertices).distance <= stroke.radius
    assert len(mark.points) == within.sum()
    assert mark.points.barycentric.max(axis=1) == pytest.approx(1.0)


def test_no_vertex_in_reach_names_the_cure() -> None:
    stroke = drawn(meshes.plane(1, 4.0), np.array([2.0, 2.0]))
    with pytest.raises(InvalidInput, match="take the disk brush"):
        VertexBrush().mark(replace(stroke, radius=0.05))


def test_the_selection_is_taken_as_it_is() -> None:
    sheet = meshes.saddle(10)
    chosen = SurfacePoints.at_vertices(sheet, [5, 17, 60, 17])
    mark = SelectionBrush().mark(BrushGesture(sheet, chosen))
    assert mark.points.positions(sheet).tolist() == sheet.points[[5, 17, 60]].tolist()


def test_the_curve_passes_its_control_points_in_equal_steps() -> None:
    sheet = meshes.saddle(20)
    stroke = replace(drawn(sheet, np.array([0.0, 0.0])), spacing=0.02)
    at = CurveBrush().mark(stroke).points.positions(sheet)
    assert stroke.screen is not None
    gaps = np.linalg.norm(at[None, :, :2] - stroke.screen[:, None], axis=-1).min(axis=1)
    assert gaps.max() <= 0.011, gaps
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    assert steps[1:].max() == pytest.approx(0.02, rel=0.02) and steps.min() == pytest.approx(0.02, rel=0.02)


def test_the_curve_is_cut_where_it_leaves_the_surface_or_jumps_over_a_silhouette() -> None:
    """Two plates, one above the other: the curve runs from the upper to the lower and off the edge."""
    lower = meshes.plane(8, 2.0)
    upper = meshes.plane(4, 1.0)
    both = meshes.TriangleMesh(
        np.concatenate([lower.points, upper.points + np.array([0.0, 0.0, 0.5])]),
        np.concatenate([lower.faces, upper.faces + len(lower.points)]),
    )
    stroke = drawn(both, np.array([1.0, 1.0]))
    line = np.stack([np.linspace(0.5, 2.6, 6), np.full(6, 0.5)], -1)
    at = CurveBrush().mark(replace(stroke, screen=line, spacing=0.05)).points.positions(both)
    assert set(np.round(at[:, 2], 9)) == {0.0, 0.5}  # nothing in mid-air between the plates
    assert at[at[:, 2] > 0.25, 0].max() <= 1.0 and at[:, 0].max() <= 2.0
    assert at[at[:, 2] > 0.25, 0].max() > 0.9 and at[:, 0].max() > 1.9


def test_several_strokes_of_a_curve_are_not_joined() -> None:
    sheet = meshes.plane(8, 2.0)
    stroke = drawn(sheet, np.array([1.0, 1.0]))
    lines = np.array([[0.2, 0.2], [0.8, 0.2], [1.2, 1.8], [1.8, 1.8]])
    at = CurveBrush(starts=(2,)).mark(replace(stroke, screen=lines)).points.positions(sheet)
    assert set(np.round(at[:, 1], 9)) == {0.2, 1.8}


def test_without_a_screen_the_curve_follows_the_path() -> None:
    stroke = replace(gesture("saddle"), screen=None, rays=None)
    at = CurveBrush().mark(stroke).points.positions(stroke.mesh)
    assert len(at) > 2.0 * np.pi * 0.4 / 0.04 * 0.8
    assert np.abs(np.linalg.norm(at[:, :2], axis=1) - 0.4).max() < 0.02


@pytest.mark.parametrize("backwards", [False, True])
def test_the_lasso_fills_its_inside_and_nothing_else(backwards: bool) -> None:
    stroke = gesture("flat")
    path = stroke.path[::-1] if backwards else stroke.path
    at = LassoBrush().mark(replace(stroke, path=path)).points.positions(stroke.mesh)[:, :2] - 1.0
    assert np.linalg.norm(at, axis=1).max() <= 0.4 + 1e-9
    square = 0.04**2 * np.sqrt(3.0) / 2.0
    assert 0.5 < len(at) * square / (np.pi * 0.16) < 1.0


def test_the_lasso_follows_a_concave_curve() -> None:
    """A horseshoe: its mouth stays empty."""
    outer = [(0.4, 0.4), (1.6, 0.4), (1.6, 1.6), (1.2, 1.6), (1.2, 0.8), (0.8, 0.8), (0.8, 1.6), (0.4, 1.6)]
    sheet = meshes.plane(16, 2.0)
    stroke = drawn(sheet, np.array([1.0, 1.0]))
    path = Locator.of(sheet).closest([(*corner, 0.0) for corner in outer]).points
    at = LassoBrush().mark(replace(stroke, path=path)).points.positions(sheet)
    assert (at[:, :2].min(axis=0) > 0.39).all() and (at[:, :2].max(axis=0) < 1.61).all()
    mouth = (at[:, 0] > 0.81) & (at[:, 0] < 1.19) & (at[:, 1] > 0.81)
    assert not mouth.any()
    for arm in (0.6, 1.4):
        assert (np.abs(at[:, 0] - arm) < 0.2).sum() > 100


def test_a_lasso_round_a_finger_takes_the_tip() -> None:
    """No plane is needed: a ring round a long egg fills the end that it turns towards."""
    egg = meshes.icosphere(3).with_points(meshes.icosphere(3).points * [0.4, 0.4, 1.6])
    angle = 2.0 * np.pi * np.arange(30) / 30
    ring = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(30, 1.06)], -1)
    path = Locator.of(egg).closest(ring).points
    at = LassoBrush().mark(BrushGesture(egg, path, spacing=0.06)).points.positions(egg)
    assert at[:, 2].min() > 0.95 and at[:, 2].max() > 1.55


def test_a_lasso_of_two_points_is_refused() -> None:
    stroke = gesture("flat")
    with pytest.raises(InvalidInput, match="three points or more, but got 2"):
        LassoBrush().mark(replace(stroke, path=stroke.path[:2]))
