"""Clocks that differ between the machines of a studio."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from contact_core.document.library import ContactSet
from contact_core.errors import FileRefused
from contact_core.library import shelf
from contact_core.library.shelf import Library
from contact_core.library.starter import starter_library


def test_a_clock_that_is_days_ahead_makes_no_half_grasp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another machine takes what is being written for litter of last week, between two of its files."""
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
    with pytest.raises(FileRefused, match="whose clock is a day ahead"):
        Library(tmp_path).add("mine", grasp, contacts)
    assert [path.name for path in tmp_path.iterdir()] == ["theirs"]
    assert Library(tmp_path).add("mine", grasp, contacts) == 1
