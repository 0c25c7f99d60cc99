"""The document in the .blend, ids that outlive names, and a session whose history follows Blender's undo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contact_core.document.schema import dump_document
from contact_core.errors import CommandRejected, FileRefused, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.scene.host import SceneSpace
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_checks import store, stored
from contact_core.testing.host_scenes import HostScene, SceneMesh, SceneRig, arm_rig, bent


@pytest.fixture
def torus(scenes: Any) -> Any:
    """A host with a torus and the contract's arm."""
    mesh = meshes.family("torus")
    shape = SceneMesh("torus", mesh.points, np.full(len(mesh.faces), 3), mesh.faces.ravel())
    return scenes.build(HostScene(SceneSpace(1.0, "Z"), (shape,), (SceneRig("arm", arm_rig()),)))


def open_session(host: Any) -> Session:
    """A session in a host, with the meshes of its document's surfaces, or of all objects at first."""
    session = Session(host=host)
    for item in host.objects():
        asset = host.read_surface(item.id)
        session.surfaces.add(item.id, asset.mesh, rig=asset.rig, up_axis=asset.up_axis)
    return session


def paint(session: Session, seed: int) -> str:
    """A small patch somewhere on the torus; its name."""
    mesh = session.surfaces.meshes["torus"]
    random = np.random.default_rng(seed)
    ring = mesh.faces[random.integers(len(mesh.faces))]
    near = np.flatnonzero(np.isin(mesh.faces, ring).any(axis=1))[:8]
    points = SurfacePoints(near, np.full((len(near), 3), 1 / 3))
    axis = SurfacePoints(near[:2], np.full((2, 3), 1 / 3))
    name = session.document.free_name(f"patch{seed}")
    session.patches.paint(name, points, surface="torus", axis=axis)
    return name


def test_ids_follow_their_objects(bpy: Any, torus: Any, tmp_path: Path) -> None:
    """Through renaming, undo, saving and loading; an object that takes the old name is another one."""
    torus.objects()
    digest = torus.read_surface("torus").mesh.digest
    bpy.data.objects["torus"].name = "ring"
    with torus.step("Document"):
        store(torus, stored(1, {"a": "{}"}))
    impostor = bpy.data.objects.new("torus", bpy.data.meshes.new("empty"))
    bpy.context.scene.collection.objects.link(impostor)
    assert {(item.id, item.name) for item in torus.objects()} == {
        ("torus", "ring"), ("arm", "arm"), ("torus (2)", "torus")}  # fmt: skip
    path = tmp_path / "renamed.blend"
    torus.save(path)
    again = type(torus)(path)
    assert again.read_surface("torus").mesh.digest == digest
    assert next(item.name for item in again.objects() if item.id == "torus") == "ring"


def test_the_document_comes_with_an_appended_scene(bpy: Any, torus: Any, scenes: Any, tmp_path: Path) -> None:
    """Appended into a file where the names are taken: its ids mean the objects that came along."""
    session = open_session(torus)
    paint(session, 1)
    wanted, digest = torus.stored_document(), torus.read_surface("torus").mesh.digest
    path = tmp_path / "shot.blend"
    torus.save(path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.data.scenes["Scene"].name = "Mine"
    scenes.mesh_object("torus", np.eye(3), [3], [0, 1, 2])
    with bpy.data.libraries.load(str(path)) as (there, here):
        here.scenes = there.scenes
    bpy.context.window.scene = here.scenes[0]
    again = scenes.BlenderHost()
    assert again.stored_document() == wanted
    assert again.read_surface("torus").mesh.digest == digest


def test_the_document_is_one_property_of_the_scene(bpy: Any, torus: Any) -> None:
    before = set(bpy.context.scene.keys())
    paint(open_session(torus), 2)
    assert set(bpy.context.scene.keys()) - before == {"contact_core"}


STAMP = {"revision": 1, "digest": "0", "schema": 1}


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (5, "not a contact document"),
        (STAMP, "not a contact document"),
        ({"parts": {"a": b"{}"}}, "not a contact document"),
        ({**STAMP, "parts": b"{}"}, "not a contact document"),
        ({"revision": 1, "schema": 1, "data": b"{}", "ids": "[]", "objects": {}}, "in one piece"),
    ],
)
def test_a_damaged_property_is_refused_and_left(bpy: Any, torus: Any, damage: Any, words: str) -> None:
    bpy.context.scene["contact_core"] = damage
    for attempt in (torus.stored_document, torus.stored_stamp, lambda: store(torus, stored(1, {"a": "{}"}))):
        with pytest.raises(FileRefused, match=words):
            attempt()
    assert "contact_core" in bpy.context.scene


@pytest.mark.parametrize("part", [3.5, b"\xff", "text"])
def test_a_damaged_part_is_refused_and_left(bpy: Any, torus: Any, part: Any) -> None:
    store(torus, stored(1, {"a": "{}"}))
    bpy.context.scene["contact_core"]["parts"]["a"] = part
    with pytest.raises(FileRefused, match="not a contact document"):
        torus.stored_document()


def test_an_edit_writes_the_parts_that_it_changes(bpy: Any, torus: Any) -> None:
    """Nothing else of the property is touched: what is there for others keeps its place in memory."""
    session = open_session(torus)
    names = [paint(session, seed) for seed in (1, 2)]
    before = torus.stored_document()
    session.patches.rotate(names[0], 0.3)
    after = torus.stored_document()
    changed = {key for key in before.parts if before.parts[key] != after.parts[key]}
    assert len(changed) == 1 and before.parts.keys() == after.parts.keys()
    assert f'"{names[0]}"' in after.parts[changed.pop()]


def test_nothing_but_ids_keeps_blender_objects(bpy: Any, torus: Any) -> None:
    """After all kinds of calls no Python object that the host reaches is a Blender object: undo frees those."""
    session = open_session(torus)
    paint(session, 3)
    rig = torus.read_rig("arm").rig
    torus.write_pose("arm", bent(rig, 1), 3.0)
    torus.skin_points("arm", bent(rig, 2))
    torus.selections("torus"), torus.placement("arm", 2.0), torus.on_undo(lambda: None)
    reached = set()
    with pytest.raises(ZeroDivisionError), torus.step("fails"):
        torus.write_pose("arm", bent(rig, 3), 5.0)
        store(torus, stored(99, {"a": "{}"}))
        reached |= values_reached_from(torus)  # with what would take the step back
        raise ZeroDivisionError
    reached |= values_reached_from(torus)
    assert {"Held", "_KnownRig", "function"} <= {type(value).__name__ for value in reached}
    assert not [value for value in reached if isinstance(value, bpy.types.bpy_struct)]


def values_reached_from(start: Any) -> set[Any]:
    """All objects that can be hashed of those reached by attributes, items and closures."""
    waiting, seen, found_values = [start], set(), set()
    while waiting:
        found = waiting.pop()
        if id(found) in seen or isinstance(found, type | np.ndarray | str | bytes):
            continue
        seen.add(id(found))
        if getattr(type(found), "__hash__", None) is not None and not isinstance(found, tuple):
            found_values.add(found)
        if isinstance(found, dict):
            waiting += [*found.keys(), *found.values()]
        elif isinstance(found, list | tuple | set | frozenset):
            waiting += list(found)
        else:
            waiting += list(getattr(found, "__dict__", {}).values())
            waiting += [cell.cell_contents for cell in getattr(found, "__closure__", None) or ()]
    return found_values


def test_in_edit_mode_a_step_waits(bpy: Any, torus: Any) -> None:
    """Blender's undo there remembers the mesh alone, so nothing is written, and the refusal says so."""
    session = open_session(torus)
    bpy.context.view_layer.objects.active = bpy.data.objects["torus"]
    bpy.ops.object.mode_set(mode="EDIT")
    held, revision = torus.stored_document(), session.revision
    with pytest.raises(InvalidInput, match="leave Edit Mode"):
        paint(session, 4)
    assert torus.stored_document() == held and session.revision == revision
    bpy.ops.object.mode_set(mode="OBJECT")
    paint(session, 4)


@pytest.mark.parametrize(
    "mode",
    ["OBJECT", "POSE", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT", "PARTICLE_EDIT", "EDIT"],
)
def test_in_every_mode_a_step_can_be_undone_or_is_refused(bpy: Any, torus: Any, mode: str) -> None:
    """Blender's undo holds the whole scene in some modes, and in others only what is being edited."""
    made = bpy.data.objects["arm"]
    made.modifiers.new("Hair", "PARTICLE_SYSTEM")
    made.particle_systems[0].settings.type = "HAIR"
    bpy.context.view_layer.objects.active = made.parent if mode == "POSE" else made
    rig = torus.read_rig("arm").rig
    with torus.step("before"):
        store(torus, stored(1, {"at": "0"}))
    bpy.ops.object.mode_set(mode=mode)
    try:
        for number in (1, 2):
            with torus.step("in the mode"):
                store(torus, stored(number + 1, {"at": str(number)}))
                torus.write_pose("arm", bent(rig, number), float(number))
    except InvalidInput as error:
        assert mode in ("TEXTURE_PAINT", "PARTICLE_EDIT", "EDIT") and "waits until you leave" in str(error)
        assert torus.stored_document().parts == {"at": "0"} and torus.pose_keys("arm") == ()
    else:
        for way, wanted in (("undo", 1), ("undo", 0), ("redo", 1), ("redo", 2)):
            assert getattr(torus, way)() and torus.stored_document().parts == {"at": str(wanted)}
            assert torus.pose_keys("arm") == tuple(map(float, range(1, wanted + 1)))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_one_command_is_one_step_of_blender(bpy: Any, torus: Any) -> None:
    """Painting, turning and a macro each go and come with one undo and redo of Blender itself."""
    session = open_session(torus)
    documents = [session.document]
    name = paint(session, 5)
    documents.append(session.document)
    session.patches.rotate(name, 0.3)
    documents.append(session.document)
    with session.macro("Two at once"):
        session.patches.rotate(name, 0.1)
        session.patches.rotate(name, 0.1)
    documents.append(session.document)
    for wanted in documents[-2::-1]:
        bpy.ops.ed.undo()  # as the user's Ctrl+Z does
        assert session.document is wanted
    for wanted in documents[1:]:
        bpy.ops.ed.redo()
        assert session.document is wanted


def test_a_walk_of_three_hundred_steps(bpy: Any, torus: Any) -> None:
    """Core commands, Blender's undo and redo by key and by session, poses, keys and foreign edits in any order.

    After each, the session's document is the stored one, revisions agree, and the scene is what it was then."""
    import blender_scenes

    session = open_session(torus)
    paint(session, 0)
    rig = torus.read_rig("arm").rig
    random = np.random.default_rng(300)
    states: list[Any] = [(blender_scenes.whole_state(), dump_document(session.document))]
    at, floor, done = 0, 0, {"undo": 0, "redo": 0, "foreign": 0, "pose": 0, "command": 0}
    step = 0
    while sum(done.values()) < 300:
        step += 1
        what = str(random.choice(["command", "pose", "foreign", "undo", "redo"], p=[0.25, 0.1, 0.15, 0.3, 0.2]))
        if what in ("undo", "redo"):
            move = -1 if what == "undo" else 1
            if not floor <= at + move < len(states):
                continue
            at += move
            if random.random() < 0.5:
                getattr(bpy.ops.ed, what)()
            else:
                getattr(session, what)()
        else:
            if what == "command":
                core_edit(session, random, step)
            elif what == "pose":
                torus.write_pose("arm", bent(rig, step), float(step % 7) if random.random() < 0.5 else None)
            else:
                foreign_edit(bpy, random)
            at += 1
            states[at:] = [(blender_scenes.whole_state(), dump_document(session.document))]
            floor = max(floor, at - 28)  # Blender keeps 32 steps
        done[what] += 1
        found = torus.stored_document()
        assert found.stamp.revision == session.revision == session.history.revision, (step, what)
        held = dump_document(found.read("the scene").document)
        assert held == dump_document(session.document) == states[at][1], (step, what)
        assert blender_scenes.whole_state() == states[at][0], (step, what)
    assert min(done.values()) > 20, done
    session.close()


def core_edit(session: Session, random: Any, seed: int) -> None:
    """A random verb on a random patch."""
    names = list(session.document.patches)
    verb = random.choice(["paint", "rotate", "translate", "remove"]) if len(names) > 1 else "paint"
    if verb == "paint":
        paint(session, seed)
    elif verb == "rotate":
        session.patches.rotate(str(random.choice(names)), float(random.uniform(-1, 1)))
    elif verb == "translate":
        near = SurfacePoints([int(random.integers(len(session.surfaces.meshes["torus"].faces)))], [[0.2, 0.3, 0.5]])
        session.patches.translate(str(random.choice(names)), near)
    else:
        session.patches.remove(str(random.choice(names)))


def foreign_edit(bpy: Any, random: Any) -> None:
    """What a user does with Blender's own tools: move, rename, make, delete."""
    kind = random.choice(["move", "rename", "make", "delete"])
    extra = [each for each in bpy.data.objects if each.type == "EMPTY"]
    if kind == "move":
        bpy.data.objects["torus" if "torus" in bpy.data.objects else "ring"].location.x += 0.5
    elif kind == "rename":
        ring = next(each for each in bpy.data.objects if each.name in ("torus", "ring"))
        ring.name = "ring" if ring.name == "torus" else "torus"
    elif kind == "delete" and extra:
        bpy.data.objects.remove(extra[0])
    else:
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("thing", None))
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message=f"User: {kind}")


def test_reopening_goes_on_where_it_was(torus: Any, tmp_path: Path) -> None:
    """A new session on the saved file has the document; its next revision comes after the stored one."""
    session = open_session(torus)
    paint(session, 6)
    path, document, revision = tmp_path / "work.blend", dump_document(session.document), session.revision
    session.close()
    torus.save(path)
    again = Session(host=type(torus)(path))
    assert dump_document(again.document) == document and again.revision == revision
    with pytest.raises(CommandRejected, match="nothing to undo"):
        again.undo()
    held = again.host.stored_document().read("the scene").document
    assert held.patches.keys() == again.document.patches.keys()


def test_a_scene_is_saved_as_a_blend_file_only(torus: Any, tmp_path: Path) -> None:
    """Blender itself would write over a stage or a picture."""
    stage = tmp_path / "shot.usda"
    stage.write_text("#usda 1.0")
    with pytest.raises(FileRefused, match=r"shot\.usda: a scene of Blender is saved as \.blend"):
        torus.save(stage)
    assert stage.read_text() == "#usda 1.0"


def test_scripts_of_a_file_are_left_to_blenders_setting_and_told(bpy: Any, torus: Any, tmp_path: Path) -> None:
    """A file from a stranger runs nothing when it is opened; that something stands still is in the notes."""
    text = bpy.data.texts.new("rig.py")
    text.write(f"open({str(tmp_path / 'ran')!r}, 'w').close()")
    text.use_module = True
    torus.save(tmp_path / "rig.blend")
    assert torus.space().notes == ()
    again = type(torus)(tmp_path / "rig.blend")
    assert not (tmp_path / "ran").exists()
    assert any("rig.py" in note for note in again.space().notes)


@pytest.mark.parametrize("way", ["another file", "a new file", "reverted"])
def test_a_session_ends_with_its_scene(way: str, bpy: Any, torus: Any, tmp_path: Path) -> None:
    """File > Open under a live session: its next edit is refused, and writes nothing into the other file."""
    session = open_session(torus)
    name = paint(session, 1)
    torus.save(tmp_path / "a.blend")
    if way == "another file":
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"))
    elif way == "a new file":
        bpy.ops.wm.read_homefile(use_empty=True)
    else:
        bpy.ops.wm.revert_mainfile()
    for edit in (lambda: session.patches.rotate(name, 0.3), session.undo, session.save):
        with pytest.raises((CommandRejected, FileRefused), match="ended with its scene"):
            edit()
    assert all("contact_core" not in scene for scene in bpy.data.scenes) == (way != "reverted")
    again = Session(host=type(torus)())
    assert list(again.document.patches) == ([name] if way == "reverted" else [])
    again.close()


def test_a_host_keeps_to_its_scene(bpy: Any, torus: Any) -> None:
    """The window may show another scene of the file: contacts go where they are, and not there."""
    session = open_session(torus)
    first = bpy.context.scene
    other = bpy.data.scenes.new("other")
    bpy.context.window.scene = other
    name = paint(session, 1)
    assert "contact_core" in first and "contact_core" not in other
    bpy.data.scenes.remove(first)
    with pytest.raises(CommandRejected, match="ended with its scene"):
        session.patches.rotate(name, 0.1)
    assert "contact_core" not in other
