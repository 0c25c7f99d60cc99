"""The timeline's data: bars, keys, curves and ghosts of a film, dragging in one step, and playing in time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import contact_core as contact
from contact_core.document.schema import dump_document
from contact_core.document.timeline import Span, Timeline
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.interaction.film import FilmDesk
from contact_core.interaction.film_shapes import HEIGHT, shapes_of
from contact_core.interaction.interaction import Interaction
from contact_core.interaction.playback import Playback
from contact_core.motion.report import motion_report
from contact_core.motion.series import motion_series
from contact_core.proposals.motion import MotionProposal

sys.path.insert(0, str(Path(__file__).parents[1] / "motion"))
from test_film import ARM, BALL, assets, film  # type: ignore[import-not-found]


@pytest.fixture
def hand() -> Iterator[Interaction]:
    session = contact.new(**assets(), discover=False)
    film(session)
    interaction = Interaction(session)
    yield interaction
    interaction.close()


def measured(desk: FilmDesk) -> None:
    assert desk.measure()
    assert desk.worker.wait(60.0) and desk.poll()


def test_it_shows_bars_keys_and_where_the_frame_is(hand: Interaction) -> None:
    view = hand.film.view()
    assert (view.first, view.last, view.rate, view.frame) == (0.0, 24.0, 24.0, 20.0)
    (bar,) = view.bars
    assert (bar.pair, bar.on, bar.off, bar.ease_in, bar.ease_out) == ("touch", 8.0, 20.0, 6.0, 4.0)
    assert {(mark.track, mark.frame) for mark in view.keys if mark.track == f"place/{BALL}"} == {
        (f"place/{BALL}", 0.0), (f"place/{BALL}", 20.0)
    }  # fmt: skip
    assert not view.curves and not view.measured
    hand.session.timeline.set_spans("touch", ())
    (bar,) = hand.film.view().bars
    assert (bar.index, bar.on, bar.off) == (-1, 0.0, 24.0)  # without spans it holds throughout


def test_keys_by_who_made_them(hand: Interaction) -> None:
    session = hand.session
    session.accept(session.solve(frames=session.timeline.settings.frames()))
    kinds = {mark.kind for mark in hand.film.view().keys if mark.track == f"pose/{ARM}"}
    assert kinds == {"solved"}
    session.timeline.key("pose", ARM, frame=12)
    marks = {mark.frame: mark.kind for mark in hand.film.view().keys if mark.track == f"pose/{ARM}"}
    assert marks[12.0] == "authored" and "stale" in marks.values()


def test_curves_are_the_figures_of_the_film(hand: Interaction) -> None:
    session = hand.session
    found = session.solve(frames=session.timeline.settings.frames())
    assert isinstance(found, MotionProposal) and found.motion is not None
    session.accept(found)
    measured(hand.film)
    view = hand.film.view()
    error, skate, acceleration, depth = view.curves
    assert view.measured and [c.name for c in view.curves][:2] == ["contact error", "skate"]
    report = motion_report(found.motion.motion, found.motion.thetas, solids={}).pairs["touch"]
    assert np.nanmax(error.values) == pytest.approx(1e3 * report.worst, abs=1.0)  # keys are within a millimetre
    assert error.worst is not None and 8.0 <= error.worst <= 20.0 and error.pair == "touch"
    assert np.isnan(error.values[:8]).all() and np.isfinite(error.values[8:21]).all()
    assert np.isfinite(acceleration.values[1:-1]).all() and np.isfinite(depth.values).all()
    assert skate.unit == "mm/s" and view.bars[0].levels[0][0] == 8.0 and view.bars[0].levels[-1][1] == 20.0
    session.timeline.hold("touch", 8, 16)
    shapes = shapes_of(view)  # of what was measured
    assert [lane.partition(":")[0] for lane in shapes.lanes[-4:]] == [c.name for c in view.curves[::-1]]
    curves = shapes.segments[shapes.segments[..., 1].min(axis=1) > len(shapes.lanes) - 1]  # the uppermost lane
    assert len(curves) == 1 + 12 and curves[1:, :, 0].min() == 8.0  # its limit, and where it holds
    assert (np.floor(curves[..., 1]) == len(shapes.lanes) - 1).all()
    assert not hand.film.view().measured  # the document moved on
    assert hand.film.measure() and hand.film.measure() is not None


def proposed(hand: Interaction) -> MotionProposal:
    assert hand.worker.wait(600.0)
    hand.advance()
    found = hand.proposing.proposal
    assert isinstance(found, MotionProposal), hand.status
    return found


def test_the_film_is_solved_beside_the_window_and_a_drag_solves_what_is_round_it(hand: Interaction) -> None:
    session = hand.session
    steps = len(session.history.steps)
    hand.do("film.solve")
    assert proposed(hand).motion is not None and len(session.history.steps) == steps  # a ghost so far
    hand.do("edit.accept")
    assert len(session.history.steps) == steps + 1 and session.timeline.stale(ARM) == ()
    session.timeline.set(last=80)
    hand.do("film.solve")
    proposed(hand)
    hand.do("edit.accept")
    session.timeline.move_span("touch", 14.0, "off", 18.0)  # a drag in the timeline
    stale = session.timeline.stale(ARM)
    hand.follow_film(18.0)
    assert stale and hand.worker.status is None  # a front end that does not advance by itself is left alone
    hand.film.follows = True
    hand.follow_film(18.0)
    frames = proposed(hand).motion.motion.frames
    assert frames[0] == 0.0 and 42.0 <= frames[-1] <= 44.0  # a second on either side, and what is pinned
    hand.do("edit.accept")
    assert not [frame for frame in session.timeline.stale(ARM) if frame <= 40.0]
    hand.set(live=False)
    session.timeline.move_span("touch", 14.0, "off", 20.0)
    hand.follow_film(20.0)
    assert hand.worker.status is None


def test_frames_that_are_cancelled_give_the_best_so_far_or_say_so(hand: Interaction) -> None:
    session = hand.session
    before = session.document
    hand.solve_frames(range(25))
    assert hand.worker.status is not None
    hand.do("edit.cancel")
    assert hand.worker.wait(60.0)
    hand.advance()
    assert hand.proposing.is_cut_short or "cancelled" in hand.status.refusal
    assert session.document is before and f"pose/{ARM}" not in session.timed_document.tracks


def test_a_film_without_a_range_or_a_pair_is_refused_in_words(hand: Interaction) -> None:
    hand.session.pairs.remove("touch")
    with pytest.raises(CommandRejected, match="no pair yet"):
        hand.do("film.solve")
    hand.session.timeline.set(0, 0)
    with pytest.raises(CommandRejected, match="one frame"):
        hand.do("film.window")


def test_shapes_have_a_lane_for_each_pair_and_track(hand: Interaction) -> None:
    shapes = shapes_of(hand.film.view())
    assert shapes.lanes[-1] == "touch" and set(shapes.lanes[:-1]) == {
        f"place of {BALL}",
        "placement of " + hand.session.document.pairs["touch"].object,
    }
    lane = len(shapes.lanes) - 1
    assert (np.floor(shapes.triangles[..., 1]) == lane).all()
    across = shapes.triangles[..., 0]
    assert (across.min(), across.max()) == (2.0, 24.0)  # with its ramps
    one, two = (shapes.triangles[:, k] - shapes.triangles[:, 0] for k in (1, 2))
    areas = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    assert areas.sum() == pytest.approx(2 * HEIGHT * (12 + 0.5 * (6 + 4)))
    assert sorted(shapes.keys[:, 0]) == [0.0, 8.0, 20.0, 20.0] and not any(shapes.hollow)


def test_series_agree_with_the_report(hand: Interaction) -> None:
    found = hand.session.solve(frames=hand.session.timeline.settings.frames())
    assert isinstance(found, MotionProposal) and found.motion is not None
    motion, thetas = found.motion.motion, found.motion.thetas
    series, report = motion_series(motion, thetas), motion_report(motion, thetas)
    pair = report.pairs["touch"]
    assert np.nanmax(series.error) == pytest.approx(pair.worst)
    assert np.nanmax(series.skate) == pytest.approx(pair.skate_max)
    assert np.nanmax(series.acceleration) == pytest.approx(report.joint_acceleration)
    assert np.nanmax(series.depth) == pytest.approx(max(report.penetration_held, report.penetration_transit))
    assert np.isnan(motion_series(motion, thetas, solids={}).depth).all()
    with pytest.raises(InvalidInput, match="shape"):
        motion_series(motion, thetas[:-1])


def test_nothing_to_measure_is_no_error(hand: Interaction) -> None:
    hand.session.pairs.remove("touch")
    assert not hand.film.measure() and hand.film.view().curves == ()


@pytest.mark.parametrize(
    ("frame", "part", "to", "wanted"),
    [
        (12, "on", 10, Span(10, 20, 6, 4)),
        (12, "on", 30, Span(20, 20, 6, 4)),  # stops at the other end
        (12, "off", 22, Span(8, 22, 6, 4)),
        (4, "ease_in", 5, Span(8, 20, 3, 4)),
        (12, "ease_out", 18, Span(8, 20, 6, 0)),
        (12, "all", 15, Span(11, 23, 6, 4)),
    ],
)
def test_a_span_is_dragged_in_one_step(hand: Interaction, frame: float, part: str, to: float, wanted: Span) -> None:
    timeline, session = hand.session.timeline, hand.session
    before, steps = dump_document(session.timed_document), len(session.history.steps)
    timeline.move_span("touch", frame, part, to)  # type: ignore[arg-type]
    assert timeline.spans("touch") == (wanted,) and len(session.history.steps) == steps + 1
    session.undo()
    assert dump_document(session.timed_document) == before


def test_spans_do_not_run_into_one_another(hand: Interaction) -> None:
    timeline = hand.session.timeline
    timeline.set_spans("touch", (Span(2, 6), Span(8, 12)))
    with pytest.raises(CommandRejected, match="another"):
        timeline.move_span("touch", 4, "off", 9)
    with pytest.raises(CommandRejected, match="no span"):
        timeline.move_span("touch", 20, "off", 22)
    with pytest.raises(InvalidInput, match="parts"):
        timeline.move_span("touch", 4, "middle", 5)  # type: ignore[arg-type]


def test_ghosts_stand_where_the_film_is(hand: Interaction) -> None:
    session = hand.session
    session.accept(session.solve(frames=session.timeline.settings.frames()))
    session.timeline.go(12)
    assert not hand.overlay().ghosts
    hand.show_onion(2, 4)
    ghosts = hand.overlay().ghosts
    assert len(ghosts) == 4
    session.timeline.go(16)  # where a ghost was, the hand is now
    seen = hand.desk.scene.surfaces[ARM].points
    assert min(np.abs(ghost.points - seen).max() for ghost in ghosts) < 1e-9
    with pytest.raises(InvalidInput, match="ghosts"):
        hand.show_onion(-1)
    hand.do("film.onion")
    assert not hand.overlay().ghosts


def test_playing_keeps_time_and_escape_ends_it(hand: Interaction) -> None:
    desk, timeline = hand.film, hand.session.timeline
    timeline.go(0)
    desk.play(10.0)
    shown = []
    for now in (10.0, 10.02, 10.1, 10.5, 11.0, 11.1):
        desk.advance(now)
        shown.append(timeline.frame)
    assert shown == [0.0, 0.0, 2.0, 12.0, 24.0, 1.0]  # slow front ends leave frames out; then over and over
    hand.do("edit.cancel")
    assert not desk.playback.is_playing and not desk.advance(20.0)
    timeline.set(0, 0)
    with pytest.raises(InvalidInput, match="one frame"):
        desk.play(0.0)


@given(st.floats(0.0, 1e4), st.floats(-50.0, 50.0), st.floats(0.0, 90.0), st.integers(1, 60), st.booleans())
def test_what_plays_is_in_the_film(now: float, first: float, length: float, rate: int, loop: bool) -> None:
    playback, timeline = Playback(), Timeline((rate, 1), first, first + length)
    playback.loop = loop
    playback.start(0.0, first)
    frame = playback.frame(now, timeline)
    assert frame is not None and timeline.first <= frame <= timeline.last
    if not loop and now > (length + 1) / rate:
        assert frame == timeline.last and not playback.is_playing
