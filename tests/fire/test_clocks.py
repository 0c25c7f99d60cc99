"""Clocks that differ between the machines of a studio."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from contact_core.document.library import ContactSet
from contact_core.errors import FileRefused
from contact_core.library import shelf
from contact_core.library.shelf import Library
from contact_core.library.starter import starter_library


def test_a_clock_that_is_days_ahead_takes_nothing_for_litter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another machine saves between two of the files of a grasp: what is old is told by the clock of the server."""
    starter, save, now = starter_library(), shelf.save_contact_set, time.time()
    grasp, contacts = starter.grasp("tripod"), starter.contacts("tripod")

    def interrupted(contact_set: ContactSet, path: Path) -> None:
        if not Library(tmp_path).names():
            with monkeypatch.context() as ahead:
                ahead.setattr(time, "time", lambda: now + 7 * 24 * 3600.0)
                ahead.setattr(shelf, "save_contact_set", save)
                Library(tmp_path).add("theirs", grasp, contacts)
        save(contact_set, path)

    monkeypatch.setattr(shelf, "save_contact_set", interrupted)
    assert Library(tmp_path).add("mine", grasp, contacts) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "theirs"]


def test_a_grasp_that_somebody_removed_while_it_was_written_is_no_half_grasp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    starter, save = starter_library(), shelf.save_contact_set
    grasp, contacts = starter.grasp("tripod"), starter.contacts("tripod")

    def emptied(contact_set: ContactSet, path: Path) -> None:
        for written in path.parent.iterdir():
            written.unlink()
        save(contact_set, path)

    with (
        monkeypatch.context() as patched,
        pytest.raises(FileRefused, match="somebody removed the unfinished grasp"),
    ):
        patched.setattr(shelf, "save_contact_set", emptied)
        Library(tmp_path).add("mine", grasp, contacts)
    assert not list(tmp_path.iterdir())
    assert Library(tmp_path).add("mine", grasp, contacts) == 1


def test_what_was_left_for_a_day_by_the_clock_of_the_server_is_litter(tmp_path: Path) -> None:
    starter = starter_library()
    for name, hours in (("old", 25), ("young", 23)):
        (tmp_path / f".staging-{name}").mkdir()
        os.utime(tmp_path / f".staging-{name}", times=(time.time() - hours * 3600,) * 2)
    Library(tmp_path).add("mine", starter.grasp("tripod"), starter.contacts("tripod"))
    assert sorted(path.name for path in tmp_path.iterdir()) == [".staging-young", "mine"]
