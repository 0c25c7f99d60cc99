"""USD as a file format keeps the contract of formats, and recipes read it."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from contact_core.cli import main
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.testing import meshes
from contact_core.testing.format_contract import FormatContract, bar, bent
from contact_core.testing.host_checks import pose_error, volume
from contact_core.testing.host_scenes import affine
from contact_usd.files import UsdFiles
from contact_usd.host import UsdHost


class TestUsdFiles(FormatContract):
    subject = "USD"
    cannot: ClassVar = {
        "poses": "a pose is an animation of the skeleton; the rest pose of the file stays the rest pose"
    }

    @pytest.fixture
    def file_format(self) -> UsdFiles:
        return UsdFiles()


def test_a_posed_rig_is_written_as_an_animation(tmp_path: Path) -> None:
    UsdFiles().write(tmp_path / "posed.usda", [bar()], {"bar": bent()})
    host = UsdHost(tmp_path / "posed.usda")
    assert pose_error(host.read_pose("/bar_rig/bar"), bent()) < 1e-5


def test_several_surfaces_are_one_mesh_where_they_stand(tmp_path: Path) -> None:
    host = UsdHost()
    for shift in (0.0, 5.0):
        host.add(Asset("ball", meshes.icosphere(1)), affine((0, 0, 0), (1, 1, 1), (shift, 0, 0)))
    host.save(tmp_path / "two.usda")
    asset = UsdFiles().read(tmp_path / "two.usda")
    assert volume(asset.mesh) == pytest.approx(2 * volume(meshes.icosphere(1)), rel=1e-5)
    width = np.ptp(meshes.icosphere(1).points[:, 0])
    assert np.ptp(asset.mesh.points[:, 0]) == pytest.approx(5.0 + width, abs=1e-5)
    assert asset.source_vertices is not None and len(asset.source_vertices) == len(asset.mesh.points)


def test_what_has_no_one_answer_is_refused(tmp_path: Path) -> None:
    host = UsdHost()
    host.save(tmp_path / "empty.usda")
    with pytest.raises(FileRefused, match="no meshes"):
        UsdFiles().read(tmp_path / "empty.usda")
    UsdFiles().write(tmp_path / "two.usda", [bar(), bar()], {})
    with pytest.raises(FileRefused, match=r"2 rigs \(/bar_rig/bar, /bar_rig_2/bar\)"):
        UsdFiles().read(tmp_path / "two.usda")


@pytest.mark.assets
def test_the_command_line_inspects_usd(assets: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(assets / "rigs" / "rigged_figure.usdz")]) == 0
    assert "19 joints" in capsys.readouterr().out
