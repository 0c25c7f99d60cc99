"""Names that nothing reads are refused in a sentence that says what to do; samples are named as files are."""

from __future__ import annotations

from pathlib import Path

import pytest

import contact_core as contact
from contact_core.cli import main
from contact_core.errors import FileRefused, InvalidInput
from contact_core.plugins.reading import read_asset


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("hero.fbx", "File > Export > glTF"),
        ("hero.FBX", "File > Export > glTF"),
        ("set.blend", "export a .glb"),
        ("cloth.abc", "Alembic is not read"),
        ("me.vrm", "copy it to a name in .glb"),
        ("all.zip", "Unpack it"),
        ("notes.docx", ".docx is none of"),
        ("README", "a name without suffix"),
    ],
)
def test_a_name_that_nothing_reads(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / name).write_bytes(b"anything")
    for read in (read_asset, contact.open):
        with pytest.raises(FileRefused, match=name) as refusal:
            read(tmp_path / name)
        assert words in str(refusal.value)


@pytest.mark.parametrize("source", ["sample:nope", Path("sample:nope")])
def test_a_sample_that_is_none_names_those_there_are(source: Path | str) -> None:
    for read in (read_asset, contact.open):
        with pytest.raises(InvalidInput, match=r"no sample 'nope'; there are: .*human_hand"):
            read(source)


@pytest.mark.parametrize("command", [["inspect"], ["repair", "--picture", "x.png"]])
def test_commands_take_samples_as_files(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([command[0], "sample:nope", *command[1:]]) == 2
    told = capsys.readouterr().err
    assert "there is no sample 'nope'; there are:" in told and "human_hand" in told and "Traceback" not in told
