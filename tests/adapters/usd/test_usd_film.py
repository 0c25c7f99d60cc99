"""A film in USD: solved, keyed, saved, and read again by USD's own evaluation of skeletons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Gf, UsdGeom

import contact_core as contact
from contact_core.film.clip import read_clips, write_clip
from contact_core.proposals.motion import MotionProposal
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig, bent
from contact_usd.host import UsdHost


def paired(session: contact.Session) -> tuple[str, str]:
    """Pairs the tip of the arm with the ball."""
    hand, thing = list(session.document.surfaces)[:2]
    mesh, ball = session.geometry.mesh(hand), session.geometry.mesh(thing)
    tip = int(np.argmax(mesh.points[:, 1] + mesh.points[:, 0]))
    near = np.argsort(np.linalg.norm(mesh.points - mesh.points[tip], axis=1))[:6]
    points = contact.SurfacePoints.at_vertices(mesh, near)
    session.patches.paint("tip", points, surface=hand, axis=points[:1], heading=1.0)
    side = contact.SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 0]))])
    session.pairs.add("tip", session.patches.transfer("tip", thing, side, heading=1.0), name="touch")
    return hand, thing


def test_samples_outside_the_range_other_rigs_and_places_stay(tmp_path: Path) -> None:
    rig, small = arm_rig(), meshes.icosphere(2)
    host = UsdHost()
    arm = host.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    ball = host.add(contact.Asset("ball", contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)))
    other = host.add(contact.Asset("other", rig.surface, rig, meters_per_unit=1.0))
    flying = UsdGeom.Xformable(host.stage.GetPrimAtPath(ball)).MakeMatrixXform()
    for frame in range(1, 31):
        host.write_pose(arm, bent(rig, frame), float(frame))
        host.write_pose(other, bent(rig, frame + 100), float(frame))
        place = np.eye(4)
        place[0, 3] = 0.01 * frame
        flying.Set(Gf.Matrix4d(place.T.tolist()), float(frame))
    host.save(tmp_path / "shot.usda")
    before = UsdHost(tmp_path / "shot.usda")
    host = UsdHost(tmp_path / "shot.usda")
    with contact.Session(host=host, objects=None, discover=False) as session:
        paired(session)
        session.timeline.set(1, 30, 24)
        session.accept(session.solve(frames=[float(frame) for frame in range(12, 19)]))
        session.save(tmp_path / "keyed.usda")
    after = UsdHost(tmp_path / "keyed.usda")
    assert after.pose_keys(arm) == before.pose_keys(arm)
    moved = []
    for frame in map(float, range(1, 31)):
        moved.append(np.abs(after.read_pose(arm, frame).local - before.read_pose(arm, frame).local).max())
        np.testing.assert_array_equal(after.read_pose(other, frame).local, before.read_pose(other, frame).local)
        np.testing.assert_array_equal(after.placement(ball, frame), before.placement(ball, frame))
    assert max(moved[:11] + moved[18:]) < 1e-6 < 1e-3 < min(moved[11:18])


def test_time_samples_land_on_the_solved_skin(tmp_path: Path) -> None:
    rig, small = arm_rig(), meshes.icosphere(2)
    host = UsdHost()
    arm = host.add(contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    ball = contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)
    host.add(contact.Asset("ball", ball, meters_per_unit=1.0))
    with contact.Session(host=host, objects=None, discover=False) as session:
        hand, thing = paired(session)
        session.timeline.set(1, 13, 24)
        session.timeline.key("place", thing, frame=1)
        session.timeline.go(13)
        moved = session.document.surface(thing).world_from_surface.copy()
        moved[:3, 3] += [0.0, 0.2, 0.1]
        session.surfaces.place(thing, moved)
        found = session.solve(frames=session.timeline.settings.frames())
        session.accept(found)
        session.save(tmp_path / "film.usda")
        assert isinstance(found, MotionProposal) and found.motion is not None
        solved, document = found.motion.poses(hand), session.timed_document
    again = UsdHost(tmp_path / "film.usda")
    keys = again.pose_keys(arm)
    assert keys[0] == 1.0 and keys[-1] == 13.0 and len(keys) <= 13
    for row, pose in enumerate(solved):
        wanted = skin(rig, forward_kinematics(rig.parents, pose.local))
        drawn = again.skin_points(arm, again.read_pose(arm, float(row + 1)))
        off = np.linalg.norm(drawn - wanted, axis=1).max()
        assert off <= 1.05e-3  # linear between samples, within a millimetre
    with contact.Session(host=again, discover=False) as reopened:
        assert set(reopened.timed_document.tracks) == set(document.tracks)
        assert reopened.timeline.stale(hand) == ()


def test_an_exported_film_lands_on_the_same_skin_and_places(tmp_path: Path) -> None:
    rig, small = arm_rig(), meshes.icosphere(2)
    with contact.new(
        arm=contact.Asset("arm", rig.surface, rig, meters_per_unit=1.0),
        ball=contact.Asset("ball", small, meters_per_unit=0.01),  # another unit, as a prop of another house
    ) as session:
        film = session.timeline
        film.set(0, 12, rate=25)
        film.key("pose", "arm", frame=0)
        film.key("place", "ball", frame=0)
        film.go(12)
        local, placed = rig.rest_local.copy(), np.eye(4)
        local[1, :3, :3] = local[1, :3, :3] @ [[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]
        session.surfaces.set_pose("arm", contact.Pose(rig.joints, local))
        placed[:3, 3] = [30.0, 0.0, 5.0]
        session.surfaces.place("ball", placed)
        path = write_clip(session, film.settings.frames(), tmp_path / "film.usda")
        host = UsdHost(path)
        arm, ball = (next(o.id for o in host.objects() if o.name == name) for name in ("arm", "ball"))
        assert host.space().frames_per_second == 25.0 and host.stage.GetEndTimeCode() == 12.0
        for frame in (0.0, 5.0, 12.0):
            still = session.scene_at(frame)
            wanted = skin(rig, forward_kinematics(rig.parents, still.poses["arm"].local))
            np.testing.assert_allclose(host.skin_points(arm, host.read_pose(arm, frame)), 100 * wanted, atol=1e-3)
            np.testing.assert_allclose(
                host.placement(ball, frame)[:3, 3], still.surface("ball").world_from_surface[:3, 3], atol=1e-5
            )
        (clip,) = read_clips(path, session.plugins)
        assert {keys.rig for keys in clip.keys} == {"arm", "ball"} and clip.rate == 25.0
        film.take("ball", next(keys for keys in clip.keys if keys.rig == "ball"))
        np.testing.assert_allclose(film.at(12.0).surface("ball").world_from_surface, placed, atol=1e-5)
