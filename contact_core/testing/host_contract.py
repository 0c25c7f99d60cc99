"""What a host promises. The numbered clauses stand in `adapters/README.md`; a subject gives one fixture.

class TestMyHost(HostContract):
    cannot = {"undo": "a renderer has none"}

    @pytest.fixture
    def build(self, tmp_path): return lambda scene: MyHost.on(native_scene_of(scene))
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from contact_core.document.asset import Asset
from contact_core.document.schema import VERSION
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.raycast import Locator
from contact_core.host import SceneSpace, StoredDocument
from contact_core.pose.rig import Pose, forward_kinematics, skin
from contact_core.testing.contract import Contract, needs
from contact_core.testing.host_checks import (
    ACCURACY,
    dense_weights,
    is_rigid,
    object_id,
    picture_of,
    placement_error,
    pose_error,
    readable_state,
    revision_of,
    same_triangles,
    surfaces_of,
    volume,
    world_error,
)
from contact_core.testing.host_scenes import STEP_AREA, STEP_VOLUME, HostScene, arm_rig, bent, contract_scene

Build = Callable[[HostScene], Any]  # Any: which capabilities a host has is what is tested


class HostContract(Contract):
    """Fixture `build(scene)`: a host on a natively made scene. spaces: units and axes that the host can have."""

    about, letter = "host", "H"
    spaces: ClassVar[tuple[SceneSpace, ...]] = (SceneSpace(1.0, "Y"), SceneSpace(0.01, "Z"))

    @pytest.fixture
    def host(self, build: Build) -> Any:
        """A host on the contract's scene, in the first of `spaces`."""
        return build(contract_scene(self.spaces[0]))

    def reopen(self, host: Any, path: Path) -> Any:
        """Save the host's scene and open it anew; override where a host opens files otherwise."""
        host.save(path)
        return type(host)(path)

    def foreign_edit(self, host: Any) -> None:
        """One undoable edit that is none of ours, made with the host's own means, as its user would."""
        raise NotImplementedError("give foreign_edit, or decline `foreign_edits`")

    def scene_state(self, host: Any) -> Any:
        """Comparable state of the whole scene; override with something that also sees what hosts do not read."""
        return readable_state(host)

    # Scenes

    def test_h01_says_its_units_and_axes(self, build: Build) -> None:
        """A host tells the scene's metres per unit and up axis, and its surfaces carry them."""
        for space in self.spaces:
            host = build(contract_scene(space))
            said = host.space()
            assert (said.meters_per_unit, said.up_axis) == (pytest.approx(space.meters_per_unit), space.up_axis)
            asset = host.read_surface(object_id(host, "plain"))
            assert (asset.meters_per_unit, asset.up_axis) == (said.meters_per_unit, said.up_axis)

    def test_h02_lists_each_object_once(self, host: Any) -> None:
        """Every surface and rig is listed once under its name and a unique id; a rig's skin is not listed again."""
        scene = contract_scene(self.spaces[0])
        wanted = [(mesh.name, "surface") for mesh in scene.meshes] + [(rig.name, "rig") for rig in scene.rigs]
        listed = host.objects()
        assert sorted((item.name, item.kind) for item in listed) == sorted(wanted)
        assert len({item.id for item in listed}) == len(listed)
        assert host.objects() == listed

    def test_h03_reads_triangles(self, host: Any) -> None:
        """A triangle mesh comes with its own points, triangles and order, and maps that say so."""
        mesh = contract_scene(self.spaces[0]).meshes[0]
        asset = host.read_surface(object_id(host, mesh.name))
        np.testing.assert_allclose(asset.mesh.points, mesh.points, atol=1e-6)
        assert same_triangles(asset.mesh.faces, mesh.face_indices.reshape(-1, 3))
        np.testing.assert_array_equal(asset.source_vertices, np.arange(len(mesh.points)))
        np.testing.assert_array_equal(asset.source_faces, np.arange(len(mesh.face_sizes)))

    @needs("polygons")
    def test_h04_cuts_polygons_right(self, host: Any) -> None:
        """Concave polygons keep their area and sense, and each triangle names the polygon that it came from."""
        asset = host.read_surface(object_id(host, "step"))
        mesh = asset.mesh
        assert mesh.face_areas.sum() == pytest.approx(STEP_AREA, rel=ACCURACY)
        assert volume(mesh) == pytest.approx(STEP_VOLUME, rel=ACCURACY)
        assert np.bincount(asset.source_faces).tolist() == [4, 4, 2, 2, 2, 2, 2, 2]
        assert mesh.face_normals[asset.source_faces == 1][:, 2] == pytest.approx(1.0)

    def test_h05_leaves_motion_out_of_the_surface(self, host: Any) -> None:
        """Moving or turning an object changes its placement, which is rigid, and not its surface."""
        still, moved = object_id(host, "step"), object_id(host, "moved")
        assert host.read_surface(moved).mesh.digest == host.read_surface(still).mesh.digest
        assert placement_error(host, moved, contract_scene(self.spaces[0]).world_of("moved")) < ACCURACY

    def test_h06_applies_scale_to_the_surface(self, host: Any) -> None:
        """Scale and shear are in the surface, so that its lengths are the scene's."""
        mesh = host.read_surface(object_id(host, "scaled")).mesh
        assert volume(mesh) == pytest.approx(STEP_VOLUME * 2.0 * 3.0 * 0.5, rel=1e-4)
        assert world_error(host, "scaled", contract_scene(self.spaces[0])) < ACCURACY

    def test_h07_keeps_mirrored_surfaces_outward(self, host: Any) -> None:
        """A mirrored object is mirrored, and its triangles are counter-clockwise seen from outside all the same."""
        assert world_error(host, "mirrored", contract_scene(self.spaces[0])) < ACCURACY
        mesh = host.read_surface(object_id(host, "mirrored")).mesh
        assert volume(mesh) == pytest.approx(STEP_VOLUME * 1.5**3, rel=1e-4)

    @needs("parents")
    def test_h08_inherits_from_parents(self, host: Any) -> None:
        """What a parent does to an object is in its placement and surface."""
        assert world_error(host, "child", contract_scene(self.spaces[0])) < ACCURACY

    def test_h09_reads_the_same_again(self, build: Build) -> None:
        """Ids, point order and triangles are the same at each read and each opening of one scene."""
        first, second = (build(contract_scene(self.spaces[0])) for _ in range(2))
        assert [item.id for item in first.objects()] == [item.id for item in second.objects()]
        assert surfaces_of(first) == surfaces_of(second) == surfaces_of(second)

    def test_h10_refuses_unknown_ids_in_words(self, host: Any) -> None:
        """An id that does not exist is refused with a sentence that names it."""
        with pytest.raises(InvalidInput, match="no_such_object"):
            host.read_surface("no_such_object")

    def test_h11_needs_no_display(self, build: Build, monkeypatch: pytest.MonkeyPatch) -> None:
        """Everything works without a screen."""
        for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
            monkeypatch.delenv(variable, raising=False)
        assert surfaces_of(build(contract_scene(self.spaces[0])))

    # Rigs and poses

    @needs("rigs")
    def test_h12_reads_the_rig(self, host: Any) -> None:
        """Joint names, their tree, rest frames and skin weights are those of the host's rig; weights sum to 1."""
        rig, made = host.read_rig(object_id(host, "arm")).rig, arm_rig()
        assert sorted(rig.joints) == sorted(made.joints)
        order = [rig.joint_index(name) for name in made.joints]
        parent_names = [None if rig.parents[k] < 0 else rig.joints[rig.parents[k]] for k in order]
        assert parent_names == [None, "shoulder", "elbow", "elbow"]
        np.testing.assert_allclose(rig.rest_world[order], made.rest_world, atol=1e-5)
        np.testing.assert_allclose(dense_weights(rig)[:, order], dense_weights(made), atol=1e-5)

    @needs("rigs")
    def test_h13_skins_as_the_host_does(self, host: Any) -> None:
        """The analytic rig's skin is the host's own evaluation to 1e-5 of its size, in rest and far from it."""
        for name in ("arm", "half_arm"):
            rig_id = object_id(host, name)
            rig = host.read_rig(rig_id).rig
            size = rig.surface.bounding_box_diagonal
            for pose in (Pose.rest(rig), bent(rig, 1), bent(rig, 2)):
                ours = skin(rig, forward_kinematics(rig.parents, pose.local))
                assert np.abs(ours - host.skin_points(rig_id, pose)).max() < ACCURACY * size

    @needs("rigs")
    def test_h14_scales_the_rig_with_its_object(self, host: Any) -> None:
        """A rig's scale in the scene is in its surface and joints, and its placement is rigid."""
        scene = contract_scene(self.spaces[0])
        asset = host.read_rig(object_id(host, "half_arm"))
        placement = host.placement(object_id(host, "half_arm"))
        world = scene.world_of("half_arm")
        made = arm_rig()
        points = made.surface.points @ world[:3, :3].T + world[:3, 3]
        ours = asset.mesh.points @ placement[:3, :3].T + placement[:3, 3]
        np.testing.assert_allclose(ours, points, atol=1e-5)
        assert is_rigid(placement)
        wrist = (placement @ asset.rig.rest_world[asset.rig.joint_index("wrist")])[:3, 3]
        np.testing.assert_allclose(wrist, (world @ made.rest_world[2])[:3, 3], atol=1e-5)

    @needs("rigs")
    def test_h15_asking_for_skin_poses_nothing(self, host: Any) -> None:
        """`skin_points` leaves the pose in the scene, its keys and the rest of the scene as they were."""
        rig_id = object_id(host, "arm")
        before = self.scene_state(host)
        host.skin_points(rig_id, bent(host.read_rig(rig_id).rig, 3))
        assert self.scene_state(host) == before

    @needs("poses")
    def test_h16_reads_the_pose_that_was_written(self, host: Any) -> None:
        """A pose comes back as it was written, also of a scaled rig, and the skin follows it."""
        for name in ("arm", "half_arm"):
            rig_id = object_id(host, name)
            rig = host.read_rig(rig_id).rig
            host.write_pose(rig_id, bent(rig, 4))
            assert pose_error(host.read_pose(rig_id), bent(rig, 4)) < ACCURACY
            assert host.read_rig(rig_id).mesh.digest == rig.surface.digest  # still the rest pose

    @needs("poses")
    def test_h17_poses_only_named_joints(self, host: Any) -> None:
        """A pose that names some joints leaves the others where they were."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        host.write_pose(rig_id, bent(rig, 4))
        elbow, other = rig.joint_index("elbow"), bent(rig, 5)
        host.write_pose(rig_id, Pose(("elbow",), other.local[elbow : elbow + 1]))
        mixed = bent(rig, 4).local.copy()
        mixed[elbow] = other.local[elbow]
        assert pose_error(host.read_pose(rig_id), Pose(rig.joints, mixed)) < ACCURACY

    @needs("keys")
    def test_h18_keys_land_on_their_frames(self, host: Any) -> None:
        """A keyed pose is at its frame and at no other; keys before and after it stay, frames between move."""
        rig_id = object_id(host, "arm")
        rig = host.read_rig(rig_id).rig
        assert host.pose_keys(rig_id) == ()
        for frame, seed in ((12.0, 6), (4.0, 7)):
            host.write_pose(rig_id, bent(rig, seed), frame)
        assert host.pose_keys(rig_id) == (4.0, 12.0)
        assert pose_error(host.read_pose(rig_id, 4.0), bent(rig, 7)) < ACCURACY
        assert pose_error(host.read_pose(rig_id, 12.0), bent(rig, 6)) < ACCURACY
        between = host.read_pose(rig_id, 8.0)
        assert min(pose_error(between, bent(rig, 6)), pose_error(between, bent(rig, 7))) > 1e-2

    # The document

    @needs("document")
    def test_h19_keeps_the_document_bit_for_bit(self, host: Any) -> None:
        """Any bytes, their revision and schema come back as they were stored; before that there are none."""
        assert host.stored_document() is None
        for data in (b"{}", b"\x00\xff" + "Fläche \N{SNOWMAN}\n".encode(), bytes(range(256)) * 4000, b""):
            document = StoredDocument(data, 7, VERSION)
            host.store_document(document)
            assert host.stored_document() == document

    @needs("files")
    def test_h20_survives_save_and_open(self, host: Any, tmp_path: Path) -> None:
        """Document, poses, keys, surfaces and ids are the same after saving and opening."""
        expected = self.furnish(host)
        # What stands after a key was set: in hosts that show one frame, what the keys say there.
        standing: Any = None if "poses" in self.cannot else host.read_pose(object_id(host, "arm"))
        path = tmp_path / f"saved{host.suffixes[0]}"
        again = self.reopen(host, path)
        assert again.stored_document() == expected
        assert surfaces_of(again) == surfaces_of(host)
        if "poses" not in self.cannot:
            rig_id = object_id(again, "arm")
            assert pose_error(again.read_pose(rig_id), standing) < ACCURACY
        if "keys" not in self.cannot:
            rig = again.read_rig(rig_id).rig
            assert again.pose_keys(rig_id) == (3.0,)
            assert pose_error(again.read_pose(rig_id, 3.0), bent(rig, 9)) < ACCURACY

    @needs("document")
    def test_h21_keeps_what_a_newer_release_wrote(self, host: Any) -> None:
        """A document of an unknown future schema is given back bit for bit and never overwritten."""
        newer = StoredDocument(b'{"from": "the future"}', 3, VERSION + 1)
        host.store_document(newer)
        with pytest.raises(FileRefused, match=str(VERSION + 1)):
            host.store_document(StoredDocument(b"{}", 1, VERSION))
        assert host.stored_document() == newer

    @needs("files")
    def test_h22_carries_a_newer_document_through_a_save(self, host: Any, tmp_path: Path) -> None:
        """Saving a scene with a document of a future schema keeps that document."""
        newer = StoredDocument(b'{"from": "the future"}', 3, VERSION + 1)
        host.store_document(newer)
        again = self.reopen(host, tmp_path / f"newer{host.suffixes[0]}")
        assert again.stored_document() == newer

    @needs("files")
    def test_h23_refuses_damaged_files_in_words(self, host: Any, tmp_path: Path) -> None:
        """A file that is cut short is refused with a sentence; a failed save leaves the old file whole."""
        path = tmp_path / f"whole{host.suffixes[0]}"
        host.save(path)
        whole = path.read_bytes()
        damaged = tmp_path / f"damaged{host.suffixes[0]}"
        damaged.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(FileRefused):
            type(host)(damaged)
        with pytest.raises(FileRefused):
            host.save(path / f"below_a_file{host.suffixes[0]}")
        assert path.read_bytes() == whole

    # Undo

    @needs("undo")
    def test_h24_one_step_is_one_undo(self, host: Any) -> None:
        """All that a step wrote goes with one undo and comes back with one redo."""
        states = [self.scene_state(host)]
        for revision in (1, 2):
            self.write_step(host, revision)
            states.append(self.scene_state(host))
        for expected in (states[1], states[0]):
            assert host.undo()
            assert self.scene_state(host) == expected
        for expected in states[1:]:
            assert host.redo()
            assert self.scene_state(host) == expected

    @needs("undo")
    def test_h25_the_revision_goes_with_undo(self, host: Any) -> None:
        """Listeners hear of every undo and redo after it happened, and find the stored revision of that moment."""
        heard: list[int | None] = []
        stop = host.on_undo(lambda: heard.append(revision_of(host)))
        for revision in (1, 2, 3):
            self.write_step(host, revision)
        host.undo(), host.undo(), host.redo()
        assert heard == [2, 1, 2]
        stop()
        host.undo()
        assert heard == [2, 1, 2]

    @needs("undo")
    def test_h26_a_failed_step_leaves_nothing(self, host: Any) -> None:
        """After an exception inside a step nothing of it stays, in the scene or on the undo stack."""
        self.write_step(host, 1)
        before = self.scene_state(host)
        with pytest.raises(ZeroDivisionError), host.step("fails"):
            self.furnish(host)
            raise ZeroDivisionError
        assert self.scene_state(host) == before
        host.undo()
        assert revision_of(host) is None

    @needs("undo")
    def test_h27_the_stack_has_two_ends(self, host: Any) -> None:
        """Opening and reading leave nothing to undo; a new step leaves nothing to redo."""
        surfaces_of(host)
        assert not host.undo() and not host.redo()
        self.write_step(host, 1)
        host.undo()
        self.write_step(host, 2)
        assert not host.redo() and revision_of(host) == 2

    @needs("undo", "foreign_edits")
    def test_h28_foreign_edits_share_the_stack(self, host: Any) -> None:
        """Edits that the user makes with the host's own tools are steps between ours, and touch no document."""
        self.write_step(host, 1)
        ours = self.scene_state(host)
        self.foreign_edit(host)
        theirs = self.scene_state(host)
        assert theirs != ours and revision_of(host) == 1
        self.write_step(host, 2)
        host.undo()
        assert self.scene_state(host) == theirs
        host.undo()
        assert self.scene_state(host) == ours
        host.redo(), host.redo()
        assert revision_of(host) == 2

    @needs("undo")
    def test_h29_any_walk_through_undo_agrees(self, host: Any) -> None:
        """Random steps, undos, redos and foreign edits agree with a list of states after each."""
        rng = np.random.default_rng(20261122)
        foreign_too = not {"foreign_edits", "H28"} & set(self.cannot)
        states, at, before = [self.scene_state(host)], 0, ""
        for revision in range(1, 41):
            what = rng.choice(["step", "undo", "redo", "foreign"], p=[0.35, 0.3, 0.2, 0.15])
            if what == "undo":
                assert host.undo() == (at > 0)
                at = max(at - 1, 0)
            elif what == "redo":
                assert host.redo() == (at + 1 < len(states))
                at = min(at + 1, len(states) - 1)
            else:
                foreign = foreign_too and what == "foreign" != before  # two in a row may be one step
                what = "foreign" if foreign else "step"
                self.foreign_edit(host) if foreign else self.write_step(host, revision)
                states[at + 1 :] = [self.scene_state(host)]
                at += 1
            before = what
            assert self.scene_state(host) == states[at], (revision, what)
        assert [host.undo() for _ in range(at + 1)] == [True] * at + [False]
        assert self.scene_state(host) == states[0]

    # What only some hosts have

    @needs("selection")
    def test_h30_a_selection_becomes_points(self, host: Any) -> None:
        """A named selection of vertices gives surface points at just those vertices."""
        mesh = contract_scene(self.spaces[0]).meshes[1]
        step = object_id(host, mesh.name)
        assert "grip" in host.selections(step)
        points = host.selected_points(step, "grip").positions(host.read_surface(step).mesh)
        chosen = mesh.points[list(mesh.selections["grip"])]
        np.testing.assert_allclose(points[np.lexsort(points.T)], chosen[np.lexsort(chosen.T)], atol=1e-6)
        with pytest.raises(InvalidInput, match="no_such_selection"):
            host.selected_points(step, "no_such_selection")

    @needs("display")
    def test_h31_showing_changes_nothing(self, host: Any) -> None:
        """Drawing over the scene and clearing it leave the scene and its undo stack as they were."""
        before = self.scene_state(host)
        host.show(picture_of(host, "step"))
        host.show(None)
        assert self.scene_state(host) == before
        assert "undo" in self.cannot or not host.undo()

    @needs("picking")
    def test_h32_rays_go_where_the_pixels_look(self, host: Any) -> None:
        """Rays are unit; those through the middle meet what is shown, those at the rim do not; y is down."""
        picture = picture_of(host, "plain")
        host.show(picture)
        width, height = host.viewport
        origins, directions = host.rays([[width / 2, height / 2], [0.5, 0.5], [width - 0.5, height / 2]])
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
        place = host.placement(object_id(host, "plain"))
        local = np.linalg.inv(place)
        hits = Locator(host.read_surface(object_id(host, "plain")).mesh).cast(
            origins @ local[:3, :3].T + local[:3, 3], directions @ local[:3, :3].T
        )
        assert (hits.faces >= 0).tolist() == [True, False, False]
        _, (above, below) = host.rays([[width / 2, 0.0], [width / 2, float(height)]])
        assert above @ picture.up > below @ picture.up

    @needs("progress")
    def test_h33_progress_asks_to_go_on(self, host: Any) -> None:
        """Telling progress changes nothing in the scene and answers whether to go on."""
        before = self.scene_state(host)
        assert all(host.progress(fraction, "solving") is True for fraction in (0.0, 0.5, 1.0))
        assert self.scene_state(host) == before

    @needs("writing")
    def test_h34_reads_what_it_wrote(self, host: Any) -> None:
        """An asset that a host adds comes back as the same triangles, or the same rig, in the scene's units."""
        space = host.space()
        half = Asset("made", arm_rig().surface, None, meters_per_unit=space.meters_per_unit / 2, up_axis="Y")
        place = contract_scene(self.spaces[0]).world_of("moved")
        made = host.add(half, place)
        mesh = host.read_surface(made).mesh
        np.testing.assert_array_equal(mesh.faces, half.mesh.faces)
        np.testing.assert_allclose(mesh.points, half.mesh.points / 2, atol=1e-5)
        assert np.abs(host.placement(made) - place).max() < ACCURACY
        rig = arm_rig()
        again = host.read_rig(host.add(Asset("made_arm", rig.surface, rig, meters_per_unit=space.meters_per_unit)))
        order = [again.rig.joint_index(name) for name in rig.joints]
        np.testing.assert_allclose(again.rig.rest_world[order], rig.rest_world, atol=1e-5)
        np.testing.assert_allclose(again.mesh.points, rig.surface.points, atol=1e-5)

    # What clauses do

    def furnish(self, host: Any) -> StoredDocument:
        """Store a document and, where the host can, a pose and a key."""
        document = StoredDocument(b'{"a": 1}', 5, VERSION)
        host.store_document(document)
        if "poses" not in self.cannot:
            rig_id = object_id(host, "arm")
            rig = host.read_rig(rig_id).rig
            host.write_pose(rig_id, bent(rig, 8))
            if "keys" not in self.cannot:
                host.write_pose(rig_id, bent(rig, 9), 3.0)
        return document

    def write_step(self, host: Any, revision: int) -> None:
        """One step that stores a document and, where the host can, poses."""
        with host.step(f"Step {revision}"):
            host.store_document(StoredDocument(b"%d" % revision, revision, VERSION))
            if "poses" not in self.cannot:
                rig_id = object_id(host, "arm")
                host.write_pose(rig_id, bent(host.read_rig(rig_id).rig, revision))
