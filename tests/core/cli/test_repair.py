"""`contact repair`: what it writes, draws and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from contact_builtins.formats.gltf import GltfFiles
from contact_core.cli import main
from contact_core.document.asset import Asset
from contact_core.geometry.report import report
from contact_core.testing.broken_meshes import fin
from contact_core.testing.rigs import hand_like


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    path, mesh = tmp_path / "fin.obj", fin()
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    path.write_text("\n".join(lines))
    return path


def test_it_writes_a_closed_manifold_and_says_what_it_did(
    broken: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "proxy.glb"
    assert main(["repair", str(broken), "--out", str(out), "--set", "offset=0.04", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["before"]["non_manifold_edges"] == 1 and facts["settings"]["offset"] == 0.04
    assert facts["after"]["non_manifold_edges"] == facts["after"]["boundary_loops"] == 0
    assert report(GltfFiles().read(out).mesh).is_watertight
    assert facts["largest_distance"] < 0.04


def test_a_skin_keeps_its_skeleton(tmp_path: Path) -> None:
    rig = hand_like()
    source, out = tmp_path / "hand.glb", tmp_path / "proxy.glb"
    GltfFiles().write(source, [Asset("hand", rig.surface, rig, meters_per_unit=1.0)], {})
    assert main(["repair", str(source), "--out", str(out), "--set", "offset=0.03", "--quiet"]) == 0
    written = GltfFiles().read(out).rig
    assert written is not None and len(written.joints) == len(rig.joints)


def test_the_picture_is_drawn(broken: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "proxy.png"
    assert main(["repair", str(broken), "--picture", str(out), "--set", "offset=0.05"]) == 0
    assert out.read_bytes().startswith(b"\x89PNG") and str(out) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "where to?"),
        (["--out", "x.xyz"], "no format writes .xyz"),
        (["--out", "x.glb", "--set", "offset"], "NAME=VALUE"),
        (["--out", "x.glb", "--set", "offset=wide"], "offset is a number"),
        (["--out", "x.glb", "--set", "ofset=0.1"], "did you mean 'offset'"),
        (["--out", "x.glb", "--set", "fill=maybe"], "fill is true or false"),
        (["--out", "x.glb", "--set", "offset=0.001"], "lattice points"),
        (["--out", "x.glb", "--maker", "nobody"], "there is no proxy maker 'nobody'"),
    ],
)
def test_it_refuses_in_a_sentence(
    broken: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["repair", str(broken), *arguments]) == 2
    assert words in capsys.readouterr().err
