"""Whatever bytes come: an asset or one sentence; never a traceback, a hang or a file outside the folder."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.formats.gltf_writer import glb_bytes
from contact_builtins.formats.mesh_files import MeshFiles
from contact_builtins.formats.sidecar import read_sidecar
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar, bent

GLB = glb_bytes([bar(), Asset("ball", meshes.icosphere(0))], {"bar": bent()})
JSON_LENGTH = int.from_bytes(GLB[12:16], "little")
DOCUMENT = json.loads(GLB[20 : 20 + JSON_LENGTH])
BINARY = GLB[20 + JSON_LENGTH + 8 :]


def survive(folder: Path, name: str, content: bytes) -> None:
    """Read it; a sentence is fine, anything else that is raised fails the test."""
    path = folder / name
    path.write_bytes(content)
    reader = GltfFiles() if name.endswith((".glb", ".gltf")) else MeshFiles()
    try:
        asset = reader.read(path)
    except FileRefused as error:
        assert "\n" not in str(error).strip() and len(str(error)) < 1000
    else:
        assert np.isfinite(asset.mesh.points).all() and len(asset.mesh.faces)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_bytes_changed_or_cut(tmp_path: Path, data: st.DataObject) -> None:
    content = bytearray(GLB)
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    survive(tmp_path, "m.glb", bytes(content[: data.draw(st.integers(0, len(content)))]))


JUNK = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**70), 2**70), st.floats(), st.text(max_size=4), st.just([]),
    st.just({}), st.lists(st.integers(-3, 40), max_size=5),
)  # fmt: skip


def _places(value: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Every place in a JSON document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path] * bool(path) + [found for key, child in inner for found in _places(child, (*path, key))]


PLACES = _places({key: value for key, value in DOCUMENT.items() if key != "asset"})


@settings(max_examples=250, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_words_of_the_document_changed(tmp_path: Path, data: st.DataObject) -> None:
    """Wrong types, huge counts, rings, missing keys: in a JSON glTF with its buffer beside it."""
    document = json.loads(json.dumps(DOCUMENT))
    document["buffers"][0]["uri"] = "m.bin"
    (tmp_path / "m.bin").write_bytes(BINARY)
    for _ in range(data.draw(st.integers(1, 3))):
        *steps, last = data.draw(st.sampled_from(PLACES))
        holder = document
        try:
            for step in steps:
                holder = holder[step]
            if data.draw(st.booleans()):
                holder[last] = data.draw(JUNK)
            else:
                del holder[last]
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change took the place away
    survive(tmp_path, "m.gltf", json.dumps(document).encode())


HEADS = [b"", b"ply\nformat ascii 1.0\nend_header\n", b"OFF\n", b"solid facet\n", b"v 0 0 0\n", b"glTF", b"{"]


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from(["m.obj", "m.ply", "m.stl", "m.off", "m.glb", "m.gltf"]),
    head=st.sampled_from(HEADS),
    noise=st.binary(max_size=300),
)
def test_noise(tmp_path: Path, name: str, head: bytes, noise: bytes) -> None:
    survive(tmp_path, name, head + noise)


@pytest.mark.parametrize("name", ["m.obj", "m.ply", "m.off", "m.stl"])
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mesh_files_changed_or_cut(tmp_path: Path, name: str, data: st.DataObject) -> None:
    import trimesh

    ball = meshes.icosphere(0)
    content = trimesh.Trimesh(ball.points, ball.faces, process=False).export(file_type=name[2:])
    changed = bytearray(content.encode() if isinstance(content, str) else content)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    survive(tmp_path, name, bytes(changed[: data.draw(st.integers(0, len(changed)))]))


SIDECAR_LINES = (
    "schema = 1", "[[joint]]", 'match = "*"', "match = [1]", "parent = 3", 'kind = "hinge"', 'kind = "wheel"',
    "limits = [5, -5]", "limits = [nan, 1]", "twist = [1]", "prior = [-1]", "prior = [1, 2]", 'bone = "x"',
    'palmar = "x"', "axis = [0, 0, 0]", 'lock = ["nod"]', "lock = 3", 'order = "XX"', "[mirror]", "a = 1",
    "meters_per_unit = -1", "unknown = 1",
)  # fmt: skip


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    lines=st.lists(
        st.sampled_from(SIDECAR_LINES),
        max_size=8,
    )
)
def test_sidecars(tmp_path: Path, lines: list[str]) -> None:
    path = tmp_path / "m.rig.toml"
    path.write_text("\n".join(lines))
    rig = bar().rig
    assert rig is not None
    try:
        sidecar = read_sidecar(path)
        sidecar.parents(rig.joints)
        sidecar.freedoms(rig.joints, rig.freedoms)
    except FileRefused as error:
        assert "m.rig.toml" in str(error)
