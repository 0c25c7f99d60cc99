"""The road from a scene to a posed rig, through the public names alone, on documents, files and hosts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import contact_core as contact
from contact_core.rig.rig import forward_kinematics, skin
from contact_core.scene.binding import same_pose
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig

ARM, BALL = "arm", "ball"


def ball() -> contact.TriangleMesh:
    """A small ball beside the arm's tip, out of reach of its rest pose."""
    small = meshes.icosphere(2)
    return contact.TriangleMesh(0.2 * small.points + [0.6, 0.5, 0.1], small.faces)


def assets() -> dict[str, contact.Asset]:
    rig = arm_rig()
    return {
        ARM: contact.Asset(ARM, rig.surface, rig, meters_per_unit=1.0),
        BALL: contact.Asset(BALL, ball(), meters_per_unit=1.0),
    }


def scene() -> contact.MemoryHost:
    host = contact.MemoryHost()
    for asset in assets().values():
        host.add(asset)
    return host


def paint(session: contact.Session) -> None:
    """A patch round the tip of the arm, its copy on the ball, paired."""
    arm, thing = session.geometry.mesh(ARM), session.geometry.mesh(BALL)
    tip = int(np.argmax(arm.points[:, 1] + arm.points[:, 0]))
    near = np.argsort(np.linalg.norm(arm.points - arm.points[tip], axis=1))[:6]
    session.patches.paint(
        "tip",
        contact.SurfacePoints.at_vertices(arm, near),
        surface=ARM,
        axis=contact.SurfacePoints.at_vertices(arm, near[:1]),
        heading=1.0,
    )
    side = int(np.argmin(thing.points[:, 0]))
    copy = session.patches.transfer("tip", BALL, contact.SurfacePoints.at_vertices(thing, [side]), heading=1.0)
    session.pairs.add("tip", copy, name="touch")


def gap(session: contact.Session, pose: contact.Pose) -> float:
    """The mean distance of the paired points, measured apart from the solver."""
    rig = session.rigs[ARM]
    local = rig.rest_local.copy()
    for joint, matrix in zip(pose.joints, pose.local, strict=True):
        local[rig.joint_index(joint)] = matrix
    posed = rig.surface.with_points(skin(rig, forward_kinematics(rig.parents, local)))
    (pair,) = session.geometry.pairs()
    world = session.document.surface(BALL).world_from_surface
    there = pair.object_points.positions(session.geometry.mesh(BALL)) @ world[:3, :3].T + world[:3, 3]
    return float(np.linalg.norm(pair.manipulator_points.positions(posed) - there, axis=1).mean())


def test_the_public_names_load_and_the_package_is_light() -> None:
    assert len(contact.__all__) <= 32
    for name in contact.__all__:
        assert getattr(contact, name) is not None, name
    with pytest.raises(AttributeError, match="Session"):
        _ = contact.Sesion
    code = "import sys, contact_core; print('numpy' in sys.modules, 'numba' in sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.split() == ["False", "False"]


def test_a_solve_on_documents_alone() -> None:
    with contact.new(**assets(), discover=False) as session:
        assert list(session.document.surfaces) == [ARM, BALL] and session.revision == 0
        paint(session)
        before = session.document
        proposal = session.solve()
        assert session.document is before and proposal.revision == session.revision
        rest = contact.Pose.rest(session.rigs[ARM])
        assert gap(session, proposal.poses[ARM]) < 0.3 * gap(session, rest)
        revision = session.revision
        session.accept(proposal)
        assert session.revision == revision + 1 and session.document.poses[ARM] is proposal.poses[ARM]
        with pytest.raises(contact.CommandRejected, match="changed"):
            session.accept(proposal)


def test_accepting_changes_document_and_scene_in_one_step() -> None:
    host = scene()
    with contact.Session(host=host, objects=None, discover=False) as session:
        steps = len(host._states)
        assert session.revision == 0 and host.stored_document() is None  # opening writes nothing
        paint(session)
        before, stood = session.document, host.read_pose(ARM)
        steps = len(host._states)
        session.accept(session.solve())
        assert len(host._states) == steps + 1
        assert same_pose(session.rigs[ARM], host.read_pose(ARM), session.document.poses[ARM])
        after = session.document
        host.undo()
        assert session.document is before and same_pose(session.rigs[ARM], host.read_pose(ARM), stood)
        host.redo()
        assert session.document is after
        assert same_pose(session.rigs[ARM], host.read_pose(ARM), session.document.poses[ARM])


def test_what_moved_in_the_scene_is_solved_for_and_reaches_the_document() -> None:
    """An object moved by the host's own tools, and the animator's own pose: both are where the solve starts."""
    host = scene()
    with contact.Session(host=host, objects=None, discover=False) as session:
        paint(session)
        moved = np.eye(4)
        moved[:3, 3] = [0.0, 0.1, 0.05]
        host.move(BALL, moved)
        rig = session.rigs[ARM]
        bent = rig.rest_local.copy()
        c, s = np.cos(0.3), np.sin(0.3)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        bent[-1, :3, :3] = bent[-1, :3, :3] @ turn
        host.write_pose(ARM, contact.Pose(rig.joints, bent))
        problem = session.problem()
        assert np.allclose(problem.bodies[problem.body_index(BALL)].world_from_rig, moved)
        assert same_pose(rig, problem.bodies[problem.body_index(ARM)].pose, contact.Pose(rig.joints, bent))
        session.accept(session.solve())
        assert np.allclose(session.document.surface(BALL).world_from_surface, moved)
        assert gap(session, host.read_pose(ARM)) < 0.5 * gap(session, contact.Pose(rig.joints, bent))


def test_frames_are_keyed_where_the_object_is() -> None:
    host = scene()
    with contact.Session(host=host, objects=None, discover=False) as session:
        paint(session)
        proposal = session.solve(frames=[1, 5.5])
        assert host.pose_keys(ARM) == () and list(proposal.keys) == [1.0, 5.5]
        session.accept(proposal)
        assert host.pose_keys(ARM) == (1.0, 5.5)
        session.undo()
        assert host.pose_keys(ARM) == ()


def test_an_object_that_left_the_scene_is_reported() -> None:
    host = scene()
    with contact.Session(host=host, objects=None, discover=False) as session:
        paint(session)
        host.remove(BALL)
        session.solve()  # with the ball where it stood
        assert any("ball" in note and "left" in note for note in session.notes)


def test_a_scene_opened_again_knows_its_surfaces(tmp_path: Path) -> None:
    path = tmp_path / "shot.contactscene"
    scene().save(path)
    with contact.open(path) as session:
        paint(session)
        session.accept(session.solve())
        session.save()
    with contact.open(path) as again:
        assert set(again.surfaces.meshes) == {ARM, BALL} and ARM in again.rigs
        assert list(again.document.pairs) == ["touch"]
        again.accept(again.solve())  # goes on where it was


def test_what_cannot_be_opened_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(contact.FileRefused, match=r"\.json"):
        contact.open(tmp_path / "picture.png")
    with pytest.raises(contact.FileRefused):
        contact.open(tmp_path / "absent.glb")


def test_held_joints_stay_and_a_pair_can_be_left_out() -> None:
    with contact.new(**assets(), discover=False) as session:
        paint(session)
        rig = session.rigs[ARM]
        free = session.solve().poses[ARM]
        held = session.solve(held={ARM: rig.joints[:-1]}).poses[ARM]
        last = len(rig.joints) - 1
        assert np.allclose(held.local[:last], rig.rest_local[:last]) and not np.allclose(free.local, held.local)
        with pytest.raises(contact.CommandRejected, match="touch"):
            session.solve(pairs=["tuch"])
        with pytest.raises(contact.InvalidInput, match="pair"):
            contact.new(**assets(), discover=False).solve()


def test_a_session_is_small_and_its_verbs_stand_in_groups() -> None:
    with contact.Session(discover=False) as session:
        public = {name for name in dir(session) if not name.startswith("_")}
    assert len(public) <= 45, sorted(public)
    assert {"patches", "pairs", "surfaces", "sets", "geometry"} <= public


def test_a_renamed_surface_keeps_its_object_and_its_rig_through_undo_and_reopening() -> None:
    host = scene()
    with contact.Session(host=host, objects=None) as session:
        paint(session)
        object_id = session.binding.surfaces[ARM].object_id
        session.surfaces.rename(ARM, "limb")
        assert session.document.patch("tip").surface == "limb" and session.rigs["limb"] is session.rigs[ARM]
        session.accept(session.solve())
        assert not same_pose(session.rigs["limb"], host.read_pose(object_id), None)
        session.undo()
        session.undo()
        assert ARM in session.document.surfaces and session.solve().poses
        session.redo()
    with contact.Session(host=host) as again:
        assert again.binding.surfaces["limb"].object_id == object_id and not again.notes


def test_a_session_ends_with_its_scene() -> None:
    host = scene()
    session = contact.Session(host=host, objects=None)
    paint(session)
    host.replace_scene(contact.MemoryHost()._scene)
    with pytest.raises(contact.CommandRejected, match="ended with its scene"):
        session.patches.rotate("tip", 0.1)
    with pytest.raises(contact.CommandRejected, match="ended with its scene"), session.stroke():
        pass
    assert host.stored_stamp() is None and "tip" in session.document.patches  # it can still be read
    with contact.Session(host=host, objects=None) as fresh:
        assert not fresh.document.patches


def test_a_session_on_files_tells_what_their_readers_told(tmp_path: Path) -> None:
    (tmp_path / "thing.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nl 1 2\n"
    )
    with contact.new(thing=tmp_path / "thing.obj", arm=assets()[ARM]) as session:
        assert len(session.notes) == 1 and session.notes[0].startswith("thing: 1 points, lines")
