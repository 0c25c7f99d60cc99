"""A film as a GLB with an animation, played by a reader of the specification, and a clip taken into a document."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_core.cli import main
from contact_core.document.timeline import CAPTURED, PoseKey
from contact_core.errors import FileRefused, InvalidInput
from contact_core.film.clip import read_clips, write_clip
from contact_core.geometry.transform import transform_points
from contact_core.motion.problem import MotionWeights
from contact_core.proposals.motion import MotionProposal, MotionSettings
from contact_core.rig.pose_keys import PoseKeys
from contact_core.rig.rig import forward_kinematics, skin

sys.path.insert(0, str(Path(__file__).parents[1] / "motion"))
sys.path.insert(0, str(Path(__file__).parents[2] / "plugins"))
from gltf_player import Player  # type: ignore[import-not-found]
from test_film import ARM, BALL, assets, film  # type: ignore[import-not-found]


@pytest.fixture
def session() -> contact.Session:
    session = contact.new(**assets())
    film(session)
    return session


def test_a_player_shows_the_solved_skin(session: contact.Session, tmp_path: Path) -> None:
    frames = session.timeline.settings.frames()
    found = session.solve(frames=frames)
    session.accept(found)
    assert isinstance(found, MotionProposal) and found.motion is not None
    player = Player(write_clip(session, frames, tmp_path / "film.glb"))
    rig = session.rigs[ARM]
    kinds = {(node, path): kind for node, path, kind, _, _ in player.channels()}
    assert set(kinds.values()) == {"CUBICSPLINE", "LINEAR"}  # few keys of the arm, every frame of the ball
    keyed = next(len(times) for _, _, kind, times, _ in player.channels() if kind == "CUBICSPLINE")
    assert keyed == len(session.timeline.track("pose", ARM).keys) < len(frames)
    ball = next(k for k, node in enumerate(player.json["nodes"]) if node.get("name") == f"{BALL} mesh")
    for frame, pose in zip(frames, found.motion.poses(ARM), strict=True):
        wanted = skin(rig, forward_kinematics(rig.parents, pose.local))
        assert np.linalg.norm(player.skin(frame / 24.0) - wanted, axis=1).max() <= 1.05e-3  # a millimetre
        placed = session.scene_at(frame).surface(BALL).world_from_surface
        np.testing.assert_allclose(player.nodes_at(frame / 24.0)[ball], placed, atol=1e-6)


def test_a_rig_that_stands_elsewhere_stays_there(session: contact.Session, tmp_path: Path) -> None:
    placed = np.array([[0, -1, 0, 0.3], [1, 0, 0, 0.1], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    session.surfaces.place(ARM, placed)
    frames = session.timeline.settings.frames()
    session.accept(session.solve(frames=frames))
    player = Player(write_clip(session, frames, tmp_path / "film.glb"))
    rig = session.rigs[ARM]
    for frame in (0.0, 5.5, 14.0):
        local = session.timeline.at(frame).poses[ARM].local
        wanted = transform_points(placed, skin(rig, forward_kinematics(rig.parents, local)))
        np.testing.assert_allclose(player.skin(frame / 24.0), wanted, atol=1e-5)


def test_a_clip_is_taken_and_mended(session: contact.Session, tmp_path: Path) -> None:
    frames = session.timeline.settings.frames()
    session.accept(session.solve(frames=frames))
    (clip,) = read_clips(write_clip(session, frames, tmp_path / "film.glb"), session.plugins)
    with contact.new(**assets()) as other:
        film(other)
        other.timeline.take(ARM, clip.keys[0])
        track = other.timeline.track("pose", ARM)
        assert {key.source for key in track.of(PoseKey)} == {CAPTURED} and other.timeline.stale(ARM) == ()
        for frame in (0.0, 7.5, 13.0, 24.0):
            one, two = (s.timeline.at(frame).poses[ARM].local for s in (session, other))
            np.testing.assert_allclose(one, two, atol=1e-5)
        settings = MotionSettings(weights=MotionWeights(follow=50.0))
        found = other.solve(frames=frames, motion=settings, prior="current")
        other.accept(found)  # no pins: all of them give way
        assert not any(key.source == CAPTURED for key in other.timeline.track("pose", ARM).of(PoseKey))
        other.undo()
        other.undo()
        assert other.timeline.track("pose", ARM) is None


def test_an_object_takes_the_places_of_a_clip(session: contact.Session) -> None:
    track = session.timeline.track("place", BALL)
    keys = PoseKeys("any", (0.0, 8.0), tuple(contact.Pose(("any",), place(x)[None]) for x in (0.0, 0.4)))
    session.timeline.take(BALL, keys)
    assert session.timeline.track("place", BALL).frames == (0.0, 8.0, 20.0)  # what lies beyond stays
    np.testing.assert_allclose(session.timeline.at(6.0).surface(BALL).world_from_surface, place(0.3), atol=1e-12)
    session.undo()
    assert session.timeline.track("place", BALL) is track
    speeds = (np.array([[0.1, 0, 0, 0, 0, 0]]), np.zeros((1, 6)))
    session.timeline.take(BALL, PoseKeys("any", keys.frames, keys.poses, speeds))
    assert session.timeline.track("place", BALL).frames == (*map(float, range(9)), 20.0)
    two = PoseKeys("any", (0.0,), (contact.Pose(("a", "b"), np.stack([np.eye(4)] * 2)),))
    with pytest.raises(InvalidInput, match="one joint"):
        session.timeline.take(BALL, two)


def place(x: float) -> np.ndarray:
    result = np.eye(4)
    result[0, 3] = x
    return result


def test_what_cannot_be_a_clip_is_refused(session: contact.Session, tmp_path: Path) -> None:
    with pytest.raises(FileRefused, match=r"\.glb"):
        write_clip(session, [0.0], tmp_path / "film.obj")
    with pytest.raises(InvalidInput, match="frames"):
        write_clip(session, [], tmp_path / "film.glb")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_one(session: contact.Session, tmp_path: Path) -> None:
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    with contact.Session(host=host, objects=None) as made:
        film(made)
        made.save(tmp_path / "shot.contactscene")
    arguments = ["motion", str(tmp_path / "shot.contactscene"), "--out", str(tmp_path / "out"), "--no-pictures"]
    assert main(arguments) == 0
    player = Player(tmp_path / "out" / "film.glb")
    with contact.open(tmp_path / "out" / "shot.keyed.contactscene") as again:
        rig = again.rigs[ARM]
        for frame in (0.0, 11.0, 24.0):
            wanted = skin(rig, forward_kinematics(rig.parents, again.scene_at(frame).poses[ARM].local))
            np.testing.assert_allclose(player.skin(frame / 24.0), wanted, atol=1e-5)
