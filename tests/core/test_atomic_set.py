"""A set of files is replaced as one: all of the new, or all of the old."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import pytest

from contact_core.atomic_file import write_atomic
from contact_core.atomic_set import _exclusive, check_writable, replacing_set
from contact_core.errors import FileRefused

NAMES = ("pose", "picture", "report")


def contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.is_file()}


def publish(folder: Path, word: str, names: tuple[str, ...] = NAMES) -> None:
    with replacing_set(folder, NAMES) as stage:
        for name in names:
            (stage / name).write_text(word)


def test_a_set_replaces_a_set_and_touches_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    publish(folder, "first")
    (folder / "mine").write_text("kept")
    publish(folder, "second", ("pose", "report"))
    assert contents(folder) == {"pose": "second", "report": "second", "mine": "kept"}


@pytest.mark.parametrize("event", [ZeroDivisionError, KeyboardInterrupt])
def test_an_error_leaves_the_old_set_and_no_litter(event: type[BaseException], tmp_path: Path) -> None:
    publish(tmp_path / "old", "first")
    for place in ("old", "new/deep"):
        with pytest.raises(event), replacing_set(tmp_path / place, NAMES) as stage:
            (stage / "pose").write_text("half")
            raise event
    assert contents(tmp_path / "old") == dict.fromkeys(NAMES, "first")
    assert [path.name for path in tmp_path.iterdir()] == ["old"]


def test_what_fails_inside_is_told_of_the_folder_that_was_named(tmp_path: Path) -> None:
    with pytest.raises(FileRefused) as told, replacing_set(tmp_path / "out", NAMES) as stage:
        (stage / "pose").mkdir()
        write_atomic(stage / "pose", "x")
    assert str(tmp_path / "out" / "pose") in str(told.value) and ".contact-" not in str(told.value)


def test_a_rename_that_fails_does_not_claim_that_nothing_changed(tmp_path: Path) -> None:
    publish(tmp_path, "first")
    with pytest.raises(FileRefused, match="may be of two runs"), replacing_set(tmp_path, NAMES) as stage:
        for name in NAMES:
            write_atomic(stage / name, "second")
        (tmp_path / "report").unlink()
        (tmp_path / "report").mkdir()  # somebody else's, in the meantime
    assert contents(tmp_path) == {"pose": "second", "picture": "second"}


@pytest.mark.skipif(sys.platform == "win32", reason="folders are not locked on Windows")
def test_two_sets_at_once_never_mix(tmp_path: Path) -> None:
    """While one publishes, another waits with all of its files ready."""
    publish(tmp_path, "first")
    with _exclusive(tmp_path):
        other = threading.Thread(target=publish, args=(tmp_path, "second"))
        other.start()
        other.join(0.5)
        assert other.is_alive()
        assert {name: (tmp_path / name).read_text() for name in NAMES} == dict.fromkeys(NAMES, "first")
    other.join()
    assert contents(tmp_path) == dict.fromkeys(NAMES, "second")


def test_a_folder_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    (tmp_path / "out" / "report").mkdir(parents=True)
    for place, says in (
        ("file", "is not a folder"),
        ("file/a/b", "is not a folder"),
        ("link", "is not a folder"),
        ("out", "it is a folder"),
    ):
        with pytest.raises(FileRefused, match=says):
            check_writable(tmp_path / place, NAMES)
    check_writable(tmp_path / "a" / "b", NAMES)
    assert not (tmp_path / "a").exists()
