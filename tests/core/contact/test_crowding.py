"""Parts of a transfer that land on one another: found where they do, never where an isometry took them."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import contact_core as contact
from contact_core.contact.crowding import crowded_points
from contact_core.geometry.raycast import Locator
from contact_core.geometry.thinning import meeting, spacing_of
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.view import Perspective
from contact_core.testing import meshes
from contact_core.testing.artist import Artist


def square(seed: int, centre: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """(n, 3) a jittered grid of a unit square."""
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 12), np.linspace(0, 1, 12)), -1).reshape(-1, 2)
    grid = grid + np.random.default_rng(seed).uniform(-0.02, 0.02, grid.shape) + centre
    return np.column_stack([grid, np.zeros(len(grid))])


@given(st.integers(0, 1000), st.floats(0.3, 3.0), st.tuples(*3 * [st.floats(-3.0, 3.0)]))
def test_what_is_only_moved_or_grown_is_not_crowded(seed: int, factor: float, turn: tuple[float, ...]) -> None:
    here = square(seed)
    there = factor * Rotation.from_rotvec(turn).apply(here) + 5.0
    assert not crowded_points(here, there).any()


@given(st.integers(0, 1000), st.floats(0.0, 0.3))
def test_two_parts_laid_on_one_another_are_all_crowded_and_parts_beside_one_another_are_not(
    seed: int, lift: float
) -> None:
    here = np.concatenate([square(seed), square(seed + 1, (4.0, 0.0))])
    on_top = np.concatenate([square(seed), square(seed + 1) + np.array([0.0, 0.0, 0.1 * lift])])
    assert crowded_points(here, on_top).mean() > 0.9
    beside = np.concatenate([square(seed), square(seed + 1, (1.3, 0.0))])
    assert not crowded_points(here, beside).any()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_points_and_points_in_one_place_are_never_crowded(count: int) -> None:
    assert not crowded_points(np.zeros((count, 3)), np.zeros((count, 3))).any()
    assert not crowded_points(np.zeros((5, 3)), np.zeros((5, 3))).any()


def painted(along: float) -> contact.Session:
    """A strip on a plane, twice as long as a pole is round."""
    session = contact.new(plane=meshes.plane(40, 6.0), pole=meshes.cylinder(48, 60, 0.4, 8.0))
    on = Locator.of(session.geometry.mesh("plane"))
    ends = on.closest([(0.5, 3.0, 0.0), (0.5 + along, 3.0, 0.0)]).points
    session.patches.brush("disk", "strip", surface="plane", at=ends, radius=0.2, spacing=0.07, axis=ends)
    return session


@pytest.mark.parametrize(("along", "rise", "crowded"), [(5.0, 0.0, True), (5.0, 1.0, False), (1.5, 0.0, False)])
def test_a_strip_that_runs_over_its_own_start_is_told_once_committed(
    along: float, rise: float, crowded: bool, caplog: pytest.LogCaptureFixture
) -> None:
    with painted(along) as session, caplog.at_level(logging.WARNING):
        root = Locator.of(session.geometry.mesh("pole")).closest([(0.4, 0.0, 2.0)]).points
        with session.stroke() as stroke:  # a drag is not commented on
            stroke.patches.transfer("strip", "pole", root, direction=(0.0, 1.0, rise))
            stroke.cancel()
        assert not caplog.records
        copy = session.patches.transfer("strip", "pole", root, direction=(0.0, 1.0, rise))
        assert (session.geometry.crowded([copy])[copy] > 0.3) is crowded
        said = [record.getMessage() for record in caplog.records]
        assert bool(said) is crowded and all("lie on one another" in one and copy in one for one in said)


def test_an_artist_is_told_in_the_line_when_the_copy_is_let_go(caplog: pytest.LogCaptureFixture) -> None:
    """Neither hovering nor a drag comments on what it shows; what was made is commented on once."""
    view = Perspective.looking_at((0.0, 0.0, 2.0), (8.0, 0.0, 2.0), viewport=(800, 600))
    with painted(5.0) as session, caplog.at_level(logging.WARNING):
        artist = Artist(session, Interaction(session), view)
        artist.hands.select("strip", surface="pole")
        artist.hands.take_up("transfer")
        start, end = (artist.at(place) for place in ((0.4, 0.0, 2.0), (0.35, 0.2, 2.0)))
        artist.move(start)
        artist.drag(start, 0.5 * (start + end), end)
        assert len(session.document.patches) == 2 and not caplog.records
        assert artist.hands.status.remark.count("lie on one another") == 1
        artist.key("Ctrl+Z")
        assert not artist.hands.status.remark


@pytest.mark.parametrize(("direction", "crowded"), [((0.0, 1.0, 0.0), True), ((0.0, 0.0, 1.0), False)])
def test_two_balls_onto_one_thin_pole_are_told_where_they_meet(
    direction: tuple[float, float, float], crowded: bool, caplog: pytest.LogCaptureFixture
) -> None:
    """Pads of two balls, side by side across the pole, are projected onto one side of it; along it they are not."""
    balls = {"one": meshes.icosphere(3, 0.5), "two": meshes.icosphere(3, 0.5)}
    pole = meshes.cylinder(48, 40, 0.15, 4.0)
    with contact.Session() as session, caplog.at_level(logging.WARNING):
        session.surfaces.add("pole", pole)
        for place, (name, mesh) in enumerate(balls.items()):
            session.surfaces.add(name, mesh)
            session.surfaces.place(name, [[1, 0, 0, 1.2 * place], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
            on = Locator.of(mesh)
            axis = on.closest([(-0.1, 0.0, 1.0), (0.1, 0.0, 1.0)]).points
            top = on.closest([(0.0, 0.0, 1.0)]).points
            session.patches.brush("disk", f"pad {name}", surface=name, at=top, radius=0.25, spacing=0.05, axis=axis)
        session.patches.group("both", ["pad one", "pad two"])
        start = Locator.of(pole).closest([(0.15, 0.0, 2.0)]).points
        names = session.patches.transfer_group("both", ["pole"], start, direction=direction)
        assert (max(session.geometry.crowded(names.values()).values()) > 0.2) is crowded
        assert bool(caplog.records) is crowded
        for name in names.values():  # one by one they are well
            assert session.geometry.crowded([name]) == {name: 0.0}


@given(st.integers(0, 1000), st.floats(0.01, 0.5), st.floats(0.01, 0.5))
def test_points_that_meet_are_those_that_every_pair_tells(seed: int, near: float, apart: float) -> None:
    random = np.random.default_rng(seed)
    points, others = random.random((60, 3)) * random.random(3), random.random((60, 3))
    gaps = [np.linalg.norm(each[:, None] - each[None], axis=2) for each in (points, others)]
    assert (meeting(points, others, near, apart) == ((gaps[0] <= near) & (gaps[1] > apart)).any(axis=1)).all()
    assert spacing_of(points, 60) == pytest.approx(np.median(np.sort(gaps[0], axis=1)[:, 1]))
