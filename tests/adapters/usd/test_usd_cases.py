"""What a stage draws is what a file is read as; the rest is named. Primitives are solids."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

import contact_core
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.geometry.solids import box
from contact_core.testing.format_contract import bar
from contact_core.testing.host_checks import volume
from contact_usd.files import UsdFiles
from contact_usd.host import UsdHost

CASES = Path(__file__).parents[2] / "data" / "cases"


def read(path: Path) -> Asset:
    return UsdFiles().read(path)


def test_what_is_drawn_is_the_surface_and_the_rest_is_named() -> None:
    asset = read(CASES / "d20_purposes.usda")
    assert len(asset.mesh.points) == 110 and asset.mesh.points[:, 0].max() < 1  # render stands at the origin
    assert all(any(path in note for note in asset.notes) for path in ("/W/proxy", "/W/guide", "/W/hidden"))


def test_a_stage_of_proxies_alone_is_read(tmp_path: Path) -> None:
    text = (CASES / "d20_purposes.usda").read_text().replace('purpose = "render"', 'purpose = "guide"')
    (tmp_path / "s.usda").write_text(text)
    assert read(tmp_path / "s.usda").mesh.points[:, 0].min() > 4
    (tmp_path / "s.usda").write_text(text.replace('purpose = "proxy"', 'purpose = "guide"'))
    with pytest.raises(FileRefused, match="draws nothing"):
        read(tmp_path / "s.usda")


def test_a_skin_without_a_skel_root_and_point_instances_are_named() -> None:
    assert any("no SkelRoot" in note for note in read(CASES / "d01_no_skelroot.usda").notes)
    with pytest.raises(FileRefused, match="/W/pi scatters 2 copies"):
        read(CASES / "d22_pointinstancer.usda")


@pytest.mark.parametrize("kind", ["BasisCurves", "NurbsCurves", "Points", "NurbsPatch"])
def test_what_is_drawn_and_is_no_mesh_is_named(tmp_path: Path, kind: str) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    for name in ("hair", "guide", "off"):
        stage.DefinePrim(f"/{name}", kind)
    UsdGeom.Imageable(stage.GetPrimAtPath("/guide")).CreatePurposeAttr("guide")
    UsdGeom.Imageable(stage.GetPrimAtPath("/off")).MakeInvisible()
    UsdGeom.Cube.Define(stage, "/block")
    stage.Save()
    told = [note for note in read(tmp_path / "s.usda").notes if kind in note]
    assert len(told) == 1 and "/hair" in told[0] and "/guide" not in told[0] and "/off" not in told[0]


def rig_of_parts(path: Path, **purposes: str) -> Path:
    """Cubes one beside the other, all on one joint; a word for each: its purpose, or "invisible"."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdSkel.Root.Define(stage, "/R")
    skeleton = UsdSkel.Skeleton.Define(stage, "/R/S")
    skeleton.CreateJointsAttr(["w"])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1)])
    points, faces = box(1.0, 1.0, 1.0)
    for place, (name, word) in enumerate(purposes.items()):
        mesh = UsdGeom.Mesh.Define(stage, f"/R/{name}")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy((points + 3.0 * place * np.eye(3)[0]).astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr([3] * len(faces))
        mesh.CreateSubdivisionSchemeAttr("none")
        mesh.CreateFaceVertexIndicesAttr(faces.ravel().tolist())
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateJointIndicesPrimvar(False, 1).Set([0] * len(points))
        binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * len(points))
        binding.CreateSkeletonRel().SetTargets(["/R/S"])
        if word == "invisible":
            mesh.MakeInvisible()
        else:
            mesh.CreatePurposeAttr(word)
    stage.Save()
    return path


@pytest.mark.parametrize("word", ["guide", "proxy"])
def test_guides_and_proxies_of_a_rig_are_named_and_no_skin(tmp_path: Path, word: str) -> None:
    asset = read(rig_of_parts(tmp_path / "s.usda", skin="render", other=word))
    assert np.isclose(volume(asset.mesh), 1.0) and np.ptp(asset.mesh.points[:, 0]) == 1.0
    assert sum("/R/other" in note for note in asset.notes) == 1
    host = UsdHost(tmp_path / "s.usda")
    assert [(item.id, item.kind) for item in host.objects()] == [("/R/S", "rig")]
    assert host.selections("/R/S") == ()


@pytest.mark.parametrize("name", ["UCX_body", "body_LOD1", "body_collider"])
def test_hulls_and_coarser_copies_are_named_and_no_surface(tmp_path: Path, name: str) -> None:
    asset = read(rig_of_parts(tmp_path / "rig.usda", body="default", **{name: "default"}))
    assert np.isclose(volume(asset.mesh), 1.0) and sum(name in note for note in asset.notes) == 1
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    for there in ("body", name):
        UsdGeom.Cube.Define(stage, f"/{there}")
    stage.Save()
    asset = read(tmp_path / "s.usda")
    assert np.isclose(volume(asset.mesh), 8.0) and sum(name in note for note in asset.notes) == 1


def cubes(path: Path, **changes: tuple[str, str]) -> Path:
    """Cubes by name, each with a change of its text."""
    points, faces = box(1.0, 1.0, 1.0)
    lines = ["#usda 1.0"]
    for name, (old, new) in changes.items():
        text = f"""def Mesh "{name}" {{
            uniform token subdivisionScheme = "none"
            point3f[] points = {[tuple(p) for p in points.tolist()]}
            int[] faceVertexCounts = {[3] * len(faces)}
            int[] faceVertexIndices = {faces.ravel().tolist()}
        }}"""
        lines.append(text.replace(old, new))
    path.write_text("\n".join(lines))
    return path


FLAT = 'def Mesh "odd" {\ndouble3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("int[] faceVertexCounts = [3, ", "int[] faceVertexCounts = [4, "),
        ("int[] faceVertexIndices = [", "int[] faceVertexIndices = [99, "),
        ('def Mesh "odd" {\n', FLAT),
        ('def Mesh "odd" {\n', FLAT.replace("1, 0, 1", "nan, 1, 1")),
    ],
)
def test_one_odd_mesh_is_named_and_spoils_no_stage(tmp_path: Path, old: str, new: str) -> None:
    for first, second in (("odd", "sound"), ("sound", "odd")):
        path = cubes(tmp_path / f"{first}.usda", **{first: ("", ""), second: ("", "")} | {"odd": (old, new)})
        asset = read(path)
        assert np.isclose(volume(asset.mesh), 1.0) and sum("/odd" in note for note in asset.notes) == 1
    with pytest.raises(FileRefused, match="/odd"):
        read(cubes(tmp_path / "alone.usda", odd=(old, new)))


def test_points_at_no_place_cost_their_faces_alone(tmp_path: Path) -> None:
    unused = cubes(tmp_path / "unused.usda", a=("points = [", "points = [(nan, 0, 0), "))
    text = unused.read_text()
    start = text.index("faceVertexIndices = [") + len("faceVertexIndices = [")
    end = text.index("]", start)
    shifted = ", ".join(str(int(word) + 1) for word in text[start:end].split(","))
    unused.write_text(text[:start] + shifted + text[end:])
    assert np.isclose(volume(read(unused).mesh), 1.0) and not read(unused).notes
    used = cubes(tmp_path / "used.usda", a=("points = [(", "points = [(nan, 0, 0), ("))
    assert any("not finite" in note for note in read(used).notes)
    assert np.isfinite(UsdHost(used).read_surface("/a").mesh.points).all()


def test_a_rig_of_guides_alone_is_read(tmp_path: Path) -> None:
    asset = read(rig_of_parts(tmp_path / "s.usda", skin="guide", other="guide"))
    assert np.isclose(volume(asset.mesh), 2.0) and not asset.notes


def test_what_is_hidden_stays_part_of_a_rig_and_is_named(tmp_path: Path) -> None:
    asset = read(rig_of_parts(tmp_path / "s.usda", skin="default", shirt="invisible"))
    assert np.isclose(volume(asset.mesh), 2.0)
    assert sum("/R/shirt" in note for note in asset.notes) == 1
    assert not read(rig_of_parts(tmp_path / "all.usda", skin="invisible")).notes  # hidden as a whole


@pytest.mark.parametrize("kind", ["references", "payload"])
def test_what_is_missing_is_told_with_a_rig_and_where_nothing_is_left(tmp_path: Path, kind: str) -> None:
    gap = f'def Xform "gap" (prepend {kind} = @./gone.usda@) {{}}\n'
    (tmp_path / "s.usda").write_text(f"#usda 1.0\n{gap}")
    with pytest.raises(FileRefused, match=r"no meshes .*gone\.usda"):
        read(tmp_path / "s.usda")
    path = rig_of_parts(tmp_path / "rig.usda", skin="render")
    path.write_text(path.read_text() + gap)
    assert any("gone.usda" in note for note in read(path).notes)


def test_a_variant_that_nobody_chose_is_told(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    model = UsdGeom.Xform.Define(stage, "/r").GetPrim().GetVariantSets().AddVariantSet("model")
    for name, kind in (("lo", "Sphere"), ("hi", "Cube")):
        model.AddVariant(name)
        model.SetVariantSelection(name)
        with model.GetVariantEditContext():
            stage.DefinePrim("/r/solid", kind)
    stage.Save()
    assert np.isclose(volume(read(tmp_path / "s.usda").mesh), 8.0)
    model.ClearVariantSelection()
    stage.Save()
    with pytest.raises(FileRefused, match=r"/r has no choice in its variant set model \((hi, lo|lo, hi)\)"):
        read(tmp_path / "s.usda")


def test_the_fallback_sizes_of_primitives() -> None:
    asset = read(CASES / "d24_gprims.usda")  # a sphere of radius 1 and a cylinder of radius 1 and height 2
    assert np.isclose(volume(asset.mesh), 4 / 3 * np.pi + 2 * np.pi, rtol=0.01)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(
    ("kind", "sizes", "wanted", "reach"),
    [
        ("Cylinder", {"radius": 0.5, "height": 3.0}, np.pi * 0.75, (0.5, 1.5)),
        ("Cone", {"radius": 0.5, "height": 3.0}, np.pi * 0.25, (0.5, 1.5)),
        ("Capsule", {"radius": 0.5, "height": 3.0}, np.pi * 0.75 + np.pi / 6, (0.5, 2.0)),
        ("Cube", {"size": 3.0}, 27.0, (1.5, 1.5)),
        ("Sphere", {"radius": 0.5}, np.pi / 6, (0.5, 0.5)),
    ],
)
def test_primitives_have_their_size_and_axis(
    tmp_path: Path, kind: str, sizes: dict[str, float], wanted: float, reach: tuple[float, float], axis: str
) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "s.usda"))
    prim = stage.DefinePrim("/solid", kind)
    for name, value in sizes.items():
        prim.GetAttribute(name).Set(value)
    if prim.HasAttribute("axis"):
        prim.GetAttribute("axis").Set(axis)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.Save()
    mesh = read(tmp_path / "s.usda").mesh
    extent = np.full(3, reach[0])
    extent["XYZ".index(axis)] = reach[1]
    assert np.allclose(np.abs(mesh.points).max(0), extent, atol=1e-6)
    assert 0.985 * wanted < volume(mesh) < wanted * (1 + 1e-6)


def changed_rig(path: Path, change: Callable[[UsdSkel.Skeleton, UsdSkel.BindingAPI], None]) -> Path:
    """The bar of the contract, written here and then changed by pxr."""
    UsdFiles().write(path, [bar()], {})
    stage = Usd.Stage.Open(str(path))
    (skeleton,) = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)]
    (mesh,) = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    change(UsdSkel.Skeleton(skeleton), UsdSkel.BindingAPI(mesh))
    stage.Save()
    return path


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_rest_transform_that_is_none_is_replaced_and_named(tmp_path: Path, value: float) -> None:
    def change(skeleton: UsdSkel.Skeleton, binding: UsdSkel.BindingAPI) -> None:
        rest = list(skeleton.GetRestTransformsAttr().Get())
        rest[1] = Gf.Matrix4d(1).SetScale(value) * rest[1]
        skeleton.GetRestTransformsAttr().Set(rest)

    asset, whole = read(changed_rig(tmp_path / "m.usda", change)), bar()
    assert asset.rig is not None and whole.rig is not None
    assert np.allclose(asset.rig.rest_local, whole.rig.rest_local, atol=1e-6)
    assert sum(asset.rig.joints[1] in note for note in asset.notes) == 1


@pytest.mark.parametrize("kind", ["weights", "joints"])
def test_few_odd_influences_count_for_nothing_and_many_are_damage(tmp_path: Path, kind: str) -> None:
    def change(count: int) -> Callable[[UsdSkel.Skeleton, UsdSkel.BindingAPI], None]:
        def spoil(skeleton: UsdSkel.Skeleton, binding: UsdSkel.BindingAPI) -> None:
            primvar = binding.GetJointWeightsPrimvar() if kind == "weights" else binding.GetJointIndicesPrimvar()
            values = np.array(primvar.Get())
            values[:: primvar.GetElementSize()][:count] = np.nan if kind == "weights" else 99
            primvar.Set(Vt.FloatArray.FromNumpy(values) if kind == "weights" else Vt.IntArray.FromNumpy(values))

        return spoil

    asset = read(changed_rig(tmp_path / "few.usda", change(1)))
    assert asset.rig is not None and any("1 points had weights" in note for note in asset.notes)
    with pytest.raises(FileRefused, match=r"no numbers|skin_joints"):
        read(changed_rig(tmp_path / "many.usda", change(30)))


def test_a_session_on_a_stage_tells_what_was_lost(tmp_path: Path) -> None:
    """As a file the stage tells it; opened as a scene it told nothing."""
    path = cubes(tmp_path / "s.usda", sound=("", ""), odd=("points = [(", "points = [(nan, 0, 0), ("))
    gap = 'def "gap" (prepend references = @./gone.usda@) {}\n'
    copies = 'def PointInstancer "grass" { int[] protoIndices = [0, 0]\n}\n'
    path.write_text(path.read_text() + "\n" + gap + copies)
    with contact_core.open(path) as session:
        told = " ".join(session.notes)
    for words in ("gone.usda", "/grass scatters 2 copies", "odd: ", "not finite"):
        assert words in told
    with contact_core.open(cubes(tmp_path / "t.usda", sound=("", ""))) as session:
        assert session.notes == ()
