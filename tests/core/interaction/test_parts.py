"""The parts of the interaction, one by one: views, events, refitted trees, continued problems, long work, keys."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.document.schema import document_to_json
from contact_core.errors import CommandRejected, ContactError, InvalidInput
from contact_core.geometry.distance_field import DistanceField
from contact_core.geometry.raycast import Locator
from contact_core.grasping import filled
from contact_core.interaction.events import Key, Pointer
from contact_core.interaction.live import KeptContacts
from contact_core.interaction.proposing import ghost_of
from contact_core.interaction.seen import SeenSurface
from contact_core.interaction.tool import TOOLS
from contact_core.interaction.view import Perspective, View, on_plane, world_per_pixel
from contact_core.interaction.work import Worker
from contact_core.progress import Progress
from contact_core.scene.problem import problem_of
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.terms import paper_terms
from contact_core.testing import meshes, rigs
from contact_core.testing.artist import Artist, ball_and_hand, paired, shifted

# -- views and events ----------------------------------------------------------------------------------------------

SOMEWHERE = st.floats(-3.0, 3.0)


@given(
    st.tuples(SOMEWHERE, SOMEWHERE, SOMEWHERE), st.floats(0.0, 800.0), st.floats(0.0, 600.0), st.floats(0.1, 20.0)
)
def test_rays_and_pixels_are_inverse(centre: Any, x: float, y: float, far: float) -> None:
    view = Perspective.looking_at(centre, np.add(centre, (1.0, 2.0, 5.0)), viewport=(800, 600))
    assert isinstance(view, View)
    origins, directions = view.rays([[x, y]])
    assert np.linalg.norm(directions) == pytest.approx(1.0)
    at = view.project(origins + far * directions)[0]
    assert at[:2] == pytest.approx([x, y], abs=1e-6) and at[2] > 0.0
    assert view.project(origins - far * directions)[0, 2] < 0.0


def test_a_pixel_in_the_world() -> None:
    view = Perspective.looking_at((0.0, 0.0, 0.0), (0.0, 0.0, 5.0), viewport=(800, 600))
    size = world_per_pixel(view, np.zeros(3))
    assert size == pytest.approx(2.0 * 5.0 * math.tan(math.radians(14.0)) / 600.0, rel=1e-3)
    assert on_plane(view, np.array([400.0, 300.0]), np.array([0.3, 0.2, 1.0])) == pytest.approx([0.0, 0.0, 1.0])
    assert world_per_pixel(view, np.array([0.0, 0.0, 9.0])) == 0.0  # behind the eye


def test_events_are_checked() -> None:
    assert Key("z", frozenset({"shift", "ctrl"})).chord == "Ctrl+Shift+Z" and Key(" ").name == "Space"
    assert Pointer("move", 1.0, 2.0, pressure=7.0).pressure == 1.0
    for wrong in (
        lambda: Pointer("move", math.nan, 0.0),
        lambda: Pointer("poke", 0.0, 0.0),  # type: ignore[arg-type]
        lambda: Pointer("move", 0.0, 0.0, modifiers=frozenset({"hyper"})),  # type: ignore[arg-type]
        lambda: Key("F13"),
    ):
        with pytest.raises(InvalidInput):
            wrong()


# -- trees and problems that go on ---------------------------------------------------------------------------------


def test_a_refitted_tree_answers_as_a_new_one() -> None:
    rest, random = rigs.tentacle(5).surface, np.random.default_rng(0)
    bent = rest.points + 0.4 * np.sin(rest.points[:, [1, 2, 0]]) * [0.0, 1.0, 1.0]
    Locator.of(rest)
    builds = Locator.builds
    refitted, new = Locator.of(rest.posed(bent)), None
    assert Locator.builds == builds, "the tree was built and not fitted"
    new = Locator(rest.with_points(bent))
    origins = random.normal(0.0, 8.0, (400, 3))
    directions = random.choice(bent, 400) - origins
    one, other = refitted.cast(origins, directions), new.cast(origins, directions)
    assert np.array_equal(one.found, other.found) and one.found.any()
    assert np.allclose(one.distance[one.found], other.distance[one.found], rtol=1e-12)
    near, near_too = refitted.closest(origins), new.closest(origins)
    assert np.allclose(near.distance, near_too.distance, rtol=1e-12)
    assert np.allclose(refitted.winding_number(origins), new.winding_number(origins), atol=0.1)


def problems(artist: Artist) -> tuple[Any, Any]:
    """A problem that continues that of the document at the press, after an edit; and the same made anew."""
    session, terms = artist.session, (*paper_terms(), PenetrationTerm())
    kept = KeptContacts(session)
    first = problem_of(session.geometry, session.rigs, meters_per_unit=1.0)
    first = replace(first, contacts=kept.of(session.document), terms=terms)
    assert np.isfinite(first.value(first.start_state))
    theta = first.start + 0.05 * np.sin(np.arange(len(first.start)))
    session.patches.rotate("copy", 0.4)
    there = session.document.surface("ball").world_from_surface @ shifted(0.1, -0.2, 0.3)
    session.surfaces.place("ball", there)
    bodies = tuple(replace(body, world_from_rig=there) if body.name == "ball" else body for body in first.bodies)
    continued = first.continued(theta, kept.of(session.document), terms, bodies)
    anew = problem_of(session.geometry, session.rigs, meters_per_unit=1.0)
    return continued, replace(anew, terms=terms, length=first.manipulator_length)


def test_a_continued_problem_is_the_problem() -> None:
    continued, anew = problems(paired())
    state, other = continued.start_state, anew.state(continued.start)
    assert continued.value(state) == pytest.approx(anew.value(other), rel=1e-12)
    assert np.allclose(continued.gradient(state), anew.gradient(other), rtol=1e-9, atol=1e-12)
    model, model_too = continued.normal_matrix(state), anew.normal_matrix(other)
    assert np.allclose(model, model_too, atol=1e-6 * np.abs(model_too).max())  # lengths of normals as of the start


def test_a_continued_problem_keeps_what_did_not_change() -> None:
    artist = paired()
    kept = KeptContacts(artist.session)
    before = kept.of(artist.session.document)
    artist.session.patches.rotate("copy", 0.4)
    after = kept.of(artist.session.document)
    assert after[0].manipulator_points is before[0].manipulator_points
    assert after[0].object_points is not before[0].object_points
    assert kept.of(artist.session.document) is after
    artist.session.patches.rename("spot", "stain")
    assert kept.of(artist.session.document)[0] is after[0]


def test_the_end_that_did_not_change_keeps_its_tracks() -> None:
    artist = paired()
    kept = KeptContacts(artist.session)
    first = problem_of(artist.session.geometry, artist.session.rigs)
    first = replace(first, contacts=kept.of(artist.session.document))
    mine, theirs = first.pairs.manipulator_points, first.pairs.object_points
    artist.session.patches.rotate("copy", 0.4)
    again = first.continued(first.start, kept.of(artist.session.document), first.terms)
    assert again.pairs.manipulator_points is mine and again.pairs.object_points is not theirs
    assert len(again.kept_ends) == 2 and len(again.continued(again.start, (), ()).kept_ends) == 0


def test_a_problem_goes_on_with_its_own_bodies_only() -> None:
    continued, anew = problems(paired())
    with pytest.raises(InvalidInput, match="same bodies"):
        continued.continued(continued.start, continued.contacts, continued.terms, anew.bodies[:1])


# -- long work -----------------------------------------------------------------------------------------------------


def test_work_is_handed_over_on_the_thread_that_polls() -> None:
    worker, found, go = Worker(), [], threading.Event()

    def work(progress: Progress) -> str:
        progress.tell(0.5, "half")
        go.wait(10.0)
        return threading.current_thread().name

    worker.begin("Count", work, lambda result: found.append((result, threading.current_thread())))
    assert not worker.poll() and worker.status is not None and worker.status.title == "Count"
    go.set()
    assert worker.wait(10.0) and not found
    assert worker.poll() and worker.status is None
    assert found == [("contact Count", threading.main_thread())]


def test_work_that_is_replaced_or_fails() -> None:
    worker, found = Worker(), []

    def endless(progress: Progress) -> None:
        while True:
            progress.tell(None, "on and on")

    worker.begin("First", endless, found.append)
    worker.begin("Second", lambda progress: 2, found.append)
    assert worker.wait(10.0) and worker.poll() and found == [2]
    worker.begin("Third", lambda progress: 1 / 0, found.append)
    assert worker.wait(10.0)
    with pytest.raises(ContactError, match="Third failed"):
        worker.poll()
    assert worker.status is None and found == [2]


def test_the_end_of_a_worker_waits_for_its_threads() -> None:
    """Also for those of work that was dropped: none may run compiled code while the interpreter ends."""
    worker = Worker()

    def endless(progress: Progress) -> None:
        while True:
            time.sleep(0.01)
            progress.tell(None, "")

    before = set(threading.enumerate())  # a thread of an earlier test may end meanwhile
    for title in ("First", "Second", "Third"):
        worker.begin(title, endless, print)
    worker.close()
    assert set(threading.enumerate()) <= before and worker.status is None


def solved(artist: Artist) -> None:
    """Wait for the work, and take it over."""
    assert artist.hands.worker.wait(60.0)
    artist.hands.advance()


@given(st.floats(0.0, 2.0), st.floats(0.1, 10.0))
def test_a_ghost_is_of_what_moved_and_of_nothing_else(angle: float, size: float) -> None:
    """Two skins nearly in one place would show in patches, each through the other."""
    rest, world = meshes.icosphere(2), np.diag([size, size, size, 1.0])
    turned = rest.points.copy()
    tip = turned[:, 2] > 0.5  # bent about the first axis from here on
    turned[tip, 1] += math.sin(angle) * (turned[tip, 2] - 0.5)
    before = SeenSurface("ball", rest, rest, world)
    now = SeenSurface("ball", rest, rest.with_points(turned), world)
    ghost, moved = ghost_of(before, now), np.linalg.norm(turned - rest.points, axis=1)
    shown = np.zeros((0, 3), np.int64) if ghost is None else ghost.triangles
    far = moved > 0.01 * rest.bounding_box_diagonal
    assert far[shown].any(axis=1).all() and set(np.flatnonzero(far)) <= set(shown.ravel())
    whole = ghost_of(before, None)
    assert whole is not None and len(whole.triangles) == len(rest.faces)


def test_a_solve_beside_the_window_is_a_ghost_until_it_is_accepted() -> None:
    artist = paired()
    before = artist.session.document
    assert artist.key("Space") and artist.hands.worker.status is not None
    solved(artist)
    assert artist.session.document is before and artist.hands.desk.document is not before, artist.hands.status
    assert artist.hands.overlay().ghosts and "Enter" in artist.hands.status.line()
    assert artist.hands.desk.scene.surfaces["hand"].pose is not None
    assert artist.hands.overlay().ghosts is artist.hands.overlay().ghosts, "made once"
    artist.key("Escape")
    assert artist.hands.desk.document is before and artist.hands.desk.scene.surfaces["hand"].pose is None
    artist.key("Space")
    solved(artist)
    revision = artist.session.revision
    artist.key("Enter")
    assert artist.session.revision == revision + 1 and "hand" in artist.session.document.poses
    assert not artist.hands.status.proposed


def test_what_is_prepared_is_not_built_again() -> None:
    artist = paired()
    ball = artist.session.geometry.mesh("ball")
    fresh = ball.with_points(1.25 * ball.points)  # a mesh that nothing was built for
    artist.session.surfaces.add("moon", fresh, world_from_surface=shifted(0.0, 9.0, 0.0))
    artist.hands.prepare()
    assert artist.hands.worker.status is not None and artist.hands.worker.status.title == "Prepare"
    solved(artist)
    assert artist.hands.worker.status is None and not artist.hands.status.refusal
    builds = Locator.builds
    Locator.of(fresh)
    assert Locator.builds == builds and fresh in DistanceField._of_mesh


def test_the_first_live_step_builds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The field of what is solid, its hollows filled, and trees: all stands there before anything is dragged."""
    built: list[str] = []

    def counting(module: Any, name: str) -> None:
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given: (built.append(name), real(*given))[1])

    counting(filled, "filled")
    counting(DistanceField, "_made")
    artist = paired()
    DistanceField._of_mesh.pop(artist.session.geometry.mesh("ball"), None)
    artist.hands.prepare()
    solved(artist)
    assert sorted(built) == ["_made", "filled"]
    trees = Locator.builds
    start = artist.pixel("ball", artist.session.geometry.root("copy").point())[0]
    artist.key("G")
    artist.drag(start, start + 5.0)
    assert "hand" in artist.session.document.poses, artist.hands.status
    assert len(built) == 2 and Locator.builds == trees


def test_a_proposal_for_another_document_is_refused_in_words() -> None:
    artist = paired()
    artist.key("Space")
    artist.session.patches.rename("spot", "stain")
    solved(artist)
    assert "changed" in artist.hands.status.refusal and artist.hands.desk.ghost is None


def test_nothing_to_solve_is_said() -> None:
    artist = ball_and_hand()
    artist.key("Space")
    assert "pair" in artist.hands.status.refusal and artist.hands.worker.status is None
    artist.key("Enter")
    assert "nothing is proposed" in artist.hands.status.refusal


# -- keys ----------------------------------------------------------------------------------------------------------


def test_every_tool_is_taken_up_by_its_key() -> None:
    artist = ball_and_hand()
    for tool in artist.hands.tools:
        assert artist.key(tool.key) and artist.hands.tool == tool.name
    assert not artist.key("Home") and not artist.key("Ctrl+S")  # the front end's own


def test_actions_on_the_selection() -> None:
    artist = paired()
    session, hands = artist.session, artist.hands
    artist.key("M")
    assert "no patch is selected" in hands.status.refusal
    hands.select("copy")
    assert artist.key("M") and session.document.patch("copy").mirrored is False and not hands.status.refusal
    assert artist.key("Shift+D") and session.document.patch("copy").shape != session.document.patch("pad").shape
    assert artist.key("Shift+P") and not session.document.pairs
    session.patches.link("copy", "spot")
    assert artist.key("Shift+K") and artist.key("Ctrl+Z")
    assert artist.key("Shift+W"), hands.status
    hands.select(surface="ball")
    assert artist.key("Ctrl+A") and set(hands.selection.patches) == {"spot", "copy"}
    assert artist.key("Delete") and set(session.document.patches) == {"pad"} and not hands.selection.patches
    assert artist.key("Ctrl+Delete") and not session.document.patches
    artist.key("Ctrl+Delete")
    assert "no contacts" in hands.status.refusal


def test_the_radius_by_keys_and_pointer() -> None:
    artist = ball_and_hand()
    artist.key("B")
    hands = artist.hands

    def radius() -> float:
        tool: Any = hands.tool_named("paint")
        return float(tool.radius_on(hands.desk, "ball"))

    hands.select(surface="ball")
    first = radius()
    artist.key("]")
    assert radius() == pytest.approx(1.15 * first)
    artist.key("F")
    artist.move((100.0, 100.0))
    artist.move((220.0, 100.0))
    assert radius() == pytest.approx(2.3 * first)
    artist.key("Escape")
    assert radius() == pytest.approx(1.15 * first) and not hands.is_busy
    artist.key("F")
    artist.move((100.0, 100.0))
    artist.move((220.0, 100.0))
    assert artist.press((220.0, 100.0)) and not hands.is_busy
    assert radius() == pytest.approx(2.3 * first) and artist.session.revision == 0
    artist.key("G")
    artist.key("]")
    assert "no radius" in hands.status.refusal


def test_settings_are_checked() -> None:
    artist = ball_and_hand()
    artist.hands.set(iterations=7)
    artist.hands.configure(TOOLS, "paint", brush="vertices")
    for wrong in (
        lambda: artist.hands.set(iterations=0),
        lambda: artist.hands.set(nothing=1),
        lambda: artist.hands.configure(TOOLS, "paint", radius=-1.0),
        lambda: artist.hands.configure(TOOLS, "pain", radius=1.0),
        lambda: artist.hands.do("file.save"),
    ):
        with pytest.raises(InvalidInput):
            wrong()
    with pytest.raises(CommandRejected):
        artist.hands.select("nobody")
    assert artist.hands.settings.iterations == 7


# -- what a front end gets -----------------------------------------------------------------------------------------


def test_only_what_changed_is_said_and_made_again() -> None:
    artist = paired()
    hands = artist.hands
    hands.changes()
    assert not hands.changes() and not hands.advance()
    still = {decal.patch: decal for decal in hands.overlay().decals}
    assert all(still[decal.patch] is decal for decal in hands.overlay().decals)
    hands.take_up("move")
    hands.select(surface="ball")
    start = artist.pixel("ball", artist.session.geometry.points("spot"))[18]
    artist.press(start)
    hands.changes()
    artist.move(np.add(start, (15.0, 5.0)))
    hands.advance()
    changed = hands.changes()
    assert {"document", "overlay"} <= changed.parts and not changed.surfaces
    now = {decal.patch: decal for decal in hands.overlay().decals}
    assert now["copy"] is still["copy"] and now["pad"] is still["pad"]
    assert now["spot"].triangles is still["spot"].triangles and now["spot"].points is not still["spot"].points
    artist.release(np.add(start, (15.0, 5.0)))
    hands.changes()
    copy = artist.pixel("ball", artist.session.geometry.points("copy"))[3]
    artist.drag(copy, np.add(copy, (5.0, 5.0)))
    assert hands.changes().surfaces == {"hand"}


def test_another_frame_or_document_ends_the_gesture() -> None:
    artist = ball_and_hand()
    artist.hands.take_up("move")
    start = artist.pixel("ball", artist.session.geometry.points("spot"))[18]
    before = document_to_json(artist.session.document)
    artist.press(start)
    artist.move(np.add(start, (9.0, 0.0)))
    artist.hands.take_up("turn")
    assert not artist.hands.is_busy and document_to_json(artist.session.document) == before


def test_a_mistake_in_a_tool_is_raised_and_leaves_nothing_open() -> None:
    artist = ball_and_hand()
    artist.hands.take_up("move")
    start = artist.pixel("ball", artist.session.geometry.points("spot"))[18]
    document = artist.session.document
    artist.press(start)
    gesture = artist.hands._gesture
    assert gesture is not None
    gesture.move = lambda pointer: 1 / 0  # type: ignore[method-assign, assignment, return-value]
    with pytest.raises(ZeroDivisionError):
        artist.move(np.add(start, (5.0, 5.0)))
    assert not artist.hands.is_busy and artist.session.document is document
    artist.session.patches.rename("spot", "stain")  # no stroke is in the way
