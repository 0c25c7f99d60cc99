"""What holds for every tool, by scripted events on a camera of numpy: no window, no toolkit."""

from __future__ import annotations

import cmath
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contact_core.contact.brush import BrushGesture, Screen
from contact_core.document.document import ContactDocument
from contact_core.document.schema import document_to_json
from contact_core.geometry.exact_geodesics import log_map
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.tool import TOOLS
from contact_core.interaction.view import world_per_pixel
from contact_core.plugins.registry import AXIS_GENERATORS, BRUSHES, POSE_SOLVERS
from contact_core.scene.problem import Objective, problem_of
from contact_core.solve.levenberg_marquardt import LevenbergMarquardt
from contact_core.solve.penetration import PenetrationTerm
from contact_core.solve.solver import SolveOptions
from contact_core.solve.terms import paper_terms
from contact_core.testing.artist import Artist, ball_and_hand, paired

SPOT = np.array([[0.0, 0.0], [6.0, -3.0], [14.0, 8.0]])  # pixels from where a drag begins


def by(x: float, y: float) -> Any:
    """(2,) pixels to the right and down."""
    return np.array([x, y], float)


def same(first: ContactDocument, second: ContactDocument) -> bool:
    """Equal content."""
    return bool(document_to_json(first) == document_to_json(second))


def on_spot(artist: Artist, point: int = 18) -> Any:
    """The pixel of a point of "spot" that is not its root."""
    return artist.pixel("ball", artist.session.geometry.points("spot"))[point]


def path(artist: Artist, tool: str) -> Any:
    """(k, 2) pixels of a drag that does something with a tool, and what is selected first."""
    start = on_spot(artist)
    if tool in ("erase",):
        return np.stack([start, start + by(2.0, 2.0)])
    if tool in ("lasso", "curve"):
        return start + 30.0 * np.array([[0, 0], [0.5, -0.5], [1, 0], [1, 1], [0.5, 1.3], [0, 1]])
    if tool == "transfer":
        artist.hands.select("spot")
        return on_spot(artist) + 60.0 + SPOT
    if tool in ("link", "pair"):
        other = artist.pixel("hand", artist.session.geometry.points("pad"))[12]
        if tool == "link":
            artist.session.patches.transfer("spot", "ball", artist.point("ball", start + by(60.0, 50.0)),
                                    direction=(0.0, 1.0, 0.0), name="near", mirrored=False)  # fmt: skip
            other = artist.pixel("ball", artist.session.geometry.points("near"))[12]
        return np.stack([start, 0.5 * (start + other), other])
    if tool == "joint":
        return artist.pixel("hand", artist.session.geometry.points("pad"))[12] + SPOT
    return start + SPOT


EDITING = tuple(name for name in ball_and_hand().session.plugins.offers(TOOLS) if name not in ("select", "measure"))


@pytest.mark.parametrize("tool", EDITING)
def test_a_gesture_is_one_step(tool: str) -> None:
    artist = ball_and_hand()
    pixels = path(artist, tool)
    artist.hands.take_up(tool)
    before, revision = artist.session.document, artist.session.revision
    artist.drag(*pixels)
    assert artist.session.revision == revision + 1, artist.hands.status
    assert not artist.hands.is_busy and not same(artist.session.document, before)
    artist.key("Ctrl+Z")
    assert artist.session.document is before
    artist.key("Ctrl+Shift+Z")
    assert not same(artist.session.document, before)


@pytest.mark.parametrize("tool", EDITING)
def test_escape_leaves_the_very_same_document(tool: str) -> None:
    artist = paired()
    pixels = path(artist, tool)
    artist.hands.take_up(tool)
    before, revision, scene = artist.session.document, artist.session.revision, artist.hands.desk.scene
    artist.press(pixels[0])
    for pixel in pixels[1:]:
        artist.move(pixel)
        artist.hands.advance()
    assert artist.hands.is_busy and artist.key("Escape")
    assert artist.session.document is before and artist.session.revision == revision
    assert artist.hands.desk.document is before and not artist.hands.is_busy
    for name, seen in artist.hands.desk.scene.surfaces.items():
        assert np.array_equal(seen.points, scene.surfaces[name].points), "it stays where the drag took it"
    artist.release(pixels[-1])
    assert artist.session.document is before


@pytest.mark.parametrize("tool", [t for t in EDITING if t not in ("paint", "erase", "lasso", "curve", "transfer")])
def test_there_and_back_is_no_edit(tool: str) -> None:
    artist = paired()
    pixels = path(artist, tool)
    artist.hands.take_up(tool)
    before, revision = artist.session.document, artist.session.revision
    artist.drag(*pixels, *pixels[-2::-1])
    assert artist.session.document is before and artist.session.revision == revision, artist.hands.status


@pytest.mark.parametrize("tool", EDITING)
def test_a_press_beside_everything_is_the_cameras(tool: str) -> None:
    artist = ball_and_hand()
    artist.hands.take_up(tool)
    assert not artist.press((2.0, 2.0)) and not artist.move((9.0, 9.0)) and not artist.release((9.0, 9.0))
    assert artist.session.revision == 0 and not artist.hands.is_busy


# -- events are direct verbs --------------------------------------------------------------------------------------


def heading(artist: Artist, start: SurfacePoints, end: SurfacePoints) -> complex:
    leg = complex(log_map(artist.session.geometry.mesh("ball"), start, end).coordinates[0])
    return leg / abs(leg)


def moved_by_its_root(artist: Artist, pixels: Any) -> None:
    artist.session.patches.translate("spot", artist.point("ball", pixels[-1]))


def turned(artist: Artist, pixels: Any) -> None:
    root = artist.session.geometry.root("spot").point()
    first, last = (heading(artist, root, artist.point("ball", pixel)) for pixel in (pixels[0], pixels[-1]))
    artist.session.patches.rotate("spot", cmath.phase(last / first))


def scaled(artist: Artist, pixels: Any) -> None:
    root = artist.pixel("ball", artist.session.geometry.root("spot").point())[0]
    first, last = (np.linalg.norm(pixel - root) for pixel in (pixels[0], pixels[-1]))
    artist.session.patches.scale("spot", along=last / first, spread=last / first)


def weighed(artist: Artist, pixels: Any) -> None:
    factor = 2.0 ** ((pixels[-1] - pixels[0])[0] / 120.0)
    artist.session.patches.weigh("spot", factor * artist.session.document.shape_of("spot").weights)


def drawn(artist: Artist, pixels: Any) -> None:
    ends = [artist.point("ball", pixel) for pixel in (pixels[0], pixels[-1])]
    artist.session.patches.set_axis("spot", SurfacePoints.concatenate(ends))


def transferred(artist: Artist, pixels: Any) -> None:
    root, end = (artist.point("ball", pixel) for pixel in (pixels[0], pixels[-1]))
    artist.session.patches.transfer("spot", "ball", root, heading=heading(artist, root, end), mirrored=False)


def joined(artist: Artist, pixels: Any) -> None:
    artist.session.pairs.add("pad", "spot")


def painted(artist: Artist, pixels: Any) -> None:
    seen = artist.hands.desk.scene.surfaces["ball"]
    hand = artist.hands.desk.scene.surfaces["hand"]
    stroke = BrushGesture(
        seen.rest, SurfacePoints.concatenate([]), radius=0.2, screen=pixels,
        rays=lambda at: seen.rays_of(artist.view, at), before=(Screen(hand.mesh, hand.surface @ seen.world),),
    )  # fmt: skip
    artist.session.patches.brush("disk", "spot", stroke)


VERBS: dict[str, Callable[[Artist, Any], None]] = {
    "turn": turned,
    "scale": scaled,
    "weigh": weighed,
    "axis": drawn,
    "transfer": transferred,
    "pair": joined,
    "paint": painted,
}


@pytest.mark.parametrize("tool", VERBS)
def test_events_are_direct_verbs(tool: str) -> None:
    artist, other = ball_and_hand(), ball_and_hand()
    artist.hands.set(live=False)
    pixels = path(artist, tool)
    path(other, tool)
    if tool == "paint":
        artist.hands.configure(TOOLS, "paint", radius=0.2)
    artist.hands.take_up(tool)
    artist.drag(*pixels)
    VERBS[tool](other, pixels)
    assert same(artist.session.document, other.session.document)


def test_a_patch_held_by_its_root_is_translated() -> None:
    artist, other = ball_and_hand(), ball_and_hand()
    artist.hands.select("spot")
    artist.hands.take_up("move")
    root = artist.pixel("ball", artist.session.geometry.root("spot").point())[0]
    artist.drag(*(root + SPOT))
    moved_by_its_root(other, root + SPOT)
    assert same(artist.session.document, other.session.document)


def test_the_point_that_was_grabbed_stays_under_the_pointer() -> None:
    """On a surface of constant curvature a patch moves rigidly, so every point of it can be checked."""
    artist = ball_and_hand()
    held = on_spot(artist)
    artist.hands.take_up("move")
    artist.drag(held, held + by(20.0, -10.0), held + by(60.0, 20.0))
    at = artist.pixel("ball", artist.session.geometry.points("spot"))[18]
    assert np.linalg.norm(at - (held + by(60.0, 20.0))) < 1.0  # a pixel: the ball has flat faces


def test_a_bend_follows_the_pointer_and_is_spread() -> None:
    artist = ball_and_hand()
    artist.hands.select("spot")
    artist.hands.take_up("bend")
    axis = artist.pixel("ball", artist.session.geometry.axis("spot").points)
    before = artist.session.document.effective_axis("spot").turning_angles
    artist.drag(axis[-1], axis[-1] + by(-5.0, 2.0), axis[-1] + by(-25.0, 8.0))
    turned_by = artist.session.document.effective_axis("spot").turning_angles - before
    after = artist.pixel("ball", artist.session.geometry.axis("spot").points)
    assert np.count_nonzero(turned_by) > 1 and (turned_by >= -1e-12).all(), turned_by
    assert np.linalg.norm(after[0] - axis[0]) < 1e-6  # the root stays
    assert (after[-1] - axis[-1])[0] < -10.0  # the end went with the pointer


# -- with a hand that follows -------------------------------------------------------------------------------------


def on_copy(artist: Artist) -> Any:
    return artist.pixel("ball", artist.session.geometry.points("copy"))[3]


def test_edit_and_pose_are_one_step() -> None:
    artist = paired()
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")
    before, revision = artist.session.document, artist.session.revision
    artist.drag(*(on_copy(artist) + SPOT))
    after = artist.session.document
    assert artist.session.revision == revision + 1
    assert after.patch("copy").placement != before.patch("copy").placement
    assert after.poses["hand"] is not before.poses.get("hand")
    assert artist.hands.desk.scene.surfaces["hand"].pose is after.poses["hand"]
    artist.session.undo()
    assert artist.session.document is before
    assert artist.hands.desk.scene.surfaces["hand"].pose is None


def test_the_hand_comes_to_its_contact() -> None:
    artist = paired()
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")

    def gap() -> float:
        scene, shown = artist.hands.desk.scene, artist.hands.desk.shown
        pad, copy = (scene.surfaces[s].positions(shown.points(p)) for s, p in (("hand", "pad"), ("ball", "copy")))
        return float(np.linalg.norm(pad - copy, axis=1).mean())

    far = gap()
    artist.drag(*(on_copy(artist) + SPOT))
    assert gap() < 0.1 * far


def test_only_the_newest_state_is_solved_for() -> None:
    artist = paired()
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")
    start = on_copy(artist)
    artist.press(start)
    for step in range(1, 20):
        artist.move(start + by(step, 0.0))
    artist.hands.advance()
    live = artist.hands._live
    assert live is not None and live.solves == 1
    while live.is_due:  # it goes on until the pose has settled
        artist.hands.advance()
        assert live.solves < 30
    settled = live.solves
    artist.hands.advance()
    assert live.solves == settled  # nothing new, so nothing to do
    artist.release(start + by(19.0, 0.0))
    assert "hand" in artist.session.document.poses


def test_beside_the_loop_the_hand_follows_as_within_it() -> None:
    """Steps on a thread: `advance` begins one for the newest, the edit waits for none and keeps the pose."""
    for beside in (False, True):
        artist = paired()
        artist.hands.close()
        hands = artist.hands = Interaction(artist.session, beside=beside)
        hands.take_up("move")
        hands.select(surface="ball")
        start = on_copy(artist)
        artist.press(start)
        for step in range(1, 20):
            artist.move(start + by(step, 0.0))
            hands.advance()
        live = hands._live
        assert live is not None and (beside or live.solves == 19)
        while hands.is_due:
            hands.advance()
        shown = hands.desk.document
        assert "hand" in shown.poses and (live.solves < 40 or not beside)
        artist.move(start + by(20.0, 0.0))  # the hand stays where it is until the next step is done
        assert hands.desk.document.poses["hand"] is shown.poses["hand"] and hands.desk.document is not shown
        hands.advance()
        artist.release(start + by(20.0, 0.0))
        assert_solved(artist)


def assert_solved(artist: Artist) -> None:
    """A full solve from the pose of the document finds nothing better."""
    objective = Objective((*paper_terms(), PenetrationTerm()))
    problem = problem_of(artist.session.geometry, artist.session.rigs, objective)
    full = LevenbergMarquardt().solve(problem, SolveOptions(max_iterations=500, candidates=("current",)))
    assert full.start_value <= 1.01 * full.value + 1e-9, (full.start_value, full.value)


def test_a_step_beside_the_loop_ends_with_the_gesture() -> None:
    artist = paired()
    artist.hands.close()
    hands = artist.hands = Interaction(artist.session, beside=True)
    hands.take_up("move")
    hands.select(surface="ball")
    before = artist.session.document
    start = on_copy(artist)
    artist.press(start)
    artist.move(start + by(9.0, 0.0))
    hands.advance()
    assert hands.is_due
    artist.key("Escape")
    assert not hands.is_due
    assert artist.session.document is before and hands.desk.document is before
    assert not [each for each in threading.enumerate() if each.name == "contact Follow"]


def test_letting_go_leaves_the_hand_where_a_full_solve_does() -> None:
    artist = paired()
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")
    artist.drag(*(on_copy(artist) + 4.0 * SPOT))
    assert_solved(artist)


def test_without_live_the_hand_stays() -> None:
    artist = paired()
    assert artist.key("V") and not artist.hands.settings.live
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")
    artist.drag(*(on_copy(artist) + SPOT))
    assert not artist.session.document.poses


def test_what_no_pair_sees_moves_no_hand() -> None:
    artist = paired()
    artist.hands.take_up("move")
    artist.drag(*(on_spot(artist) + SPOT))
    assert not artist.session.document.poses


def test_a_fingertip_follows_the_pointer() -> None:
    artist = ball_and_hand()
    artist.hands.take_up("joint")
    tip = artist.pixel("hand", artist.session.geometry.points("pad"))[12]
    for _ in range(3):
        artist.drag(tip, tip + by(-4.0, -10.0), tip + by(-10.0, -40.0))
        tip = artist.pixel("hand", artist.session.geometry.points("pad"))[12]
    pose = artist.session.document.poses["hand"]
    assert pose is artist.hands.desk.scene.surfaces["hand"].pose
    first = ball_and_hand()
    assert tip[1] < first.pixel("hand", first.session.geometry.points("pad"))[12][1] - 60.0


def test_a_hand_that_is_placed_is_not_pulled_back() -> None:
    artist = paired()
    artist.hands.take_up("place")
    artist.hands.select(surface="hand")
    artist.drag(*(artist.pixel("hand", artist.session.geometry.points("pad"))[12] + SPOT))
    assert not artist.session.document.poses
    artist.hands.select(surface="ball")
    artist.drag(*(on_spot(artist) + SPOT))
    assert "hand" in artist.session.document.poses  # the object moved, so the hand followed


# -- every plugin through the tools -------------------------------------------------------------------------------


@pytest.mark.parametrize("brush", ball_and_hand().session.plugins.offers(BRUSHES))
def test_every_brush_paints(brush: str) -> None:
    artist = ball_and_hand()
    artist.hands.take_up("paint")
    artist.hands.configure(TOOLS, "paint", brush=brush, radius=0.25)
    start, before = on_spot(artist), len(artist.session.geometry.points("spot"))
    erases = artist.session.makers.brush(brush).erases
    if not erases:
        start = start + by(10.0, 60.0)
        artist.hands.select("spot")
    artist.drag(*(start + (0.1 if erases else 30.0) * np.array([[0, 0], [0.5, -0.5], [1, 0], [1, 1], [0, 1]])))
    after = len(artist.session.geometry.points("spot"))
    assert (after < before) if erases else (after > before), artist.hands.status


@pytest.mark.parametrize("generator", ball_and_hand().session.plugins.offers(AXIS_GENERATORS))
def test_every_axis_generator_lays_an_axis(generator: str) -> None:
    artist = ball_and_hand()
    artist.hands.take_up("paint")
    artist.hands.configure(TOOLS, "paint", generator=generator, radius=0.2)
    artist.drag(*(on_spot(artist) + by(20.0, 70.0) + SPOT), held=("shift",))
    if generator != "along_bone":  # which needs a rig, and says so
        assert "contact" in artist.session.document.patches, artist.hands.status


@pytest.mark.parametrize("solver", ball_and_hand().session.plugins.offers(POSE_SOLVERS))
def test_every_solver_follows(solver: str) -> None:
    artist = paired()
    artist.hands.set(solver=solver, iterations=4)
    artist.hands.take_up("move")
    artist.hands.select(surface="ball")
    artist.drag(*(on_copy(artist) + SPOT[:2]))
    assert "hand" in artist.session.document.poses, artist.hands.status


# -- through one another ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tool", ["move", "bend"])
def test_a_handle_on_another_surface_takes_no_press(tool: str) -> None:
    """What touches lies in one place: the root of the hand's patch is where the ball's is pressed."""
    artist = ball_and_hand()
    spot = artist.pixel("ball", artist.session.geometry.axis("spot").points)[-1]
    pad = artist.hands.desk.scene.surfaces["hand"].positions(artist.session.geometry.root("pad").point())[0]
    there = artist.session.document.surface("hand").world_from_surface.copy()
    origin, direction = (part[0] for part in artist.view.rays([spot]))
    there[:3, 3] += origin + 3.0 * direction - pad
    artist.session.surfaces.place("hand", there)
    artist.hands.select("pad", surface="ball")
    artist.hands.take_up(tool)
    before = artist.session.document
    artist.drag(spot, spot + by(12.0, -10.0))
    assert artist.session.document.patch("pad") == before.patch("pad")
    assert artist.session.document is not before and artist.hands.selection.patch == "spot"


def test_contacts_are_reached_through_what_hides_them() -> None:
    artist = ball_and_hand()
    there = artist.session.document.surface("hand").world_from_surface.copy()
    there[:3, 3] = [-8.0, 0.0, 6.0]  # before the ball
    artist.session.surfaces.place("hand", there)
    hit = artist.hands.desk.scene.pick(artist.view, on_spot(artist))
    assert hit is not None and hit.surface == "hand"
    artist.key("Tab")
    artist.key("Tab")
    assert artist.hands.selection.surface == "ball"
    artist.hands.take_up("move")
    before = artist.session.document
    artist.drag(*(on_spot(artist) + SPOT))
    assert artist.session.document.patch("spot").placement != before.patch("spot").placement


def test_a_stroke_on_a_posed_hand_lands_where_it_is_seen() -> None:
    artist = ball_and_hand()
    artist.hands.take_up("joint")
    tip = artist.pixel("hand", artist.session.geometry.points("pad"))[12]
    artist.drag(tip, tip + by(-10.0, -40.0), tip + by(-30.0, -120.0))
    posed = artist.pixel("hand", artist.session.geometry.points("pad"))[12]
    assert posed[1] < tip[1] - 40.0
    artist.hands.take_up("paint")
    artist.hands.configure(TOOLS, "paint", radius=0.04)
    stroke = posed + np.array([[-4.0, 0.0], [0.0, 2.0], [4.0, 0.0]])
    artist.drag(*stroke, held=("shift",))
    assert "contact" in artist.session.document.patches, artist.hands.status
    at = artist.pixel("hand", artist.session.geometry.points("contact"))
    reach = 4.0 + 0.04 / world_per_pixel(artist.view, np.array([0.8, -1.0, 0.0]))
    assert np.linalg.norm(at - posed, axis=1).max() < 1.5 * reach


def test_a_stroke_ends_where_another_surface_hides_it() -> None:
    artist = ball_and_hand()
    there = artist.session.document.surface("hand").world_from_surface.copy()
    there[:3, 3] = [-4.4, 0.0, 6.0]  # before the right half of the ball
    artist.session.surfaces.place("hand", there)
    artist.hands.take_up("paint")
    artist.hands.configure(TOOLS, "paint", radius=0.1)
    y = artist.at((-1.1, 0.0, 1.0))[1] + 2.0
    left, right = artist.at((-1.8, 0.0, 0.7))[0], artist.at((-0.4, 0.0, 0.7))[0]
    artist.drag((left, y), (0.5 * (left + right), y), (right, y), held=("shift",))
    x = artist.pixel("ball", artist.session.geometry.points("contact"))[:, 0]
    artist.hands.select(surface="ball")
    artist.drag((left, y), (0.5 * (left + right), y), (right, y), held=("shift",))
    through = artist.pixel("ball", artist.session.geometry.points("contact.2"))[:, 0]
    assert x.max() < 0.6 * right + 0.4 * left and through.max() > 0.9 * right


def test_another_hand_undoes_in_the_middle_of_a_drag() -> None:
    """A host's own undo ends the gesture, and its document stands."""
    artist = ball_and_hand()
    artist.hands.take_up("move")
    artist.session.patches.rename("pad", "palm")
    earlier = artist.session.revision - 1
    artist.press(on_spot(artist))
    artist.move(on_spot(artist) + SPOT[2])
    artist.session.goto(earlier, origin="host")
    document = artist.session.document
    assert not artist.hands.is_busy
    artist.release(on_spot(replace(artist)) if "spot" in document.patches else (0.0, 0.0))
    assert artist.session.document is document and artist.hands.desk.document is document
