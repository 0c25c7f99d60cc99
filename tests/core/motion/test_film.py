"""Solving the film of a session: one proposal, few keys, one step of document and scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contact_core as contact
from contact_core.document.schema import dump_document, inconsistencies
from contact_core.document.timeline import PoseKey, address
from contact_core.edit.commands import SetKeys
from contact_core.errors import Cancelled, InvalidInput
from contact_core.motion.detection import DetectionOptions
from contact_core.motion.problem import MotionBounds, MotionWeights
from contact_core.motion.reduction import skin_errors
from contact_core.motion.report import motion_report
from contact_core.progress import CallbackProgress
from contact_core.proposals.motion import MotionProposal, MotionSettings
from contact_core.rig.pose_keys import PoseKeys
from contact_core.session import Session
from contact_core.solve.solver import SolveStatus
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig
from contact_core.testing.rigs import tentacle

ARM, BALL = "arm", "ball"


def assets() -> dict[str, contact.Asset]:
    rig, small = arm_rig(), meshes.icosphere(2)
    ball = contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    return {
        ARM: contact.Asset(ARM, rig.surface, rig, meters_per_unit=1.0),
        BALL: contact.Asset(BALL, ball, meters_per_unit=1.0),
    }


def film(session: Session) -> None:
    """The tip of the arm touches a ball that moves and on which the contact slides, from frame 8 to 20 of 24."""
    arm, thing = session.geometry.mesh(ARM), session.geometry.mesh(BALL)
    tip = int(np.argmax(arm.points[:, 1] + arm.points[:, 0]))
    near = contact.SurfacePoints.at_vertices(
        arm, np.argsort(np.linalg.norm(arm.points - arm.points[tip], axis=1))[:6]
    )
    session.patches.paint("tip", near, surface=ARM, axis=near[:1], heading=1.0)
    side, beside = np.argsort(thing.points[:, 0])[[0, 8]]
    copy = session.patches.transfer("tip", BALL, contact.SurfacePoints.at_vertices(thing, [side]), heading=1.0)
    session.pairs.add("tip", copy, name="touch")
    session.timeline.set(0, 24, 24)
    session.timeline.key("placement", copy, frame=8)
    session.timeline.key("place", BALL, frame=0)
    session.timeline.go(20)
    session.patches.translate(copy, contact.SurfacePoints.at_vertices(thing, [beside]))
    moved = np.eye(4)
    moved[:3, 3] = (0.0, 0.15, 0.05)
    session.surfaces.place(BALL, moved)
    session.timeline.hold("touch", 8, 20, ease_in=6, ease_out=4)


@pytest.fixture
def session() -> Session:
    session = contact.new(**assets(), discover=False)
    film(session)
    return session


def solved(session: Session, **more: object) -> MotionProposal:
    found = session.solve(frames=session.timeline.settings.frames(), **more)  # type: ignore[arg-type]
    assert isinstance(found, MotionProposal)
    return found


def test_a_film_is_solved_into_few_keys_in_one_step(session: Session) -> None:
    before, steps = dump_document(session.timed_document), len(session.history.steps)
    found = solved(session)
    assert dump_document(session.timed_document) == before  # nothing is committed
    assert found.motion is not None and found.motion.status is SolveStatus.CONVERGED
    session.accept(found)
    assert len(session.history.steps) == steps + 1 and not list(inconsistencies(session.timed_document))
    track = session.timeline.track("pose", ARM)
    assert track is not None and 2 <= len(track.keys) <= 12
    keys = track.of(PoseKey)
    assert not any(key.is_authored for key in keys) and session.timeline.stale(ARM) == ()
    rig, frames = session.rigs[ARM], found.motion.motion.frames
    shown = [session.timeline.at(frame).poses[ARM] for frame in frames]
    off = skin_errors(rig, frames, found.motion.poses(ARM), PoseKeys(rig.name, frames, tuple(shown)))
    assert off.max() <= 1.01e-3  # a millimetre
    report, alone = found.report(depth=False), motion_report(found.motion.motion, found.motion.causal, solids={})
    assert report.pairs["touch"].frames == 13 and report.pop < 2.0
    assert report.pairs["touch"].mean < 1.1 * alone.pairs["touch"].mean  # as near as frame by frame
    session.undo()
    assert dump_document(session.timed_document) == before


def test_contacts_slide_smoothly_in_what_is_solved(session: Session) -> None:
    found = solved(session)
    assert found.motion is not None
    problems = found.motion.motion.problems
    centres = np.array(
        [p.contacts[0].object_points.positions(session.geometry.mesh(BALL)).mean(axis=0) for p in problems]
    )
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    assert steps[:8].max() < 1e-12 and steps[20:].max() < 1e-12 and steps[8:20].min() > 0.0
    gains = [p.contacts[0].gain for p in problems]
    assert gains[2] == 0.0 and gains[8] == gains[20] == 1.0 and 0.0 < gains[5] < 1.0 and gains[24] == 0.0


def test_keys_that_a_person_made_are_pins(session: Session) -> None:
    rest = contact.Pose.rest(session.rigs[ARM])
    session.timeline.key("pose", ARM, rest, frame=0)
    session.timeline.key("pose", ARM, rest, frame=24)
    session.accept(solved(session))
    track = session.timeline.track("pose", ARM)
    assert track is not None
    first, *solved_keys, last = track.of(PoseKey)
    assert first.is_authored and last.is_authored and not any(key.is_authored for key in solved_keys)
    for key in (first, last):
        assert np.array_equal(key.pose.local, rest.local)
    session.accept(solved(session))  # again: solved keys give way, the person's stay
    again = session.timeline.track("pose", ARM)
    assert again is not None and len(again.keys) <= len(track.keys) + 2
    assert [key.frame for key in again.of(PoseKey) if key.is_authored] == [0.0, 24.0]


def test_a_dragged_key_changes_its_window_alone(session: Session) -> None:
    session.timeline.set(0, 96)
    session.accept(solved(session))
    before = {frame: session.timeline.at(frame).poses[ARM].local for frame in (0.0, 60.0, 96.0)}
    session.timeline.go(14)
    pose = session.document.poses[ARM]
    local = pose.local.copy()
    local[0, :3, 3] += 0.02
    session.surfaces.set_pose(ARM, replace(pose, local=local))
    assert session.timeline.stale(ARM)
    window = session.timeline.window(seconds=1.0)
    assert window[0] == 2.0 and window[-1] == 26.0
    found = session.solve(frames=window)
    assert isinstance(found, MotionProposal) and found.motion is not None
    assert set(found.motion.motion.frames) == {0.0, 1.0, *window, 27.0, 28.0}
    session.accept(found)
    assert np.abs(session.timeline.at(14).poses[ARM].local - local).max() < 1e-9  # where it was dragged to
    for frame, was in before.items():
        assert np.abs(session.timeline.at(frame).poses[ARM].local - was).max() < 2e-3, frame


def test_a_host_gets_keys_in_the_same_step() -> None:
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    with contact.Session(host=host, objects=None, discover=False) as session:
        film(session)
        states = len(host._states)
        found = solved(session)
        session.accept(found)
        assert len(host._states) == states + 1
        keyed = host.pose_keys(ARM)
        assert keyed == tuple(found.keys) and keyed[0] == 0.0 and keyed[-1] == 24.0
        session.undo()
        assert host.pose_keys(ARM) == () and session.timeline.track("pose", ARM) is None


def test_a_clip_is_followed(session: Session) -> None:
    """With a weight to follow, what has no contact stays as it was keyed."""
    rig = session.rigs[ARM]
    bent = rig.rest_local.copy()
    bent[-1, :3, :3] = bent[-1, :3, :3] @ np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    keys = tuple(PoseKey(f, contact.Pose(rig.joints, local), None, "smooth", "clip")
                 for f, local in ((0.0, rig.rest_local), (24.0, bent)))  # fmt: skip
    session.do(SetKeys(address("pose", ARM), keys))
    followed = solved(session, motion=MotionSettings(weights=MotionWeights(follow=50.0)), prior="current")
    free = solved(session, prior="current")

    def off(found: MotionProposal) -> float:
        assert found.motion is not None
        last = found.motion.poses(ARM)[-1].local
        return float(np.abs(last - bent).max())

    assert off(followed) < 0.5 * off(free) or off(followed) < 1e-3


def test_cancelling_keeps_the_best_so_far(session: Session) -> None:
    told: list[str] = []

    def stop(fraction: float | None, text: str) -> None:
        told.append(text)
        if "all frames" in text or "iteration" in text:
            raise Cancelled("enough")

    found = solved(session, progress=CallbackProgress(stop))
    assert found.motion is not None and found.motion.status is SolveStatus.CANCELLED and told
    assert found.motion.value <= found.motion.causal_value

    def at_once(fraction: float | None, text: str) -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        solved(session, progress=CallbackProgress(at_once))


def test_what_cannot_be_solved_is_said(session: Session) -> None:
    with pytest.raises(InvalidInput, match="each once"):
        session.solve(frames=[1, 1])
    with pytest.raises(InvalidInput, match="each once"):
        session.solve(frames=[])
    with pytest.raises(InvalidInput, match="each once"):
        session.solve(frames=[float("nan")])
    session.pairs.remove("touch")
    with pytest.raises(InvalidInput, match="pair patches"):
        session.solve(frames=[0, 1])
    with pytest.raises(InvalidInput, match="tolerance"):
        MotionSettings(tolerance=0.0)


def test_the_report_is_that_of_the_motion(session: Session) -> None:
    found = solved(session)
    assert found.motion is not None
    report, again = found.report(), motion_report(found.motion.motion, found.motion.thetas)
    assert report.pairs == again.pairs and report.keys == {ARM: len(found.reductions[ARM].keys.frames)}


# --- detection ----------------------------------------------------------------------------------------------


def visit(skate: float) -> Session:
    """A tentacle comes down onto a floor in 12 frames, stands there for 24, slipping to and fro, and leaves."""
    rig = tentacle(3)
    rig = replace(rig, faces=rig.faces[:, ::-1])  # with its skin outside
    low = float(rig.surface.points[:, 1].min())
    plane = meshes.plane(16, 40.0)
    flat = (plane.points - plane.points.mean(axis=0))[:, [0, 2, 1]] + [0.0, low, 0.0]
    floor = contact.TriangleMesh(flat, plane.faces[:, ::-1])
    session = Session(discover=False)
    session.surfaces.add("arm", rig.surface, rig=rig)
    session.surfaces.add("floor", floor)
    session.timeline.set(0, 48)
    keys = []
    for frame in range(49):
        local = rig.rest_local.copy()
        local[0, :3, 3] += [skate * np.sin(0.8 * frame), 0.3 * max(12 - frame, 0, frame - 36), 0.0]
        keys.append(PoseKey(float(frame), contact.Pose(rig.joints, local), None, "linear", "clip"))
    session.do(SetKeys(address("pose", "arm"), tuple(keys)))
    return session


def test_the_contacts_of_a_clip_are_proposed_accepted_and_hold() -> None:
    session = visit(0.02)
    told: list[contact.ContactDocument] = []
    session.listen(lambda change: told.append(change.after))
    before, steps = dump_document(session.timed_document), len(session.history.steps)
    found = session.detect(options=DetectionOptions(near=0.04, far=0.08))
    assert dump_document(session.timed_document) == before and told[-1].pairs  # a ghost
    feet = [each for each in found.found if each.span.joint == "link00"]
    assert len(feet) == 1 and abs(feet[0].span.on - 12) <= 3 and abs(feet[0].span.off - 36) <= 3
    session.accept(found)
    assert len(session.history.steps) == steps + 1 and not list(inconsistencies(session.timed_document))
    foot = feet[0]
    (span,) = session.timeline.spans(foot.pair)
    assert (span.on, span.off) == (foot.span.on, foot.span.off)
    session.timeline.go(24)
    (pair,) = (pair for pair in session.geometry.pairs() if pair.pair.name == foot.pair)
    here = pair.manipulator_points.positions(session.geometry.mesh("arm"))
    there = pair.object_points.positions(session.geometry.mesh("floor"))
    assert np.linalg.norm(here - there, axis=1).mean() < 0.35  # the pad lies where it was seen

    weights = MotionWeights(skate=50.0, follow=100.0)
    repaired = session.solve(
        frames=session.timeline.settings.frames(), motion=MotionSettings(weights=weights), prior="current",
        pairs=[foot.pair],
    )  # fmt: skip
    assert isinstance(repaired, MotionProposal) and repaired.motion is not None
    motion = repaired.motion.motion
    clip = np.array([problem.start for problem in motion.problems])
    skates = [
        motion_report(motion, thetas, solids={}).pairs[foot.pair].skate_rms
        for thetas in (clip, repaired.motion.thetas)
    ]
    assert skates[1] < 0.25 * skates[0]
    session.undo()
    assert dump_document(session.timed_document) == before


def test_nothing_is_proposed_where_nothing_touches_and_the_rest_is_said() -> None:
    session = visit(0.0)
    session.timeline.key(
        "place", "floor", np.array([[1, 0, 0, 0], [0, 1, 0, -9], [0, 0, 1, 0], [0, 0, 0, 1.0]]), frame=0
    )
    assert session.detect().found == ()
    alone = contact.new(arm=assets()[ARM], discover=False)
    with pytest.raises(InvalidInput, match="an object"):
        alone.detect([0, 1])
    with pytest.raises(Cancelled):
        session.detect(progress=CallbackProgress(lambda fraction, text: _stop()))


def _stop() -> None:
    raise Cancelled("enough")


def test_a_clip_in_a_scene_is_repaired_at_its_own_keys() -> None:
    """The scene's keys within the range take part: what lies between would stay as it slipped."""
    known = visit(0.02)
    host = contact.MemoryHost()
    rig = known.rigs["arm"]
    host.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    host.add(contact.Asset("floor", known.geometry.mesh("floor"), meters_per_unit=1.0))
    track = known.timeline.track("pose", "arm")
    assert track is not None
    for key in track.of(PoseKey):
        host.write_pose("arm", key.pose, key.frame)
    host.write_pose("arm", contact.Pose.rest(rig), 60.0)  # beyond the range
    with contact.Session(host=host, objects=None, discover=False) as session:
        session.timeline.set(0, 48)
        session.accept(session.detect(options=DetectionOptions(near=0.04, far=0.08)))
        weights = MotionWeights(skate=50.0, follow=100.0)
        found = session.solve(
            frames=session.timeline.settings.frames(), motion=MotionSettings(weights=weights), prior="current"
        )
        session.accept(found)
        assert isinstance(found, MotionProposal) and found.motion is not None
        assert host.pose_keys("arm") == (*map(float, range(49)), 60.0)
        for frame in (0.0, 20.0, 37.0):
            wanted = found.motion.by_frame[int(frame)]["arm"]
            assert np.abs(host.read_pose("arm", frame).local - wanted.local).max() < 1e-5
        assert np.abs(host.read_pose("arm", 60.0).local - rig.rest_local).max() < 1e-5


def test_skin_in_transit_keeps_to_its_depth(session: Session) -> None:
    """What is too deep at frames without a contact that is fully on gets a wall, dearer and dearer."""
    free = solved(session).report()
    bound = 0.5 * free.penetration_transit
    assert bound > 0.0
    bounded = solved(session, motion=MotionSettings(bounds=MotionBounds(depth=bound))).report()
    assert bounded.penetration_transit <= 1.05 * bound
    assert bounded.pairs["touch"].mean < 1.2 * free.pairs["touch"].mean  # what is held stays
