"""Atomic writes and bounded reads: a reader sees the old file or the new one, a full disk keeps the old one, and a
hostile file does not fill the memory."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import stat
import zlib
from collections.abc import Iterator
from pathlib import Path

from contact_core.errors import FileRefused


def read_bounded(path: Path | str, max_bytes: int) -> bytes:
    """The bytes of a plain file of at most `max_bytes`. Raises FileRefused for any other."""
    check_no_null(path)
    try:
        with open(path, "rb", opener=_open_nonblocking) as stream:  # the only one with an opener
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise FileRefused(f"cannot read {path}: it is not a plain file.")
            if status.st_size > max_bytes:
                raise FileRefused(f"{path} has {status.st_size} bytes; more than {max_bytes} are refused.")
            return stream.read()
    except OSError as error:
        raise FileRefused(f"cannot read {path}: {error.strerror or error}.") from error


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
        temporary.unlink(missing_ok=True)


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
    temporary.replace(target)
    with contextlib.suppress(OSError):  # not every system opens folders, nor flushes them
        folder = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _open_nonblocking(path: str, flags: int) -> int:
    """Opening a pipe that nobody writes to waits for ever otherwise."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
