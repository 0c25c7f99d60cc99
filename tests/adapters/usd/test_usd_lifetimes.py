"""Nothing outlives the stage that it belongs to, and nothing of one host is seen by another.

USD hands out weak handles, and keeps one copy of each open file for the whole process. So all of this is checked
with Python's garbage collector switched off: what only a late collection mends, fails here.
"""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Sdf, Usd, UsdGeom, UsdSkel

from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_scenes import arm_rig, bent
from contact_usd.host import UsdHost
from contact_usd.shots import open_shot, prims_of, read_contacts, transfer

ARM, BALL = "/arm_rig/arm", "/ball"


@pytest.fixture(autouse=True)
def _without_collector() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """An arm and a ball in a file like any other."""
    made = UsdHost()
    rig = arm_rig()
    made.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    made.add(Asset("ball", meshes.icosphere(2), meters_per_unit=1.0))
    made.layer.customLayerData = {}
    made.save(tmp_path / "scene.usda")
    return tmp_path / "scene.usda"


def open_files(folder: Path) -> list[str]:
    """Files of a folder that USD's registry of layers still holds."""
    return sorted(
        {Path(item.realPath).name for item in Sdf.Layer.GetLoadedLayers() if str(folder) in item.realPath}
    )


def use(host: UsdHost) -> None:
    """All that a host caches or registers."""
    rig = host.read_rig(ARM).rig
    assert rig is not None
    host.objects()
    host.write_pose(ARM, bent(rig, 1), 2.0)
    host.skin_points(ARM, host.read_pose(ARM, 2.0))
    host.undo()


def test_a_host_that_nobody_holds_is_gone_with_its_files(scene: Path) -> None:
    host = UsdHost(scene)
    use(host)
    assert open_files(scene.parent) == ["scene.usda"]
    seen = weakref.ref(host)
    del host
    assert seen() is None and open_files(scene.parent) == []


def test_a_session_that_is_closed_lets_its_host_go(scene: Path) -> None:
    session = Session(host=UsdHost(scene), discover=False)
    session.surfaces.add("ball", session.host.read_surface(BALL).mesh)
    seen = weakref.ref(session.host)
    session.close()
    assert seen() is None and open_files(scene.parent) == []


def test_a_file_that_changed_is_read_anew(scene: Path) -> None:
    """As by a render farm that opens shot after shot while artists save."""
    before = len(UsdHost(scene).read_surface(BALL).mesh.points)
    text = scene.read_text()
    other = UsdHost()
    other.add(Asset("ball", meshes.icosphere(1), meters_per_unit=1.0))
    other.layer.customLayerData = {}
    other.save(scene)
    after = len(UsdHost(scene).read_surface(BALL).mesh.points)
    assert before == len(meshes.icosphere(2).points) and after == len(meshes.icosphere(1).points)
    scene.write_text(text)
    assert len(UsdHost(scene).read_surface(BALL).mesh.points) == before


def test_a_shot_lets_its_files_go(scene: Path) -> None:
    with Session(host=UsdHost(scene), discover=False) as session:
        mesh = session.host.read_surface(BALL).mesh
        session.surfaces.add("ball", mesh, world_from_surface=session.host.placement(BALL))
        points = SurfacePoints.at_vertices(mesh, [0, 1, 2])
        session.patches.paint("tip", points, surface="ball", axis=points[[0, 1]])
        document = session.document
    out = scene.with_name("out.usda")
    assert transfer(document, scene, {}, out)["surfaces"] == {"ball": BALL}
    with pytest.raises(InvalidInput):
        transfer(document, scene, {"ball": "/nowhere"}, out)
    with open_shot(out) as shot:
        assert prims_of(shot) == {"ball": BALL}
    assert read_contacts(out).patches.keys() == document.patches.keys()
    del shot
    assert open_files(scene.parent) == []


def test_hosts_on_one_file_do_not_see_each_others_edits(scene: Path) -> None:
    """The registry gives both the same source layer: what each writes stays in its own."""
    one, two = UsdHost(scene), UsdHost(scene)
    rig = one.read_rig(ARM).rig
    assert rig is not None
    one.write_pose(ARM, bent(rig, 1))
    one.add(Asset("extra", meshes.icosphere(1)))
    assert [item.id for item in two.objects()] == [ARM, BALL]
    np.testing.assert_allclose(two.read_pose(ARM).local, Pose.rest(rig).local, atol=1e-6)
    for name in ("one.usda", "two.usda"):
        one.save(scene.with_name(name))
    ours = UsdHost(scene.with_name("one.usda"))
    ours.write_pose(ARM, bent(rig, 2))  # not saved
    again = UsdHost(scene.with_name("one.usda"))
    np.testing.assert_allclose(again.read_pose(ARM).local, bent(rig, 1).local, atol=1e-5)


def test_a_dcc_may_edit_any_layer_of_its_stage_at_any_time(scene: Path) -> None:
    """Removing, renaming, rebinding in the DCC's own layers: the host answers for the stage as it is then."""
    stage = Usd.Stage.Open(str(scene))
    host = UsdHost.on(stage)
    assert [item.id for item in host.objects()] == [ARM, BALL]
    stage.RemovePrim("/arm_rig")
    assert [item.id for item in host.objects()] == [BALL]
    with pytest.raises(InvalidInput, match="no prim '/arm_rig/arm'"):
        host.read_rig(ARM)
    stage.GetRootLayer().Reload(force=True)
    use(host)
    UsdSkel.BindingAPI(stage.GetPrimAtPath("/arm_rig/arm_skin")).GetSkeletonRel().ClearTargets(True)
    assert [item.kind for item in host.objects()] == ["surface", "surface"]
    stage.GetRootLayer().Reload(force=True)
    other = Usd.Stage.CreateNew(str(scene.with_name("reference.usda")))
    UsdSkel.Root.Define(other, "/arm_rig").GetPrim().GetReferences().AddReference("scene.usda", "/arm_rig")
    hosted = UsdHost.on(other)
    use(hosted)
    other.GetPrimAtPath("/arm_rig").GetReferences().ClearReferences()
    assert hosted.objects() == ()


def test_what_the_dccs_session_says_holds_for_the_skin_too(scene: Path) -> None:
    """A variant chosen in the session layer, and a muted layer: the skin is that of the stage as it stands."""
    layer = Sdf.Layer.CreateNew(str(scene.with_name("shot.usda")))
    stage = Usd.Stage.Open(layer)
    root = UsdGeom.Xform.Define(stage, "/set").GetPrim()
    choices = root.GetVariantSets().AddVariantSet("cast")
    for name in ("nobody", "arm"):
        choices.AddVariant(name)
    choices.SetVariantSelection("arm")
    with choices.GetVariantEditContext():
        stage.DefinePrim("/set/arm_rig").GetReferences().AddReference("scene.usda", "/arm_rig")
    choices.SetVariantSelection("nobody")
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        stage.GetPrimAtPath("/set").GetVariantSets().SetSelection("cast", "arm")
    host = UsdHost.on(stage)
    (item,) = host.objects()
    rig = host.read_rig(item.id).rig
    assert rig is not None
    points = host.skin_points(item.id, Pose.rest(rig))
    np.testing.assert_allclose(points, rig.surface.points, atol=1e-5)
    over = Sdf.Layer.CreateAnonymous()
    layer.subLayerPaths = [over.identifier]
    with Usd.EditContext(stage, over):
        stage.OverridePrim("/set/arm_rig").SetActive(False)
    assert host.objects() == ()
    stage.MuteLayer(over.identifier)
    np.testing.assert_allclose(host.skin_points(item.id, Pose.rest(rig)), points)


def test_a_stage_without_a_session_layer_is_refused_in_words(scene: Path) -> None:
    stage = Usd.Stage.Open(rootLayer=Sdf.Layer.FindOrOpen(str(scene)), sessionLayer=None)
    assert stage.GetSessionLayer() is None
    with pytest.raises(InvalidInput, match="without a session layer"):
        UsdHost.on(stage)


def test_search_paths_start_where_the_source_is(tmp_path: Path) -> None:
    """As usdview resolves them: from the folder of the shot, for its sublayers in other folders too."""
    for folder in ("props", "deep", "elsewhere"):
        (tmp_path / folder).mkdir()
    mug = UsdHost()
    mug.add(Asset("mug", meshes.icosphere(1), meters_per_unit=1.0))
    mug.layer.customLayerData = {}
    mug.save(tmp_path / "props" / "mug.usda")
    (tmp_path / "deep" / "set.usda").write_text('#usda 1.0\ndef "thing" (references = @props/mug.usda@) {}\n')
    shot = tmp_path / "shot.usda"
    shot.write_text("#usda 1.0\n(subLayers = [@./deep/set.usda@])\n")
    assert Usd.Stage.Open(str(shot)).GetPrimAtPath("/thing").IsA(UsdGeom.Mesh)
    host = UsdHost(shot)
    assert [item.id for item in host.objects()] == ["/thing"] and host.space().notes == ()
    host.save(tmp_path / "elsewhere" / "ours.usda")
    assert [item.id for item in UsdHost(tmp_path / "elsewhere" / "ours.usda").objects()] == ["/thing"]
