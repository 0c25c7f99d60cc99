"""`contact usd` over a small sequence: one character and one ball, two shots in which the ball moves."""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom

from contact_core.cli import main
from contact_core.document.asset import Asset
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.rig.rig import Pose
from contact_core.session import Session
from contact_core.testing.host_checks import pose_error
from contact_core.testing.host_scenes import arm_rig
from contact_usd import contacts
from contact_usd.host import UsdHost
from contact_usd.shots import open_shot

ARM, BALL = "/arm_rig/arm", "/ball"


def parity() -> ModuleType:
    """parity_script.py, for its ball; test folders are no packages."""
    if "parity_script" not in sys.modules:
        path = Path(__file__).parents[1] / "parity_script.py"
        spec = importlib.util.spec_from_file_location("parity_script", path)
        assert spec is not None and spec.loader is not None
        sys.modules["parity_script"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["parity_script"])
    return sys.modules["parity_script"]


@pytest.fixture
def sequence(tmp_path: Path) -> Path:
    """asset.usda, two shots over it with a moving ball, and contacts.usda with painted contacts."""
    rig = arm_rig()
    made = UsdHost()
    place = np.eye(4)
    place[:3, 3] = (1.2, 3.0, 0.0)
    made.add(Asset("arm", rig.surface, rig, meters_per_unit=1.0))
    made.add(Asset("ball", parity()._ball(0.5), meters_per_unit=1.0), place)
    made.layer.customLayerData = {}  # assets like any other
    made.save(tmp_path / "asset.usda")
    for name, far in (("shot010", 0.2), ("shot020", -0.4)):
        layer = Sdf.Layer.CreateNew(str(tmp_path / f"{name}.usda"))
        layer.subLayerPaths = ["asset.usda"]
        stage = Usd.Stage.Open(layer)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        move = UsdGeom.Xformable(stage.GetPrimAtPath(BALL)).GetOrderedXformOps()[0]
        for frame in (1.0, 3.0):
            move.Set(Gf.Matrix4d(1.0).SetTranslate((1.2, 3.0 + far * frame, 0.0)), frame)
        layer.Save()
    host = UsdHost(tmp_path / "asset.usda")
    session = Session(host=host, discover=False)
    surfaces = {name: host.read_surface(path) for name, path in (("arm", ARM), ("ball", BALL))}
    for name, path in (("arm", ARM), ("ball", BALL)):
        asset = surfaces[name]
        session.surfaces.add(name, asset.mesh, rig=asset.rig, world_from_surface=host.placement(path))
    skin = surfaces["arm"].mesh
    order = np.argsort(np.linalg.norm(skin.points - [0.3, 2.8, 0.0], axis=1), kind="stable")[:6]
    points = SurfacePoints.at_vertices(skin, order)
    session.patches.paint("tip", points, surface="arm", axis=points[[0, 3]])
    ball = surfaces["ball"].mesh
    nearest = SurfacePoints.at_vertices(ball, [int(np.argmin(ball.points[:, 0]))])
    session.pairs.add("tip", session.patches.transfer("tip", "ball", nearest, heading=1.0 + 0.0j))
    host.save(tmp_path / "contacts.usda")
    return tmp_path


def told(capsys: pytest.CaptureFixture[str], *arguments: Any) -> tuple[int, Any]:
    """Exit code and the JSON answer of a command."""
    code = main(["usd", "--json", *map(str, arguments)])
    return code, json.loads(capsys.readouterr().out)


def test_contacts_go_to_every_shot_and_every_frame_is_solved(
    sequence: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shots = [sequence / "shot010.usda", sequence / "shot020.usda"]
    missing = sequence / "shot030.usda"
    out = sequence / "work"
    code, facts = told(capsys, "transfer", sequence / "contacts.usda", *shots, missing, "--out", out)
    assert code == 1 and "shot030" in facts[2]["failed"]  # and the others are done all the same
    assert [item["surfaces"] for item in facts[:2]] == [{"arm": ARM, "ball": BALL}] * 2

    work = [out / "shot010.contact.usda", out / "shot020.contact.usda"]
    code, facts = told(capsys, "solve", *work, "--frames", "1,2-3")
    assert code == 0 and [[f["frame"] for f in shot["frames"]] for shot in facts] == [[1.0, 2.0, 3.0]] * 2
    poses = []
    for path in work:
        host = UsdHost(path)
        assert host.pose_keys(ARM) == (1.0, 2.0, 3.0)
        with open_shot(path) as shot:
            (pair,) = shot.geometry.pairs()
        for frame in (1.0, 2.0, 3.0):
            pose = host.read_pose(ARM, frame)
            poses.append(pose)
            skin, ball = host.skin_points(ARM, pose), host.placement(BALL, frame)
            ours = pair.manipulator_points.positions(host.read_rig(ARM).mesh.with_points(skin))
            theirs = pair.object_points.positions(host.read_surface(BALL).mesh) @ ball[:3, :3].T + ball[:3, 3]
            rest = pair.manipulator_points.positions(host.read_rig(ARM).mesh)
            assert np.linalg.norm(ours - theirs, axis=1).mean() < 0.8 * np.linalg.norm(rest - theirs, axis=1).mean()
        assert {patch.surface for patch in contacts.read_patches(host.stage)} == {ARM, BALL}
        assert all(shot_file.read_bytes() for shot_file in shots)
    assert min(pose_error(poses[0], other) for other in poses[1:]) > 1e-3  # every frame has a pose of its own
    assert pose_error(UsdHost(shots[0]).read_pose(ARM), Pose.rest(arm_rig())) < 1e-6  # the shots are untouched


def test_inspect_tells_what_is_there(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, facts = told(capsys, "inspect", sequence / "contacts.usda")
    assert code == 0 and "problems" not in facts
    assert [(item["id"], item["kind"]) for item in facts["objects"]] == [(ARM, "rig"), (BALL, "surface")]
    assert len(facts["document"]["patches"]) == 2 and len(facts["document"]["pairs"]) == 1
    assert main(["usd", "inspect", str(sequence / "contacts.usda")]) == 0
    assert "4 joints" in capsys.readouterr().out


def test_inspect_validates_where_usd_can(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pxr.UsdValidation", reason="this pxr has no UsdValidation")
    code, facts = told(capsys, "inspect", sequence / "contacts.usda", "--validate")
    assert code == 0 and facts["problems"] == []


def test_export_writes_files_and_samples(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, facts = told(capsys, "export", "sample:tentacle", "sample:mug", "--out", sequence / "new.usdc")
    assert code == 0 and len(facts["objects"]) == 2
    kinds = {item.id: item.kind for item in UsdHost(sequence / "new.usdc").objects()}
    assert [kinds[path] for path in facts["objects"]] == ["rig", "surface"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["inspect", "no_such.usda"], "no_such.usda is no USD file"),
        (["solve", "asset.usda"], "no contact pairs"),
        (["transfer", "asset.usda", "shot010.usda"], "no contacts"),
        (["transfer", "sub/no_such.contact", "shot010.usda"], "there is no file"),
        (["transfer", "contacts.usda", "shot010.usda", "--surface", "arm=/nowhere"], "/nowhere"),
    ],
)
def test_refusals_are_sentences(
    arguments: list[str], words: str, sequence: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there = sorted(sequence.rglob("*"))
    code = main(["usd", *(str(sequence / a) if a.endswith((".usda", ".contact")) else a for a in arguments)])
    said = capsys.readouterr()
    assert code in (1, 2) and words in said.out + said.err
    assert sorted(sequence.rglob("*")) == there  # and nothing is written


def test_without_pxr_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    assert main(["usd", "inspect", "any.usda"]) == 2
    assert 'pip install "contact-core[usd]"' in capsys.readouterr().err


def test_shots_that_would_write_one_layer_are_told_apart(
    sequence: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Versions of a shot keep their names; two shots of one name cannot go into one folder."""
    shots = []
    for name in ("shot010.v001.usda", "shot010.v002.usda", "a/layout.usda", "b/layout.usda"):
        shots.append(sequence / name)
        shots[-1].parent.mkdir(exist_ok=True)
        shots[-1].write_bytes((sequence / "asset.usda").read_bytes())
    out = sequence / "work"
    code, facts = told(capsys, "transfer", sequence / "contacts.usda", *shots, "--out", out)
    assert code == 1 and ["failed" in item for item in facts] == [False, False, False, True]
    assert "a/layout.usda and this shot both write layout.contact.usda" in facts[3]["failed"]
    written = ["layout.contact.usda", "shot010.v001.contact.usda", "shot010.v002.contact.usda"]
    assert sorted(path.name for path in out.iterdir()) == written
    code, _ = told(capsys, "solve", out / written[0], "--frames", "1", "--out", sequence / "solved")
    assert code == 0 and [path.name for path in (sequence / "solved").iterdir()] == written[:1]


@pytest.mark.parametrize("frames", ["20-10", "nan", "inf", "1-3000000000", "1,,2", "1-2-3", "a"])
def test_frames_that_are_none_are_refused(frames: str, sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["usd", "solve", str(sequence / "contacts.usda"), "--frames", frames])
    assert left.value.code == 2 and "frames are like 1,5,10-20" in capsys.readouterr().err


def test_a_name_that_is_not_unicode_is_refused_in_words(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = Path(str(sequence), os.fsdecode(b"\xff.usda"))
    try:
        path.write_bytes((sequence / "asset.usda").read_bytes())
    except (OSError, UnicodeEncodeError):
        pytest.skip("this file system has Unicode names only")
    assert main(["usd", "inspect", str(path)]) == 2
    assert "not Unicode" in capsys.readouterr().err
    assert main(["usd", "transfer", str(sequence / "contacts.usda"), str(path)]) == 1
