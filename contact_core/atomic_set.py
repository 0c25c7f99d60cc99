"""Files that belong together, replaced as one: a folder holds all of the new set or all of the old one."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import tempfile
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

from contact_core.atomic_file import put_in_place
from contact_core.errors import FileRefused

_STAGING = ".contact-staging-"
_MACHINE = f"{_STAGING}{zlib.crc32(socket.gethostname().encode()):08x}-"  # locks of folders end at this machine
_STALE_S = 24 * 3600.0


@contextlib.contextmanager
def replacing_set(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """An empty staging folder inside `folder`; when the block ends without an error, its files replace those there.

    names: of all files of the set. The old ones stay as they are until the last of the new is on the disk; one
    that the new set lacks (a picture that nothing could draw) is gone afterwards. Whoever publishes at the same
    moment on this machine waits, so that two sets never mix; only a process killed between two renames leaves some
    of each, and two machines in a shared folder at one moment. The staging folder of a killed process is removed by
    the next on its machine, by others after a day. Raises FileRefused.
    """
    check_writable(folder, names)
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _exclusive(folder):
            stage = Path(tempfile.mkdtemp(prefix=_MACHINE, dir=folder))
            _remove_leftovers(folder, stage)
            in_use = _lock(stage, wait=False)
    except OSError as error:
        raise FileRefused(f"cannot write into {folder}: {error.strerror or error}.") from error
    untouched = True
    try:
        yield stage
        with _exclusive(folder):
            written = sorted(path.name for path in stage.iterdir())
            untouched = False
            for name in written:
                put_in_place(stage / name, folder / name)
            for name in set(names) - set(written):  # what an earlier run left would not belong to this set
                (folder / name).unlink(missing_ok=True)
    except FileRefused as error:  # in the words of the folder that was asked for
        raise FileRefused(str(error).replace(str(stage), str(folder))) from error
    except OSError as error:
        state = (
            "What was there before is untouched." if untouched else "Run it again: its files may be of two runs."
        )
        raise FileRefused(f"cannot write into {folder}: {error.strerror or error}. {state}") from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        _release(in_use)
        with contextlib.suppress(OSError):  # what was made for nothing goes; a folder that holds anything stays
            for place in made:
                place.rmdir()


def check_writable(folder: Path, names: Collection[str]) -> None:
    """Raises FileRefused when `names` cannot be written into `folder`: told before the work, not after it."""
    there = next(place for place in (folder, *folder.absolute().parents) if os.path.lexists(place))
    try:
        if not there.is_dir():
            raise FileRefused(f"cannot write into {folder}: {there} is not a folder. Name another folder.")
        if not os.access(there, os.W_OK | os.X_OK):
            raise FileRefused(f"cannot write into {folder}: {there} is read-only for you. Name another folder.")
        for name in names:
            if (folder / name).is_dir():
                raise FileRefused(
                    f"cannot write {folder / name}: it is a folder. Name another folder, or remove it."
                )
    except OSError as error:  # a server that is away
        raise FileRefused(f"cannot write into {folder}: {error.strerror or error}. Try it again later.") from error


def _remove_leftovers(folder: Path, mine: Path) -> None:
    """Remove the staging folders of processes that were killed. mine: made just now.

    One that is in use is locked by its process. No file system tells other machines of the locks of folders, so
    theirs go by age, by the clock of the server that dates them.
    """
    now = mine.stat().st_mtime
    for stage in folder.glob(_STAGING + "*"):
        if stage == mine:
            continue
        if not stage.name.startswith(_MACHINE):
            with contextlib.suppress(OSError):
                if now - stage.stat().st_mtime > _STALE_S:
                    shutil.rmtree(stage, ignore_errors=True)
            continue
        lock = _lock(stage, wait=False)
        if lock is not None:
            shutil.rmtree(stage, ignore_errors=True)
            _release(lock)


@contextlib.contextmanager
def _exclusive(folder: Path) -> Iterator[None]:
    """While this holds, nobody else is in here with the same folder, where the system can lock folders (POSIX)."""
    lock = _lock(folder, wait=True)
    try:
        yield
    finally:
        _release(lock)


def _lock(folder: Path, *, wait: bool) -> int | None:
    """The descriptor that holds the lock of a folder until it is closed, or its process dies.

    None where another process has it, and where folders cannot be locked: on Windows (each file is still replaced
    atomically) and on some network drives.
    """
    try:
        import fcntl
    except ImportError:
        return None
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        _release(handle)
        return None
    return handle


def _release(lock: int | None) -> None:
    if lock is not None:
        with contextlib.suppress(OSError):  # a server that is gone fails the closing, too
            os.close(lock)
