"""What readers tell of the files that are opened is told by the session of the application, too."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("vtkmodules")

from contact_core.plugins.manager import PluginManager
from contact_viewer import files

LINKS = "".join(
    f'<link name="{name}"><visual><geometry>{shape}</geometry></visual></link>'
    for name, shape in (("a", '<box size="1 1 1"/>'), ("b", '<mesh filename="gone.obj"/>'))
)


def test_what_is_missing_in_a_file_that_is_opened_is_told(tmp_path: Path) -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
    (tmp_path / "robot.urdf").write_text(f'<robot name="r">{LINKS}{joint}</robot>')
    session = files.open_files([str(tmp_path / "robot.urdf")], PluginManager())
    assert any("gone.obj of b" in note and note.startswith("robot: ") for note in session.notes)


def test_of_samples_nothing_is_told() -> None:
    assert files.open_files((), PluginManager()).notes == ()
