"""What the fuzzers of test_readers.py found: files that were answered with a traceback or Python's words."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from contact_builtins.formats.scene_meshes import SceneMeshFiles
from contact_builtins.formats.sidecar import read_sidecar
from contact_core.document.schema import parse_document
from contact_core.errors import ContactError
from contact_core.farm import kinds
from contact_core.farm.jobs import find_jobs
from contact_core.rig.pose_files import load_pose
from contact_core.scene.memory_scene import load_scene
from contact_core.testing.format_contract import bar
from contact_core.testing.spoilt_files import PYTHON_WORDS, survive


def _document(path: Path) -> Any:
    return parse_document(path.read_bytes(), path.name)


def _sidecar(path: Path) -> Any:
    rig = bar().rig
    assert rig is not None
    return read_sidecar(path).freedoms(rig.joints, rig.freedoms)


def _usd(path: Path) -> Any:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from contact_usd.files import UsdFiles

    return UsdFiles().read(path)


def _list(path: Path) -> Any:
    return find_jobs([path], kinds.OWN, path.parent / "out")


def _archive_cut_inside() -> bytes:
    """A package whose directory tells of more bytes than there are."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as package:
        package.writestr("3D/3dmodel.model", "<model/>" * 20)
    data = bytearray(stream.getvalue())
    at = data.index(b"PK\x01\x02")
    data[at + 20 : at + 28] = (10_000).to_bytes(4, "little") * 2  # packed and unpacked sizes
    return bytes(data)


POSE = b'{"kind": "contact.pose", "schema": 1, "rig": "", "joints": ["a"], "local": %s}'
RULE = b'schema = 1\n[[joint]]\nmatch = "bend"\n'
FOUND: dict[str, tuple[str, Callable[[Path], Any], bytes, str]] = {
    "no UTF-8": ("m.json", _document, b'{"a": "\xc4"}', "not UTF-8 text (byte 7)"),
    "deep": ("m.json", _document, b"[" * 100_000, "nested too deeply"),
    "many digits": ("m.json", _document, b"[" + b"9" * 5000 + b"]", "more digits than any that is meant"),
    "no end": ("m.json", _document, b'{"a": ', "line 1, column 7"),
    "a version of any length": ("m.json", _document, b'{"schema": "contact-core.document", "version": "%s"}'
        % (b"9" * 5000), "names no version"),
    "a deep pose": ("m.json", load_pose, b"[" * 100_000, "nested too deeply"),
    "a pose in another alphabet": ("m.json", load_pose, b"\xff\xfe{", "not UTF-8 text"),
    "a pose of too few numbers": ("m.json", load_pose, POSE % b"[[1, 2]]", "a matrix of 16 numbers"),
    "a pose of words": ("m.json", load_pose, POSE % b'[["a"]]', "16 numbers"),
    "a pose of tables": ("m.json", load_pose, POSE % b"[{}]", "16 numbers"),
    "a scene of noise": ("m.contactscene", load_scene, b"PK\x03\x04noise", "no scene of the memory host"),
    "a list for a limit": ("m.rig.toml", _sidecar, RULE + b'kind = "euler"\nflexion = [[1], 2]', "of another kind"),
    "a word of any length": ("m.rig.toml", _sidecar, RULE.replace(b"bend", b"[" * 5000), "name or pattern"),
    "a key of any length": ("m.rig.toml", _sidecar, b"schema = 1\n" + b"x" * 5000 + b" = 1", "top level has no"),
    "a cut package": ("m.3mf", SceneMeshFiles().read, _archive_cut_inside(), "no 3MF package"),
    "USD that quotes the file": ("m.usda", _usd, b"#usda 1.0\ndef Mesh \"a\" {\nint[] faceVertexIndices = ["
        + b"1, " * 5000 + b"x]\n}", "cannot be used as a USD layer"),
    "a pattern with ** in a name": ("m.txt", _list, b"a**b.json\n", "no pattern of files"),
    "a pattern of any length": ("m.txt", _list, b"*" + b"x" * 5000 + b"\n", "no"),
}  # fmt: skip


@pytest.mark.parametrize("name", FOUND)
def test_it_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    file, read, content, words = FOUND[name]
    assert not survive(read, tmp_path / file, content)
    with pytest.raises(ContactError) as refusal:
        read(tmp_path / file)
    assert words in str(refusal.value)


def test_a_binary_layer_that_is_damaged_within_is_refused(tmp_path: Path) -> None:
    """Values of binary layers are read when somebody asks for them; then the packing does not fit."""
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from contact_usd.files import UsdFiles

    path = tmp_path / "m.usdc"
    UsdFiles().write(path, [bar()], {})
    whole, refused = path.read_bytes(), 0
    for at in range(88, len(whole) - 64, len(whole) // 60):
        content = bytearray(whole)
        content[at : at + 16] = b"\xff" * 16
        refused += not survive(UsdFiles().read, path, bytes(content))
    assert refused > 20


def test_attributes_of_another_type_are_none(tmp_path: Path) -> None:
    """A layer may name any type; what a skeleton can do without is done without."""
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from contact_usd.files import UsdFiles

    path = tmp_path / "m.usda"
    UsdFiles().write(path, [bar()], {})
    lines = [
        line for line in path.read_text().splitlines() if "restTransforms" not in line and "jointNames" not in line
    ]
    at = next(k for k, line in enumerate(lines) if "uniform token[] joints" in line)
    lines[at:at] = ["uniform bogus restTransforms = 3", "double jointNames = 3"]
    path.write_text("\n".join(lines))
    asset = UsdFiles().read(path)
    assert asset.rig is not None and asset.rig.joints == ("base", "bend")
    assert any("no rest pose" in note for note in asset.notes)


def test_a_reader_that_speaks_python_is_caught(tmp_path: Path) -> None:
    """The fuzzers' own law can fail."""

    def careless(path: Path) -> None:
        try:
            int(path.read_text())
        except ValueError as error:
            raise ContactError(f"the file is bad: {error}") from error

    with pytest.raises(AssertionError, match="Python's words"):
        survive(careless, tmp_path / "m", b"a")
    with pytest.raises(ValueError, match=PYTHON_WORDS[0]):
        survive(lambda path: int(path.read_text()), tmp_path / "m", b"a")
