"""The metrics of report.json on scenes whose numbers are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contact_core.arrays import FloatArray
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.grasping.metrics import Contact, PosedScene, bones_through, joint_changes, measure, skin_stretch
from contact_core.testing.meshes import icosphere, plane

LENGTH = 2.0


def ball_at(height: float, radius: float = 0.3) -> TriangleMesh:
    """A fine ball whose lowest vertex is `height` above z = 0, over the middle of the unit square."""
    ball = icosphere(3, radius)
    low = ball.points[:, 2].min()
    return TriangleMesh(ball.points + np.array([0.5, 0.5, height - low]), ball.faces)


def scene(height: float, **changes: Any) -> PosedScene:
    """A ball over a square, its lowest vertex paired with the middle of the square."""
    ball, floor = ball_at(height), plane(12)
    lowest = SurfacePoints.at_vertices(ball, [int(ball.points[:, 2].argmin())])
    middle = SurfacePoints.at_vertices(floor, [int(np.linalg.norm(floor.points - [0.5, 0.5, 0], axis=1).argmin())])
    still = np.eye(4)[None]
    made = PosedScene(
        rest=ball,
        skin=ball,
        bones=np.zeros((0, 2, 3)),
        rest_local=still,
        local=still,
        moving=np.array([True]),
        object_mesh=floor,
        solids=(),
        contacts={"tip": Contact(lowest, middle)},
        length=LENGTH,
    )
    return replace(made, **changes)


@pytest.mark.parametrize("height", [0.0, 0.05, 0.4])
def test_distance_and_gap_are_the_height_as_a_fraction_of_the_length(height: float) -> None:
    ball = scene(height)
    values = measure(ball)
    contact = ball.contacts["tip"]
    paired = np.linalg.norm(contact.source.positions(ball.skin) - contact.target.positions(ball.object_mesh))
    assert values["mean_contact_distance"] == pytest.approx(paired / LENGTH, abs=1e-12)
    assert values["p95_contact_distance"] == pytest.approx(paired / LENGTH, abs=1e-12)
    assert values["gap"] == pytest.approx(height / LENGTH, abs=1e-12)
    assert values["patches"]["tip"]["points"] == values["contacts"] == 1


@pytest.mark.parametrize(
    ("degrees", "opposed", "opposed_45"), [(0, 1, 1), (40, 1, 1), (50, 1, 0), (85, 1, 0), (95, 0, 0)]
)
def test_normals_oppose_until_90_and_until_45_degrees(degrees: float, opposed: int, opposed_45: int) -> None:
    """A square tilted over a square: the angle between the normals is the tilt."""
    tilt = np.radians(degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    flat = plane(6)
    skin = TriangleMesh(flat.points @ turn.T, flat.faces[:, ::-1])
    points = SurfacePoints.at_vertices(flat, [10, 20, 30])
    skin_points = SurfacePoints.at_vertices(skin, [10, 20, 30])
    values = measure(
        scene(0.1, rest=skin, skin=skin, object_mesh=flat, contacts={"a": Contact(skin_points, points)})
    )
    assert values["opposed_normals"] == opposed
    assert values["opposed_normals_45"] == values["worst_patch_opposed_45"] == opposed_45


def test_the_worst_patch_is_not_hidden_by_the_mean() -> None:
    flat = plane(6)
    down, up = TriangleMesh(flat.points, flat.faces[:, ::-1]), flat
    both = TriangleMesh(
        np.concatenate([down.points, up.points]), np.concatenate([down.faces, up.faces + len(flat.points)])
    )
    many, few = np.arange(20), np.arange(2)
    contacts = {
        "good": Contact(SurfacePoints.at_vertices(both, many), SurfacePoints.at_vertices(flat, many)),
        "turned": Contact(
            SurfacePoints.at_vertices(both, few + len(flat.points)), SurfacePoints.at_vertices(flat, few)
        ),
    }
    values = measure(scene(0.1, rest=both, skin=both, object_mesh=flat, contacts=contacts))
    assert values["opposed_normals"] == pytest.approx(20 / 22)
    assert values["worst_patch_opposed_45"] == 0.0
    assert values["patches"]["good"]["opposed_normals_45"] == 1.0


@pytest.mark.parametrize("sunk", [0.02, 0.1])
def test_penetration_is_the_depth_and_the_share_of_sunken_skin(sunk: float) -> None:
    """A small ball sunk into a large one: depth and area of the cap are known."""
    large, small = 1.0, 0.3
    block = icosphere(4, large)
    ball = icosphere(4, small)
    centre = large + small - sunk
    skin = TriangleMesh(ball.points + np.array([0.0, 0.0, centre]), ball.faces)
    values = measure(scene(0.0, rest=skin, skin=skin, object_mesh=block, solids=(block,), contacts={}))
    assert values["max_penetration"] == pytest.approx(sunk / LENGTH, rel=0.08)
    z = (centre**2 + small**2 - large**2) / (2 * centre)  # where the spheres cross, from the small one's centre
    assert values["skin_inside"] == pytest.approx((small - z) / (2 * small), rel=0.15)
    assert values["mean_contact_distance"] is None


def test_a_hollow_walls_depth_is_small_until_the_filled_proxy_counts() -> None:
    """The trap of the cup: deep inside a thin shell the wall's own depth reads nothing."""
    outer, inner = icosphere(4, 1.0), icosphere(4, 0.95)
    count = len(outer.points)
    shell = TriangleMesh(
        np.concatenate([outer.points, inner.points]), np.concatenate([outer.faces, inner.faces[:, ::-1] + count])
    )
    skin = icosphere(2, 0.2)
    blind = measure(scene(0.0, rest=skin, skin=skin, object_mesh=shell, solids=(shell,), contacts={}))
    seeing = measure(scene(0.0, rest=skin, skin=skin, object_mesh=shell, solids=(shell, outer), contacts={}))
    assert blind["max_penetration"] == 0.0
    assert seeing["max_penetration"] == pytest.approx(1.0 / LENGTH, rel=0.25)
    assert seeing["skin_inside"] == pytest.approx(1.0)


def test_without_solids_depth_is_unknown_not_zero() -> None:
    values = measure(scene(-0.1))
    assert values["max_penetration"] is None and values["skin_inside"] is None


def test_bones_cross_a_surface_or_do_not() -> None:
    floor = plane(5)
    bones: FloatArray = np.array(
        [
            [[0.5, 0.4, -1], [0.5, 0.4, 1]],
            [[0.5, 0.4, 0.1], [0.5, 0.4, 1]],
            [[2, 0, -1], [2, 0, 1]],
            [[0.5] * 3, [0.5] * 3],
        ]
    )
    assert bones_through(bones, floor).tolist() == [True, False, False, False]
    assert measure(scene(0.3, bones=bones))["bones_through"] == 1


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.5, 2.0, np.pi])
def test_a_joints_change_is_the_angle_of_its_rotation(angle: float) -> None:
    c, s = np.cos(angle), np.sin(angle)
    turn, scaled = np.eye(4), np.diag([2.0, 2.0, 2.0, 1.0])
    turn[:3, :3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    changes = joint_changes(np.stack([np.eye(4), scaled]), np.stack([turn, scaled @ turn]))
    np.testing.assert_allclose(changes, angle, atol=1e-9)
    root = scene(0.1, local=turn[None], moving=np.array([False]))
    assert measure(root)["max_joint_change_deg"] == 0.0


def test_skin_stretch_is_the_ratio_of_edges() -> None:
    rest = plane(8)
    assert skin_stretch(rest, TriangleMesh(rest.points * [3, 3, 1], rest.faces), 99.0) == pytest.approx(3.0)
    assert skin_stretch(rest, rest, 99.0) == pytest.approx(1.0)
