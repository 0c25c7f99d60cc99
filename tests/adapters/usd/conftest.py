"""A small sequence: one character and one ball, two shots in which the ball moves, and a stage with contacts."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core is not installed")

from pxr import Gf, Sdf, Usd, UsdGeom

from contact_core.document.asset import Asset
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing.host_scenes import arm_rig
from contact_usd.host import UsdHost

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
