"""Files are written atomically, and read with a bound."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from contact_core.atomic_file import read_bounded, replacing, write_atomic
from contact_core.errors import FileRefused


def test_a_file_is_written_and_replaced_and_nothing_else_remains(tmp_path: Path) -> None:
    target = tmp_path / "new" / "report.json"
    write_atomic(target, "first")
    write_atomic(target, b"second")
    assert target.read_bytes() == b"second"
    assert list(target.parent.iterdir()) == [target]
    plain = tmp_path / "plain"
    plain.write_text("")
    assert stat.S_IMODE(target.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_an_error_while_writing_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    target = tmp_path / "picture.png"
    write_atomic(target, b"old")
    with pytest.raises(ZeroDivisionError), replacing(target) as temporary:
        assert temporary.suffix == ".png"
        temporary.write_bytes(b"half")
        raise ZeroDivisionError
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_that_is_a_file_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "folder").write_text("")
    with pytest.raises(FileRefused, match="cannot write into"):
        write_atomic(tmp_path / "folder" / "report.json", b"")


def test_a_target_that_is_a_folder_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(FileRefused, match=r"cannot write .*taken"):
        write_atomic(tmp_path / "taken", b"")
    assert list(tmp_path.iterdir()) == [tmp_path / "taken"]


def test_a_null_character_in_a_name_is_a_sentence(tmp_path: Path) -> None:
    for action in (lambda path: write_atomic(path, b"new"), lambda path: read_bounded(path, 10)):
        with pytest.raises(FileRefused, match="null character"):
            action(tmp_path / "a\0b")
    assert not list(tmp_path.iterdir())
