"""The heat map by events: its distances are those of the metrics, measured when something is let go."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.geometry.inside import Sunk, depth_inside
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.grasping.metrics import Contact, PosedScene, measure
from contact_core.interaction.heat import DEEP, FAR, LEGEND, colors_of, distances_to
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.seen import SeenSurface
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.artist import Artist, paired, shifted
from tests.core.interaction.test_laws import by


def heat_of(artist: Artist) -> np.ndarray:
    (heat,) = artist.hands.overlay().heats
    assert heat.surface == "hand" and heat.colors.shape == (len(heat.distances), 3)
    return heat.distances


def hand_in_ball(artist: Artist) -> None:
    """The ball stands where the hand is."""
    artist.session.surfaces.place("ball", shifted(1.0, 0.0, 0.0))


def test_they_are_the_distances_of_the_metrics() -> None:
    artist = paired()
    hand_in_ball(artist)
    artist.key("Shift+H")
    distances = heat_of(artist)
    hand, ball = (artist.hands.desk.scene.surfaces[name] for name in ("hand", "ball"))
    skin = TriangleMesh(hand.points, hand.mesh.faces)
    thing = TriangleMesh(ball.points, ball.mesh.faces)
    gaps = SurfacePoints.at_vertices(skin, np.arange(len(skin.points)))
    ends = SurfacePoints.at_vertices(thing, np.zeros(len(skin.points), int))
    none = np.zeros((0, 4, 4))
    told = measure(
        PosedScene(skin, skin, np.zeros((0, 2, 3)), none, none, np.zeros(0, bool), thing, (thing,),
                   {"all": Contact(gaps, ends)}, 1.0)
    )  # fmt: skip
    assert np.abs(distances).mean() == pytest.approx(told["gap"], rel=1e-9)
    assert -distances.min() == pytest.approx(told["max_penetration"], rel=1e-9) and distances.min() < -0.01
    assert Sunk.of(skin, np.maximum(-distances, 0.0)).share == pytest.approx(told["skin_inside"], rel=1e-9)
    depths = depth_inside(skin.points, thing)
    away = np.linalg.norm(skin.points - ball.world[:3, 3], axis=1)
    np.testing.assert_allclose(-distances[depths > 0], depths[depths > 0], rtol=1e-9)
    assert np.abs(np.abs(distances) - np.abs(away - 1.0)).max() < 0.01  # a ball of radius one, of flat faces


def test_units_of_surface_and_world_do_not_matter() -> None:
    ball = meshes.icosphere(3)
    points = np.random.default_rng(0).normal(size=(200, 3))
    large = np.diag([3.0, 3.0, 3.0, 1.0])
    small = TriangleMesh(ball.points / 3.0, ball.faces)
    one, other = (
        distances_to(points, (SeenSurface("ball", mesh, mesh, world),))
        for mesh, world in ((ball, np.eye(4)), (small, large))
    )
    np.testing.assert_allclose(one, other, atol=1e-9)
    far = SeenSurface("far", ball, ball, shifted(9.0, 0.0, 0.0))
    both = distances_to(points, (SeenSurface("ball", ball, ball, np.eye(4)), far))
    np.testing.assert_array_equal(one[one < 0], both[one < 0])  # another thing makes nothing less deep
    assert (both <= one).all()


def test_measured_when_let_go_and_not_while_it_is_dragged() -> None:
    artist = paired()
    artist.key("Shift+H")
    before = heat_of(artist)
    assert heat_of(artist) is before  # nothing moved
    artist.hands.take_up("move")
    artist.hands.select("copy", surface="ball")
    start = artist.pixel("ball", artist.session.geometry.points("copy"))[12]
    assert artist.press(start)
    artist.move(start + by(12.0, 6.0))
    artist.hands.advance()
    assert artist.hands.desk.document.poses  # the hand follows
    assert heat_of(artist) is before
    artist.release(start + by(12.0, 6.0))
    after = heat_of(artist)
    ball = artist.hands.desk.scene.surfaces["ball"]
    np.testing.assert_array_equal(after, distances_to(artist.hands.desk.scene.surfaces["hand"].points, (ball,)))
    assert not np.array_equal(after, before)
    artist.key("Ctrl+Z")
    np.testing.assert_array_equal(heat_of(artist), before)
    artist.key("Shift+H")
    assert not artist.hands.overlay().heats


def test_without_a_hand_it_is_refused_in_words() -> None:
    session = Session()
    session.surfaces.add("ball", meshes.icosphere(1))
    artist = Artist(session, Interaction(session))
    artist.key("Shift+H")
    assert "no hand" in artist.hands.status.refusal and not artist.hands.settings.heat


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_colours_tell_far_from_near_from_deep(one: float, other: float) -> None:
    """Blue less red grows with distance, strictly between the ends: the order shows without red and green."""
    low, high = sorted((one, other))
    colors = colors_of(np.array([low, high]))
    assert ((colors >= 0.0) & (colors <= 1.0)).all()
    balance = colors[:, 2] - colors[:, 0]
    assert balance[0] <= balance[1] + 1e-12
    ends = np.clip([low, high], -DEEP, FAR)
    if (ends[1] - ends[0] > 1e-6) and not (low < 0.0 < high):
        assert not np.allclose(colors[0], colors[1], atol=1e-9)


def test_the_legend_is_the_ramp() -> None:
    for stop, meters in zip(LEGEND, (-DEEP, -DEEP / 2, 0.0, FAR / 4, FAR), strict=True):
        np.testing.assert_allclose(colors_of(np.array([meters]))[0], stop.color)
        assert stop.text.startswith(f"{abs(1e3 * meters):g} mm") or meters == 0.0
