"""Broken, foreign and malicious files: each is refused, or read with a note, in a sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Usd

from contact_core.cli import main
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.scene.host import SceneSpace
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.host_checks import store, stored, volume
from contact_usd.host import UsdHost

CORNERS = "point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]\n"
TRIANGLE = CORNERS + "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n"
FLAT = "((0,0,0,0), (0,0,0,0), (0,0,0,0), (0,0,0,1))"
NAN = "((nan,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))"
UNIT = "((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))"

MESHES = {  # what is wrong, and a word of the refusal
    "point that is no number": (TRIANGLE.replace("(1,0,0)", "(nan,0,0)"), "finite"),
    "point too many": (TRIANGLE.replace("1, 2]", "1, 99]"), "names the point 99"),
    "point before the first": (TRIANGLE.replace("1, 2]", "1, -2]"), "names the point -2"),
    "giant count": (TRIANGLE.replace("[3]", "[2147483647]"), "add up to 2147483647"),
    "counts that cancel": (TRIANGLE.replace("[3]", "[2147483647, -2147483644]"), "the least is -2147483644"),
    "cancelling counts and a hole": (TRIANGLE.replace("[3]", "[6, -3]") + "int[] holeIndices = [0]\n", "add up"),
    "no points": (TRIANGLE.replace(CORNERS, ""), "without points"),
    "one number for points": (TRIANGLE.replace(CORNERS, "double points = 3\n"), "where a point3f"),
    "words for points": (TRIANGLE.replace(CORNERS, 'string[] points = ["a"]\n'), "where a point3f"),
    "an operation that does not exist": (
        TRIANGLE + 'uniform token[] xformOpOrder = ["xformOp:bogus"]\n',
        "USD cannot compute: Invalid xform",
    ),
    "a matrix that is no number": (
        TRIANGLE + f'matrix4d xformOp:transform = {NAN}\nuniform token[] xformOpOrder = ["xformOp:transform"]\n',
        "finite",
    ),
}

JOINTS = f'uniform token[] joints = ["a", "a/b"]\nuniform matrix4d[] bindTransforms = [{UNIT}, {UNIT}]\n'
VERTEX = '(elementSize = 1\ninterpolation = "vertex")\n'
INDICES = f"int[] primvars:skel:jointIndices = [0, 1, 0] {VERTEX}"
WEIGHTS = f"float[] primvars:skel:jointWeights = [1, 1, 1] {VERTEX}"
SKIN = INDICES + WEIGHTS

SKELETONS = {  # what is wrong: of the skeleton, of the skin, and a word of the refusal
    "no joints": ("", SKIN, "without joints"),
    "an empty list of joints": ("uniform token[] joints = []\n", SKIN, "without joints"),
    "a child before its parent": (JOINTS.replace('"a", "a/b"', '"a/b", "a"'), SKIN, "topology"),
    "a joint twice": (JOINTS.replace('"a/b"', '"a"'), SKIN, "comes twice"),
    "no bind transforms": (JOINTS.split("\n")[0] + "\n", SKIN, "bindTransforms do not fit"),
    "too few bind transforms": (JOINTS.replace(f", {UNIT}]", "]"), SKIN, "bindTransforms do not fit"),
    "a flat bind transform": (JOINTS.replace(f", {UNIT}]", f", {FLAT}]"), SKIN, "joint a/b flattens"),
    "a bind transform that is no number": (JOINTS.replace(f"[{UNIT},", f"[{NAN},"), SKIN, "joint a flattens"),
    "a joint too many": (JOINTS, SKIN.replace("[0, 1, 0]", "[0, 7, 0]"), "7"),
    "a joint before the first": (JOINTS, SKIN.replace("[0, 1, 0]", "[0, -1, 0]"), "skin_joints must be in 0..1"),
    "weights that are no numbers": (
        JOINTS,
        SKIN.replace("[1, 1, 1]", "[1, nan, 1]"),
        "weights that are no numbers",
    ),
    "endless weights": (JOINTS, SKIN.replace("[1, 1, 1]", "[1, inf, 1]"), "weights that are no numbers"),
    "influences for other points": (JOINTS, SKIN.replace("[0, 1, 0]", "[0]"), "do not fit"),
    "giant element size": (JOINTS, SKIN.replace("elementSize = 1", "elementSize = 2000000000"), "do not fit"),
    "an own joint that the skeleton has not": (
        JOINTS,
        SKIN + 'uniform token[] skel:joints = ["a", "z"]\n',
        "names the joint 'z'",
    ),
    "more own joints than listed": (JOINTS, SKIN + 'uniform token[] skel:joints = ["a"]\n', "joint number 1"),
    "own joints before the first": (
        JOINTS,
        SKIN.replace("[0, 1, 0]", "[0, -1, 0]") + 'uniform token[] skel:joints = ["a", "a/b"]\n',
        "joint number -1",
    ),
    "no own joints at all": (JOINTS, SKIN + "uniform token[] skel:joints = []\n", "joint number 1"),
    "a place of the skin that is no number": (
        JOINTS,
        SKIN + f"matrix4d primvars:skel:geomBindTransform = {NAN}\n",
        "geomBindTransform",
    ),
    "freedoms nested without end": (
        JOINTS + 'string contact:jointFreedoms = "' + 50_000 * "[" + '"\n',
        SKIN,
        "jointFreedoms is damaged",
    ),
    "freedoms that are a number": (JOINTS + "int contact:jointFreedoms = 5\n", SKIN, "jointFreedoms is damaged"),
}


def written(path: Path, text: str) -> Path:
    path.write_text(f"#usda 1.0\n{text}", encoding="utf-8")
    return path


def skinned(skeleton: str, skin: str, animation: str = "") -> str:
    """A SkelRoot with a skeleton, one triangle that it drives, and perhaps an animation."""
    bound = "rel skel:animationSource = </figure/walk>\n" if animation else ""
    return f"""(metersPerUnit = 1)
def SkelRoot "figure" {{
def Skeleton "bones" (prepend apiSchemas = ["SkelBindingAPI"]) {{
{skeleton}{bound}}}
def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"]) {{
{TRIANGLE}rel skel:skeleton = </figure/bones>
{skin}}}
{animation}}}
"""


@pytest.mark.parametrize("what", MESHES)
def test_meshes_that_do_not_fit_together_are_refused_by_name(what: str, tmp_path: Path) -> None:
    body, words = MESHES[what]
    host = UsdHost(
        written(tmp_path / "bad.usda", f'def Mesh "bad" {{\n{body}}}\ndef Mesh "good" {{\n{TRIANGLE}}}\n')
    )
    with pytest.raises(InvalidInput, match=words) as refused:
        host.read_surface("/bad")
    assert str(refused.value).startswith("/bad") and "pxrInternal" not in str(refused.value)
    assert len(host.read_surface("/good").mesh.faces) == 1  # and the rest of the stage is there


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("what", SKELETONS)
def test_skeletons_that_do_not_fit_together_are_refused_by_name(what: str, tmp_path: Path) -> None:
    skeleton, skin, words = SKELETONS[what]
    host = UsdHost(written(tmp_path / "bad.usda", skinned(skeleton, skin)))
    with pytest.raises(InvalidInput, match=words) as refused:
        host.read_rig("/figure/bones")
    assert "/figure/" in str(refused.value)
    for call in (host.read_pose, host.pose_keys):  # these may have an answer; if not, in words
        try:
            call("/figure/bones")
        except InvalidInput as error:
            assert str(error)


def test_the_plain_skeleton_of_these_tests_is_a_rig(tmp_path: Path) -> None:
    host = UsdHost(written(tmp_path / "good.usda", skinned(JOINTS, SKIN)))
    rig = host.read_rig("/figure/bones").rig
    assert rig is not None and len(rig.joints) == 2
    host.skin_points("/figure/bones", Pose.rest(rig))


@pytest.mark.parametrize("damage", ["rotations = [(nan, 0, 0, 0), (1, 0, 0, 0)]", "rotations = []"])
def test_an_animation_without_numbers_is_no_pose(damage: str, tmp_path: Path) -> None:
    animation = f"""def SkelAnimation "walk" {{
uniform token[] joints = ["a", "a/b"]
float3[] translations = [(0,0,0), (0,0,0)]
half3[] scales = [(1,1,1), (1,1,1)]
quatf[] {damage}
}}
"""
    host = UsdHost(written(tmp_path / "walk.usda", skinned(JOINTS, SKIN, animation)))
    if "nan" in damage:
        with pytest.raises(InvalidInput, match="/figure/walk holds values that are no numbers"):
            host.read_pose("/figure/bones")
    else:
        assert np.isfinite(host.read_pose("/figure/bones").local).all()


@pytest.mark.parametrize("frame", [np.nan, np.inf, -np.inf])
def test_frames_that_are_no_numbers_are_refused(frame: float, tmp_path: Path) -> None:
    """USD takes NaN for its default time, and a key there would be no key at all."""
    host = UsdHost(written(tmp_path / "good.usda", skinned(JOINTS, SKIN)))
    pose, before = host.read_pose("/figure/bones"), host.layer.ExportToString()
    for call in (host.placement, host.read_pose, lambda key, frame: host.write_pose(key, pose, frame)):
        with pytest.raises(InvalidInput, match="a frame is a number"):
            call("/figure/bones", frame)
    with pytest.raises(InvalidInput, match="world_from_surface must be finite"):
        host.add(Asset("ball", meshes.icosphere(1)), np.full((4, 4), frame))
    assert host.layer.ExportToString() == before and not host.undo()


def test_selections_of_points_that_are_not_there_are_refused(tmp_path: Path) -> None:
    subset = 'def GeomSubset "part" {\nuniform token elementType = "point"\nint[] indices = [1, 77]\n}\n'
    host = UsdHost(written(tmp_path / "part.usda", f'def Mesh "solid" {{\n{TRIANGLE}{subset}}}\n'))
    with pytest.raises(InvalidInput, match="'part' names points that the mesh has not"):
        host.selected_points("/solid", "part")


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
@pytest.mark.parametrize("content", ["empty", "noise", "cut"])
def test_files_that_are_no_usd_are_refused_in_a_sentence(
    suffix: str, content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the host and by the command line, without the insides of USD or Python."""
    path = tmp_path / f"näh, 日本{suffix}"
    if content == "cut":
        whole = UsdHost()
        whole.add(Asset("ball", meshes.icosphere(2)))
        whole.save(tmp_path / ("whole.usda" if suffix == ".usda" else "whole.usdc"))
        data = next(tmp_path.glob("whole.*")).read_bytes()
        path.write_bytes(data[: len(data) // 2])
    else:
        path.write_bytes(b"" if content == "empty" else np.random.default_rng(1).bytes(3000))
    with pytest.raises(FileRefused) as refused:
        UsdHost(path)
    codes = [main(["usd", "inspect", str(path)]), main(["usd", "transfer", str(path), str(path)])]
    said = capsys.readouterr()
    for text in (str(refused.value), said.err):
        assert path.name in text and len(text.split()) > 6
        assert not any(word in text for word in ("NoneType", "attribute", "pxrInternal", "Traceback", "::"))
    assert codes == [2, 2]


STAMP = 'int64 contact:revision = 1\nstring contact:digest = "0"\nint contact:schema = 1\n'
DOCUMENTS = {
    "no revision": 'string contact:digest = "0"\nint contact:schema = 1\n',
    "no digest": "int64 contact:revision = 1\nint contact:schema = 1\n",
    "words for numbers": (
        'string contact:digest = "0"\nstring contact:revision = "x"\nstring contact:schema = "y"\n'
    ),
    "a number for a part": f"{STAMP}int contact:part:a = 3\n",
}


@pytest.mark.parametrize("what", DOCUMENTS)
def test_a_damaged_document_is_refused_and_left(what: str, tmp_path: Path) -> None:
    host = UsdHost(written(tmp_path / "bad.usda", f'def Scope "Contacts" {{\n{DOCUMENTS[what]}}}\n'))
    for _ in range(2):
        with pytest.raises(FileRefused, match="damaged") as refused:
            host.stored_document()
        assert "NoneType" not in str(refused.value)
    if "part" not in what:
        with pytest.raises(FileRefused, match=r"contact:(revision|digest) is no"):
            store(host, stored(1))
    with pytest.raises(FileRefused):
        Session(host=host, discover=False)
    assert host._undo._listeners == []  # the session that could not begin does not listen


METADATA = {
    "metersPerUnit = 0": ("metersPerUnit is 0", SceneSpace(0.01, "Y")),
    "metersPerUnit = -1": ("metersPerUnit is -1", SceneSpace(0.01, "Y")),
    "metersPerUnit = nan": ("metersPerUnit is nan", SceneSpace(0.01, "Y")),
    'upAxis = "Q"': ("upAxis is Q", SceneSpace(0.01, "Y")),
    "timeCodesPerSecond = 0": ("timeCodesPerSecond is 0", SceneSpace(0.01, "Y")),
    "timeCodesPerSecond = -5": ("timeCodesPerSecond is -5", SceneSpace(0.01, "Y")),
}


@pytest.mark.parametrize("metadata", METADATA)
def test_units_that_are_none_become_usds_fallback_and_are_told(metadata: str, tmp_path: Path) -> None:
    words, wanted = METADATA[metadata]
    path = written(tmp_path / "odd.usda", f'({metadata})\ndef Mesh "solid" {{\n{TRIANGLE}}}\n')
    space = UsdHost(path).space()
    assert (space.meters_per_unit, space.up_axis) == (wanted.meters_per_unit, wanted.up_axis)
    assert space.frames_per_second == 24.0
    assert any(words in note for note in space.notes), space.notes
    assert main(["usd", "export", str(path), "--out", str(tmp_path / "out.usda")]) == 0


def test_an_asset_with_x_up_is_turned_on_export(tmp_path: Path) -> None:
    ball = meshes.icosphere(1)
    host = UsdHost(space=SceneSpace(1.0, "X"))
    assert host.space().up_axis == "Y"
    key = host.add(Asset("ball", ball.with_points(ball.points * [3.0, 1.0, 1.0]), up_axis="X"))
    surface, place = host.read_surface(key).mesh, host.placement(key)
    size = np.ptp(surface.points @ place[:3, :3].T, axis=0)
    assert size.argmax() == 1 and volume(surface) > 0.0


def test_what_the_files_lack_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Missing and cyclic sublayers and references, and a way out to files that are no layers: notes, no stop."""
    if not hasattr(Usd.Stage, "GetCompositionErrors"):
        pytest.skip("this pxr only prints what it did not find")
    written(tmp_path / "other.usda", "(subLayers = [@./shot.usda@])\n")
    shot = written(
        tmp_path / "shot.usda",
        "(subLayers = [@./other.usda@, @./nowhere.usda@, @../../../../../../../../etc/passwd@])\n"
        'def Xform "lost" (references = @./nothing.usda@</x>) {}\n'
        f'def Mesh "here" {{\n{TRIANGLE}}}\n',
    )
    notes = " ".join(UsdHost(shot).space().notes)
    assert all(word in notes for word in ("nowhere.usda", "nothing.usda", "cycles")), notes
    assert main(["usd", "--json", "inspect", str(shot)]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert [item["id"] for item in facts["objects"]] == ["/here"] and "nowhere.usda" in " ".join(facts["notes"])


def test_names_alike_and_names_of_any_alphabet(tmp_path: Path) -> None:
    """Prims of one name under different parents, and a name that is no ASCII, are objects of their own."""
    mesh = f'def Mesh "größe_日本" {{\n{TRIANGLE}}}\n'
    path = written(tmp_path / "日本.usda", "".join(f'def Xform "{group}" {{\n{mesh}}}\n' for group in "ab"))
    host = UsdHost(path)
    assert [item.id for item in host.objects()] == ["/a/größe_日本", "/b/größe_日本"]
    host.save(tmp_path / "ü.usda")
    again = UsdHost(tmp_path / "ü.usda")
    assert again.read_surface("/b/größe_日本").mesh.digest == host.read_surface("/b/größe_日本").mesh.digest


def test_every_command_survives_every_broken_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """inspect, transfer from and to, solve and export: an exit code and words, whatever the file."""
    good = tmp_path / "good.usda"
    made = UsdHost()
    key = made.add(Asset("ball", meshes.icosphere(1), meters_per_unit=1.0))
    with Session(host=made, discover=False) as session:
        mesh = made.read_surface(key).mesh
        session.surfaces.add("ball", mesh)
        points = SurfacePoints.at_vertices(mesh, [0, 1, 2])
        session.patches.paint("tip", points, surface="ball", axis=points[[0, 1]])
    made.save(good)
    texts: dict[str, str] = {what: f'def Mesh "m" {{\n{body}}}\n' for what, (body, _) in MESHES.items()}
    texts |= {what: skinned(skeleton, skin) for what, (skeleton, skin, _) in SKELETONS.items()}
    texts |= {what: f'def Scope "Contacts" {{\n{body}}}\n' for what, body in DOCUMENTS.items()}
    for number, text in enumerate(texts.values()):
        path = str(written(tmp_path / f"bad{number}.usda", text))
        out = str(tmp_path / "out")
        calls: list[list[Any]] = [
            ["inspect", path],
            ["transfer", path, good, "--out", out],
            ["transfer", good, path, "--out", out],
            ["solve", path, "--out", out],
            ["export", path, "--out", f"{out}/new.usda"],
        ]
        for call in calls:
            assert main(["usd", *map(str, call)]) in (0, 1, 2), (call, text)
    assert "Traceback" not in "".join(capsys.readouterr())
    assert not list(tmp_path.glob("out/.*"))  # no half-written file stays
