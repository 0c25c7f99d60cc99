"""Which files a job has read, and whether they are still what they were: what decides if a job is done again.

Nobody lists the files of an asset: a glTF names buffers, a URDF meshes, a stage layers. So the worker notes what
Python opens while the job runs (an audit hook, which costs a comparison for each file), and libraries that open
files themselves name theirs.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypedDict

from contact_core.cache import cache_directory

_CODE = {".py", ".pyc", ".so", ".pyd", ".dll", ".nbi", ".nbc"}  # the version of the program, not of the job
_WRITES = os.O_WRONLY | os.O_RDWR


class Input(TypedDict):
    """A file as a job read it. file: relative to the job's own file, where the drive is the same.

    size, changed, touched (ns): while all are the same the bytes are not read again. changed is what a copy may
    keep, and a clock that was set back may repeat; touched (POSIX) nobody can set. sha256: None for what was not
    there, CHANGING for what was written while the job ran, of which nobody knows what the job has read.
    """

    file: str
    sha256: str | None
    size: int
    changed: int
    touched: int


Stamp = tuple[int, int, int]
_FRESH_NS = 2_000_000_000
CHANGING = "changed while the job ran"
GONE: Stamp = (-1, -1, -1)  # of a file that is not there


class _Notes(threading.local):
    """What the job of this thread has opened; None outside a job."""

    read: dict[str, Stamp] | None = None
    written: set[str] | None = None


_notes = _Notes()
_installed = threading.Lock()
_is_installed = False


@contextmanager
def noting_files() -> Iterator[dict[str, Stamp]]:
    """Yields what holds, at the end, the real paths of the plain files that this thread has read inside, each with
    how it was when it was first opened.

    What was written inside, what belongs to Python or to the cache, and what is gone again, is left out.
    """
    _install()
    read, written, found = dict[str, Stamp](), set[str](), dict[str, Stamp]()
    _notes.read, _notes.written = read, written
    try:
        yield found
    finally:
        _notes.read = _notes.written = None
        own = set(map(os.path.realpath, written))
        for name, stamp in read.items():
            path = os.path.realpath(name)
            if path not in own and _is_input(path):
                found.setdefault(path, stamp)


class Clock:
    """The time by the clock that dates files: a server's, where results and inputs lie on one."""

    def __init__(self, folder: Path | None = None) -> None:
        """folder: results go there; its server is asked once, by a file that is made in it and removed."""
        self._ahead: dict[int, int] = {}
        for place in () if folder is None else (folder, *folder.absolute().parents):
            if place.is_dir():
                with suppress(OSError), tempfile.NamedTemporaryFile(prefix=".contact-clock-", dir=place) as made:
                    status = os.fstat(made.fileno())
                    self._ahead[status.st_dev] = status.st_mtime_ns - time.time_ns()
                break

    def now(self, path: str) -> int:
        """The time (ns) by which a file would be dated now; that of this machine where its server was not asked."""
        with suppress(OSError, ValueError):
            return time.time_ns() + self._ahead.get(Path(path).stat().st_dev, 0)
        return time.time_ns()


def as_read(
    paths: Iterable[str | Path],
    beside: Path,
    digests: Digests,
    opened: Mapping[str, Stamp] | None = None,
    clock: Clock | None = None,
) -> list[Input]:
    """The files as they are now, sorted by name. beside: the job's own file. opened: how they were when they were
    read, where that is known; one that is another now fits nothing, so that its job is done again. clock: that
    dates them."""
    clock = clock or Clock()
    found = []
    for path in sorted({os.path.realpath(path) for path in paths}):
        now = stamp_of(path)
        held = now == (opened or {}).get(path, now)
        size, changed, touched = now if held else GONE
        if touched > clock.now(path) - _FRESH_NS:  # a second change within the same tick leaves the same times
            touched = 0
        digest = digests.of(path) if held else CHANGING
        file = _relative(path, beside)
        found.append(Input(file=file, sha256=digest, size=size, changed=changed, touched=touched))
    return found


def first_change(inputs: Iterable[Mapping[str, Any]], beside: Path, digests: Digests) -> str | None:
    """The first file that is not what it was when the job read it; None where all are."""
    for known in inputs:
        path = os.path.normpath(beside.absolute().parent / known["file"])
        if stamp_of(path) == (known["size"], known["changed"], known.get("touched")) != GONE:
            continue
        if digests.of(path) != known["sha256"]:
            return path
    return None


class Digests:
    """SHA-256 of files, each read once for as long as it does not change."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, Stamp], str | None] = {}

    def of(self, path: str) -> str | None:
        """64 hex digits; None for what is no readable file."""
        key = (path, stamp_of(path))
        if key not in self._known:
            try:
                with Path(path).open("rb") as stream:
                    self._known[key] = hashlib.file_digest(stream, "sha256").hexdigest()
            except OSError:
                self._known[key] = None
        return self._known[key]


def stamp_of(path: str) -> Stamp:
    """Size, time of the last change and of the last touch (ns) of a file; -1 each for one that is not there."""
    try:
        status = Path(path).stat()
    except (OSError, ValueError):
        return GONE
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns


def _relative(path: str, beside: Path) -> str:
    try:
        return Path(os.path.relpath(path, beside.absolute().parent)).as_posix()
    except ValueError:  # another drive
        return path


def _install() -> None:
    """Audit hooks stay for the life of a process, so there is one."""
    global _is_installed
    with _installed:
        if not _is_installed:
            sys.addaudithook(_hear)
            _is_installed = True


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or _notes.read is None or _notes.written is None:
        return
    path, mode, flags = arguments
    if isinstance(path, bytes | os.PathLike):
        path = os.fsdecode(path)
    if not isinstance(path, str):  # a descriptor
        return
    writes = bool(flags & _WRITES) if isinstance(flags, int) else any(letter in str(mode) for letter in "wax+")
    if writes:
        _notes.written.add(path)
    elif path not in _notes.read:
        _notes.read[path] = stamp_of(path)


def _is_input(path: str) -> bool:
    if Path(path).suffix.lower() in _CODE or not Path(path).is_file():
        return False
    return not any(path.startswith(place + os.sep) for place in _elsewhere())


def _elsewhere() -> Iterator[str]:
    """Folders whose files are no inputs: Python's, the cache's, the system's."""
    yield from {os.path.realpath(sys.prefix), os.path.realpath(sys.base_prefix)}
    cache = cache_directory()
    if cache is not None:
        yield os.path.realpath(cache)
    yield from ("/proc", "/sys", "/dev", "/etc")
