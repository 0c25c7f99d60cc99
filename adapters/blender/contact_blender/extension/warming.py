"""The libraries and kernels that the first stroke would wait for, loaded and compiled on a thread of their own.

The first time on a machine numba compiles for some ten seconds; what it made is kept in the user's folder of the
extension. The window goes on meanwhile, and the line of status says so. Nothing of bpy is touched on the thread.
"""

from __future__ import annotations

import logging
import os
import threading
from pathlib import Path

import bpy

log = logging.getLogger(__name__)
_CACHES = ("NUMBA_CACHE_DIR", "CONTACT_CACHE")


class Warming:
    """Begun once in a process. failure: a sentence where it could not be done."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self.failure = ""
        self.doing = ""

    @property
    def is_done(self) -> bool:
        """Whether a tool can work now without a wait."""
        return self._thread is not None and not self._thread.is_alive() and not self.failure

    @property
    def is_begun(self) -> bool:
        """Whether it runs, or has run."""
        return self._thread is not None

    def begin(self) -> None:
        """Start, where it has not been started."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="contact warming", daemon=True)
            self._thread.start()

    def wait(self, seconds: float | None = None) -> bool:
        """Until it is done; whether it is. For scripts and tests."""
        self.begin()
        assert self._thread is not None
        self._thread.join(seconds)
        return self.is_done

    def _run(self) -> None:
        try:
            self.doing = "loading libraries"
            from contact_blender.extension import rehearsal

            self.doing = "compiling kernels, once on this machine"
            rehearsal.rehearse()
        except Exception as error:  # told where a tool is used
            log.exception("preparing failed")
            self.failure = f"the tools cannot be made ready ({error})."
        self.doing = ""


WARMING = Warming()


def keep_kernels(package: str) -> None:
    """Let compiled kernels and distance fields be kept in the extension's own folder, which goes when it is
    removed; where the user has said another place, that holds. package: the name under which it was enabled."""
    try:
        folder = Path(bpy.utils.extension_path_user(package, path="cache", create=True))
    except (AttributeError, ValueError, OSError):  # no extension: a script registered the package
        return
    for name in _CACHES:
        os.environ.setdefault(name, str(folder))
