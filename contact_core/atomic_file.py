"""Atomic writes and bounded reads: a reader sees the old file or the new one, a full disk keeps the old one, and a
hostile file does not fill the memory."""

from __future__ import annotations

import contextlib
import errno
import mmap
import os
import re
import secrets
import stat
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

from contact_core.errors import FileRefused
from contact_core.mounts import mount_of

_ATTEMPTS = 5  # at a file that other machines go on replacing
_PATIENCE_S = 2.0  # for whoever reads a file at the moment at which it is replaced
_BUSY = {errno.EBUSY, errno.ETXTBSY, errno.EEXIST}  # what SMB says where somebody has the file open
_BUSY_WINDOWS = {5, 32}  # access denied, sharing violation
_PIECE = 1 << 20


def read_bounded(path: Path | str, max_bytes: int) -> bytes:
    """The bytes of a plain file of at most `max_bytes`, as it is now: on a folder that other machines write, too.

    Raises FileRefused for any other.
    """
    check_no_null(path)
    for attempt in range(_ATTEMPTS):
        try:
            return _read(path, max_bytes)
        except OSError as error:
            if error.errno != errno.ESTALE or attempt == _ATTEMPTS - 1:
                raise FileRefused(f"cannot read {path}: {error.strerror or error}.") from error
    raise AssertionError  # the last attempt returns or raises


def _read(path: Path | str, max_bytes: int) -> bytes:
    """As read_bounded. Raises OSError; ESTALE where another machine replaced the file while it was read (NFS)."""
    with open(path, "rb", opener=_open_nonblocking) as stream:  # the only one with an opener
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise FileRefused(f"cannot read {path}: it is not a plain file.")
        mount = mount_of(status)
        data = _read_past_caches(path, max_bytes) if mount is not None and mount.is_shared else None
        size = status.st_size if data is None else len(data)
        if size > max_bytes:
            raise FileRefused(f"{path} has {size} bytes; more than {max_bytes} are refused.")
        return stream.read() if data is None else data


def _read_past_caches(path: Path | str, max_bytes: int) -> bytes | None:
    """The bytes that the server of a network folder has, at most one more than `max_bytes`; None where no such
    reading is possible.

    FUSE mounts (sshfs, SMB, object stores, shares of virtual machines) remember the size of a file for up to 20 s,
    and the system cuts every reading there: what another machine has appended to a journal would be missing, and
    nobody would know.
    """
    if not hasattr(os, "O_DIRECT"):
        return None
    try:
        file = os.open(path, os.O_RDONLY | os.O_DIRECT | os.O_NONBLOCK)
    except OSError as error:
        if error.errno == errno.ESTALE:
            raise
        return None
    parts, total = [], 0
    try:
        with mmap.mmap(-1, _PIECE) as piece:  # its start and length suit every file system
            while total <= max_bytes and (count := os.readv(file, [piece])) > 0:
                parts.append(piece[:count])
                total += count
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
        return None
    finally:
        os.close(file)
    return b"".join(parts)


def is_there(path: Path) -> bool:
    """Whether a path names anything. Raises FileRefused where the system cannot tell: a server that does not answer
    is no reason to take a document for a new one, or to write over it."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        if error.errno == errno.ELOOP:
            return False
        raise FileRefused(f"cannot look at {path}: {error.strerror or error}.") from error
    except ValueError:  # a null character
        return False
    return True


def check_no_null(path: Path | str) -> None:
    """Raises FileRefused where a path holds what the system raises a ValueError about, and no OSError."""
    if "\0" in str(path):
        raise FileRefused(f"no name of a file holds a null character, but got {str(path)!r}; leave it out.")


def write_atomic(path: Path | str, data: bytes | str) -> None:
    """Write a file (text as UTF-8) atomically: a temporary file beside it, fsync, rename. Raises FileRefused."""
    with replacing(path) as temporary:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)


@contextlib.contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """A temporary path beside `path`, of the same suffix; when the block ends without an error, it replaces `path`.

    For libraries that insist on writing files by name. A link stays a link, and a file that is replaced keeps its
    permissions. Raises FileRefused when the folder cannot be written.
    """
    path = Path(path)
    check_no_null(path)
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f"{_prefix(target)}{secrets.token_hex(6)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except OSError as error:
        raise FileRefused(f"cannot write into {path.parent}: {error.strerror or error}.") from error
    try:
        yield temporary
        _commit(temporary, target)
    except OSError as error:
        raise FileRefused(
            f"cannot write {path}: {error.strerror or error}. What was there before is untouched."
        ) from error
    finally:
        with contextlib.suppress(OSError):  # a server that is gone: the next writer removes it
            temporary.unlink(missing_ok=True)


def put_in_place(source: Path, target: Path) -> None:
    """Rename a file over another, waiting a moment for those who read it: Windows and SMB replace no file that
    somebody has open, and readers of ours are soon done. Raises OSError."""
    end = time.monotonic() + _PATIENCE_S
    while True:
        try:
            source.replace(target)
            return
        except OSError as error:
            busy = error.errno in _BUSY or getattr(error, "winerror", None) in _BUSY_WINDOWS
            if not busy or target.is_dir() or time.monotonic() > end:
                raise
        time.sleep(0.02)


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files of writers of `path` that were killed. Only for who has the right to write it:
    the temporary file of a writer that still runs looks the same."""
    pattern = re.compile(re.escape(_prefix(path)) + "[0-9a-f]{12}" + re.escape(path.suffix))
    with contextlib.suppress(OSError):  # litter is no reason not to open a document
        for entry in os.scandir(path.parent):
            if pattern.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                Path(entry.path).unlink()


def _prefix(target: Path) -> str:
    """How the names of temporary files begin. Long names are cut; the checksum tells them apart."""
    return f".{target.name[:40]}.{zlib.crc32(os.fsencode(target.name)):08x}"


def _commit(temporary: Path, target: Path) -> None:
    """Bytes to the disk, then the name, then the folder that holds the name."""
    with temporary.open("rb+") as stream:
        os.fsync(stream.fileno())
    if target.is_file():
        temporary.chmod(stat.S_IMODE(target.stat().st_mode))
    put_in_place(temporary, target)
    with contextlib.suppress(OSError):  # not every system opens folders, nor flushes them
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _open_nonblocking(path: str, flags: int) -> int:
    """Opening a pipe that nobody writes to waits for ever otherwise."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
