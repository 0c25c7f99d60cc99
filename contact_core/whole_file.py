"""Files written whole or not at all: a reader never sees half a file, a full disk never eats the old one."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from contact_core.errors import FileRefused


def write_whole(path: Path | str, data: bytes | str) -> None:
    """Write a file (text as UTF-8) by a temporary neighbour, fsync and rename. Raises FileRefused."""
    with replacing(path) as temporary:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)


@contextlib.contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """A temporary path beside `path`, of the same suffix; whoever fills it without an error has replaced `path`.

    For libraries that insist on writing files by name. Raises FileRefused when the folder cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name[:40]}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise FileRefused(f"cannot write into {path.parent}: {error.strerror or error}.") from error
    temporary = Path(name)
    try:
        yield temporary
        _settle(temporary, path)
    except OSError as error:
        raise FileRefused(
            f"cannot write {path}: {error.strerror or error}. What was there before is untouched."
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _settle(temporary: Path, path: Path) -> None:
    """Bytes to the disk, then the name; mkstemp's private mode becomes what a plain open would have given."""
    mask = os.umask(0)
    os.umask(mask)
    temporary.chmod(0o666 & ~mask)
    with temporary.open("rb+") as stream:
        os.fsync(stream.fileno())
    temporary.replace(path)
