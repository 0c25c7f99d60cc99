"""One solid, told in every way that USD has, is one surface; what is no face is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from contact_core.errors import InvalidInput
from contact_core.testing.host_checks import is_rigid, volume
from contact_core.testing.host_scenes import STEP_AREA, STEP_VOLUME, affine, step_prism
from contact_usd.host import UsdHost

POINTS, SIZES, INDICES = step_prism()
WORLD = affine((0.3, -0.2, 0.9), (1.0, 1.0, 1.0), (3.0, 1.0, -2.0))


def define(stage: Usd.Stage, path: str, world: np.ndarray, points: np.ndarray = POINTS) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(SIZES.tolist()))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray(INDICES.tolist()))
    UsdGeom.Xformable(mesh).MakeMatrixXform().Set(Gf.Matrix4d(world.T.tolist()))
    return mesh


def centimetres(stage: Usd.Stage) -> str:
    """The unit of the stage changes what a number means, not the number."""
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    return str(define(stage, "/solid", WORLD).GetPath())


def left_handed(stage: Usd.Stage) -> str:
    mesh = define(stage, "/solid", WORLD)
    mesh.CreateOrientationAttr("leftHanded")
    parts = np.split(INDICES, np.cumsum(SIZES)[:-1])
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray(np.concatenate([part[::-1] for part in parts]).tolist()))
    return str(mesh.GetPath())


def mirrored(stage: Usd.Stage) -> str:
    """The points mirrored one way, and the transform the other way: the same solid in the world."""
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    mesh = define(stage, "/solid", WORLD @ mirror, POINTS * [1, -1, 1])
    parts = np.split(INDICES, np.cumsum(SIZES)[:-1])
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray(np.concatenate([part[::-1] for part in parts]).tolist()))
    mesh.CreateOrientationAttr("rightHanded")
    return str(mesh.GetPath())


def inherited(stage: Usd.Stage) -> str:
    half = affine((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), (0.0, 5.0, 0.0))
    group = UsdGeom.Xform.Define(stage, "/group")
    group.MakeMatrixXform().Set(Gf.Matrix4d(half.T.tolist()))
    return str(define(stage, "/group/solid", np.linalg.inv(half) @ WORLD).GetPath())


def reset_stack(stage: Usd.Stage) -> str:
    group = UsdGeom.Xform.Define(stage, "/group")
    group.AddTranslateOp().Set((100.0, 0.0, 0.0))
    mesh = define(stage, "/group/solid", WORLD)
    mesh.SetResetXformStack(True)
    return str(mesh.GetPath())


def instanced(stage: Usd.Stage) -> str:
    define(stage, "/asset/solid", np.eye(4))
    stage.GetPrimAtPath("/asset").SetSpecifier(Sdf.SpecifierClass)
    instance = UsdGeom.Xform.Define(stage, "/placed")
    instance.MakeMatrixXform().Set(Gf.Matrix4d(WORLD.T.tolist()))
    instance.GetPrim().GetReferences().AddInternalReference("/asset")
    instance.GetPrim().SetInstanceable(True)
    return "/placed/solid"


def variant(stage: Usd.Stage) -> str:
    """Variants as they stand: the chosen one holds the solid."""
    prim = UsdGeom.Xform.Define(stage, "/model").GetPrim()
    choices = prim.GetVariantSets().AddVariantSet("shape")
    for name in ("cube", "step"):
        choices.AddVariant(name)
        choices.SetVariantSelection(name)
        with choices.GetVariantEditContext():
            if name == "step":
                define(stage, "/model/solid", WORLD)
            else:
                UsdGeom.Cube.Define(stage, "/model/solid")
    return "/model/solid"


@pytest.mark.parametrize(
    "told",
    [centimetres, left_handed, mirrored, inherited, reset_stack, instanced, variant],
    ids=lambda f: f.__name__,
)
def test_the_same_solid_in_the_world_whichever_way_it_is_told(told, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    stage = Usd.Stage.CreateNew(str(tmp_path / "told.usda"))
    path = told(stage)
    stage.GetRootLayer().Save()
    host = UsdHost(tmp_path / "told.usda")
    assert [item.id for item in host.objects()] == [path]
    asset, placement = host.read_surface(path), host.placement(path)
    world = asset.mesh.points @ placement[:3, :3].T + placement[:3, 3]
    np.testing.assert_allclose(world, POINTS @ WORLD[:3, :3].T + WORLD[:3, 3], atol=1e-6)
    assert is_rigid(placement)
    assert volume(asset.mesh) == pytest.approx(STEP_VOLUME)  # outward
    assert asset.mesh.face_areas.sum() == pytest.approx(STEP_AREA)


def test_holes_and_faces_that_are_none_are_left_out_and_the_map_goes_back(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "holes.usda"))
    mesh = define(stage, "/solid", np.eye(4))
    mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray([2, *SIZES.tolist(), 3]))
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray([0, 1, *INDICES.tolist(), 4, 4, 5]))
    mesh.CreateHoleIndicesAttr([2])  # the upper hexagon
    stage.GetRootLayer().Save()
    asset = UsdHost(tmp_path / "holes.usda").read_surface("/solid")
    assert sorted(set(asset.source_faces)) == [1, 3, 4, 5, 6, 7, 8]
    assert asset.mesh.face_areas.sum() == pytest.approx(STEP_AREA - 3.0)
    assert any("holes" in note for note in asset.notes) and any("dropped" in note for note in asset.notes)
    assert any("catmullClark" in note for note in asset.notes)  # the cage is not what is drawn


def test_a_subset_of_faces_or_points_becomes_a_patch(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "subsets.usda"))
    mesh = define(stage, "/solid", np.eye(4))
    UsdGeom.Subset.CreateGeomSubset(mesh, "lid", UsdGeom.Tokens.face, Vt.IntArray([1]))
    UsdGeom.Subset.CreateGeomSubset(mesh, "corner", UsdGeom.Tokens.point, Vt.IntArray([11]))
    stage.GetRootLayer().Save()
    host = UsdHost(tmp_path / "subsets.usda")
    assert host.selections("/solid") == ("lid", "corner")
    surface = host.read_surface("/solid").mesh
    lid = host.selected_points("/solid", "lid").positions(surface)
    np.testing.assert_allclose(sorted(lid.tolist()), sorted(POINTS[6:].tolist()))
    np.testing.assert_allclose(host.selected_points("/solid", "corner").positions(surface), POINTS[11:])


def test_seams_are_welded_and_told(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "seams.usda"))
    mesh = define(stage, "/solid", np.eye(4), POINTS[INDICES])  # every face has points of its own
    mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray(list(range(len(INDICES)))))
    stage.GetRootLayer().Save()
    asset = UsdHost(tmp_path / "seams.usda").read_surface("/solid")
    assert len(asset.mesh.points) == len(POINTS) and volume(asset.mesh) == pytest.approx(STEP_VOLUME)
    np.testing.assert_allclose(asset.mesh.points[asset.source_vertices], POINTS[INDICES])
    assert any("welded" in note for note in asset.notes)


def test_prototypes_of_point_instancers_are_no_objects(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "scatter.usda"))
    define(stage, "/real", np.eye(4))
    instancer = UsdGeom.PointInstancer.Define(stage, "/scatter")
    define(stage, "/scatter/stone", np.eye(4))
    instancer.CreatePrototypesRel().SetTargets(["/scatter/stone"])
    stage.GetRootLayer().Save()
    assert [item.id for item in UsdHost(tmp_path / "scatter.usda").objects()] == ["/real"]


def test_units_hold_in_a_root_layer_only_and_are_carried_over(tmp_path: Path) -> None:
    """A shot that says no units over an asset in metres: USD alone would read centimetres."""
    asset = Usd.Stage.CreateNew(str(tmp_path / "asset.usda"))
    UsdGeom.SetStageMetersPerUnit(asset, 1.0)
    UsdGeom.SetStageUpAxis(asset, "Z")
    define(asset, "/solid", np.eye(4))
    asset.GetRootLayer().Save()
    shot = Sdf.Layer.CreateNew(str(tmp_path / "shot.usda"))
    shot.subLayerPaths = ["asset.usda"]
    shot.Save()
    assert UsdGeom.GetStageMetersPerUnit(Usd.Stage.Open(shot)) == 0.01  # the trap
    del asset, shot  # from here on nobody but the host holds the layers
    host = UsdHost(tmp_path / "shot.usda")
    assert (host.space().meters_per_unit, host.space().up_axis) == (1.0, "Z")
    assert any("metersPerUnit" in note for note in host.space().notes)
    host.save(tmp_path / "ours.usda")
    again = UsdHost(tmp_path / "ours.usda")
    assert (again.space().meters_per_unit, again.space().up_axis) == (1.0, "Z")
    copied = Usd.Stage.Open(str(tmp_path / "ours.usda"))
    assert UsdGeom.GetStageMetersPerUnit(copied) == 1.0


def test_what_is_no_mesh_is_refused_in_words(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "odd.usda"))
    UsdGeom.Camera.Define(stage, "/cube")
    mesh = define(stage, "/broken", np.eye(4))
    mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray([3, 3]))
    flat = define(stage, "/flat", np.diag([1.0, 1.0, 0.0, 1.0]))
    assert flat
    stage.GetRootLayer().Save()
    host = UsdHost(tmp_path / "odd.usda")
    for path, word in (("/cube", "Camera"), ("/broken", "add up"), ("/flat", "flat"), ("no path", "no path")):
        with pytest.raises(InvalidInput, match=word):
            host.read_surface(path)
