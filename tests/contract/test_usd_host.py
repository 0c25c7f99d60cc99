"""The USD host keeps the host contract, on text and on binary layers."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path
from typing import Any, ClassVar

import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Usd, UsdGeom

from contact_core.testing.host_contract import Build, HostContract
from contact_core.testing.host_scenes import HostScene
from contact_usd.host import UsdHost

NO_VIEW = "a stage has no view; pictures are drawn by the renderers, picking belongs to the viewer"


def scenes() -> Any:
    """tests/adapters/usd/usd_scenes.py; test folders are no packages."""
    path = Path(__file__).parents[1] / "adapters" / "usd" / "usd_scenes.py"
    if "usd_scenes" not in sys.modules:
        spec = importlib.util.spec_from_file_location("usd_scenes", path)
        assert spec is not None and spec.loader is not None
        sys.modules["usd_scenes"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["usd_scenes"])
    return sys.modules["usd_scenes"]


class TestUsdHost(HostContract):
    subject = "USD"
    cannot: ClassVar = {
        "display": NO_VIEW,
        "picking": NO_VIEW,
        "progress": "a stage has no user; the command line tells the progress",
        "curves": "the joints of a UsdSkel animation have time samples, which are joined by straight blends",
        "bones": "a UsdSkel skeleton has no joints but those that are posed",
    }

    @pytest.fixture(params=[".usda", ".usdc"])
    def build(self, request: pytest.FixtureRequest, tmp_path: Path) -> Build:
        counter = itertools.count()

        def opened(scene: HostScene) -> UsdHost:
            path = tmp_path / f"source{next(counter)}{request.param}"
            return UsdHost(scenes().write_scene(scene, path))

        return opened

    def foreign_edit(self, host: UsdHost) -> None:
        """A script of the artist's moves a prim in our layer, behind our back."""
        with Usd.EditContext(host.stage, host.layer):
            prim = host.stage.GetPrimAtPath("/World/plain_group")
            x = host.placement("/World/plain_group/plain")[0, 3]
            UsdGeom.Xformable(prim).MakeMatrixXform().Set(Gf.Matrix4d(1.0).SetTranslate((x + 1.0, 0, 0)))

    def scene_state(self, host: UsdHost) -> str:
        return str(host.layer.ExportToString())


class TestUsdHostOnAnOpenStage(HostContract):
    """What a DCC does: it has the stage open, with the artist's file as root, and our layer goes above."""

    subject = "USD on an open stage"
    cannot: ClassVar = {
        **TestUsdHost.cannot,
        "files": "the DCC saves its own files; our layer alone is saved with a path",
    }

    @pytest.fixture
    def build(self, tmp_path: Path) -> Build:
        counter = itertools.count()

        def opened(scene: HostScene) -> UsdHost:
            path = scenes().write_scene(scene, tmp_path / f"scene{next(counter)}.usda")
            return UsdHost.on(Usd.Stage.Open(str(path)))

        return opened

    foreign_edit = TestUsdHost.foreign_edit
    scene_state = TestUsdHost.scene_state
