"""A full disk and a folder that may not be written: the old file stands, a sentence says so, nothing is left."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import contact_core as contact
from contact_builtins.formats.gltf import GltfFiles
from contact_builtins.renderers.png import write_png
from contact_core.cache import cached_arrays
from contact_core.document.library import load_contact_set, save_contact_set
from contact_core.edit.commands import SetExtra
from contact_core.edit.operation_log import OperationLog
from contact_core.edit.recovery import write_document
from contact_core.errors import ContactError
from contact_core.farm.task import RECEIPT, Task, perform, read_receipt
from contact_core.film.movie import write_movie
from contact_core.library.shelf import Library
from contact_core.library.starter import starter_library
from contact_core.rig.pose_files import save_pose
from contact_core.scene.memory_host import MemoryHost
from contact_core.scene.memory_scene import save_scene
from contact_core.session import Session
from contact_core.testing import meshes
from contact_core.testing.format_contract import bar, bent

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits and permissions of POSIX")
BALL = contact.Asset("ball", meshes.icosphere(2))
Write = Callable[[Path, int], Any]  # into a folder, content of the first or the second time


@contextlib.contextmanager
def full_disk(folder: Path) -> Iterator[None]:
    """No file grows beyond a few bytes, as on a disk that has just filled up."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextlib.contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Nobody may write into the folders; an administrator, who may all the same, becomes nobody for the while."""
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    for each in folders:
        each.chmod(0o555)
    is_root = os.geteuid() == 0
    if is_root:
        os.setresuid(65534, 65534, 0)
    try:
        yield
    finally:
        if is_root:
            os.setresuid(0, 0, 0)
        for each in folders:
            each.chmod(0o755)


@dataclass(frozen=True)
class Frozen:
    """What lies in a folder: every file with its bytes; lock files, which stay where they are, aside."""

    files: dict[str, bytes]

    @classmethod
    def of(cls, folder: Path) -> Frozen:
        found = sorted(path for path in folder.rglob("*") if path.suffix != ".lock")
        return cls({str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b"" for path in found})


def _document(folder: Path, time: int) -> None:
    with contact.new(ball=BALL.mesh) as session:
        session.set_extra("time", time)
        write_document(folder / "a.json", session.document)


def _saved(folder: Path, time: int) -> None:
    """Through a session, with its lock and its journal."""
    with Session.open(folder / "a.json", discover=False) as session:
        session.do(SetExtra("time", time))
        session.save()


def _set(folder: Path, time: int) -> None:
    save_contact_set(load_contact_set(starter_library().path_of("tripod") / "contacts.json"), folder / "set.json")


def _scene(folder: Path, time: int) -> None:
    host = MemoryHost()
    host.add(BALL)
    save_scene(host.scene, folder / "a.contactscene")


def _grasp(folder: Path, time: int) -> None:
    starter = starter_library()
    Library(folder).add("tripod", starter.grasp("tripod"), starter.contacts("tripod"), replace=time > 0)


def _usd(folder: Path, time: int) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from contact_usd.files import UsdFiles

    UsdFiles().write(folder / "a.usda", [bar()], {"bar": bent()})


def _operations(folder: Path, time: int) -> None:
    with contact.new(ball=BALL.mesh) as session:
        OperationLog(session).write(folder / "operations.json")


def _movie(suffix: str) -> Write:
    def write(folder: Path, time: int) -> None:
        pytest.importorskip(
            {".gif": "PIL", ".webm": "av"}[suffix], reason="what makes such movies is not installed"
        )
        with contact.new(ball=BALL.mesh) as session:
            write_movie(session, [0.0, 1.0], folder / f"a{suffix}", size=(64, 48))

    return write


WRITERS: dict[str, Write] = {
    "document": _document,
    "session": _saved,
    "contact set": _set,
    "library": _grasp,
    "pose": lambda folder, _: save_pose(folder / "pose.json", bent(), rig="bar"),
    "scene": _scene,
    "glb": lambda folder, _: GltfFiles().write(folder / "a.glb", [bar()], {"bar": bent()}),
    "usd": _usd,
    "picture": lambda folder, time: write_png(np.full((64, 64, 3), time, np.uint8), folder / "a.png"),
    "operations": _operations,
    "gif": _movie(".gif"),
    "webm": _movie(".webm"),
}


@pytest.fixture
def folder() -> Iterator[Path]:
    """One that everybody could reach, unlike those of pytest."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        inside = Path(name) / "folder"
        inside.mkdir()
        yield inside


@pytest.mark.parametrize("trouble", [full_disk, read_only])
@pytest.mark.parametrize("name", WRITERS)
def test_what_was_there_stands_and_a_sentence_says_so(
    name: str, trouble: Any, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, elsewhere = WRITERS[name], folder.parent / f"{folder.name}-temporary"
    elsewhere.mkdir()
    elsewhere.chmod(0o777)
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    write(folder, 0)
    before = Frozen.of(folder)
    with trouble(folder), pytest.raises(ContactError) as refusal:
        write(folder, 1)
    assert len(str(refusal.value).split()) >= 4 and "Traceback" not in str(refusal.value)
    after = Frozen.of(folder)
    assert set(after.files.values()) >= set(before.files.values())  # a journal that has ended may have moved
    assert {name for name in after.files if ".journal" not in name} == {
        n for n in before.files if ".journal" not in n
    }
    assert not list(elsewhere.iterdir())
    write(folder, 1)  # there is room again


@pytest.mark.parametrize("trouble", [full_disk, read_only])
def test_a_cache_without_room_is_no_trouble(trouble: Any, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CONTACT_CACHE", str(folder))
    with trouble(folder):
        made = cached_arrays("kind", "key", lambda: {"x": np.arange(1000)})
    assert made["x"].sum() == 499_500 and not [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("trouble", [full_disk, read_only])
def test_a_job_without_room_has_no_receipt_and_is_tried_again(
    trouble: Any, folder: Path, makers: ModuleType
) -> None:
    """Results of before stand until new ones are whole; without a receipt they count for nothing."""
    (path,) = makers.write_jobs(folder / "jobs", 1)
    task = Task("job", "document", str(path), str(folder / "out"), "key")
    assert perform(task).state == "done"
    results = {each.name: each.read_bytes() for each in (folder / "out").iterdir() if each.name != RECEIPT}
    with trouble(folder):
        result = perform(task)
    assert result.state == "failed" and result.sentence.startswith("cannot write") and result.again
    assert {each.name: each.read_bytes() for each in (folder / "out").iterdir() if each.name != RECEIPT} == results
    assert perform(task).state == "done" and read_receipt(folder / "out") is not None


@pytest.fixture
def makers(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The makers of jobs of the farm's tests; test folders are no packages."""
    import importlib.util

    path = Path(__file__).parents[1] / "core" / "farm" / "conftest.py"
    spec = importlib.util.spec_from_file_location("farm_makers", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
