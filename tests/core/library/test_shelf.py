"""The folder of a library: nothing is written over, nobody reads half a grasp, bad names and files do no harm."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contact_core.document.library import ContactSet
from contact_core.errors import FileRefused, InvalidInput
from contact_core.library import record
from contact_core.library.record import Grasp, dump_grasp
from contact_core.library.shelf import GRASP, PICTURE, Library, check_grasp_name, is_grasp_name

Saved = tuple[Grasp, ContactSet]
PNG = b"\x89PNG\r\n\x1a\n" + b"0" * 20


def test_what_is_put_on_the_shelf_is_there(tmp_path: Path, saved: Saved) -> None:
    library = Library(tmp_path / "studio" / "grasps")
    assert library.add("ball, by the top", *saved, PNG) == 1
    assert library.names() == ("ball, by the top",)
    assert dump_grasp(library.grasp("ball, by the top")) == dump_grasp(saved[0])
    assert set(library.contacts("ball, by the top").patches) == set(saved[1].patches)
    assert library.picture("ball, by the top") == PNG
    assert not [path for path in library.folder.iterdir() if path.name.startswith(".")]


def test_a_taken_name_is_refused_and_a_further_version_keeps_the_one_before(tmp_path: Path, saved: Saved) -> None:
    library = Library(tmp_path)
    library.add("Ball", *saved)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for name in ("Ball", "ball"):  # one file on systems that do not tell them apart
        with pytest.raises(FileRefused, match="already"):
            library.add(name, *saved)
    assert library.add("Ball", *saved, PNG, replace=True) == 2
    assert {path: path.read_bytes() for path in before} == before
    assert library.versions("Ball") == (1, 2)
    assert library.picture("Ball") == PNG and library.picture("Ball@1") is None
    with pytest.raises(FileRefused, match="no version '3'; it has 1, 2"):
        library.grasp("Ball@3")


def test_many_writers_at_once_all_find_their_grasp(tmp_path: Path, saved: Saved) -> None:
    def save(_: int) -> int:
        return Library(tmp_path).add("ball", *saved, PNG, replace=True)

    with ThreadPoolExecutor(8) as pool:
        numbers = sorted(pool.map(save, range(16)))
    assert numbers == list(range(1, 17)) == list(Library(tmp_path).versions("ball"))
    for number in numbers:
        assert Library(tmp_path).grasp(f"ball@{number}").kind == saved[0].kind


def test_of_two_new_grasps_of_one_name_one_wins_and_the_other_is_told(tmp_path: Path, saved: Saved) -> None:
    def save(_: int) -> bool:
        try:
            return bool(Library(tmp_path).add("ball", *saved))
        except FileRefused as refused:
            assert "another name" in str(refused)
            return False

    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(save, range(8))) == 1
    assert Library(tmp_path).versions("ball") == (1,)


def test_a_writer_that_fails_leaves_nothing(tmp_path: Path, saved: Saved, monkeypatch: pytest.MonkeyPatch) -> None:
    library = Library(tmp_path)
    library.add("ball", *saved)
    before = sorted(tmp_path.rglob("*"))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("contact_core.library.shelf.save_contact_set", full)
    with pytest.raises(FileRefused, match="No space left"):
        library.add("ball", *saved, replace=True)
    assert sorted(tmp_path.rglob("*")) == before


def test_what_cannot_be_read_is_listed_and_hides_no_other(tmp_path: Path, saved: Saved) -> None:
    library = Library(tmp_path)
    library.add("good", *saved)
    library.add("bad", *saved, PNG)
    (library.path_of("bad") / GRASP).write_text("{", encoding="utf-8")
    (library.path_of("bad") / PICTURE).write_bytes(b"GIF89a")
    (tmp_path / "not a grasp").mkdir()
    (tmp_path / "notes.txt").write_text("hello", encoding="utf-8")
    bad, good = library.entries()
    assert bad.grasp is None and "not valid JSON" in bad.problem
    assert good.grasp is not None and [entry.name for entry in library.entries("TEST")] == ["good"]
    with pytest.raises(FileRefused, match="no PNG"):
        library.picture("bad")
    (library.path_of("bad") / GRASP).write_bytes(b" " * (record.MAX_BYTES + 1))
    with pytest.raises(FileRefused, match="more than"):
        library.grasp("bad")


@pytest.mark.parametrize(
    "name",
    ["", " ", ".", "..", "../x", "a/b", "a\\b", "C:", "nul", "COM1.txt", "x.", ".hidden", "a\n", "x@2", "é" * 81],
)
def test_names_that_are_no_file_everywhere_are_refused(name: str, tmp_path: Path, saved: Saved) -> None:
    with pytest.raises(InvalidInput, match="name of a grasp"):
        Library(tmp_path / "library").add(name, *saved)
    assert not (tmp_path / "library").exists()


@given(st.text(max_size=90))
def test_a_name_is_one_folder(name: str) -> None:
    try:
        checked = check_grasp_name(name)
    except InvalidInput:
        return
    assert is_grasp_name(checked) and Path(checked).name == checked and Path(checked).parts == (checked,)


def test_what_is_missing_is_said(tmp_path: Path, saved: Saved) -> None:
    with pytest.raises(FileRefused, match="there is no library"):
        Library(tmp_path / "nowhere").names()
    library = Library(tmp_path)
    with pytest.raises(FileRefused, match="none yet"):
        library.grasp("mug")
    library.add("mug by the body", *saved)
    with pytest.raises(FileRefused, match="it has mug by the body"):
        library.grasp("mug by the bod")
    with pytest.raises(InvalidInput, match="PNG"):
        library.add("other", *saved, b"no picture")
