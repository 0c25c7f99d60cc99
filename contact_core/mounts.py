"""What kind of file system a file lies on: shared with other machines or not, and whether locks stop at this one.

Told by Linux (`/proc/self/mountinfo`); on other systems, and where it cannot be read, nothing is known of a mount.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

_TABLE = Path("/proc/self/mountinfo")
_SHARED = {
    "nfs",
    "nfs4",
    "cifs",
    "smb3",
    "smbfs",
    "9p",
    "virtiofs",
    "ceph",
    "lustre",
    "gpfs",
    "beegfs",
    "afs",
    "fuse",
}
_PASS_LOCKS = {"fuse.ceph", "fuse.ceph-fuse", "fuse.glusterfs", "fuse.juicefs", "fuse.lizardfs", "fuse.mfs"}
_LOCAL_LOCKS = {"nolock", "local_lock=flock", "local_lock=all", "nobrl"}  # options of NFS and SMB


@dataclass(frozen=True)
class Mount:
    """A mounted file system. kind: as the system calls it. options: those of the mount and of the file system."""

    kind: str
    options: frozenset[str]

    @property
    def is_shared(self) -> bool:
        """Whether other machines may write what is in it."""
        return self.kind in _SHARED or self.kind.startswith("fuse.")

    @property
    def keeps_locks(self) -> bool:
        """Whether other machines are not told of its locks, or (FUSE of an unknown kind) may not be."""
        if self.kind == "fuse" or self.kind.startswith("fuse."):
            return self.kind not in _PASS_LOCKS
        return self.is_shared and bool(self.options & _LOCAL_LOCKS)


def mount_of(status: os.stat_result) -> Mount | None:
    """The mount that a file lies on, None where that is not known. status: of the file."""
    device = f"{os.major(status.st_dev)}:{os.minor(status.st_dev)}" if hasattr(os, "major") else ""
    if not device.startswith("0:"):  # a disk of this machine has a number
        return None
    try:
        lines = _TABLE.read_text(errors="replace").splitlines()
    except OSError:
        return None
    for line in lines:
        before, _, after = line.partition(" - ")
        at, what = before.split(), after.split()
        if len(at) > 5 and at[2] == device and what:
            return Mount(what[0], frozenset(at[5].split(",")) | frozenset(what[-1].split(",")))
    return None
