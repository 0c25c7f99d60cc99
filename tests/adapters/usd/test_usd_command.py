"""`contact usd` over a small sequence: one character and one ball, two shots in which the ball moves."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from contact_core.cli import main
from contact_core.geometry.mesh import TriangleMesh
from contact_core.rig.rig import Pose
from contact_core.testing import meshes
from contact_core.testing.host_checks import pose_error
from contact_core.testing.host_scenes import arm_rig
from contact_usd import contacts
from contact_usd.host import UsdHost
from contact_usd.shots import open_shot

ARM, BALL = "/arm_rig/arm", "/ball"


def parity_ball(radius: float, level: int) -> TriangleMesh:
    ball = meshes.icosphere(level)
    return TriangleMesh(radius * ball.points, ball.faces)


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
            gaps = [np.linalg.norm(points - theirs, axis=1).mean() for points in (ours, rest)]
            assert gaps[0] < 0.9 * gaps[1]  # the ball moves by 0.4 a frame, and the motion is solved as a whole
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


def test_solve_on_a_shot_finds_its_contact_layer(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shot = sequence / "shot010.usda"
    code, facts = told(capsys, "solve", shot)
    assert code == 1 and f"there is no {sequence / 'shot010.contact.usda'}" in facts[0]["failed"]
    assert "contact usd transfer" in facts[0]["failed"]
    told(capsys, "transfer", sequence / "contacts.usda", shot)
    code, facts = told(capsys, "solve", shot, "--frames", "1")
    assert code == 0 and UsdHost(sequence / "shot010.contact.usda").pose_keys(ARM) == (1.0,)

    (sequence / "shot020.contact.usda").write_bytes((sequence / "shot010.contact.usda").read_bytes())
    code, facts = told(capsys, "solve", sequence / "shot020.usda")
    assert code == 1 and "shot010.usda, not over" in facts[0]["failed"]


def test_publish_keys_what_a_plain_viewer_shows(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Points and curves with colours lie on the skin and the ball at every frame, read by pxr alone."""
    shot = sequence / "shot010.usda"
    told(capsys, "transfer", sequence / "contacts.usda", shot)
    told(capsys, "solve", shot, "--frames", "1,3")
    out = sequence / "review"
    code, facts = told(capsys, "publish", shot, "--frames", "1,3", "--out", out)
    assert code == 0 and len(facts[0]["patches"]) == 2
    stage = Usd.Stage.Open(str(out / "shot010.contact.usda"))
    drawn = [prim for prim in stage.Traverse() if prim.GetTypeName() in ("Points", "BasisCurves")]
    assert {prim.GetTypeName() for prim in drawn} == {"Points", "BasisCurves"}
    host = UsdHost(shot)
    for prim in drawn:
        shape = UsdGeom.PointBased(prim)
        assert shape.GetDisplayColorAttr().Get() and shape.GetPointsAttr().GetTimeSamples() == [1.0, 3.0]
        assert len(prim.GetAttribute("widths").Get()) and shape.ComputePurpose() == "default"
    ball = host.read_surface(BALL).mesh
    on_ball = next(p for p in contacts.read_patches(stage) if p.surface == BALL)
    path = next(p for p in drawn if p.GetAttribute("contact:name").Get() == on_ball.name)
    for frame in (1.0, 3.0):
        place = host.placement(BALL, frame)
        seen = np.asarray(UsdGeom.Points(path).GetPointsAttr().Get(frame))
        expected = on_ball.points.positions(ball) @ place[:3, :3].T + place[:3, 3]
        assert np.abs(seen - expected).max() < 1e-5
        low, high = np.asarray(UsdGeom.Points(path).GetExtentAttr().Get(frame))
        assert (low <= seen.min(axis=0) + 1e-5).all() and (high >= seen.max(axis=0) - 1e-5).all()


def test_a_batch_of_shots_solves_again_what_changed(sequence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A layer that moved only one shot's ball concerns that shot; an asset with new triangles concerns all."""
    shots = [sequence / "shot010.usda", sequence / "shot020.usda"]
    told(capsys, "transfer", sequence / "contacts.usda", *shots)
    out = sequence / "out"

    def batch(*jobs: Path) -> dict[str, Any]:
        arguments = ["batch", "--json", *map(str, jobs), "--out", str(out), "--frames", "1,3", "--workers", "0"]
        assert main(arguments) == 0
        return {job["name"]: job for job in json.loads(capsys.readouterr().out)["jobs"]}

    found = batch(sequence)  # in a folder, the contact layers are the jobs
    assert set(found) == {"shot010.contact", "shot020.contact"}
    found = batch(*shots)
    assert {job["state"] for job in found.values()} == {"done"} and set(found) == {"shot010", "shot020"}
    assert UsdHost(out / "shot010" / "shot010.contact.usda").pose_keys(ARM) == (1.0, 3.0)
    assert (out / "shot010" / "picture.png").stat().st_size > 1000
    assert {job["state"] for job in batch(*shots).values()} == {"same"}

    layer = Sdf.Layer.FindOrOpen(str(shots[1]))
    stage = Usd.Stage.Open(layer)
    UsdGeom.Xformable(stage.GetPrimAtPath(BALL)).GetOrderedXformOps()[0].Set(
        Gf.Matrix4d(1.0).SetTranslate((1.2, 2.9, 0.0)), 3.0
    )
    layer.Save()
    del stage, layer
    assert {name: job["state"] for name, job in batch(*shots).items()} == {"shot010": "same", "shot020": "done"}

    stage = Usd.Stage.Open(str(sequence / "asset.usda"))
    finer = parity_ball(0.5, 2)
    prim = UsdGeom.Mesh(stage.GetPrimAtPath(BALL))
    prim.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(finer.points.astype(np.float32)))
    prim.GetFaceVertexCountsAttr().Set(Vt.IntArray([3] * len(finer.faces)))
    prim.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(finer.faces.astype(np.int32).ravel()))
    stage.GetRootLayer().Save()
    del prim, stage
    found = batch(*shots)
    assert {job["state"] for job in found.values()} == {"done"}
    assert all("has other triangles now" in job["notes"][0] for job in found.values()), found
    with open_shot(out / "shot010" / "shot010.contact.usda") as shot:
        (pair,) = shot.geometry.pairs()
        theirs = pair.object_points.positions(finer)
        assert np.abs(np.linalg.norm(theirs, axis=1) - 0.5).max() < 0.05
