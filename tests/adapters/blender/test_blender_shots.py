"""Shots as they come: several characters, linked and overridden ones, things that move, units, updated assets."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_scenes import affine, arm_rig

BALL = np.array((0.6, 0.5, 0.1))


def arm_at(scenes: Any, name: str, place: Any = (0.0, 0.0, 0.0)) -> Any:
    from mathutils import Matrix

    made = scenes.skinned(arm_rig(), name)
    made.parent.matrix_basis = Matrix(affine(place, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)).tolist())
    return made


def ball_at(scenes: Any, name: str, place: Any = (0.0, 0.0, 0.0), subdivisions: int = 1) -> Any:
    ball = meshes.icosphere(subdivisions)
    made = scenes.mesh_object(name, 0.2 * ball.points, np.full(len(ball.faces), 3), ball.faces.ravel())
    made.location = BALL + place
    return made


def paired(session: Session, arm: str, ball: str) -> str:
    """The tip of an arm on the near side of a ball; the name of the pair."""
    skin, round_ = session.geometry.mesh(arm), session.geometry.mesh(ball)
    tip = int(np.argmax(skin.points[:, 1] + skin.points[:, 0]))
    near = np.argsort(np.linalg.norm(skin.points - skin.points[tip], axis=1))[:6]
    points = SurfacePoints.at_vertices(skin, near)
    session.patches.paint(f"{arm} tip", points, surface=arm, axis=points[[0]], heading=1.0)
    side = SurfacePoints.at_vertices(round_, [int(np.argmin(round_.points[:, 0]))])
    return session.pairs.add(f"{arm} tip", session.patches.transfer(f"{arm} tip", ball, side, heading=1.0))


def gaps(bpy: Any, session: Session) -> dict[str, float]:
    """Mean distance of each pair's points in the world, as Blender evaluates the scene now."""
    bpy.context.view_layer.update()
    graph, found = bpy.context.evaluated_depsgraph_get(), {}

    def in_world(surface: str, points: SurfacePoints) -> Any:
        bound = session.binding.surfaces[surface]
        seen = session.host._ids.resolve(bound.object_id).evaluated_get(graph)
        corners = np.array([seen.matrix_world @ vertex.co for vertex in seen.data.vertices])
        kept = np.unique(bound.asset.source_vertices, return_index=True)[1]
        return points.positions(bound.asset.mesh.with_points(corners[kept]))

    for pair in session.geometry.pairs():
        skin = in_world(pair.manipulator_surface, pair.manipulator_points)
        touched = in_world(pair.object_surface, pair.object_points)
        found[pair.pair.name] = float(np.linalg.norm(skin - touched, axis=1).mean())
    return found


def test_several_characters_in_one_scene(bpy: Any, empty: Any, scenes: Any, tmp_path: Path) -> None:
    """One solve poses both, each on its own ball; reopened, every surface has its mesh and names its object."""
    import contact_core as contact

    for number, place in enumerate(((0.0, 0.0, 0.0), (4.0, 1.0, 0.5))):
        arm_at(scenes, f"arm {number}", place)
        ball_at(scenes, f"ball {number}", place)
    bpy.context.view_layer.update()
    session = Session(host=empty, objects=None, discover=False)
    pairs = [paired(session, f"arm {number}", f"ball {number}") for number in range(2)]
    before = gaps(bpy, session)
    session.accept(session.solve())
    after = gaps(bpy, session)
    assert all(after[name] < 0.3 * before[name] for name in pairs), (before, after)
    empty.save(tmp_path / "shot.blend")
    session.close()
    bpy.data.objects["ball 1"].name = "boulder"
    empty.save(tmp_path / "shot.blend")
    with contact.open(tmp_path / "shot.blend") as again:
        assert set(again.surfaces.meshes) == {"arm 0", "arm 1", "ball 0", "ball 1"}
        objects = {name: again.host._ids.resolve(b.object_id).name for name, b in again.binding.surfaces.items()}
        assert objects == {"arm 0": "arm 0", "arm 1": "arm 1", "ball 0": "ball 0", "ball 1": "boulder"}
        assert gaps(bpy, again) == pytest.approx(after, abs=1e-5) and not again.binding.missing


@pytest.mark.parametrize(("system", "metres"), [("METRIC", 0.01), ("IMPERIAL", 0.3048)])
def test_units_of_the_scene(bpy: Any, empty: Any, scenes: Any, system: str, metres: float) -> None:
    """A centimetre or a foot for a unit: the same pose, distances in scene units, told in the scene's own."""
    from contact_blender.extension import panel, shared

    arm_at(scenes, "arm")
    ball_at(scenes, "ball")
    poses = []
    for kind, length in (("METRIC", 1.0), (system, metres)):
        units = bpy.context.scene.unit_settings
        units.system, units.scale_length = kind, length
        with Session(host=scenes.BlenderHost(), discover=False, objects=None) as session:
            assert session.document.surface("arm").meters_per_unit == pytest.approx(length)
            if not session.document.pairs:
                paired(session, "arm", "ball")
            proposal = session.solve()
            poses.append(proposal.after.poses["arm"].local)
            (told,) = proposal.after.patches.values()
            shared._held[int(bpy.context.scene.session_uid)] = shared.Held(
                session, {"p": told.p95}, session.revision
            )
            text = panel.nearness("p", bpy.context.scene)
            assert text.endswith({"METRIC": "m", "IMPERIAL": ('"', "'", "in", "ft")}[kind]), text
            shared._held.clear()
        del bpy.context.scene["contact_core"]
    assert np.abs(poses[0] - poses[1]).max() < 1e-4


def test_things_that_move_and_keys_between_frames(bpy: Any, empty: Any, scenes: Any) -> None:
    """The ball is a child of something animated and follows a constraint; the arm stays on it at 2.5, too."""
    arm_at(scenes, "arm")
    ball = ball_at(scenes, "ball")
    carrier, guide = bpy.data.objects.new("carrier", None), bpy.data.objects.new("guide", None)
    for each in (carrier, guide):
        bpy.context.scene.collection.objects.link(each)
    ball.parent = carrier
    for frame, height in ((1, 0.0), (4, 0.3)):
        carrier.location = guide.location = (0.0, 0.0, height)
        carrier.keyframe_insert("location", index=2, frame=frame)
        guide.keyframe_insert("location", index=2, frame=frame)
    follow = ball.constraints.new("COPY_ROTATION")
    follow.target = guide
    bpy.context.scene.frame_set(1)
    session = Session(host=empty, objects=None, discover=False)
    pair = paired(session, "arm", "ball")
    still = gaps(bpy, session)[pair]
    session.accept(session.solve(frames=[2.5]))
    assert empty.pose_keys("arm") == (2.5,)
    session.accept(session.solve(frames=[1, 2.5, 4]))
    for frame, part in ((1, 0.0), (2, 0.5), (4, 0.0)):
        bpy.context.scene.frame_set(frame, subframe=part)
        assert gaps(bpy, session)[pair] < 0.3 * still, frame
    session.close()


def library_of(bpy: Any, scenes: Any, path: Path, make: Any) -> None:
    """A .blend with a collection "asset" of what `make` makes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    before = set(bpy.data.objects)
    make()
    asset = bpy.data.collections.new("asset")
    bpy.context.scene.collection.children.link(asset)
    for each in set(bpy.data.objects) - before:
        bpy.context.scene.collection.objects.unlink(each)
        asset.objects.link(each)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)


def linked(bpy: Any, path: Path) -> Any:
    with bpy.data.libraries.load(str(path), link=True) as (_, here):
        here.collections = ["asset"]
    bpy.context.scene.collection.children.link(here.collections[0])
    return here.collections[0]


def test_an_overridden_character_is_painted_solved_saved_and_reopened(
    bpy: Any, empty: Any, scenes: Any, tmp_path: Path
) -> None:
    """Document, pose and choice of bones are in the shot; the character's own file is as it was, bit for bit."""
    import contact_core as contact

    library, shot = tmp_path / "character.blend", tmp_path / "shot.blend"
    library_of(bpy, scenes, library, lambda: arm_at(scenes, "arm"))
    before = hashlib.sha256(library.read_bytes()).digest()
    asset = linked(bpy, library)
    asset.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    bpy.context.scene.collection.children.unlink(asset)
    ball_at(scenes, "ball")
    bpy.context.view_layer.update()
    host = scenes.BlenderHost()
    skin = next(each for each in bpy.context.scene.objects if each.name.startswith("arm") and each.type == "MESH")
    assert skin.override_library is not None and skin.data.library is not None and skin.parent.override_library
    session = Session(host=host, objects=[host._ids.id_of(skin), "ball"], discover=False)
    name = next(each for each in session.document.surfaces if each != "ball")
    pair = paired(session, name, "ball")
    apart = gaps(bpy, session)[pair]
    session.surfaces.choose_bones(name, "deform")
    session.accept(session.solve(frames=[3]))
    bpy.context.scene.frame_set(3)
    near = gaps(bpy, session)[pair]
    assert near < 0.3 * apart
    host.save(shot)
    session.close()
    assert hashlib.sha256(library.read_bytes()).digest() == before
    with contact.open(shot) as again:
        bpy.context.scene.frame_set(3)
        assert gaps(bpy, again)[pair] == pytest.approx(near, abs=1e-5)
        object_id = again.binding.surfaces[name].object_id
        assert again.host.bones_of(object_id) == "deform" and again.host.pose_keys(object_id) == (3.0,)
        again.patches.rotate(f"{name} tip", 0.2)
        again.undo()


def test_a_linked_scene_keeps_no_document(bpy: Any, empty: Any, scenes: Any, tmp_path: Path) -> None:
    """It would be gone with the file: refused in words, which say where the user may write."""
    from contact_blender import storage
    from contact_core.errors import FileRefused
    from contact_core.scene.host import DocumentStamp

    bpy.context.scene.name = "set"
    empty.save(tmp_path / "set.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "set.blend"), link=True) as (_, here):
        here.scenes = ["set"]
    with pytest.raises(FileRefused, match="work in a scene of this file"):
        storage.write(here.scenes[0], DocumentStamp(1, "digest", 1), {"a": "b"}, (), ())
    assert storage.KEY not in here.scenes[0]


def test_an_asset_that_was_updated_is_rebound(bpy: Any, empty: Any, scenes: Any, tmp_path: Path) -> None:
    """A linked ball with finer triangles: the contact is projected onto it and the document knows the new mesh."""
    library = tmp_path / "ball.blend"
    library_of(bpy, scenes, library, lambda: ball_at(scenes, "ball"))
    linked(bpy, library)
    arm_at(scenes, "arm")
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    session = Session(host=scenes.BlenderHost(), objects=None, discover=False)
    name = next(each for each in session.document.surfaces if each != "arm")
    pair = paired(session, "arm", name)
    old, object_id = session.geometry.mesh(name), session.binding.surfaces[name].object_id
    session.save()
    session.close()
    library_of(bpy, scenes, library, lambda: ball_at(scenes, "ball", subdivisions=2))
    with Session(host=scenes.BlenderHost(tmp_path / "shot.blend"), discover=False) as again:
        assert "Use rebind" in again.binding.missing[name] and name not in again.surfaces.meshes
        report = again.surfaces.rebind(name, again.host.read_surface(object_id).mesh, old_mesh=old)
        assert max(report.moves.values()) < 0.02
        again.save()
    with Session(host=scenes.BlenderHost(tmp_path / "shot.blend"), discover=False) as fine:
        assert not fine.binding.missing and len(fine.surfaces.meshes[name].faces) == 320
        before = gaps(bpy, fine)[pair]
        fine.accept(fine.solve())
        assert gaps(bpy, fine)[pair] < 0.3 * before
