"""Whatever a file holds, each reader gives a thing or a sentence: small sound files spoilt at random.

`make explore` gives each reader CONTACT_FUZZ seconds and new spoilt files; the suite, a few that stay the same.
What was found stands in test_found.py.
"""

from __future__ import annotations

import os
import random
import time
import zipfile
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.sidecar import read_sidecar
from contact_core.document.library import load_contact_set, save_contact_set
from contact_core.document.schema import parse_document
from contact_core.edit.recovery import journal_path
from contact_core.farm import kinds
from contact_core.farm.jobs import find_jobs
from contact_core.farm.task import RECEIPT, Result, read_receipt, sealed_receipt
from contact_core.library.record import parse_grasp
from contact_core.library.starter import starter_library
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import read_asset
from contact_core.recipe.reader import load_recipe
from contact_core.rig.pose_files import load_pose, save_pose
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import load_scene, save_scene
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar, bent
from contact_core.testing.random_commands import random_history
from contact_core.testing.spoilt_files import spoilt, survive

SECONDS = float(os.environ.get("CONTACT_FUZZ", "0"))  # for each reader; by `make explore`
FEW = 25  # spoilt files of each reader in the suite
LONGEST = 20.0  # seconds of a core for one small file, however it was spoilt
CASES = Path(__file__).parents[1] / "data" / "cases"
EXAMPLES = Path(__file__).parents[2] / "examples"
Read = Callable[[Path], Any]

BOX = "<geometry><box size='1 1 1'/></geometry>"
URDF = f"""<robot name="r"><link name="a"><visual>{BOX}</visual></link><link name="b"><visual>
<origin xyz="0 0 1" rpy="0 0.5 0"/><geometry><cylinder radius="0.1" length="2"/></geometry></visual><visual>
<geometry><mesh filename="part.obj" scale="1 2 1"/></geometry></visual></link>
<joint name="j" type="revolute"><origin xyz="0 0 1" rpy="0 0 0"/><parent link="a"/><child link="b"/>
<axis xyz="0 1 0"/>
<limit lower="-1" upper="1.5" effort="1" velocity="1"/></joint>
<link name="c"><visual><geometry><sphere radius="0.3"/></geometry></visual></link><joint name="k" type="prismatic">
<parent link="b"/><child link="c"/><mimic joint="j" multiplier="0.5"/><limit upper="2"/></joint></robot>"""
DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="12">0 0 0  4 0 0  4 4 0  2 1 5
</float_array><technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="2">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles></mesh></geometry>
</library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><matrix>1 0 0 0 0 1 0 0 0 0 1 3 0 0 0 1</matrix>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
MODEL = """<?xml version="1.0"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
<object id="1" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>
<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>
</object><object id="2" type="model"><components>
<component objectid="1"/><component objectid="1" transform="-1 0 0 0 1 0 0 0 1 -5 0 0"/></components></object>
</resources><build><item objectid="2"/></build></model>"""
SIDECAR = """schema = 1
meters_per_unit = 0.01
[[joint]]
match = "ben*"
kind = "euler"
order = "XYZ"
limits = [[-10, 80], [-5, 5], [0, 0]]
prior = [1, 2, 3]
[[joint]]
match = "base"
kind = "fixed"
"""


@cache
def plugins() -> PluginManager:
    return PluginManager()


def _asset(path: Path) -> None:
    asset = read_asset(path, plugins())
    assert np.isfinite(asset.mesh.points).all() and len(asset.mesh.faces)


def _trimesh(**how: Any) -> bytes:
    import trimesh

    ball = meshes.icosphere(0)
    made = trimesh.Trimesh(ball.points, ball.faces, process=False).export(**how)
    return made.encode() if isinstance(made, str) else bytes(made)


def _written(folder: Path, suffix: str) -> bytes:
    """A rig in its pose beside a ball, by our own writer of the format."""
    path = folder / f"made{suffix}"
    if suffix == ".glb":
        GltfFiles().write(path, [bar(), contact.Asset("ball", meshes.icosphere(0))], {"bar": bent()})
        return path.read_bytes()
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from contact_usd.files import UsdFiles

    UsdFiles().write(path, [bar()], {"bar": bent()})
    return path.read_bytes()


def _packed(files: dict[str, str], folder: Path) -> bytes:
    with zipfile.ZipFile(folder / "made.zip", "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return (folder / "made.zip").read_bytes()


def _contacts(session: Session) -> None:
    ball = meshes.icosphere(1)
    session.surfaces.add("ball", ball)
    points = contact.SurfacePoints.at_vertices(ball, [0, 5, 9, 12])
    session.patches.paint("a", points, surface="ball", axis=points[[0, 2]])


def _opened(path: Path) -> None:
    with Session.open(path, discover=False):
        pass


def _journal(path: Path) -> None:
    """A journal beside a sound document, opened as after a crash; what it sets aside is cleared for the next."""
    document = path.with_name("kept.json")
    path.replace(journal_path(document))
    _opened(document)
    for found in document.parent.glob("kept.json*"):
        found.unlink()


def _sidecar(path: Path) -> None:
    rig = bar().rig
    assert rig is not None
    found = read_sidecar(path)
    found.parents(rig.joints)
    found.freedoms(rig.joints, rig.freedoms)


def _made(folder: Path, kind: str) -> bytes:
    """A sound file of what we store ourselves."""
    path = folder / f"made.{kind}"
    if kind == "contacts":
        with contact.new() as session:
            _contacts(session)
            save_contact_set(session.sets.of("set", ["a"]), path)
    elif kind == "pose":
        save_pose(path, bent(), rig="bar")
    elif kind == "scene":
        host = MemoryHost()
        host.add(contact.Asset("ball", meshes.icosphere(0)))
        host.add(bar())
        save_scene(host.scene, path)
    else:
        session = Session.open(path, discover=False)
        for step in random_history(5, 25, still=True).steps:
            session.do(step.command)
        if kind == "document":
            session.save()
        else:
            assert session._file is not None
            session._file.close(in_order=False)
            return journal_path(path).read_bytes()
        session.close()
    return path.read_bytes()


def _sealed_receipt() -> bytes:
    inputs = [{"file": "job.json", "sha256": "0" * 64, "size": 12, "changed": 345}]
    return sealed_receipt("key", "document", inputs, asdict(Result("job", "done", files=("a.txt",)))).encode()


def _listed(path: Path) -> None:
    find_jobs([path], kinds.OWN, path.parent / "out")


def _cases(*patterns: str) -> list[bytes]:
    return [path.read_bytes() for pattern in patterns for path in sorted(CASES.glob(pattern))]


def _starter(name: str) -> bytes:
    return (starter_library().path_of("tripod") / name).read_bytes()


READERS: dict[str, tuple[str, Read, Callable[[Path], list[bytes]]]] = {  # the file's name, its reader, sound files
    "obj": ("m.obj", _asset, lambda _: [_trimesh(file_type="obj")]),
    "ply": ("m.ply", _asset, lambda _: [_trimesh(file_type="ply", encoding=kind) for kind in ("ascii", "binary")]),
    "stl": ("m.stl", _asset, lambda _: [_trimesh(file_type="stl"), _trimesh(file_type="stl_ascii")]),
    "off": ("m.off", _asset, lambda _: [_trimesh(file_type="off")]),
    "gltf": ("m.gltf", _asset, lambda _: _cases("e11*.gltf")),
    "glb": ("m.glb", _asset, lambda at: [_written(at, ".glb"), *_cases("g23*.glb", "g36*.glb")]),
    "urdf": ("m.urdf", _asset, lambda _: [URDF.encode()]),
    "dae": ("m.dae", _asset, lambda _: [DAE.encode()]),
    "3mf": ("m.3mf", _asset, lambda at: [_packed({"3D/3dmodel.model": MODEL}, at)]),
    "usda": ("m.usda", _asset, lambda at: [_written(at, ".usda"), *_cases("d20*.usda")]),
    "usdc": ("m.usdc", _asset, lambda at: [_written(at, ".usdc")]),
    "sidecar": ("m.rig.toml", _sidecar, lambda _: [SIDECAR.encode()]),
    "recipe": ("m.toml", load_recipe, lambda _: [path.read_bytes() for path in sorted(EXAMPLES.glob("0*.toml"))]),
    "document": ("m.json", lambda path: parse_document(path.read_bytes()), lambda at: [_made(at, "document")]),
    "opened": ("n.json", _opened, lambda at: [_made(at, "document")]),
    "journal": ("m.journal", _journal, lambda at: [_made(at, "journal")]),
    "contacts": ("m.json", load_contact_set, lambda at: [_made(at, "contacts"), _starter("contacts.json")]),
    "grasp": ("m.json", lambda path: parse_grasp(path.read_bytes(), "m.json"), lambda _: [_starter("grasp.json")]),
    "pose": ("m.json", load_pose, lambda at: [_made(at, "pose")]),
    "scene": ("m.contactscene", load_scene, lambda at: [_made(at, "scene")]),
    "receipt": (RECEIPT, lambda path: read_receipt(path.parent), lambda _: [_sealed_receipt()]),
    "list": ("m.txt", _listed, lambda _: [b"a.toml\n# b\n*.json\n"]),
}  # fmt: skip


@pytest.mark.parametrize("name", READERS)
def test_a_spoilt_file_is_read_or_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    file, read, sound = READERS[name]
    (tmp_path / "sound").mkdir()
    files = sound(tmp_path / "sound")
    (tmp_path / "part.obj").write_bytes(_trimesh(file_type="obj"))
    first = random.SystemRandom().randrange(1 << 40) if SECONDS else 0
    until, number = time.monotonic() + SECONDS, 0
    while number < FEW or time.monotonic() < until:
        chance = random.Random(first + number)
        content = spoilt(chance.choice(files), chance)
        began = time.process_time()
        try:
            survive(read, tmp_path / file, content)
            took = time.process_time() - began
            assert not SECONDS or took < LONGEST, f"it took {took:.1f} s"
        except BaseException as error:
            (tmp_path / f"found-{file}").write_bytes(content)
            error.add_note(f"spoilt file number {first + number}, kept as {tmp_path / f'found-{file}'}")
            raise
        number += 1
