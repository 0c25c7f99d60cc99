"""Assets that a shot names by a search path, in the versions that a show has of them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from contact_core.document.asset import Asset
from contact_core.testing import meshes
from contact_usd.host import UsdHost

SHOT = """#usda 1.0
(metersPerUnit = 1)
def "World" {
    def "ball" (references = @chars/ball.usda@) {
    }
}
"""


def version(folder: Path, radius: float) -> Path:
    """A version of the show's assets: a folder with chars/ball.usda in it."""
    (folder / "chars").mkdir(parents=True)
    ball, host = meshes.icosphere(1), UsdHost()
    key = host.add(Asset("ball", ball.with_points(radius * ball.points), meters_per_unit=1.0))
    host.layer.customLayerData = {}
    host.layer.defaultPrim = key.strip("/").split("/")[0]
    host.save(folder / "chars" / "ball.usda")
    return folder


def size_in(shot: Path) -> float:
    host = UsdHost(shot)
    (found,) = host.objects()
    return float(np.abs(host.read_surface(found.id).mesh.points).max())


def test_the_version_that_is_set_is_the_one_that_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shot = tmp_path / "seq" / "shot010.usda"
    shot.parent.mkdir()
    shot.write_text(SHOT)
    for name, radius in (("v001", 1.0), ("v002", 2.0)):
        monkeypatch.setenv("CONTACT_ASSETS", str(version(tmp_path / name, radius)))
        assert np.isclose(size_in(shot), radius)
    version(shot.parent, 3.0)  # what stands beside the shot comes first
    assert np.isclose(size_in(shot), 3.0)
    monkeypatch.delenv("CONTACT_ASSETS")
    assert np.isclose(size_in(shot), 3.0)


def test_usds_own_search_path_counts_too(tmp_path: Path) -> None:
    """It is read once in a process, so this is another one."""
    (tmp_path / "shot.usda").write_text(SHOT)
    versions = str(version(tmp_path / "v", 2.0))
    run = subprocess.run(
        [sys.executable, "-m", "contact_core", "inspect", str(tmp_path / "shot.usda")],
        env={**os.environ, "CONTACT_ASSETS": str(tmp_path), "PXR_AR_DEFAULT_SEARCH_PATH": versions},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0 and "42 vertices" in run.stdout and "4 x 4 x 4 units" in run.stdout, run.stderr
