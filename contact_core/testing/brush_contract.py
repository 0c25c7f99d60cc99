"""The contract of brushes. Subclass it and give the fixture `brush`.

Every gesture comes with a path, a radius, a spacing, screen positions and rays, so that each kind of brush finds
what it works from: the same closed or open line, once over the surface and once as seen from above.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from contact_core.arrays import FloatArray
from contact_core.contact.brush import Brush, BrushGesture, BrushMark
from contact_core.errors import InvalidInput
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

GESTURES = ("flat", "saddle", "ridge")


def gesture(name: str) -> BrushGesture:
    """A round stroke, drawn from above, on a sheet: flat, saddle-shaped or with a ridge."""
    sheet = {"flat": meshes.plane(16, 2.0), "saddle": meshes.saddle(16), "ridge": meshes.creased(16)}[name]
    middle = 0.5 * (sheet.points.min(axis=0) + sheet.points.max(axis=0))[:2]
    return drawn(sheet, middle, seed=4)


def drawn(mesh: TriangleMesh, middle: FloatArray, *, seed: int = 0) -> BrushGesture:
    """A circle of radius 0.4 round `middle` as seen along -z, with rays that look down from above everything."""
    angle = 2.0 * np.pi * np.arange(24) / 24
    screen = middle + 0.4 * np.stack([np.cos(angle), np.sin(angle)], -1)  # (24, 2)
    top = float(mesh.points[:, 2].max()) + 1.0

    def rays(positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        origins = np.concatenate([positions, np.full((len(positions), 1), top)], axis=1)
        return origins, np.tile([0.0, 0.0, -1.0], (len(positions), 1))

    hits = Locator.of(mesh).cast(*rays(screen))
    path = hits.points[hits.found]
    return BrushGesture(mesh, path, radius=0.15, spacing=0.04, screen=screen, rays=rays, seed=seed)


def same_up_to_order(first: FloatArray, second: FloatArray, tolerance: float) -> bool:
    """Whether two sets of positions (n, 3) are the same set."""
    return len(first) == len(second) and (
        len(first) == 0 or float(cKDTree(first).query(second)[0].max()) <= tolerance
    )


class BrushContract(Contract):
    """Fixture: `brush`, a Brush."""

    about, letter = "brush", "B"

    def test_b01_is_named(self, brush: Brush) -> None:
        """Has a name, says in a sentence what it does, and says whether it erases."""
        assert brush.name == brush.name.strip() != ""
        assert len(brush.summary.split()) >= 3, brush.summary
        assert brush.erases in (True, False)

    @pytest.mark.parametrize("name", GESTURES)
    def test_b02_marks_points_of_the_mesh(self, brush: Brush, name: str) -> None:
        """Leaves at least one point; each is a point of the mesh, with a strength from 0 to 1."""
        stroke = gesture(name)
        mark = brush.mark(stroke)
        assert isinstance(mark, BrushMark) and len(mark.points) > 0
        assert ((mark.points.faces >= 0) & (mark.points.faces < len(stroke.mesh.faces))).all()
        assert mark.strength.shape == (len(mark.points),)
        assert mark.strength.max() > 0.0

    @pytest.mark.parametrize("name", GESTURES)
    def test_b03_marks_no_point_twice(self, brush: Brush, name: str) -> None:
        """No two points lie in the same place."""
        stroke = gesture(name)
        positions = brush.mark(stroke).points.positions(stroke.mesh)
        twice = cKDTree(positions).query_pairs(1e-9 * stroke.mesh.bounding_box_diagonal)
        assert not twice, sorted(twice)[:5]

    def test_b04_is_deterministic(self, brush: Brush) -> None:
        """Equal gestures, seed included, give equal marks, to the bit."""
        first, second = brush.mark(gesture("saddle")), brush.mark(gesture("saddle"))
        assert first.points.same_as(second.points)
        assert np.array_equal(first.strength, second.strength)

    def test_b05_leaves_its_input_alone(self, brush: Brush) -> None:
        """Mesh and path are the same bits afterwards."""
        stroke = gesture("ridge")
        arrays = (stroke.mesh.points, stroke.mesh.faces, stroke.path.faces, stroke.path.barycentric)
        before = [array.tobytes() for array in arrays]
        brush.mark(stroke)
        assert before == [array.tobytes() for array in arrays]

    def test_b06_bears_an_empty_stroke(self, brush: Brush) -> None:
        """A stroke that touched nothing leaves an empty mark or raises InvalidInput with a sentence."""
        stroke = gesture("flat")
        empty = replace(stroke, path=stroke.path[[]], screen=None, rays=None)
        try:
            assert len(brush.mark(empty).points) == 0
        except InvalidInput as error:
            assert len(str(error).split()) >= 4, str(error)

    @needs("rigid_motion")
    def test_b07_moves_with_the_mesh(self, brush: Brush) -> None:
        """A stroke over a mesh that was moved marks the moved points."""
        stroke = gesture("ridge")
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        shift = np.array([3.0, -2.0, 0.5])
        other = replace(stroke, mesh=stroke.mesh.with_points(stroke.mesh.points @ turn.T + shift))
        if stroke.screen is not None and stroke.rays is not None:
            rays = stroke.rays
            other = replace(other, rays=lambda at: (rays(at)[0] @ turn.T + shift, rays(at)[1] @ turn.T))
        here = brush.mark(stroke).points.positions(stroke.mesh)
        there = brush.mark(other).points.positions(stroke.mesh)
        assert same_up_to_order(here, there, 1e-6), (len(here), len(there))

    @needs("radius")
    @pytest.mark.parametrize("name", GESTURES)
    def test_b08_stays_within_the_radius(self, brush: Brush, name: str) -> None:
        """No point is farther from the stroke than the radius, measured over the surface."""
        stroke = gesture(name)
        mark = brush.mark(stroke)
        fine = replace(stroke, path=_dense(stroke))
        distance = log_map(stroke.mesh, fine.path, mark.points).distance
        assert distance.max() <= 1.02 * stroke.radius, distance.max()  # 2%: the stroke is sampled here

    @needs("radius")
    def test_b09_never_bleeds(self, brush: Brush) -> None:
        """Nothing is marked on a sheet that lies closer than the radius in space but far away over the surface."""
        sheet = meshes.plane(16, 2.0)
        stroke = drawn(sheet, np.array([1.0, 1.0]))
        below = sheet.points - [0.0, 0.0, 0.3 * stroke.radius]
        both = TriangleMesh(
            np.concatenate([sheet.points, below]), np.concatenate([sheet.faces, sheet.faces + len(below)])
        )
        faces = brush.mark(replace(stroke, mesh=both)).points.faces
        assert (faces < len(sheet.faces)).all(), int((faces >= len(sheet.faces)).sum())

    @needs("radius", "spacing")
    def test_b10_covers_the_stroke(self, brush: Brush) -> None:
        """Every place within nine tenths of the radius has a marked point within twice the spacing."""
        stroke = gesture("saddle")
        random = np.random.default_rng(1)
        places = SurfacePoints(random.integers(0, len(stroke.mesh.faces), 4000), random.dirichlet(np.ones(3), 4000))
        distance = log_map(stroke.mesh, _dense(stroke), places, max_distance=stroke.radius).distance
        covered = places[distance < 0.9 * stroke.radius].positions(stroke.mesh)
        marked = brush.mark(stroke).points.positions(stroke.mesh)
        gap = cKDTree(marked).query(covered)[0]
        assert gap.max() <= 2.0 * stroke.spacing, gap.max()

    @needs("spacing")
    @pytest.mark.parametrize("name", GESTURES)
    def test_b11_keeps_the_spacing(self, brush: Brush, name: str) -> None:
        """No two points are closer than half the spacing."""
        stroke = gesture(name)
        positions = brush.mark(stroke).points.positions(stroke.mesh)
        gap = cKDTree(positions).query(positions, k=2)[0][:, 1]
        assert gap.min() >= 0.5 * stroke.spacing, gap.min()

    @needs("spacing")
    def test_b12_works_alike_on_coarse_and_dense(self, brush: Brush) -> None:
        """The same surface with sixteen times the faces gets the same number of points within a quarter."""
        coarse = meshes.plane(6, 2.0)
        dense = meshes.subdivided(meshes.subdivided(coarse))
        few = len(brush.mark(drawn(coarse, np.array([1.0, 1.0]))).points)
        many = len(brush.mark(drawn(dense, np.array([1.0, 1.0]))).points)
        assert 0.75 <= many / few <= 1.34, (few, many)

    def test_b13_declares_its_settings(self, brush: Brush) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(brush)


def _dense(stroke: BrushGesture) -> SurfacePoints:
    """The stroke's closed or open line, sampled finely on the surface, its own points among them."""
    at = stroke.path.positions(stroke.mesh)
    steps = np.linspace(0.0, 1.0, 12, endpoint=False)[None, :, None]
    between = (at[:, None] + steps * (np.roll(at, -1, axis=0) - at)[:, None]).reshape(-1, 3)
    return Locator.of(stroke.mesh).closest(between).points
