"""The same script on the memory host and on USD, text and binary, gives the same document and the same pose."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from contact_core.document.asset import Asset
from contact_core.scene.memory_host import MemoryHost

pytest.importorskip("pxr", reason="usd-core is not installed")

from contact_usd.host import UsdHost


def script() -> ModuleType:
    """parity_script.py beside this file; test folders are no packages."""
    if "parity_script" not in sys.modules:
        spec = importlib.util.spec_from_file_location("parity_script", Path(__file__).with_name("parity_script.py"))
        assert spec is not None and spec.loader is not None
        sys.modules["parity_script"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["parity_script"])
    return sys.modules["parity_script"]


def human_hand(assets: Callable[[], Path]) -> tuple[Asset, str]:
    from contact_builtins.samples.catalogue import HUMAN_HAND

    return HUMAN_HAND.build(), "index_tip"


def webxr_hand(assets: Callable[[], Path]) -> tuple[Asset, str]:
    from contact_builtins.formats.gltf import GltfFiles

    return GltfFiles().read(assets() / "rigs" / "webxr_generic_hand_left.glb"), "index-finger-tip"


def rigged_figure(assets: Callable[[], Path]) -> tuple[Asset, str]:
    host = UsdHost(assets() / "rigs" / "rigged_figure.usdz")
    (rig,) = [item for item in host.objects() if item.kind == "rig"]
    asset = host.read_rig(rig.id)
    return asset, "arm_joint_L_3"


@pytest.mark.parametrize("source", [human_hand, webxr_hand, rigged_figure])
def test_one_script_gives_one_result_on_every_host(
    source: Callable[[Callable[[], Path]], tuple[Asset, str]], request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    parity = script()
    asset, joint = source(lambda: request.getfixturevalue("assets"))
    hand = parity.prepared(asset)
    outcomes = {}
    for host_type, suffix in ((MemoryHost, ".contactscene"), (UsdHost, ".usda"), (UsdHost, ".usdc")):
        host = host_type()
        parity.build_scene(host, hand, joint)
        outcomes[suffix] = parity.run(host, joint, tmp_path / f"scene{suffix}")
    reference = outcomes.pop(".contactscene")
    before, after = reference.gap
    assert after < 0.5 * before  # the script solves something
    for suffix, outcome in outcomes.items():
        found = parity.differences(reference, outcome)
        assert {name: value for name, value in found.items() if value > parity.LIMITS[name]} == {}, (suffix, found)
