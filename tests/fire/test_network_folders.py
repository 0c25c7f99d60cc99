"""What NFS, SMB and sshfs were seen to do (ADR 0112), done to the same code: CI has no such mount."""

from __future__ import annotations

import builtins
import errno
import io
import json
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from contact_core import atomic_file, atomic_set, mounts
from contact_core.atomic_file import is_there, read_bounded, write_atomic
from contact_core.atomic_set import check_writable, replacing_set
from contact_core.cache import cached_arrays
from contact_core.document import lock
from contact_core.document.lock import DocumentLock
from contact_core.document.schema import parse_document
from contact_core.edit import journal
from contact_core.edit.commands import SetExtra
from contact_core.edit.journal import Journal
from contact_core.edit.journal_file import read_journal
from contact_core.edit.recovery import journal_path
from contact_core.errors import FileRefused
from contact_core.farm import batch, inputs, workers
from contact_core.farm.batch import BatchSettings, run_batch
from contact_core.farm.inputs import Clock, Digests, as_read
from contact_core.farm.task import RECEIPT, Result, Task, _held, sealed_receipt
from contact_core.farm.workers import NoWorkers
from contact_core.library.shelf import Library
from contact_core.library.starter import starter_library
from contact_core.mounts import Mount, mount_of
from contact_core.progress import CallbackProgress
from contact_core.session import Session

SSHFS = Mount("fuse.sshfs", frozenset({"rw"}))
NFS = Mount("nfs4", frozenset({"rw", "vers=4.2", "local_lock=none"}))
posix = pytest.mark.skipif(sys.platform == "win32", reason="mounts are those of Linux")


def no_error(*_: Any) -> None:
    """In place of what would raise."""


def failing(number: int, times: int, then: Callable[..., Any] = no_error) -> Callable[..., Any]:
    """A function that raises OSError `times` times, and then does `then`."""
    left = iter(range(times))

    def call(*arguments: Any, **named: Any) -> Any:
        if next(left, None) is not None:
            raise OSError(number, os.strerror(number))
        return then(*arguments, **named)

    return call


# -- what other machines appended ---------------------------------------------------------------------------------


@pytest.fixture
def old_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[Path, int]:
    """Sizes that the system remembers of files: ordinary readings end there."""
    if not hasattr(os, "O_DIRECT"):
        pytest.skip("no readings past the caches here")
    (tmp_path / "probe").write_text("x")
    if atomic_file._read_past_caches(tmp_path / "probe", 10) != b"x":
        pytest.skip("this file system reads through its caches alone")
    sizes: dict[Path, int] = {}

    def cut(path: Any, *arguments: Any, **named: Any) -> Any:
        stream = builtins.open(path, *arguments, **named)  # noqa: PTH123, SIM115
        return stream if Path(path) not in sizes else Cut(stream, sizes[Path(path)])

    monkeypatch.setattr(atomic_file, "open", cut, raising=False)
    monkeypatch.setattr(atomic_file, "mount_of", lambda _: SSHFS)
    return sizes


class Cut:
    """A stream that ends where the system believes that its file does."""

    def __init__(self, stream: io.BufferedReader, size: int) -> None:
        self._stream, self._size = stream, size

    def __enter__(self) -> Cut:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def fileno(self) -> int:
        return self._stream.fileno()

    def read(self) -> bytes:
        return self._stream.read(self._size)


def test_an_old_size_cuts_no_file(tmp_path: Path, old_sizes: dict[Path, int]) -> None:
    path, content = tmp_path / "file", os.urandom(3_000_001)
    for size in (0, 1, 4096, len(content), len(content) + 5):
        path.write_bytes(content)
        old_sizes[path] = size
        assert read_bounded(path, len(content)) == content
    with pytest.raises(FileRefused, match="bytes; more than 2000000 are refused"):
        read_bounded(path, 2_000_000)
    path.write_bytes(b"")
    assert read_bounded(path, 10) == b""


def test_edits_of_another_machine_that_crashed_are_all_recovered(
    tmp_path: Path, old_sizes: dict[Path, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """This one had looked at document and journal some edits before."""
    theirs, ours = tmp_path / "theirs.json", tmp_path / "ours.json"
    session = Session.open(theirs, discover=False)
    for number in range(30):
        session.do(SetExtra(f"x{number}", "y" * 50))
        if number in (5, 20):
            session.save()
        if number == 10:
            old_sizes |= {ours: theirs.stat().st_size, journal_path(ours): journal_path(theirs).stat().st_size}
    ours.write_bytes(theirs.read_bytes())
    journal_path(ours).write_bytes(journal_path(theirs).read_bytes())
    session.close(discard=True)
    end = os.lseek
    monkeypatch.setattr(journal.os, "lseek", lambda file, *how: end(file, *how) // 2)
    with Session.open(ours, discover=False) as opened:
        assert set(opened.document.extras) == {f"x{number}" for number in range(30)}
        monkeypatch.undo()
        opened.do(SetExtra("more", 1))
    with Session.open(ours, discover=False) as again:  # nothing was written over the middle of the journal
        assert set(again.document.extras) == {*(f"x{number}" for number in range(30)), "more"}
    assert not list(tmp_path.glob("*damaged*")) and not list(tmp_path.glob("*unused*"))


def test_no_line_is_written_over_others_where_the_system_takes_the_journal_for_shorter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("a", 1))
        contents = read_journal(journal_path(path))
    with monkeypatch.context() as old:
        old.setattr(journal.os, "lseek", lambda *_: contents.length - 1)
        assert Journal.resume(journal_path(path), contents) is None
    resumed = Journal.resume(journal_path(path), read_journal(journal_path(path)))
    assert resumed is not None
    resumed.close(record=False)


# -- files that others have open, or replace -----------------------------------------------------------------------


def test_a_file_that_is_replaced_while_it_is_read_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("new")
    monkeypatch.setattr(atomic_file, "open", failing(errno.ESTALE, 2, builtins.open), raising=False)
    assert read_bounded(tmp_path / "file", 10) == b"new"
    monkeypatch.setattr(atomic_file, "open", failing(errno.ESTALE, 99, builtins.open), raising=False)
    with pytest.raises(FileRefused, match=f"cannot read .*file: {os.strerror(errno.ESTALE)}"):
        read_bounded(tmp_path / "file", 10)


@pytest.mark.parametrize("number", [errno.EBUSY, errno.EEXIST, errno.ETXTBSY])
def test_who_reads_a_file_keeps_nobody_from_replacing_it(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, names = tmp_path / "file", ("pose", "report")
    write_atomic(target, "old")
    monkeypatch.setattr(Path, "replace", failing(number, 3, Path.replace))
    write_atomic(target, "new")
    assert target.read_text() == "new"
    monkeypatch.undo()
    monkeypatch.setattr(Path, "replace", failing(number, 1, Path.replace))
    with replacing_set(tmp_path / "set", names) as stage:
        for name in names:
            (stage / name).write_text(name)
    assert {path.name for path in (tmp_path / "set").iterdir()} == set(names)
    monkeypatch.undo()
    monkeypatch.setattr(Path, "replace", failing(number, 9999, Path.replace))
    monkeypatch.setattr(atomic_file, "_PATIENCE_S", 0.05)
    with pytest.raises(FileRefused, match="What was there before is untouched"):
        write_atomic(target, "newer")
    assert target.read_text() == "new"


# -- locks that other machines do not see --------------------------------------------------------------------------


def named_by(path: Path, host: str) -> Path:
    """A lock file as a session on a host has it, or left it when it crashed."""
    file = path.with_name(path.name + ".lock")
    who = {"process": 4711, "host": host, "user": "ada", "since": "2026-01-02 03:04:05"}
    file.write_text(json.dumps(who))
    return file


def test_where_locks_end_at_the_machine_the_lock_file_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "document.json"
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("a", 1))
        session.save()
    monkeypatch.setattr(lock, "mount_of", lambda _: SSHFS)
    file = named_by(path, "another-machine")
    with Session.open(path, discover=False) as session:
        assert session.read_only and dict(session.document.extras) == {"a": 1}
        assert "process 4711 of ada on another-machine since 2026-01-02 03:04:05" in session.notes[0]
        assert "delete that file where nobody there has it open any more" in session.notes[0]
    assert json.loads(file.read_text())["host"] == "another-machine"
    file.unlink()  # as the sentence says
    for host in (None, socket.gethostname()):  # what a crash on this machine left keeps nobody out
        if host is not None:
            named_by(path, host)
        with Session.open(path, discover=False) as session:
            assert not session.read_only
    monkeypatch.setattr(lock, "mount_of", lambda _: NFS)  # here the server knows better than the file
    named_by(path, "another-machine")
    with Session.open(path, discover=False) as session:
        assert not session.read_only


@posix
def test_mounts_are_told_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = tmp_path / "mountinfo"
    rows = {
        40: "fuse.sshfs ada@server:/show rw,user_id=0",
        41: "nfs4 server:/show rw,vers=4.2,local_lock=none",
        42: "nfs server:/show rw,vers=3,nolock,local_lock=all",
        43: "cifs //server/show rw,vers=3.1.1",
        44: "cifs //server/show rw,vers=3.1.1,nobrl",
        45: "fuse.glusterfs server:show rw",
        46: "tmpfs tmpfs rw",
    }
    text = "".join(f"{n} 1 0:{n} / /mnt/a\\040b rw,relatime shared:9 - {what}\n" for n, what in rows.items())
    table.write_text(f"x\n - \n{text}")
    monkeypatch.setattr(mounts, "_TABLE", table)

    def seen(device: int) -> Mount | None:
        return mount_of(os.stat_result((0o100644, 1, device, 1, 0, 0, 0, 0, 0, 0)))

    found = {number: seen(os.makedev(0, number)) for number in rows}
    assert [number for number, mount in found.items() if mount is not None and mount.is_shared] == [*range(40, 46)]
    assert [number for number, mount in found.items() if mount is not None and mount.keeps_locks] == [40, 42, 44]
    assert seen(os.makedev(8, 40)) is None and seen(os.makedev(0, 99)) is None
    table.unlink()
    assert seen(os.makedev(0, 40)) is None


# -- servers that go away ------------------------------------------------------------------------------------------


def test_a_server_that_does_not_answer_makes_no_new_document(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, look = tmp_path / "document.json", Path.stat
    with Session.open(path, discover=False) as session:
        session.do(SetExtra("a", 1))
        session.save()
    gone = failing(errno.EIO, 9999)
    monkeypatch.setattr(Path, "stat", lambda p, **how: (gone if p.name.startswith(path.name) else look)(p, **how))
    for act in (lambda: Session.open(path, discover=False), lambda: is_there(path)):
        with pytest.raises(FileRefused, match="cannot look at"):
            act()
    monkeypatch.undo()
    assert dict(parse_document(path.read_bytes()).extras) == {"a": 1}
    assert is_there(path) and not is_there(tmp_path / "none") and not is_there(path / "within a file")


def test_a_session_goes_on_where_the_server_is_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "document.json"
    session = Session.open(path, discover=False)
    session.do(SetExtra("before", 1))
    with monkeypatch.context() as gone:
        for call in ("write", "ftruncate"):
            gone.setattr(journal.os, call, failing(errno.EIO, 9999))
        for _ in range(2):
            with pytest.raises(FileRefused, match="until the document is saved: here, once the disk answers"):
                session.do(SetExtra("meanwhile", 1))
    with pytest.raises(FileRefused, match="until the document is saved"):
        session.do(SetExtra("before it is saved", 1))
    session.save()
    session.do(SetExtra("after", 1))
    copy = tmp_path / "copy.json"  # as it lies there at this moment
    copy.write_bytes(path.read_bytes())
    journal_path(copy).write_bytes(journal_path(path).read_bytes())
    with Session.open(copy, discover=False) as opened:
        assert set(opened.document.extras) == {"before", "after"}
        opened.undo()
        opened.undo()
        assert not opened.document.extras
    session.close()


def test_a_lock_on_a_server_that_is_gone_is_let_go_without_a_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "document.json"
    with monkeypatch.context() as gone:
        gone.setattr(lock.os, "ftruncate", failing(errno.EIO, 1))
        assert "cannot be written" in str(DocumentLock.take(path))
    held = DocumentLock.take(path)
    assert isinstance(held, DocumentLock)
    with monkeypatch.context() as gone:
        gone.setattr(lock.os, "ftruncate", failing(errno.EIO, 1))
        held.release()
    again = DocumentLock.take(path)
    assert isinstance(again, DocumentLock)
    again.release()


@pytest.fixture
def jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Three jobs, and a batch that waits for hundredths of what it waits for elsewhere."""
    paths = [tmp_path / "jobs" / f"job{number}.json" for number in range(3)]
    for path in paths:
        with Session.open(path, discover=False) as session:
            session.save()
    monkeypatch.setattr(batch, "_PAUSE_S", 0.01)
    monkeypatch.setattr(batch, "_LOOK_S", 0.01)
    return paths


class Server:
    """Where results go: it does not answer until it was asked `left` times; jobs need it."""

    def __init__(self, left: int, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.left, self.number, self._make = left, number, tempfile.NamedTemporaryFile
        monkeypatch.setattr(batch.tempfile, "NamedTemporaryFile", self.make)
        monkeypatch.setattr(workers, "perform", self.perform)

    def make(self, *arguments: Any, **named: Any) -> Any:
        self.left -= 1
        if self.left >= 0:
            raise OSError(self.number, os.strerror(self.number))
        return self._make(*arguments, **named)

    def perform(self, task: Task) -> Result:
        folder = Path(task.folder)
        if self.left > 0:
            return Result(task.name, "failed", f"cannot write into {folder}.", again=True, worker="here")
        result = Result(task.name, "done", worker="here")
        write_atomic(folder / RECEIPT, sealed_receipt(task.key, task.kind, [], asdict(result)))
        return result


def test_a_batch_waits_for_a_server_and_no_job_pays_for_it(
    tmp_path: Path, jobs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    server, told = Server(7, errno.EIO, monkeypatch), list[str]()
    progress = CallbackProgress(lambda fraction, text: told.append(text))
    once = BatchSettings(retries=0)
    result = run_batch(jobs, tmp_path / "out", once, workers=NoWorkers(), progress=progress)
    assert [(each.state, each.attempts) for each in result.results] == [("done", 1)] * 3
    assert server.left < 0 and any("out, which does not answer" in text for text in told)


def test_a_server_that_stays_away_ends_the_batch_with_a_sentence_and_a_report(
    tmp_path: Path, jobs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    Server(10**9, errno.ENOTCONN, monkeypatch)
    monkeypatch.setattr(batch, "_AWAY_S", 0.1)
    with pytest.raises(FileRefused, match="out did not answer for"):
        run_batch(jobs, tmp_path / "out", workers=NoWorkers())
    assert json.loads((tmp_path / "out" / "batch.json").read_text())["counts"]["stopped"] == 3


def test_nobody_waits_for_a_full_disk(tmp_path: Path, jobs: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    Server(10**9, errno.ENOSPC, monkeypatch)
    result = run_batch(jobs, tmp_path / "out", BatchSettings(retries=1), workers=NoWorkers())
    assert [(each.state, each.attempts) for each in result.results] == [("failed", 2)] * 3


def test_a_folder_of_results_that_does_not_answer_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "is_dir", failing(errno.ECONNREFUSED, 1, Path.is_dir))
    with pytest.raises(FileRefused, match=r"cannot write into .*Try it again later"):
        check_writable(tmp_path, ("pose",))
    check_writable(tmp_path, ("pose",))


def test_what_is_let_go_of_on_a_server_that_is_gone_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """fsync, close and unlink fail there, too."""
    path, close = tmp_path / "document.json", os.close
    session = Session.open(path, discover=False)
    session.do(SetExtra("a", 1))
    with monkeypatch.context() as gone, pytest.raises(FileRefused, match="the disk under"):
        gone.setattr(journal.os, "fsync", failing(errno.EIO, 99))
        gone.setattr(journal.os, "close", lambda file: close(file) or failing(errno.EIO, 1)())
        session.close()
    with Session.open(path, discover=False) as again:
        assert dict(again.document.extras) == {"a": 1}
    with monkeypatch.context() as gone, pytest.raises(FileRefused, match="untouched"):
        gone.setattr(atomic_file.os, "fsync", failing(errno.EIO, 1))
        gone.setattr(Path, "unlink", failing(errno.EIO, 1))
        write_atomic(tmp_path / "file", "new")

    class System:
        """The module os, where every file that is closed fails."""

        def __getattr__(self, name: str) -> Any:
            return getattr(os, name)

        def close(self, file: int) -> None:
            close(file)
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(atomic_set, "os", System())
    with replacing_set(tmp_path / "set", ("pose",)) as stage:
        (stage / "pose").write_text("new")
    assert (tmp_path / "set" / "pose").read_text() == "new"


def test_a_cache_on_a_server_that_is_away_stands_in_nobodys_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is remembered to be there, and nothing in it can be looked at."""
    monkeypatch.setenv("CONTACT_CACHE", str(tmp_path))
    look = Path.stat
    gone = failing(errno.EIO, 9999)
    monkeypatch.setattr(Path, "stat", lambda p, **how: (gone if p.suffix == ".npz" else look)(p, **how))
    assert cached_arrays("kind", "key", lambda: {"x": np.arange(3)})["x"].tolist() == [0, 1, 2]


def test_a_new_document_where_no_locks_are_to_be_had_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lock, "_try_lock", failing(errno.ENOLCK, 1))
    with pytest.raises(FileRefused, match=f"cannot begin .*{os.strerror(errno.ENOLCK)}.*nobody can tell"):
        Session.open(tmp_path / "document.json", discover=False)


# -- folders of grasps and of results ------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [errno.EPERM, errno.EEXIST, errno.EACCES])
def test_many_machines_fill_a_shelf_whatever_a_taken_number_is_called(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """sshfs says EPERM, SMB EEXIST; and sshfs lists a folder as it was 20 s ago."""
    starter, rename, versions = starter_library(), Path.rename, Library.versions
    grasp, contacts = starter.grasp("tripod"), starter.contacts("tripod")

    def refusing(path: Path, target: Path) -> Path:
        if target.exists():
            raise OSError(number, os.strerror(number))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refusing)
    monkeypatch.setattr(Library, "versions", lambda shelf, name: ())
    with ThreadPoolExecutor(4) as pool:
        saved = list(pool.map(lambda _: Library(tmp_path).add("b", grasp, contacts, replace=True), range(12)))
    monkeypatch.setattr(Library, "versions", versions)
    assert sorted(saved) == [*range(1, 13)] == list(Library(tmp_path).versions("b"))
    monkeypatch.setattr(Path, "rename", failing(number if number != errno.EEXIST else errno.EROFS, 9))
    with pytest.raises(FileRefused, match="cannot write into"):
        Library(tmp_path).add("b", grasp, contacts, replace=True)


def test_the_unfinished_results_of_another_machine_stay_for_a_day(tmp_path: Path) -> None:
    for name, hours in (("0badcafe-young", 23), ("0badcafe-old", 25)):
        (tmp_path / f".contact-staging-{name}").mkdir()
        os.utime(tmp_path / f".contact-staging-{name}", times=(time.time() - 3600 * hours,) * 2)
    with replacing_set(tmp_path, ("pose",)) as stage:
        (stage / "pose").write_text("new")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".contact-staging-0badcafe-young", "pose"]


# -- servers whose clock is another --------------------------------------------------------------------------------


@pytest.fixture(params=[-3600, 3600, 0])
def server(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Files are dated by a clock that is an hour behind or ahead; yields by how much, in ns."""
    ahead, look = request.param * 10**9, inputs.stamp_of

    def dated(path: str) -> inputs.Stamp:
        size, changed, touched = look(path)
        return size, changed + ahead, touched + ahead

    class System:
        """The module os, by the clock of the server."""

        def __getattr__(self, name: str) -> Any:
            return getattr(os, name)

        def fstat(self, file: int) -> Any:
            status = os.fstat(file)
            return SimpleNamespace(st_dev=status.st_dev, st_mtime_ns=status.st_mtime_ns + ahead)

    monkeypatch.setattr(inputs, "stamp_of", dated)
    monkeypatch.setattr("contact_core.farm.task.stamp_of", dated)
    monkeypatch.setattr(inputs, "os", System())
    yield ahead


@posix
def test_what_was_written_while_a_job_ran_is_told_by_the_clock_of_the_server(tmp_path: Path, server: int) -> None:
    before, during = tmp_path / "before.usd", tmp_path / "during.usd"
    before.write_text("old")
    os.utime(before, times=(time.time() - 9,) * 2)
    time.sleep(0.1)
    clock, start = Clock(tmp_path / "out"), time.monotonic_ns()
    during.write_text("new")
    held = _held([str(before), str(during)], time.monotonic_ns() - start, clock)
    assert [*held] == [str(during)]
    assert [*tmp_path.iterdir()] and not list(tmp_path.glob(".contact-clock*"))


@posix
def test_what_was_touched_just_now_is_not_believed_by_its_times(tmp_path: Path, server: int) -> None:
    path = tmp_path / "asset.glb"
    path.write_text("asset")
    fresh = as_read([path], tmp_path / "job.json", Digests(), clock=Clock(tmp_path))
    assert [known["touched"] for known in fresh] == [0]
