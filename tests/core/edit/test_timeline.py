"""The film of a session: keys, spans, the frame that is shown, and edits that become keys."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from contact_core.contact.placement import Root, Walk
from contact_core.document.schema import dump_document, inconsistencies
from contact_core.document.timeline import PoseKey, Span
from contact_core.edit.commands import Pair, SetKeys
from contact_core.errors import CommandRejected, InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.session import DocumentChanged, Session
from contact_core.testing.rigs import tentacle


def somewhere(session: Session, seed: int, surface: str = "torus") -> SurfacePoints:
    random = np.random.default_rng(seed)
    return SurfacePoints(
        [int(random.integers(len(session.geometry.mesh(surface).faces)))], [random.dirichlet(np.ones(3))]
    )


@pytest.fixture
def sliding(session: Session) -> Session:
    """The palm has keys at 0 and 20; its thumb is paired with a copy on the sphere."""
    session.timeline.set(0, 48, 24)
    session.timeline.key("placement", "palm", frame=0)
    session.timeline.go(20)
    session.patches.translate("palm", somewhere(session, 1))
    copy = session.patches.transfer("thumb", "sphere", somewhere(session, 7, "sphere"), heading=1.0)
    session.pairs.add("thumb", copy, name="grip")
    return session


def test_an_edit_at_a_frame_is_a_key_where_a_track_exists(sliding: Session) -> None:
    track = sliding.timeline.track("placement", "palm")
    assert track is not None and track.frames == (0.0, 20.0)
    first, second = (sliding.timeline.at(frame).patches["palm"].placement for frame in (0, 20))
    assert first != second and isinstance(second, Root)
    assert isinstance(sliding.timeline.at(10).patches["palm"].placement, Walk)
    placed = sliding.timed_document.patches["thumb"].placement
    sliding.patches.translate("thumb", somewhere(sliding, 2))  # has no track
    assert sliding.timeline.track("placement", "thumb") is None
    assert sliding.timed_document.patches["thumb"].placement != placed


def test_between_keys_a_patch_is_edited_where_it_is_shown(sliding: Session) -> None:
    sliding.timeline.go(10)
    root = sliding.geometry.root("palm")
    sliding.patches.rotate("palm", 0.5)
    turned = sliding.geometry.root("palm")
    assert turned.face == root.face and np.isclose(np.angle(turned.heading / root.heading), 0.5)
    track = sliding.timeline.track("placement", "palm")
    assert track is not None and track.frames == (0.0, 10.0, 20.0)
    assert not list(inconsistencies(sliding.timed_document))


def test_scrubbing_is_no_edit_and_loses_nothing(sliding: Session) -> None:
    told: list[DocumentChanged] = []
    sliding.listen(told.append)
    before, steps = dump_document(sliding.timed_document), len(sliding.history.steps)
    for frame in (0.0, 7.5, 100.0, -3.0, 20.0):
        sliding.timeline.go(frame)
        assert sliding.document is sliding.document and not sliding.document.is_timed
    assert dump_document(sliding.timed_document) == before and len(sliding.history.steps) == steps
    assert [event.kind for event in told] == ["frame"] * 5 and told[-1].after is sliding.document
    with pytest.raises(InvalidInput, match="finite"):
        sliding.timeline.go(float("inf"))


def test_a_drag_between_keys_is_one_step_with_one_key(sliding: Session) -> None:
    sliding.timeline.go(15)
    steps = len(sliding.history.steps)
    with sliding.stroke() as stroke:
        for seed in range(3):
            stroke.patches.translate("palm", somewhere(sliding, seed))
    assert len(sliding.history.steps) == steps + 1
    command = sliding.history.steps[-1].command
    assert isinstance(command, SetKeys) and {key.frame for key in command.keys} == {0.0, 15.0}
    sliding.undo()
    track = sliding.timeline.track("placement", "palm")
    assert track is not None and track.frames == (0.0, 20.0)


def test_a_macro_keys_what_has_tracks_and_edits_the_rest(sliding: Session) -> None:
    sliding.timeline.go(5)
    steps = len(sliding.history.steps)
    with sliding.macro("both"):
        sliding.patches.translate("palm", somewhere(sliding, 3))
        sliding.patches.translate("thumb", somewhere(sliding, 4))
        sliding.timeline.key("weight", "grip", 2.0)
        sliding.timeline.key("weight", "grip", 0.5, frame=9)
    assert len(sliding.history.steps) == steps + 1
    palm, weight = sliding.timeline.track("placement", "palm"), sliding.timeline.track("weight", "grip")
    assert palm is not None and weight is not None
    assert palm.frames == (0.0, 5.0, 20.0) and weight.frames == (5.0, 9.0)
    assert 0.5 < sliding.timeline.at(7).pairs["grip"].weight < 2.0


def test_keys_are_moved_removed_and_cleared(sliding: Session) -> None:
    timeline = sliding.timeline
    timeline.key("placement", "palm", frame=10)
    timeline.move_key("placement", "palm", 10, 12.5)
    track = timeline.track("placement", "palm")
    assert track is not None and track.frames == (0.0, 12.5, 20.0)
    with pytest.raises(CommandRejected, match=r"no key at frame 10.*near it: 12\.5"):
        timeline.remove_key("placement", "palm", 10)
    timeline.remove_key("placement", "palm", 20)
    timeline.go(30)
    shown = sliding.geometry.root("palm")
    timeline.clear("placement", "palm")
    assert timeline.track("placement", "palm") is None and sliding.geometry.root("palm") == shown
    sliding.undo()
    timeline.remove_key("placement", "palm", 0)
    timeline.remove_key("placement", "palm", 12.5)
    assert not sliding.timed_document.tracks


def test_spans_set_the_gain_of_a_pair(sliding: Session) -> None:
    timeline = sliding.timeline
    timeline.hold("grip", 10, 20, ease_in=4)
    timeline.hold("grip", 30, 40)
    assert [sliding.timeline.at(f).pairs["grip"].gain for f in (5, 10, 20, 25.5, 30)] == pytest.approx(
        [0.0, 1.0, 1.0, timeline.at(25.5).pairs["grip"].gain, 1.0]
    )
    timeline.hold("grip", 18, 35, ease_in=0, ease_out=0)  # takes the place of both
    assert timeline.spans("grip") == (Span(18.0, 35.0),)
    timeline.release("grip", 20)
    assert timeline.spans("grip") == () and timeline.at(0).pairs["grip"].gain == 1.0
    with pytest.raises(CommandRejected, match="no span"):
        timeline.release("grip", 20)


def test_a_weight_that_has_keys_is_keyed_by_pairing_anew(sliding: Session) -> None:
    sliding.timeline.key("weight", "grip", 1.0, frame=0)
    sliding.timeline.go(12)
    pair = sliding.document.pairs["grip"]
    sliding.do(Pair(type(pair)("grip", pair.manipulator, pair.object, 3.0)))
    assert sliding.timeline.at(0).pairs["grip"].weight == 1.0
    assert sliding.timeline.at(12).pairs["grip"].weight == 3.0


def test_poses_and_places_over_time() -> None:
    rig = tentacle(4)
    session = Session(discover=False)
    session.surfaces.add("arm", rig.surface, rig=rig)
    session.timeline.set(last=30)
    session.timeline.key("pose", "arm", frame=0)
    bent = rig.rest_local.copy()
    bent[1, :3, :3] = bent[1, :3, :3] @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    session.timeline.go(30)
    session.surfaces.set_pose("arm", Pose((rig.joints[1],), bent[1:2]))  # one joint alone
    track = session.timeline.track("pose", "arm")
    assert track is not None and all(key.pose.joints == rig.joints for key in track.of(PoseKey))
    assert session.document.poses["arm"].local[1] == pytest.approx(bent[1])
    halfway = session.timeline.at(15).poses["arm"].local[1, :3, :3]
    angle = np.arccos((np.trace(rig.rest_local[1, :3, :3].T @ halfway) - 1.0) / 2.0)
    assert angle == pytest.approx(np.pi / 4.0)
    with pytest.raises(CommandRejected, match="know no joint"):
        session.surfaces.set_pose("arm", Pose(("nose",), np.eye(4)[None]))
    with pytest.raises(CommandRejected, match="has keys"):
        session.surfaces.clear_pose("arm")
    moved = np.eye(4)
    moved[:3, 3] = (1.0, 2.0, 3.0)
    session.timeline.key("place", "arm", frame=0)
    session.surfaces.place("arm", moved)
    assert session.timeline.at(0).surfaces["arm"].world_from_surface[:3, 3] == pytest.approx(0.0)
    assert session.timeline.at(15).surfaces["arm"].world_from_surface[:3, 3] == pytest.approx((0.5, 1.0, 1.5))


def test_solved_keys_know_when_they_are_stale(sliding: Session) -> None:
    from contact_core.document.staleness import motion_source

    rig = tentacle(4)
    sliding.surfaces.add("arm", rig.surface, rig=rig)
    sliding.timeline.hold("grip", 80, 85, ease_in=0, ease_out=0)
    timed = sliding.timed_document
    keys = tuple(
        PoseKey(f, Pose.rest(rig), None, "smooth", motion_source(timed, f)) for f in (0.0, 24.0, 48.0, 96.0)
    )
    sliding.do(SetKeys("pose/arm", keys))
    timeline = sliding.timeline
    assert timeline.stale("arm") == ()
    timeline.hold("grip", 80, 90, ease_in=0, ease_out=0)
    assert timeline.stale("arm") == (96.0,)  # within a second
    sliding.undo()
    assert timeline.stale("arm") == ()
    timeline.key("placement", "palm", frame=20)  # where it is: the way is another
    sliding.patches.recolor("palm", (0.0, 0.0, 1.0))
    assert set(timeline.stale("arm")) <= {0.0, 24.0}
    timeline.key("pose", "arm", frame=110)
    assert 96.0 in timeline.stale("arm") and 48.0 not in timeline.stale("arm")
    sliding.patches.scale("palm", along=1.1)
    assert timeline.stale("arm") == (0.0, 24.0, 48.0, 96.0)


@pytest.mark.parametrize(
    ("rate", "fraction"),
    [
        (24, (24, 1)),
        (23.976, (24000, 1001)),
        (29.97, (30000, 1001)),
        (59.94, (60000, 1001)),
        (12.5, (25, 2)),
        (Fraction(30000, 1001), (30000, 1001)),
        ((25, 1), (25, 1)),
    ],
)
def test_rates_are_fractions(rate: float, fraction: tuple[int, int]) -> None:
    session = Session(discover=False)
    session.timeline.set(rate=rate)
    assert session.timeline.settings.rate == fraction


def test_a_film_is_saved_and_opened_again(sliding: Session, tmp_path: Path) -> None:
    sliding.timeline.hold("grip", 10, 20)
    sliding.save(tmp_path / "film.json")
    wanted = dump_document(sliding.timed_document)
    sliding.close()
    with Session.open(tmp_path / "film.json", discover=False) as again:
        assert dump_document(again.timed_document) == wanted and again.timeline.settings.last == 48.0


def test_a_child_and_what_is_linked_have_no_keys_of_their_own_place(sliding: Session) -> None:
    with pytest.raises(CommandRejected, match="clear them"):
        sliding.patches.link("palm", "thumb")
    sliding.patches.link("tip", "thumb")
    with pytest.raises(CommandRejected, match="unlink it"):
        sliding.timeline.key("placement", "tip")
    with pytest.raises(InvalidInput, match="a track is one of"):
        sliding.timeline.key("colour", "palm", 1.0)  # type: ignore[arg-type]


def test_keys_of_places_follow_onto_another_mesh(sliding: Session) -> None:
    torus = sliding.geometry.mesh("torus")
    sliding.surfaces.add("torus", torus.with_points(1.1 * torus.points))  # the same triangles
    halves = torus.points[torus.faces].mean(axis=1)
    points, count = np.concatenate([torus.points, halves]), len(torus.points)
    centre = count + np.arange(len(torus.faces))
    faces = np.concatenate([np.stack([torus.faces[:, k], torus.faces[:, k - 2], centre], 1) for k in range(3)])
    old = [sliding.timeline.at(f) for f in (0.0, 10.0, 20.0)]
    before = [sliding.derived.root(d, "palm").point().positions(sliding.derived.mesh(d, "torus"))[0] for d in old]
    sliding.surfaces.rebind("torus", TriangleMesh(1.1 * points, faces))
    assert not list(inconsistencies(sliding.timed_document))
    new = [sliding.timeline.at(f) for f in (0.0, 10.0, 20.0)]
    after = [sliding.derived.root(d, "palm").point().positions(sliding.derived.mesh(d, "torus"))[0] for d in new]
    size = torus.bounding_box_diagonal
    assert np.abs(np.subtract(before, after)[[0, 2]]).max() < 1e-9 * size
    assert np.abs(np.subtract(before, after)[1]).max() < 1e-6 * size  # the way, too
    sliding.undo()
    sliding.undo()
    assert sliding.timeline.at(20.0).patches["palm"].placement == old[2].patches["palm"].placement
