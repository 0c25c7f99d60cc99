"""UsdSkel rigs: our skin is UsdSkel's, our keys join the scene's, and the scene's files stay as they are."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from contact_core.errors import InvalidInput
from contact_core.rig.rig import Pose, Rig, forward_kinematics, skin
from contact_core.scene.host import SceneSpace
from contact_core.testing.host_checks import pose_error
from contact_core.testing.host_scenes import SceneRig, arm_rig, bent, contract_scene
from contact_usd.host import UsdHost

ARM = "/World/arm_root/arm"


def scenes() -> ModuleType:
    """usd_scenes.py beside this file; test folders are no packages."""
    if "usd_scenes" not in sys.modules:
        spec = importlib.util.spec_from_file_location("usd_scenes", Path(__file__).with_name("usd_scenes.py"))
        assert spec is not None and spec.loader is not None
        sys.modules["usd_scenes"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["usd_scenes"])
    return sys.modules["usd_scenes"]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """The contract's scene as a file."""
    return Path(scenes().write_scene(contract_scene(SceneSpace(1.0, "Y")), tmp_path / "source.usda"))


def edit(path: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(path))


def skin_difference(host: UsdHost, rig_id: str, pose: Pose) -> float:
    """Largest distance between our skin and UsdSkel's, by the size of the rig."""
    rig = host.read_rig(rig_id).rig
    assert rig is not None
    ours = skin(rig, forward_kinematics(rig.parents, pose.local))
    return float(np.abs(ours - host.skin_points(rig_id, pose)).max() / rig.surface.bounding_box_diagonal)


@pytest.mark.assets
def test_real_rig_skins_as_usd_does_at_rest_and_in_its_own_animation(assets: Path) -> None:
    path = assets / "rigs" / "rigged_figure.usdz"
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    host = UsdHost(path)
    (item,) = [item for item in host.objects() if item.kind == "rig"]
    rig = host.read_rig(item.id).rig
    frames = host.pose_keys(item.id)
    assert frames
    poses = [Pose.rest(rig), *(host.read_pose(item.id, frame) for frame in frames)]
    assert max(skin_difference(host, item.id, pose) for pose in [*poses, bent(rig, 1)]) < 1e-5
    assert hashlib.sha256(path.read_bytes()).hexdigest() == before


def test_bind_pose_geom_bind_and_constant_influences(tmp_path: Path) -> None:
    """A skin bound away from rest, its points moved by geomBindTransform, and a rigid part with one influence."""
    made = arm_rig()
    bind = forward_kinematics(made.parents, bent(made, 3).local)
    path = tmp_path / "bound.usda"
    stage = Usd.Stage.CreateNew(str(path))
    scenes().write_rig(stage, Sdf.Path("/figure"), SceneRig("arm", replace(made, bind_world=bind)))
    mesh = stage.GetPrimAtPath("/figure/arm_skin")
    shift = Gf.Matrix4d(1.0).SetScale(Gf.Vec3d(2.0, 2.0, -2.0)) * Gf.Matrix4d(1.0).SetTranslate((0.5, 0.0, 0.25))
    UsdSkel.BindingAPI(mesh).CreateGeomBindTransformAttr(shift)
    rigid = UsdGeom.Mesh.Define(stage, "/figure/nail")
    rigid.CreatePointsAttr(Vt.Vec3fArray([(0, 2, 0), (1, 2, 0), (0, 3, 0)]))
    rigid.CreateFaceVertexCountsAttr([3])
    rigid.CreateFaceVertexIndicesAttr([0, 1, 2])
    binding = UsdSkel.BindingAPI.Apply(rigid.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/figure/arm"])
    binding.CreateJointIndicesPrimvar(True, 1).Set([2])
    binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    stage.GetRootLayer().Save()
    host = UsdHost(path)
    asset = host.read_rig("/figure/arm")
    assert [part["prim"] for part in asset.details["parts"]] == ["/figure/arm_skin", "/figure/nail"]
    assert max(skin_difference(host, "/figure/arm", bent(made, seed)) for seed in range(3)) < 1e-5


def test_loose_weights_are_normalised_and_told(source: Path) -> None:
    stage = edit(source)
    primvar = UsdSkel.BindingAPI(stage.GetPrimAtPath("/World/arm_root/arm_skin")).GetJointWeightsPrimvar()
    primvar.Set(Vt.FloatArray((np.asarray(primvar.Get()) * 1.7).tolist()))
    stage.GetRootLayer().Save()
    asset = UsdHost(source).read_rig(ARM)
    assert asset.rig is not None
    np.testing.assert_allclose(asset.rig.skin_weights.sum(axis=1), 1.0)
    assert any("1.7" in note and "normalised" in note for note in asset.notes)


def test_dual_quaternion_skinning_is_refused_by_name(source: Path) -> None:
    stage = edit(source)
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/World/arm_root/arm_skin"))
    binding.CreateSkinningMethodAttr(UsdSkel.Tokens.dualQuaternion)
    stage.GetRootLayer().Save()
    with pytest.raises(InvalidInput, match=r"arm_skin is skinned by dualQuaternion"):
        UsdHost(source).read_rig(ARM)


def test_uneven_scale_of_a_rig_is_refused_by_name(source: Path) -> None:
    stage = edit(source)
    UsdGeom.Xformable(stage.GetPrimAtPath("/World/arm_root")).MakeMatrixXform().Set(
        Gf.Matrix4d(1.0).SetScale(Gf.Vec3d(1.0, 2.0, 1.0))
    )
    stage.GetRootLayer().Save()
    with pytest.raises(InvalidInput, match=r"arm: .*scaled unevenly"):
        UsdHost(source).read_rig(ARM)


def test_a_mirrored_rig_poses_as_it_is_drawn(source: Path) -> None:
    stage = edit(source)
    UsdGeom.Xformable(stage.GetPrimAtPath("/World/arm_root")).MakeMatrixXform().Set(
        Gf.Matrix4d(1.0).SetScale(Gf.Vec3d(1.5, -1.5, 1.5))
    )
    stage.GetRootLayer().Save()
    host = UsdHost(source)
    rig = host.read_rig(ARM).rig
    assert rig is not None
    assert max(skin_difference(host, ARM, bent(rig, seed)) for seed in range(3)) < 1e-5
    host.write_pose(ARM, bent(rig, 1), 5.0)
    assert pose_error(host.read_pose(ARM, 5.0), bent(rig, 1)) < 1e-5


def animate(path: Path, rig: Rig, frames: dict[float, int]) -> None:
    """The scene's own animation: in its file, with samples at time codes of 1/1000 s."""
    stage = edit(path)
    stage.SetTimeCodesPerSecond(1000.0)
    stage.SetFramesPerSecond(24.0)
    animation = UsdSkel.Animation.Define(stage, "/World/arm_root/walk")
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath(ARM))
    animation.CreateJointsAttr(skeleton.GetJointsAttr().Get())
    for frame, seed in frames.items():
        matrices = Vt.Matrix4dArray([Gf.Matrix4d(m.T.tolist()) for m in bent(rig, seed).local])
        animation.SetTransforms(matrices, Usd.TimeCode(frame))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    stage.GetRootLayer().Save()


def test_our_keys_join_the_scenes_keys_and_its_files_stay(source: Path, tmp_path: Path) -> None:
    rig = arm_rig()
    animate(source, rig, {0.0: 1, 500.0: 2})
    before = hashlib.sha256(source.read_bytes()).hexdigest()
    host = UsdHost(source)
    assert host.space().frames_per_second == 1000.0 and any("time codes" in n for n in host.space().notes)
    assert host.pose_keys(ARM) == (0.0, 500.0)
    assert pose_error(host.read_pose(ARM), bent(rig, 1)) < 1e-5  # as it stands: the first sample
    host.write_pose(ARM, bent(rig, 3), 250.5)
    host.save(tmp_path / "ours.usdc")
    again = UsdHost(tmp_path / "ours.usdc")
    assert again.pose_keys(ARM) == (0.0, 250.5, 500.0)
    for frame, seed in ((0.0, 1), (250.5, 3), (500.0, 2)):
        assert pose_error(again.read_pose(ARM, frame), bent(rig, seed)) < 1e-5
    assert hashlib.sha256(source.read_bytes()).hexdigest() == before
    layer = Sdf.Layer.Find(str(source))
    assert layer is not None and not layer.dirty


@pytest.mark.parametrize("frame", [130.0, None], ids=["a key", "no key"])
def test_keys_join_those_of_our_own_layer_further_below(frame: float | None, source: Path, tmp_path: Path) -> None:
    """A posed shot under another shot, retimed: the animation has our name there already."""
    rig = arm_rig()
    below = UsdHost(source)
    for at, seed in ((10.0, 1), (20.0, 2)):
        below.write_pose(ARM, bent(rig, seed), at)
    below.save(tmp_path / "below.usda")
    shot = tmp_path / "shot.usda"
    shot.write_text("#usda 1.0\n(metersPerUnit = 1\nsubLayers = [@./below.usda@ (offset = 100; scale = 2)])\n")
    host = UsdHost(shot)
    assert host.pose_keys(ARM) == (120.0, 140.0)
    host.write_pose(ARM, bent(rig, 3), frame)
    host.save(tmp_path / "ours.usda")
    again = UsdHost(tmp_path / "ours.usda")
    wanted = {120.0: 1, 140.0: 2} | ({frame: 3} if frame is not None else {})
    assert again.pose_keys(ARM) == tuple(sorted(wanted))
    assert pose_error(again.read_pose(ARM), bent(rig, 3 if frame is None else 1)) < 1e-5
    for at, seed in wanted.items():
        assert pose_error(again.read_pose(ARM, at), bent(rig, seed)) < 1e-5


def test_a_rig_in_an_instance_is_read_and_posed_without_its_twin(tmp_path: Path) -> None:
    path = tmp_path / "crowd.usda"
    stage = Usd.Stage.CreateNew(str(path))
    scenes().write_rig(stage, Sdf.Path("/asset"), SceneRig("arm", arm_rig()))
    stage.GetPrimAtPath("/asset").SetSpecifier(Sdf.SpecifierClass)
    for name in ("a", "b"):
        prim = UsdSkel.Root.Define(stage, f"/{name}").GetPrim()
        prim.GetReferences().AddInternalReference("/asset")
        prim.SetInstanceable(True)
    stage.GetRootLayer().Save()
    host = UsdHost(path)
    assert [item.id for item in host.objects()] == ["/a/arm", "/b/arm"]
    assert skin_difference(host, "/b/arm", bent(arm_rig(), 2)) < 1e-5
    host.write_pose("/a/arm", bent(arm_rig(), 1))
    assert pose_error(host.read_pose("/a/arm"), bent(arm_rig(), 1)) < 1e-5
    assert pose_error(host.read_pose("/b/arm"), Pose.rest(arm_rig())) < 1e-5
    assert host.stage.GetPrimAtPath("/b").IsInstance()  # only what is posed stops being an instance
    assert host.undo() and host.stage.GetPrimAtPath("/a").IsInstance()


def test_names_and_freedoms_survive_an_export(tmp_path: Path) -> None:
    """Joint names that USD does not allow, limits, hinges: what our exporter writes it reads back."""
    from contact_core.document.asset import Asset
    from contact_core.rig.rig import JointFreedom

    made = arm_rig()
    freedoms = (
        JointFreedom("fixed"),
        JointFreedom("hinge", lower=np.array([-0.1]), upper=np.array([1.5])),
        JointFreedom("euler", order="ZXY", locked=np.array([True, False, False])),
        JointFreedom(translates=True),
    )
    rig = replace(made, joints=("Bip01 L", "Bip01.L", "Bip01_L", "Daumen ü"), freedoms=freedoms)
    host = UsdHost()
    key = host.add(Asset("Die Hand", rig.surface, rig, meters_per_unit=1.0))
    host.save(tmp_path / "out.usda")
    again = UsdHost(tmp_path / "out.usda").read_rig(key).rig
    assert again is not None and again.joints == rig.joints
    for ours, theirs in zip(again.freedoms, freedoms, strict=True):
        assert (ours.kind, ours.order, ours.translates) == (theirs.kind, theirs.order, theirs.translates)
        for field in ("frame", "lower", "upper", "prior_weight", "locked"):
            np.testing.assert_array_equal(getattr(ours, field), getattr(theirs, field))


def test_what_an_animation_cannot_hold_is_refused(source: Path) -> None:
    host = UsdHost(source)
    before = host.layer.ExportToString()
    sheared, tiny, flat = (bent(arm_rig(), 1).local.copy() for _ in range(3))
    flat[2, :3, 0] = 0.0
    sheared[1, 0, 1] += 0.5
    tiny[1, :3, :3] *= 1e-7
    for local in (sheared, tiny, flat):
        with pytest.raises(InvalidInput, match="cannot hold"):
            host.write_pose(ARM, Pose(arm_rig().joints, local))
    assert host.layer.ExportToString() == before and not host.undo()


def test_a_pose_shows_although_somebody_bound_another_animation(source: Path) -> None:
    host = UsdHost(source)
    rig = arm_rig()
    host.write_pose(ARM, bent(rig, 1))
    with Usd.EditContext(host.stage, host.layer):
        UsdSkel.Animation.Define(host.stage, "/World/arm_root/other")
        binding = UsdSkel.BindingAPI(host.stage.GetPrimAtPath(ARM))
        binding.GetAnimationSourceRel().SetTargets(["/World/arm_root/other"])
    host.write_pose(ARM, bent(rig, 2))
    assert pose_error(host.read_pose(ARM), bent(rig, 2)) < 1e-5
