"""Every built-in axis generator keeps the contract; and the laws that are its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_builtins.axes.along_bone import AlongBone
from contact_builtins.axes.consistent import Consistent
from contact_builtins.axes.farthest_pair import FarthestPair
from contact_builtins.axes.guided import Guided
from contact_builtins.axes.medial_axis import MedialAxis
from contact_builtins.axes.principal import Principal
from contact_builtins.axes.thumb import towards_thumb
from contact_builtins.brushes.disk import DiskBrush
from contact_core.contact.axis_generator import AxisGenerator, AxisRequest
from contact_core.contact.brush import BrushGesture
from contact_core.errors import InvalidInput
from contact_core.geometry import SurfacePoints
from contact_core.geometry.raycast import Locator
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import SAMPLES
from contact_core.rig.bones import bones_of
from contact_core.testing import meshes
from contact_core.testing.axis_generator_contract import AxisGeneratorContract, mirrored, patch, scattered


class TestFarthestPair(AxisGeneratorContract):
    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return FarthestPair()


class TestMedialAxis(AxisGeneratorContract):
    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return MedialAxis()


class TestPrincipal(AxisGeneratorContract):
    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return Principal()


class TestConsistent(AxisGeneratorContract):
    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return Consistent()


class TestGuided(AxisGeneratorContract):
    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return Guided()


class TestAlongBone(AxisGeneratorContract):
    cannot = {"without_rig": "it follows a bone, so it refuses in words where there is none"}

    @pytest.fixture
    def generator(self) -> AxisGenerator:
        return AlongBone()


def strip(angle: float) -> AxisRequest:
    """Points of a strip of 0.8 x 0.16 in the middle of a flat square, turned by `angle`; the bone lies along x."""
    mesh = meshes.plane(12)
    c, s = np.cos(angle), np.sin(angle)
    random = np.random.default_rng(11)
    local = (random.random((160, 2)) - 0.5) * [0.8, 0.16]
    spots = local @ np.array([[c, s], [-s, c]]) + 0.5
    return AxisRequest(
        mesh,
        on_plane(spots),
        bones=np.array([[[0.0, 0.5, -0.3], [1.0, 0.5, -0.3]]]),
        bone_of_point=np.zeros(160, np.int64),
    )


def on_plane(spots: np.ndarray) -> SurfacePoints:
    """Surface points of meshes.plane(12) at positions (k, 2)."""
    mesh = meshes.plane(12)
    corners = mesh.points[mesh.faces][:, :, :2]  # (m, 3, 2)
    to_edges = np.concatenate([corners, np.ones((len(corners), 3, 1))], axis=2)
    weights = np.einsum("kc,mcb->kmb", np.c_[spots, np.ones(len(spots))], np.linalg.inv(to_edges))
    inside = weights.min(axis=2).argmax(axis=1)
    return SurfacePoints(inside, weights[np.arange(len(spots)), inside].clip(0.0))


def direction(request: AxisRequest, axis: SurfacePoints) -> np.ndarray:
    positions = axis.positions(request.mesh)
    chord = positions[-1] - positions[0]
    return np.asarray(chord / np.linalg.norm(chord))


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1, 2.3])
def test_principal_finds_the_long_side(angle: float) -> None:
    request = strip(angle)
    found = direction(request, Principal().generate(request))
    assert abs(found[:2] @ [np.cos(angle), np.sin(angle)]) > np.cos(np.radians(3.0))


@pytest.mark.parametrize("angle", [0.4, 1.1])
def test_along_bone_follows_the_bone_whatever_the_patch(angle: float) -> None:
    request = strip(angle)
    assert direction(request, AlongBone().generate(request)) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)


def test_along_bone_refuses_a_bone_that_stands_upright() -> None:
    upright = replace(strip(0.0), bones=np.array([[[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]]]))
    with pytest.raises(InvalidInput, match="does not stand upright"):
        AlongBone().generate(upright)


def test_the_farthest_pair_is_the_farthest() -> None:
    request = patch("rough")
    positions = request.points.positions(request.mesh)
    ends = FarthestPair().generate(request).positions(request.mesh)
    widest = np.linalg.norm(positions[:, None] - positions[None], axis=-1).max()
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(widest, rel=1e-12)


def test_the_medial_axis_follows_a_bent_band() -> None:
    random = np.random.default_rng(2)
    radius, angle = 0.36 + 0.12 * (random.random(700) - 0.5), np.pi * random.random(700)
    spots = np.stack([0.5 + radius * np.cos(angle), 0.3 + radius * np.sin(angle)], -1)
    request = AxisRequest(meshes.plane(12), on_plane(spots))
    axis = MedialAxis().generate(request).positions(request.mesh)[:, :2] - [0.5, 0.3]
    off = np.abs(np.linalg.norm(axis, axis=1) - 0.36)
    assert off.max() < 0.03, off  # half the band's half width
    assert np.abs(np.ptp(np.arctan2(axis[:, 1], axis[:, 0]))) > 0.75 * np.pi


def test_consistent_is_parallel_to_the_axis_that_is_drawn() -> None:
    request = strip(1.1)
    drawn = on_plane(np.array([[0.2, 0.2], [0.3, 0.1]]))
    other = on_plane(np.array([[0.75, 0.9], [0.75, 0.2]]))
    found = Consistent().generate(replace(request, other_axes={"corner": drawn, "beside": other}))
    assert direction(request, found)[:2] == pytest.approx([0.0, -1.0], abs=1e-6)


def test_consistent_needs_no_plane() -> None:
    """Round a tube, a direction along the tube stays along the tube, with a bone and without."""
    tube = meshes.cylinder(24, 14)
    along = np.array([0.0, 0.0, 1.0])
    first = scattered(tube, np.array([0.5, 0.0, 0.5]), np.array([0.4, 0.3, 0.3]), seed=1)
    second = scattered(tube, np.array([-0.4, 0.3, 1.4]), np.array([0.4, 0.3, 0.3]), seed=2)
    drawn = AlongBone().generate(replace(first, bones=np.array([[-along, along]])))
    for bones in (None, np.array([[np.zeros(3), along]])):
        axis = Consistent().generate(replace(second, bones=bones, other_axes={"first": drawn}))
        assert direction(second, axis) @ along > np.cos(np.radians(2.0))


def test_consistent_keeps_the_angle_to_the_bone() -> None:
    """Crosswise on one of two fingers, crosswise to the left on the other, which points elsewhere."""
    mesh = meshes.plane(12)
    bones = np.array([[[0.2, 0.1, -0.1], [0.2, 0.9, -0.1]], [[0.5, 0.3, -0.1], [0.9, 0.7, -0.1]]])
    spots = np.array([0.7, 0.5]) + 0.1 * (np.random.default_rng(0).random((60, 2)) - 0.5)
    request = AxisRequest(mesh, on_plane(spots), bones=bones, bone_of_point=np.ones(60, np.int64))
    crosswise = on_plane(np.array([[0.3, 0.5], [0.1, 0.5]]))  # to the left of the first bone, seen from above
    axis = Consistent().generate(replace(request, other_axes={"first": crosswise}))
    assert direction(request, axis)[:2] == pytest.approx([-np.sqrt(0.5), np.sqrt(0.5)], abs=1e-6)


@pytest.mark.parametrize(("angle", "wanted"), [(0.2, 0.2), (3.3, 3.3 - np.pi), (0.6, 0.6), (-0.6 + np.pi, -0.6)])
def test_guided_follows_a_stroke_and_never_runs_against_the_bone(angle: float, wanted: float) -> None:
    request = strip(angle)  # the bone lies along x
    found = direction(request, Guided().generate(request))
    assert found[:2] @ [np.cos(wanted), np.sin(wanted)] > np.cos(np.radians(3.0))


def fan(lengths: list[float]) -> np.ndarray:
    """Bones (b, 2, 3) of digits that fan out from the middle of the square's lower edge, from left to right, two to
    a digit."""
    bones = []
    for length, angle in zip(lengths, np.linspace(2.2, 0.9, len(lengths)), strict=True):
        way = length * np.array([np.cos(angle), np.sin(angle), 0.0])
        joints = np.array([0.5, 0.1, -0.1]) + np.array([[0.0], [0.5], [1.0]]) * way
        bones += [joints[:2], joints[1:]]
    return np.array(bones)


@pytest.mark.parametrize("owner", [0, 3, 8])
@pytest.mark.parametrize(
    ("lengths", "wanted"), [([0.4, 0.8, 0.9, 0.8, 0.7], 1.0), ([0.7, 0.8, 0.9, 0.8, 0.4], -1.0)]
)
def test_guided_runs_away_from_the_thumb(lengths: list[float], wanted: float, owner: int) -> None:
    """Whichever side the thumb is on, and whichever digit the stroke lies across."""
    request = replace(strip(0.0), bones=fan(lengths), bone_of_point=np.full(160, owner))
    assert direction(request, Guided().generate(request))[0] * wanted > 0.99


def test_bones_without_length_hide_no_thumb() -> None:
    """Rigs put helper joints onto others: the digits part there all the same, seen from the last bone of one."""
    bones = fan([0.4, 0.8, 0.9, 0.8, 0.7])
    helpers = np.repeat(bones.reshape(-1, 1, 3), 2, axis=1)  # (2b, 2, 3)
    request = replace(strip(0.0), bones=np.concatenate([helpers, bones]), bone_of_point=np.full(160, 20 + 9))
    found, plain = (
        towards_thumb(request),
        towards_thumb(replace(request, bones=bones, bone_of_point=np.full(160, 9))),
    )
    assert found is not None and plain is not None
    assert found == pytest.approx(plain)


def test_guided_goes_with_the_axes_drawn_already_where_no_digit_is_a_thumb() -> None:
    request = replace(strip(1.4), bones=np.array([[[0.0, 0.5, -0.3], [1.0, 0.5, -0.3]]]))
    for sign in (1, -1):
        drawn = on_plane(np.array([[0.7, 0.3], [0.72, 0.6]]))[::sign]
        found = Guided().generate(replace(request, other_axes={"drawn": drawn}))
        assert direction(request, found)[1] * sign > 0.9


def test_a_body_has_no_thumb() -> None:
    """Two arms that reach equally far are no thumb, and neither is a chain without branches."""
    even = replace(strip(0.0), bones=fan([0.8, 0.9, 0.9, 0.8]), bone_of_point=np.zeros(160, np.int64))
    assert towards_thumb(even) is None
    assert towards_thumb(strip(0.0)) is None
    assert towards_thumb(replace(strip(0.0), bones=None, bone_of_point=None)) is None


@pytest.mark.parametrize(
    "generator", [Guided(), AlongBone(), Consistent(), Principal(), FarthestPair(), MedialAxis()]
)
def test_the_mirror_image_of_a_hand_gets_the_mirror_image_of_its_axes(generator: AxisGenerator) -> None:
    """A right hand and the left one that the mirror shows, painted one patch after the other."""
    hand = PluginManager(environ={}).get(SAMPLES, "human_hand").build()
    assert hand.rig is not None
    drawn: dict[str, SurfacePoints] = {}
    images: dict[str, SurfacePoints] = {}
    for name, stroke, radius in STROKES:
        path = Locator.of(hand.mesh).closest(stroke).points
        points = DiskBrush().mark(BrushGesture(hand.mesh, path, radius=radius, spacing=radius / 4.0)).points
        bones, owner = bones_of(hand.rig, points)
        request = AxisRequest(hand.mesh, points, bones, owner, dict(drawn))
        other = mirrored(request)
        drawn[name], image = generator.generate(request), generator.generate(other)
        there = image.positions(other.mesh) * [-1.0, 1.0, 1.0]
        assert drawn[name].positions(hand.mesh) == pytest.approx(there, abs=1e-6), name
        images[name] = image
    if isinstance(
        generator, Guided
    ):  # and on both, the band runs away from the thumb, which is at x > 0 on this one
        assert direction(request, drawn["band"])[0] < -0.9 and direction(other, images["band"])[0] > 0.9


STROKES = (  # on the palm's side of the human hand, metres; radius of the brush
    ("band", [[0.026, 0.075, 0.008], [0.003, 0.076, 0.007], [-0.015, 0.071, 0.008], [-0.034, 0.063, 0.010]], 0.007),
    ("index_tip", [[0.0328, 0.1522, 0.0230]], 0.007),
    ("thumb_pad", [[0.044, 0.055, 0.033], [0.051, 0.069, 0.036]], 0.007),
)


def test_guided_takes_the_bone_for_a_round_patch() -> None:
    random = np.random.default_rng(5)
    radius, angle = 0.2 * np.sqrt(random.random(300)), 2.0 * np.pi * random.random(300)
    spots = 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
    request = replace(strip(0.0), points=on_plane(spots), bone_of_point=np.zeros(300, np.int64))
    assert direction(request, Guided().generate(request)) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("generator", [Principal(), MedialAxis(), Consistent(), AlongBone(), Guided()])
def test_a_patch_in_two_parts_is_refused(generator: AxisGenerator) -> None:
    mesh = meshes.copies(meshes.saddle(8), 2)
    faces = np.array([0, 1, 2, len(mesh.faces) - 1, len(mesh.faces) - 2])
    request = AxisRequest(mesh, SurfacePoints(faces, np.full((5, 3), 1 / 3)))
    with pytest.raises(InvalidInput, match="in one piece"):
        generator.generate(request)
