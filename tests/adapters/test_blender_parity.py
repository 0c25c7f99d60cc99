"""The one script runs in Blender as on the memory host, and each rig, read in its native host, goes everywhere.

Documents are equal bit for bit (positions in single precision), solved and keyed rotations within 1e-4 rad, skins,
by Blender's own evaluation, within 1e-5 of the rig's size. Blender is a process of its own.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.reading import turn_up

HERE = Path(__file__).parent
JOINTS = {  # joint whose patch goes to the ball, and where the rig comes from
    "human": "index_tip",
    "webxr": "index-finger-tip",
    "figure": "arm_joint_L_2",
    "godot": "Index_Distal_R",
}


def _module(name: str, path: Path) -> ModuleType:
    """A module by file; test folders are no packages."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


parity = _module("parity_script", HERE / "parity_script.py")
blender_parity = _module("blender_parity", HERE / "blender_parity.py")
run_tests = _module("blender_run_tests", HERE.parents[1] / "adapters" / "blender" / "run_tests.py")


def _read_natively(name: str, assets: Path) -> Any:
    if name == "human":
        from contact_builtins.samples.catalogue import HUMAN_HAND

        return HUMAN_HAND.build()
    if name == "webxr":
        from contact_builtins.formats.gltf import GltfFiles

        return GltfFiles().read(assets / "rigs" / "webxr_generic_hand_left.glb")
    usd = pytest.importorskip("contact_usd.host", reason="usd-core is not installed", exc_type=ImportError)
    host = usd.UsdHost(assets / "rigs" / "rigged_figure.usdz")
    return host.read_rig(next(item.id for item in host.objects() if item.kind == "rig"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, assets: Path) -> Path:
    """What the Blender process was given and what it left: rigs and outcomes."""
    try:
        python = run_tests.environment()
    except run_tests.Unavailable as reason:
        pytest.skip(str(reason))
    folder = tmp_path_factory.mktemp("parity")
    jobs: dict[str, dict[str, str]] = {name: {"joint": joint} for name, joint in JOINTS.items()}
    blend = assets / "rigs" / "godot_xr_hand_right.blend"
    jobs["godot"] |= {"blend": str(blend), "object": "mesh_Hand_R"}
    for name in ("human", "webxr", "figure"):
        blender_parity.put_away(parity.prepared(_read_natively(name, assets)), folder / f"{name}.rig")
    (folder / "jobs.json").write_text(json.dumps(jobs))
    for host, suffix in _usd_hosts():
        parity.build_scene(host, blender_parity.fetch(folder / "human.rig"), JOINTS["human"])
        shot = parity.run(host, JOINTS["human"], folder / f"shot{suffix}")
        np.savez(folder / "shot", **blender_parity.outcome_to_arrays(shot))
    done = run_tests.run_script(python, HERE / "blender_parity.py", str(folder))
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return folder


@pytest.mark.parametrize("name", JOINTS)
def test_one_script_gives_one_result_in_blender_too(name: str, folder: Path, tmp_path: Path) -> None:
    with np.load(folder / f"{name}.npz") as arrays:
        theirs = blender_parity.outcome_from_arrays(arrays)
    hand = blender_parity.fetch(folder / f"{name}.rig")
    # USD beside memory for the rig that only Blender reads; the others meet USD in test_parity.
    for host, suffix in [(MemoryHost(), ".contactscene"), *(_usd_hosts() if name == "godot" else [])]:
        parity.build_scene(host, hand, JOINTS[name])
        ours = parity.run(host, JOINTS[name], tmp_path / f"scene{suffix}")
        before, after = ours.gap
        assert after < 0.5 * before  # the script solves something
        found = parity.differences(ours, theirs)
        assert {key: value for key, value in found.items() if value > parity.LIMITS[key]} == {}, (suffix, found)


def test_a_posed_usd_shot_opens_in_blender_with_its_animation(folder: Path) -> None:
    """What the USD host wrote, by Blender's own importer: the key is at its frame, and the skin is where it was."""
    if not (folder / "shot.usda").is_file():
        pytest.skip("usd-core is not installed")
    with np.load(folder / "shot.npz") as arrays:
        shot = blender_parity.outcome_from_arrays(arrays)
    with np.load(folder / "imported.npz") as imported:
        assert set(imported["joints"].tolist()) == set(shot.pose)
        assert imported["keys"].tolist() == list(shot.keys) == [parity.FRAME]
        wanted = shot.skin @ turn_up("Y", "Z")[:3, :3].T  # the stage's up is y, the scene's z
        for skin in (imported["ours"], imported["theirs"]):
            assert np.abs(skin - wanted).max() < 1e-4 * shot.length


@pytest.mark.parametrize("name", ["human", "godot"])
def test_what_blender_exports_opens_as_a_usd_host(name: str, folder: Path) -> None:
    """The posed scene by Blender's own exporter: the USD host finds its rig, pose and skin."""
    usd = pytest.importorskip("contact_usd.host", reason="usd-core is not installed", exc_type=ImportError)
    with np.load(folder / f"{name}.npz") as arrays:
        posed = blender_parity.outcome_from_arrays(arrays)
    host = usd.UsdHost(folder / f"{name}.usdc")
    (key,) = [item.id for item in host.objects() if item.kind == "rig"]
    place = host.placement(key)
    skin = host.skin_points(key, host.read_pose(key, parity.FRAME)) @ place[:3, :3].T + place[:3, 3]
    assert np.abs(skin - posed.skin).max() < 1e-5 * posed.length  # the script stands the rig at the origin


def _usd_hosts() -> list[tuple[Any, str]]:
    if importlib.util.find_spec("pxr") is None:
        return []
    from contact_usd.host import UsdHost

    return [(UsdHost(), ".usda")]
