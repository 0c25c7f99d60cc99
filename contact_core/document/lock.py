"""One writer for one document: a lock file that the operating system releases when its holder dies.

On a network path the file system decides how far the lock reaches. Linux asks the server for it (NFS since version
4, or 3 with its lock service; SMB), so that it holds between machines; a mount that keeps locks to itself
(`nolock`, `local_lock=flock`) keeps out writers on the same machine alone, and nothing here can tell. One that
refuses locks is said so, and the document is opened read-only. Nothing waits for a lock.
"""

from __future__ import annotations

import contextlib
import errno
import getpass
import json
import os
import socket
import sys
import time
from pathlib import Path
from typing import Any

from contact_core.atomic_file import read_bounded
from contact_core.errors import FileRefused
from contact_core.mounts import mount_of


class DocumentLock:
    """The right to write a document and its journal. `take` returns one, `release` gives it up."""

    def __init__(self, path: Path, file: int) -> None:
        self.path = path
        self._file = file

    @classmethod
    def take(cls, document_path: Path) -> DocumentLock | str:
        """Returns the lock, or a reason why there is none: who holds it, or what cannot be written."""
        if _is_protected(document_path):
            return f"{document_path.name} is write-protected"
        path = document_path.with_name(document_path.name + ".lock")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            return f"{path.parent} cannot be written ({error.strerror or error})"
        try:
            free = _try_lock(file)
        except OSError as error:  # a share without a lock service
            os.close(file)
            return f"{path.parent} takes no locks ({error.strerror or error}), so nobody can tell who writes"
        reason = (
            _why_not(path, document_path.name, file) if free else f"{document_path.name} is open in {_holder(path)}"
        )
        if reason is None:
            try:
                os.ftruncate(file, 0)
                os.lseek(file, 0, os.SEEK_SET)
                os.write(file, json.dumps(_myself()).encode())
                return cls(path, file)
            except OSError as error:
                reason = f"{path.parent} cannot be written ({error.strerror or error})"
        _close(file)
        return reason

    def release(self) -> None:
        """Give the lock up; the lock file stays, and names no holder."""
        if self._file >= 0:
            with contextlib.suppress(OSError):  # a server that is gone
                os.ftruncate(self._file, 0)
            _close(self._file)  # which releases the lock
            self._file = -1


def _is_protected(path: Path) -> bool:
    """Whether a file is there that may not be written, as version control leaves what is not checked out.

    Renaming another file over it would go through all the same, and so would anything that an administrator does:
    the permissions themselves are asked.
    """
    try:
        return not path.stat().st_mode & 0o222 or not os.access(path, os.W_OK)
    except OSError:
        return False


def _myself() -> dict[str, Any]:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container without a user entry
        user = "unknown"
    started = time.strftime("%Y-%m-%d %H:%M:%S")
    return {"process": os.getpid(), "host": socket.gethostname(), "user": user, "since": started}


def _why_not(path: Path, name: str, file: int) -> str | None:
    """Where locks end at this machine: who on another one has the document, says the lock file. None for nobody."""
    mount = mount_of(os.fstat(file))
    if mount is None or not mount.keeps_locks:
        return None
    who = _named(path)
    if who is None or who["host"] == socket.gethostname():
        return None
    return (
        f"{name} is open in {_holder(path)}, says {path.name} (this folder passes no locks to other machines;"
        " delete that file where nobody there has it open any more)"
    )


def _holder(path: Path) -> str:
    who = _named(path)
    if who is None:
        return "another process"
    return f"process {who['process']} of {who['user']} on {who['host']} since {who['since']}"


def _named(path: Path) -> dict[str, Any] | None:
    """Who a lock file names; None for nobody, or what cannot be read."""
    try:
        who = json.loads(read_bounded(path, 4096))
    except (FileRefused, ValueError):
        return None
    return who if isinstance(who, dict) and _myself().keys() <= who.keys() else None


def _close(file: int) -> None:
    with contextlib.suppress(OSError):
        os.close(file)


_TAKEN = {errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK}  # what systems say where another has it

if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: int) -> bool:
        """Lock a byte far behind the text, so that others can read who holds it. Raises OSError."""
        os.lseek(file, 1 << 20, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if error.errno in _TAKEN:
                return False
            raise
        return True

else:
    import fcntl

    def _try_lock(file: int) -> bool:
        """Whether nobody else has it. Raises OSError where no lock can be had at all."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in _TAKEN:
                return False
            raise
        return True
