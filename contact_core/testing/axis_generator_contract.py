"""The contract of axis generators. Subclass it and give the fixture `generator`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.contact.axis_generator import AxisGenerator, AxisRequest
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes
from contact_core.testing.contract import Contract, needs
from contact_core.testing.settings_checks import check_settings

PATCHES = ("strip", "disk", "bent", "rough")


def patch(name: str) -> AxisRequest:
    """A patch without ties and a bone through it, on a plane, a saddle, a tube or a rough sphere."""
    mesh, centre, reach = {
        "strip": (meshes.plane(14), (0.5, 0.5, 0.0), (0.42, 0.11, 1.0)),
        "disk": (meshes.saddle(14), (0.1, -0.05, 0.0), (0.5, 0.45, 1.0)),
        "bent": (meshes.cylinder(24, 14), (0.5, 0.0, 1.0), (0.5, 0.3, 0.6)),
        "rough": (meshes.noisy(3, 0.02), (0.0, 0.0, 1.0), (0.5, 0.3, 0.6)),
    }[name]
    return scattered(mesh, np.array(centre), np.array(reach), seed=len(name))


def scattered(
    mesh: TriangleMesh, centre: FloatArray, reach: FloatArray, *, seed: int, count: int = 70
) -> AxisRequest:
    """`count` random points in the faces whose centres lie in an ellipsoid; the bone runs along its longer side."""
    offset = (mesh.points[mesh.faces].mean(axis=1) - centre) / reach  # (m, 3)
    near = np.flatnonzero((offset**2).sum(axis=1) < 1.0)
    random = np.random.default_rng(seed)
    points = SurfacePoints(random.choice(near, count), random.dirichlet(np.ones(3), count))
    side = np.zeros(3)
    side[int(np.argmax(reach[:2]))] = float(reach[:2].max())
    bones = np.array([[centre - side, centre + side]])  # (1, 2, 3)
    return AxisRequest(mesh, points, bones=bones, bone_of_point=np.zeros(count, np.int64))


def moved(request: AxisRequest, rotation: FloatArray, scale: float, shift: FloatArray) -> AxisRequest:
    """The same patch after x -> scale * rotation @ x + shift."""
    bones = None if request.bones is None else scale * request.bones @ rotation.T + shift
    return replace(
        request, mesh=request.mesh.with_points(scale * request.mesh.points @ rotation.T + shift), bones=bones
    )


def crossed(request: AxisRequest) -> AxisRequest:
    """The same patch with its bone turned a quarter about z, so that a long patch lies across it."""
    assert request.bones is not None
    middle = request.bones.mean(axis=1, keepdims=True)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return replace(request, bones=middle + (request.bones - middle) @ quarter.T)


def mirrored(request: AxisRequest) -> AxisRequest:
    """The same patch seen in a mirror at x = 0: a left hand for a right one, with triangles outward again."""
    flip = np.array([-1.0, 1.0, 1.0])
    points = request.points
    return replace(
        request,
        mesh=TriangleMesh(request.mesh.points * flip, request.mesh.faces[:, ::-1]),
        points=SurfacePoints(points.faces, points.barycentric[:, ::-1]),
        bones=None if request.bones is None else request.bones * flip,
        other_axes={
            name: SurfacePoints(axis.faces, axis.barycentric[:, ::-1]) for name, axis in request.other_axes.items()
        },
    )


def turn(seed: int) -> FloatArray:
    """(3, 3) a random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return np.asarray(q * np.sign(np.linalg.det(q)))


class AxisGeneratorContract(Contract):
    """Fixture: `generator`, an AxisGenerator."""

    about, letter = "axis generator", "A"

    def test_a01_is_named(self, generator: AxisGenerator) -> None:
        """Has a name and says in a sentence what it does."""
        assert generator.name == generator.name.strip() != ""
        assert len(generator.summary.split()) >= 3, generator.summary

    @pytest.mark.parametrize("name", PATCHES)
    def test_a02_answers_points_of_the_mesh(self, generator: AxisGenerator, name: str) -> None:
        """Every axis point is a point of the mesh: a face of it, weights from 0 to 1 that sum to 1."""
        request = patch(name)
        axis = generator.generate(request)
        assert isinstance(axis, SurfacePoints)
        assert ((axis.faces >= 0) & (axis.faces < len(request.mesh.faces))).all(), axis.faces
        assert (axis.barycentric >= -1e-9).all(), axis.barycentric.min()
        assert np.abs(axis.barycentric.sum(axis=1) - 1.0).max() < 1e-9

    @pytest.mark.parametrize("name", PATCHES)
    def test_a03_has_two_points_at_least(self, generator: AxisGenerator, name: str) -> None:
        """Gives at least two points, and neighbours lie apart."""
        request = patch(name)
        positions = generator.generate(request).positions(request.mesh)
        assert len(positions) >= 2
        steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        assert steps.min() > 1e-9 * request.mesh.bounding_box_diagonal, steps

    def test_a04_is_deterministic(self, generator: AxisGenerator) -> None:
        """The same patch gives the same axis, to the bit."""
        first, second = generator.generate(patch("disk")), generator.generate(patch("disk"))
        assert np.array_equal(first.faces, second.faces)
        assert np.array_equal(first.barycentric, second.barycentric)

    @pytest.mark.parametrize("name", PATCHES)
    def test_a05_ignores_the_order_of_points(self, generator: AxisGenerator, name: str) -> None:
        """The patch is a set: shuffled points give the same axis."""
        request = patch(name)
        order = np.random.default_rng(3).permutation(len(request.points))
        owner = None if request.bone_of_point is None else request.bone_of_point[order]
        shuffled = replace(
            request,
            points=SurfacePoints(request.points.faces[order], request.points.barycentric[order]),
            bone_of_point=owner,
        )
        _same(request, generator.generate(request), shuffled, generator.generate(shuffled))

    @pytest.mark.parametrize("name", PATCHES)
    def test_a06_moves_with_the_mesh(self, generator: AxisGenerator, name: str) -> None:
        """A rigid motion of the mesh moves the axis along."""
        request = patch(name)
        other = moved(request, turn(5), 1.0, np.array([3.0, -1.0, 0.5]))
        _same(request, generator.generate(request), other, generator.generate(other))

    @pytest.mark.parametrize("factor", [1e-2, 1e3])
    def test_a07_is_free_of_units(self, generator: AxisGenerator, factor: float) -> None:
        """A mesh in other units gives the same axis in those units."""
        request = patch("bent")
        other = moved(request, np.eye(3), factor, np.zeros(3))
        _same(request, generator.generate(request), other, generator.generate(other))

    def test_a08_stays_on_the_component(self, generator: AxisGenerator) -> None:
        """Where the mesh has several parts, the axis lies on the part that holds the patch."""
        request = patch("disk")
        twice = replace(request, mesh=meshes.copies(request.mesh, 2, spacing=0.01))
        axis = generator.generate(twice)
        assert (axis.faces < len(request.mesh.faces)).all(), axis.faces

    @pytest.mark.parametrize("name", PATCHES)
    def test_a09_stays_near_the_patch(self, generator: AxisGenerator, name: str) -> None:
        """No axis point is farther from the patch than the patch is long."""
        request = patch(name)
        painted = request.points.positions(request.mesh)
        axis = generator.generate(request).positions(request.mesh)
        gap = np.linalg.norm(axis[:, None] - painted[None], axis=-1).min(axis=1)  # (points of the axis,)
        assert gap.max() <= np.linalg.norm(np.ptp(painted, axis=0)), gap

    def test_a10_is_in_order(self, generator: AxisGenerator) -> None:
        """The points come in the order of the axis: on a flat strip, no point lies behind the one before it."""
        request = patch("strip")
        positions = generator.generate(request).positions(request.mesh)
        along = (positions - positions[0]) @ (positions[-1] - positions[0])
        assert (np.diff(along) > 0.0).all(), along

    def test_a11_leaves_its_input_alone(self, generator: AxisGenerator) -> None:
        """Mesh, points and bones are the same bits afterwards."""
        request = patch("rough")
        arrays = [request.mesh.points, request.mesh.faces, request.points.faces, request.points.barycentric]
        arrays += [part for part in (request.bones, request.bone_of_point) if part is not None]
        before = [array.tobytes() for array in arrays]
        generator.generate(request)
        assert before == [array.tobytes() for array in arrays]

    @pytest.mark.parametrize("count", [0, 1, 2])
    def test_a12_refuses_in_words(self, generator: AxisGenerator, count: int) -> None:
        """With two points or fewer it gives an axis or raises InvalidInput with a sentence; never another error."""
        request = patch("disk")
        few = replace(
            request,
            points=SurfacePoints(request.points.faces[:count], request.points.barycentric[:count]),
            bone_of_point=np.zeros(count, np.int64),
        )
        try:
            axis = generator.generate(few)
        except InvalidInput as error:
            assert len(str(error).split()) >= 4, str(error)
        else:
            assert len(axis) >= 2

    @needs("without_rig")
    def test_a13_works_without_a_rig(self, generator: AxisGenerator) -> None:
        """Gives an axis where there are no bones."""
        assert len(generator.generate(replace(patch("disk"), bones=None, bone_of_point=None))) >= 2

    @needs("mirroring")
    @pytest.mark.parametrize("bone", ["along", "across"])
    @pytest.mark.parametrize("name", PATCHES)
    def test_a14_is_mirrored_with_the_mesh(self, generator: AxisGenerator, name: str, bone: str) -> None:
        """The mirror image of mesh, patch and bones gets the mirror image of the axis: left hands as right ones."""
        request = patch(name) if bone == "along" else crossed(patch(name))
        other = mirrored(request)
        axis, image = generator.generate(request), generator.generate(other)
        assert len(axis) == len(image), (len(axis), len(image))
        there = image.positions(other.mesh) * [-1.0, 1.0, 1.0]
        apart = np.linalg.norm(axis.positions(request.mesh) - there, axis=1)
        tolerance = 1e-6 * request.mesh.bounding_box_diagonal
        assert apart.max() <= tolerance, (
            f"the axes lie {apart.max():.3g} apart (at most {tolerance:.1e} is allowed)"
        )

    def test_a15_declares_its_settings(self, generator: AxisGenerator) -> None:
        """Its settings say unit, range and help; a value out of range and a name it does not know are refused."""
        check_settings(generator)


def _same(first: AxisRequest, axis: SurfacePoints, second: AxisRequest, other: SurfacePoints) -> None:
    """Both axes are the same points of the two placements of one mesh, compared through the first mesh."""
    assert len(axis) == len(other), (len(axis), len(other))
    apart = np.linalg.norm(axis.positions(first.mesh) - other.positions(first.mesh), axis=1)
    tolerance = 1e-6 * first.mesh.bounding_box_diagonal
    assert apart.max() <= tolerance, f"the axes lie {apart.max():.3g} apart (at most {tolerance:.1e} is allowed)"
