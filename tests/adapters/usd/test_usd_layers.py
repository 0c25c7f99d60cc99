"""One layer is ours: what is written there, how it is undone, found again, and seen without our schema."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Tf, Usd, UsdGeom

from contact_core.document.asset import Asset
from contact_core.document.schema import same_documents
from contact_core.errors import FileRefused
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_checks import revision_of, store, stored
from contact_core.testing.host_scenes import arm_rig, bent
from contact_usd import contacts, schema_dir
from contact_usd.host import UsdHost
from contact_usd.validate import problems


def torus_host() -> tuple[UsdHost, Session, str]:
    """A torus on a stage of our own, with one painted patch and a copy that it is paired with."""
    host = UsdHost()
    key = host.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    session = Session(host=host, discover=False)
    mesh = host.read_surface(key).mesh
    session.surfaces.add("torus", mesh, world_from_surface=host.placement(key))
    order = np.argsort(np.linalg.norm(mesh.points - mesh.points[0], axis=1), kind="stable")[:30]
    axis = SurfacePoints.at_vertices(mesh, order[[0, 12]])
    session.patches.paint("grip (links)", SurfacePoints.at_vertices(mesh, order), surface="torus", axis=axis)
    far = SurfacePoints.at_vertices(mesh, [int(np.argmax(np.linalg.norm(mesh.points - mesh.points[0], axis=1)))])
    copy = session.patches.transfer("grip (links)", "torus", far, heading=1.0 + 0.0j, mirrored=False)
    session.pairs.add("grip (links)", copy)
    return host, session, key


def test_patches_axes_and_pairs_come_back_equal(tmp_path: Path) -> None:
    host, session, key = torus_host()
    contacts.publish(host, session, {"torus": key})
    host.save(tmp_path / "ours.usda")
    stage = Usd.Stage.Open(str(tmp_path / "ours.usda"))
    found = {patch.name: patch for patch in contacts.read_patches(stage)}
    assert set(found) == set(session.document.patches)
    for name, patch in found.items():
        ours = session.geometry.reconstruction(name).points
        np.testing.assert_array_equal(patch.points.faces, ours.faces)
        np.testing.assert_allclose(patch.points.barycentric, ours.barycentric, atol=1e-6)
        np.testing.assert_allclose(patch.positions, ours.positions(session.surfaces.meshes["torus"]), atol=1e-6)
        assert patch.axis is not None
        np.testing.assert_array_equal(patch.axis.faces, session.geometry.axis(name).points.faces)
        assert (patch.surface, patch.topology) == (key, session.surfaces.meshes["torus"].topology_digest)
        assert patch.role == ("original" if session.document.patches[name].original else "transferred")
    (pair,) = contacts.read_pairs(stage)
    (wanted,) = session.document.pairs.values()
    assert (pair.name, pair.manipulator, pair.object) == (wanted.name, wanted.manipulator, wanted.object)
    contacts.publish(host, session, {"torus": key})  # again: in place of the first
    assert len(contacts.read_patches(host.stage)) == len(found)


def test_what_a_layer_below_published_does_not_come_back(tmp_path: Path) -> None:
    """A shot over a shot with contacts: a patch that is removed is gone, and comes back when it is brought back."""
    below, session, key = torus_host()
    contacts.publish(below, session, {"torus": key})
    names = set(session.document.patches)
    session.close()
    below.layer.customLayerData = {}
    below.save(tmp_path / "below.usda")
    host = UsdHost(tmp_path / "below.usda")
    session = Session(host=host, discover=False)
    session.surfaces.add("torus", host.read_surface(key).mesh, world_from_surface=host.placement(key))
    copy = next(name for name in names if name != "grip (links)")
    session.patches.remove(copy)
    contacts.publish(host, session, {"torus": key})
    assert {patch.name for patch in contacts.read_patches(host.stage)} == {"grip (links)"} == names - {copy}
    assert contacts.read_pairs(host.stage) == ()
    host.save(tmp_path / "above.usda")
    assert len(contacts.read_patches(Usd.Stage.Open(str(tmp_path / "above.usda")))) == 1
    session.undo()  # the publishing
    session.undo()
    assert set(session.document.patches) == names
    contacts.publish(host, session, {"torus": key})
    assert {patch.name for patch in contacts.read_patches(host.stage)} == names
    assert len(contacts.read_pairs(host.stage)) == 1


def test_edits_of_the_document_and_of_others_share_a_step() -> None:
    """In whichever order they come; also where somebody answers our edit with his own, or ours changes nothing."""
    host, session, key = torus_host()
    prim = host.stage.GetPrimAtPath(key)

    def move(x: float) -> None:
        with Usd.EditContext(host.stage, host.layer):
            UsdGeom.Xformable(prim).MakeMatrixXform().Set(Gf.Matrix4d(1.0).SetTranslate((x, 0.0, 0.0)))

    def answer(notice: Usd.Notice.ObjectsChanged, stage: Usd.Stage) -> None:
        if any(path.name == "contact:digest" for path in notice.GetChangedInfoOnlyPaths()):
            move(7.0)

    def answered() -> None:
        listener = Tf.Notice.Register(Usd.Notice.ObjectsChanged, answer, host.stage)
        session.set_extra("answered", 1)
        listener.Revoke()

    def nothing_new() -> None:
        with host.step("both"):
            move(5.0)
            host.store_document(host.stored_stamp(), {})  # type: ignore[arg-type]

    def both() -> None:
        with host.step("both"):
            session.set_extra("first", 1)
            move(2.0)
            session.set_extra("second", 1)

    texts = [host.layer.ExportToString()]
    for edit in (both, lambda: session.set_extra("alone", 1), nothing_new, answered):
        edit()
        texts.append(host.layer.ExportToString())
        assert texts[-1] != texts[-2]
    for text in texts[-2::-1]:
        assert host.undo() and host.layer.ExportToString() == text
    for text in texts[1:]:
        assert host.redo() and host.layer.ExportToString() == text


def test_publishing_writes_what_changed_and_nothing_else() -> None:
    """Prims whose patch, surface, pose and place are the same are not touched; those of other names go."""
    host, session, key = torus_host()
    contacts.publish(host, session, {"torus": key})
    whole, changed = host.layer.ExportToString(), set[str]()

    def hear(notice: Usd.Notice.ObjectsChanged, stage: Usd.Stage) -> None:
        paths = [*notice.GetResyncedPaths(), *notice.GetChangedInfoOnlyPaths()]
        changed.update(path.GetPrimPath().name for path in paths)

    listener = Tf.Notice.Register(Usd.Notice.ObjectsChanged, hear, host.stage)
    contacts.publish(host, session, {"torus": key})
    assert host.layer.ExportToString() == whole and not changed
    copy = next(name for name in session.document.patches if name != "grip (links)")
    session.patches.rotate(copy, 0.3)
    assert changed == {"Contacts"}  # the document alone
    changed.clear()
    contacts.publish(host, session, {"torus": key})
    prim = Tf.MakeValidIdentifier(copy)
    assert changed == {prim, f"{prim}_axis"}
    found = {patch.name: patch for patch in contacts.read_patches(host.stage)}
    there = session.geometry.reconstruction(copy).points.positions(session.surfaces.meshes["torus"])
    np.testing.assert_allclose(found[copy].positions, there, atol=1e-6)
    host.undo(), host.undo()
    assert host.layer.ExportToString() == whole
    session.patches.rename(copy, "other")
    changed.clear()
    contacts.publish(host, session, {"torus": key})
    assert {patch.name for patch in contacts.read_patches(host.stage)} == {"grip (links)", "other"}
    assert {prim, "other"} <= changed and Tf.MakeValidIdentifier("grip (links)") not in changed
    listener.Revoke()


def test_a_document_of_a_layer_below_does_not_mix_with_ours(tmp_path: Path) -> None:
    """Our layer holds the whole document from its first edit on, and parts of the one below never come through."""
    below, session, _ = torus_host()
    session.close()
    below.layer.customLayerData = {}
    below.save(tmp_path / "below.usda")
    host = UsdHost(tmp_path / "below.usda")
    with Session(host=host, discover=False) as above:
        above.patches.remove("grip (links)")
        wanted = above.document
    host.save(tmp_path / "above.usda")
    with Session(host=below, discover=False) as session:  # the file below goes on
        session.set_extra("note", "later")
    below.save(tmp_path / "below.usda")
    with Session(host=UsdHost(tmp_path / "above.usda"), discover=False) as again:
        assert same_documents(again.document, wanted)


def test_a_document_in_one_piece_is_refused_and_left(tmp_path: Path) -> None:
    host = UsdHost()
    prim = host.stage.DefinePrim("/Contacts", "Scope")
    prim.CreateAttribute("contact:document", Sdf.ValueTypeNames.String).Set("{}")
    before = host.layer.ExportToString()
    for attempt in (host.stored_document, host.stored_stamp, lambda: store(host, stored(1))):
        with pytest.raises(FileRefused, match="in one piece"):
            attempt()
    assert host.layer.ExportToString() == before


def test_usds_own_validators_find_no_error_in_our_layer(tmp_path: Path) -> None:
    pytest.importorskip("pxr.UsdValidation", reason="this pxr has no UsdValidation")
    host, session, key = torus_host()
    rig = arm_rig()
    arm = host.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    for frame in (1.0, 2.0):
        host.write_pose(arm, bent(rig, 1), frame)
    contacts.publish(host, session, {"torus": key})
    host.save(tmp_path / "ours.usda")
    stage = Usd.Stage.Open(str(tmp_path / "ours.usda"))
    assert problems(stage) == ()
    patch = stage.GetPrimAtPath(contacts.PATCHES).GetChildren()[0]
    UsdGeom.Points.Define(stage, patch.GetPath().AppendChild("nested"))
    assert any("Nested" in problem for problem in problems(stage))  # the validators do look


NEW_PROCESS = """
import json, sys
from pxr import Usd, UsdGeom
if sys.argv[2] == "imported":
    import contact_usd.host
early = Usd.Stage.Open(sys.argv[1]) if sys.argv[2] in ("late", "imported") else None
if sys.argv[2] != "without":
    from contact_usd.host import UsdHost
    host = UsdHost(sys.argv[1])
    stage, problem = host.stage, host.schema_problem
else:
    stage, problem = Usd.Stage.Open(sys.argv[1]), None
patch = next(p for p in stage.Traverse() if p.GetName().startswith("grip"))
print(json.dumps({
    "known": [str(n) for n in patch.GetAppliedSchemas()], "problem": problem,
    "points": len(UsdGeom.Points(patch).GetPointsAttr().Get()),
    "faces": len(patch.GetAttribute("primvars:contact:face").Get()),
    "surface": str(patch.GetRelationship("contact:surface").GetTargets()[0]),
    "revision": stage.GetPrimAtPath("/Contacts").GetAttribute("contact:revision").Get()}))
"""


@pytest.mark.parametrize("plugin", ["with", "without", "late", "imported", "environment"])
def test_a_new_process_reads_it_with_and_without_the_schema(plugin: str, tmp_path: Path) -> None:
    host, session, key = torus_host()
    contacts.publish(host, session, {"torus": key})
    host.save(tmp_path / "ours.usda")
    environment = {k: v for k, v in os.environ.items() if k != "PXR_PLUGINPATH_NAME"}
    if plugin == "environment":  # a host that loads USD first, started with our folder on USD's path
        environment["PXR_PLUGINPATH_NAME"] = str(schema_dir())
    how = "late" if plugin == "environment" else plugin
    command = [sys.executable, "-c", NEW_PROCESS, str(tmp_path / "ours.usda"), how]
    run = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    seen = json.loads(run.stdout.splitlines()[-1])
    assert seen["points"] == seen["faces"] == 30 and seen["surface"] == key
    assert seen["revision"] == session.revision
    assert seen["known"] == ([] if plugin in ("without", "late") else ["ContactPatchAPI"])
    if plugin == "late":
        assert "PXR_PLUGINPATH_NAME" in seen["problem"] and str(schema_dir()) in seen["problem"]
    else:
        assert seen["problem"] is None


def test_schema_files_are_what_usd_generates(repository: Path) -> None:
    pytest.importorskip("jinja2", reason="usdGenSchema needs jinja2")
    pytest.importorskip("pxr.UsdValidation", reason="the committed files are those of usd-core 26.3 and later")
    generator = repository / "adapters" / "usd" / "generate_schema.py"
    spec = importlib.util.spec_from_file_location("generate_schema", generator)
    assert spec is not None and spec.loader is not None
    module: ModuleType = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, text in module.generate().items():
        assert (schema_dir() / name).read_text(encoding="utf-8") == text, (
            f"run adapters/usd/generate_schema.py: {name}"
        )


def test_sources_are_never_written(tmp_path: Path) -> None:
    source = tmp_path / "source.usda"
    made = UsdHost()
    key = made.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    made.layer.customLayerData = {}  # a file like any other
    made.save(source)
    before = hashlib.sha256(source.read_bytes()).hexdigest()
    host = UsdHost(source)
    store(host, stored(1, {"a": "{}"}))
    with pytest.raises(FileRefused, match="never written"):
        host.save(source)
    host.save()
    assert (tmp_path / "source.contact.usda").exists()
    assert hashlib.sha256(source.read_bytes()).hexdigest() == before
    assert "@./source.usda@" in (tmp_path / "source.contact.usda").read_text().replace("@source", "@./source")
    (tmp_path / "elsewhere").mkdir()
    for name in ("source.usda", "source.contact.usda"):  # relative paths: the pair of files can move
        (tmp_path / name).rename(tmp_path / "elsewhere" / name)
    assert [item.id for item in UsdHost(tmp_path / "elsewhere" / "source.contact.usda").objects()] == [key]


def test_files_that_others_named_in_our_layer_are_found_wherever_it_is_saved(tmp_path: Path) -> None:
    """A reference and a texture, added to our layer by another tool with relative paths."""
    prop = UsdHost()
    prop.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    prop.layer.customLayerData = {}
    prop.save(tmp_path / "prop.usda")
    (tmp_path / "paint.png").write_bytes(b"")
    UsdHost().save(tmp_path / "ours.usda")
    stage = Usd.Stage.Open(str(tmp_path / "ours.usda"))
    stage.DefinePrim("/added").GetReferences().AddReference("./prop.usda", "/torus")
    for name, asset in (("near", "paint.png"), ("searched", "studio/paint.png"), ("far", "https://studio/p.png")):
        stage.GetPrimAtPath("/added").CreateAttribute(name, Sdf.ValueTypeNames.Asset).Set(asset)
    stage.GetRootLayer().Save()
    del stage
    (tmp_path / "a" / "b").mkdir(parents=True)
    host = UsdHost(tmp_path / "ours.usda")
    for place in ("a/b/deeper.usda", "ours.usda", "a/again.usdc"):
        host.save(tmp_path / place)
        stage = Usd.Stage.Open(str(tmp_path / place))
        added = stage.GetPrimAtPath("/added")
        assert added.IsA(UsdGeom.Mesh), stage.GetRootLayer().ExportToString()
        values = {name: added.GetAttribute(name).Get() for name in ("near", "searched", "far")}
        assert Path(values["near"].resolvedPath).resolve() == (tmp_path / "paint.png").resolve()
        assert (values["searched"].path, values["far"].path) == ("studio/paint.png", "https://studio/p.png")
        again = UsdHost(tmp_path / place)
        assert [item.id for item in again.objects()] == ["/added"] and again.space().notes == ()


def test_a_stage_that_a_dcc_has_open_keeps_its_layers(tmp_path: Path) -> None:
    made = UsdHost()
    made.add(Asset("torus", meshes.family("torus"), meters_per_unit=1.0))
    made.layer.customLayerData = {}
    made.save(tmp_path / "scene.usda")
    stage = Usd.Stage.Open(str(tmp_path / "scene.usda"))
    root, session_layer = stage.GetRootLayer().ExportToString(), stage.GetSessionLayer()
    host = UsdHost.on(stage)
    store(host, stored(4, {"a": "{}"}))
    assert stage.GetPrimAtPath("/Contacts").GetAttribute("contact:revision").Get() == 4
    assert stage.GetRootLayer().ExportToString() == root and not stage.GetRootLayer().dirty
    assert not session_layer.rootPrims
    assert host.undo() and host.stored_document() is None


def test_every_host_on_one_stage_has_its_one_document() -> None:
    """A tool of a DCC makes a host, is closed and opened again: it goes on where it was."""
    stage = Usd.Stage.CreateInMemory()
    for revision in (1, 2, 3):
        host = UsdHost.on(stage)
        assert (revision_of(host) or 0) == revision - 1
        store(host, stored(revision, {"a": "{}"}))
        assert stage.GetPrimAtPath("/Contacts").GetAttribute("contact:revision").Get() == revision
        assert host.undo() and host.redo() and not host.redo()
        del host
    assert len(stage.GetSessionLayer().subLayerPaths) == 1
    one, other = UsdHost.on(stage), UsdHost.on(stage)
    store(one, stored(4, {"a": "{}"}))
    store(other, stored(5, {"b": "{}"}))
    assert one.stored_document() == other.stored_document() == stored(5, {"b": "{}"})
    assert other.undo() and revision_of(one) == 4


def test_three_hundred_steps_of_core_host_and_strangers_agree() -> None:
    """Core commands, the host's undo and redo, and edits of a script: document, storage and cursor agree."""
    host, session, key = torus_host()
    session.close()
    session = Session(host=host, discover=False)
    session.surfaces.meshes["torus"] = host.read_surface(key).mesh
    rng = np.random.default_rng(7)
    texts = [host.layer.ExportToString()]
    at, last = 0, ""
    for number in range(300):
        what = rng.choice(["command", "undo", "redo", "stranger"], p=[0.35, 0.3, 0.2, 0.15])
        if what in ("undo", "redo"):
            moved = host.undo() if what == "undo" else host.redo()
            bottom = 4  # steps of torus_host that are older than this list
            assert moved == ((at > -bottom) if what == "undo" else at + 1 < len(texts)), number
            at = at - (what == "undo" and moved) + (what == "redo" and moved)
            if at < 0:
                assert host.redo()
                at = 0
        else:
            if what == "command":
                session.patches.rotate("grip (links)", float(rng.uniform(-1, 1)))
            else:
                with Usd.EditContext(host.stage, host.layer):
                    shift = Gf.Matrix4d(1.0).SetTranslate((float(number), 0.0, 0.0))
                    UsdGeom.Xformable(host.stage.GetPrimAtPath(key)).MakeMatrixXform().Set(shift)
            at += not what == last == "stranger"  # what strangers do in a row is one step
            texts[at:] = [host.layer.ExportToString()]
        last = what
        found = host.stored_document()
        assert found is not None and found.stamp.revision == session.revision, (number, what)
        assert same_documents(found.read("the stage").document, session.document), (number, what)
        assert host.layer.ExportToString() == texts[at], (number, what)
