"""The memory host beyond its contract: in step with a session, poses between keys, files that lie."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from contact_core.document.asset import Asset
from contact_core.document.schema import same_documents
from contact_core.edit.commands.organising import Recolor
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.polar import split_world_from_local
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import JointFreedom, Pose, Rig, forward_kinematics, skin
from contact_core.scene.host import CAPABILITIES, SceneSpace, capabilities
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.reading import stretch_pose, stretch_rig, turn_up
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_scenes import affine, arm_rig, bent


def arm_host() -> MemoryHost:
    host = MemoryHost()
    rig = arm_rig()
    host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    return host


def test_it_has_every_capability() -> None:
    assert capabilities(MemoryHost()) == tuple(CAPABILITIES)


def test_three_hundred_steps_of_core_host_and_user_agree() -> None:
    """Core commands, the host's undo and redo, and moves by its user: document, storage and cursor agree."""
    host = MemoryHost()
    key = host.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    session = Session(host=host, discover=False)
    mesh = host.read_surface(key).mesh
    session.surfaces.add("torus", mesh)
    near = np.argsort(np.linalg.norm(mesh.points - mesh.points[0], axis=1), kind="stable")[:30]
    points = SurfacePoints.at_vertices(mesh, near)
    session.patches.paint("grip", points, surface="torus", axis=points[[0, 12]])
    rng = np.random.default_rng(11)
    scenes, at = [host.scene], 0
    for number in range(300):
        what = rng.choice(["command", "undo", "redo", "user"], p=[0.35, 0.3, 0.2, 0.15])
        if what == "undo" and at > 0:  # what is older than the list stays
            assert host.undo()
            at -= 1
        elif what == "redo":
            assert host.redo() == (at + 1 < len(scenes))
            at = min(at + 1, len(scenes) - 1)
        elif what in ("command", "user"):
            if what == "command":
                session.patches.rotate("grip", float(rng.uniform(-1, 1)))
            else:
                host.move(key, affine(rng.uniform(-1, 1, 3), (1, 1, 1), rng.normal(size=3)))
            at += 1
            scenes[at:] = [host.scene]
        stored = host.stored_document()
        assert stored is not None and stored.stamp.revision == session.revision, (number, what)
        assert same_documents(stored.read("the scene").document, session.document), (number, what)
        assert host.scene is scenes[at], (number, what)


@given(st.floats(0.0, 1.0))
@settings(max_examples=25)
def test_between_keys_joints_turn_evenly_along_the_shortest_way(t: float) -> None:
    host = arm_host()
    rig = arm_rig()
    host.write_pose("arm", bent(rig, 1), 10.0)
    host.write_pose("arm", bent(rig, 2), 20.0)
    here = host.read_pose("arm", 10.0 + 10.0 * t).local
    for a, b, m in zip(bent(rig, 1).local, bent(rig, 2).local, here, strict=True):
        whole = Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).magnitude()
        part = Rotation.from_matrix(a[:3, :3].T @ m[:3, :3]).magnitude()
        assert part == pytest.approx(t * whole, abs=1e-6)
        np.testing.assert_allclose(m[:3, 3], (1 - t) * a[:3, 3] + t * b[:3, 3], atol=1e-9)
    for frame, seed in ((-5.0, 1), (99.0, 2)):  # held beyond the ends
        np.testing.assert_array_equal(host.read_pose("arm", frame).local, bent(rig, seed).local)


def test_everything_survives_the_file(tmp_path: Path) -> None:
    freedoms = (
        JointFreedom("fixed"),
        JointFreedom("hinge", lower=np.array([-0.1])),
        JointFreedom("euler", order="ZXY", locked=np.array([True, False, False])),
        JointFreedom(translates=True),
    )
    rig = replace(arm_rig(), freedoms=freedoms)
    host = MemoryHost(space=SceneSpace(0.01, "Z", 25.0))
    host.add(Asset("arm", rig.surface, rig, meters_per_unit=0.01))
    host.add_polygons("square", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [4], [0, 1, 2, 3])
    host.select("square", "corner", [2])
    host.save(tmp_path / "scene.contactscene")
    again = MemoryHost(tmp_path / "scene.contactscene")
    assert again.space() == host.space() and again.selections("square") == ("corner",)
    read = again.read_rig("arm").rig
    assert read is not None
    for ours, theirs in zip(read.freedoms, freedoms, strict=True):
        assert (ours.kind, ours.order, ours.translates) == (theirs.kind, theirs.order, theirs.translates)
        for name in ("frame", "lower", "upper", "prior_weight", "locked"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


@given(st.integers(0, 2**31), st.integers(1, 30))
@settings(max_examples=40)
def test_files_with_changed_bytes_are_read_or_refused(seed: int, count: int) -> None:
    path = _saved_file()
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(0, len(data), count):
        data[place] = rng.integers(0, 256)
    damaged = path.with_name("damaged.contactscene")
    damaged.write_bytes(bytes(data))
    try:
        MemoryHost(damaged)
    except FileRefused as error:
        assert str(damaged) in str(error)


_FILES: list[Path] = []


@pytest.fixture(autouse=True, scope="module")
def _saved(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("scenes") / "whole.contactscene"
    host = arm_host()
    host.write_pose("arm", bent(arm_rig(), 1), 3.0)
    host.save(path)
    _FILES.append(path)


def _saved_file() -> Path:
    return _FILES[-1]


mirrored_scales = st.sampled_from([(1.5, 1.5, 1.5), (-1.5, 1.5, 1.5), (0.5, 0.5, -0.5), (-2.0, -2.0, -2.0)])


@given(mirrored_scales, st.tuples(*3 * [st.floats(-3, 3)]), st.integers(0, 5))
@settings(max_examples=30)
def test_a_scaled_or_mirrored_rig_moves_as_its_object_does(scale, angles, seed) -> None:  # type: ignore[no-untyped-def]
    """Posing in surface space and placing gives what posing in local space and transforming gives."""
    rig = arm_rig()
    world = affine(angles, scale, (1.0, 2.0, 3.0))
    placement = split_world_from_local(world)
    stretched = stretch_rig(rig, placement, SceneSpace(1.0, "Y"))
    pose = stretch_pose(bent(rig, seed), placement.surface_from_local)
    ours = skin(stretched, forward_kinematics(stretched.parents, pose.local))
    local = skin(rig, forward_kinematics(rig.parents, bent(rig, seed).local))
    placed = ours @ placement.world_from_surface[:3, :3].T + placement.world_from_surface[:3, 3]
    np.testing.assert_allclose(placed, local @ world[:3, :3].T + world[:3, 3], atol=2e-5)
    assert np.allclose(pose.local[:, :3, :3] @ pose.local[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=2e-5)
    outward = np.einsum("mi,mi->m", stretched.surface.face_normals, _outward(stretched))
    assert (outward > 0).mean() > 0.9


def test_a_mirror_keeps_what_a_joint_may_do() -> None:
    """A limit of the mirrored rig allows the mirror image of what the limit of the rig allows."""
    from contact_core.rig.chart import Chart

    freedom = JointFreedom(
        "euler", order="ZXY", lower=np.array([-0.1, -0.2, -0.3]), upper=np.array([0.4, 0.5, 0.6])
    )
    rig = replace(arm_rig(), freedoms=(JointFreedom("fixed"), freedom, freedom, JointFreedom("fixed")))
    mirror = split_world_from_local(np.diag([-1.0, 1.0, 1.0, 1.0]))
    other = stretch_rig(rig, mirror, SceneSpace(1.0, "Y"))
    assert isinstance(other, Rig)
    ours, theirs = Chart(rig), Chart(other)
    corner = ours.local(ours.upper.clip(-2, 2))
    image = stretch_pose(Pose(rig.joints, corner), mirror.surface_from_local).local
    low, high = theirs.lower.clip(-2, 2), theirs.upper.clip(-2, 2)
    mirrored_corner = np.where(np.isclose(high, ours.upper.clip(-2, 2)), high, low)
    np.testing.assert_allclose(theirs.local(mirrored_corner), image, atol=1e-12)


def test_up_axes_turn_without_a_mirror() -> None:
    for source in "XYZ":
        for target in "XYZ":
            turn = turn_up(source, target)  # type: ignore[arg-type]
            assert np.linalg.det(turn) == pytest.approx(1.0)
            np.testing.assert_allclose(
                turn[:3, :3] @ np.eye(3)["XYZ".index(source)], np.eye(3)["XYZ".index(target)]
            )


def test_refusals_name_what_is_there() -> None:
    host = arm_host()
    with pytest.raises(InvalidInput, match="near ids: arm"):
        host.read_rig("arn")
    with pytest.raises(InvalidInput, match="elbow"):
        host.write_pose("arm", Pose(("elbo",), np.eye(4)[None]))
    with pytest.raises(InvalidInput, match="no view"):
        host.rays([[0.0, 0.0]])
    with host.step("open"), pytest.raises(InvalidInput, match="step"):
        host.undo()
    with pytest.raises(FileRefused, match="came from no file"):
        MemoryHost().save()


def _outward(rig: Rig) -> np.ndarray:
    centre = rig.surface.points.mean(axis=0)
    return np.asarray(rig.surface.points[rig.surface.faces].mean(axis=1) - centre)


def test_merging_commands_in_a_host_loses_no_step() -> None:
    """A host cannot join its own steps, so each command stays one: undo goes back one by one, redo returns."""
    host = MemoryHost()
    host.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    session = Session(host=host, discover=False)
    mesh = meshes.family("torus")
    session.surfaces.add("torus", mesh)
    points = SurfacePoints.at_vertices(mesh, np.arange(12))
    session.patches.paint("grip", points, surface="torus", axis=points[[0, 6]])
    for color in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        session.do(Recolor(("grip",), color), merge=True)
    last = session.document
    session.undo()
    assert session.document.patch("grip").color == (1.0, 0.0, 0.0)
    session.redo()
    assert session.document is last, "the history kept the step"
