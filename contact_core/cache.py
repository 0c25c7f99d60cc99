"""Where this machine keeps what can be made again: distance fields, generated samples, compiled kernels.

`CONTACT_CACHE` names the directory; else the platform's own cache directory is used. Everything in it may be
deleted at any time. Files are numpy archives (never pickles) under a content key, written whole or not at all.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from contact_core.atomic_file import replacing
from contact_core.errors import FileRefused

_NAMES = "names of all arrays"  # an archive guards the bytes of its entries, but not which ones there are


def cache_directory() -> Path | None:
    """The cache directory, made if absent; None where none can be written."""
    for candidate in _candidates():
        try:
            candidate.mkdir(parents=True, exist_ok=True)
            if os.access(candidate, os.W_OK):
                return candidate
        except OSError:
            continue
    return None


def cached_arrays(
    kind: str, key: str, make: Callable[[], dict[str, npt.NDArray[Any]]]
) -> dict[str, npt.NDArray[Any]]:
    """The arrays kept under `kind`/`key`, or made now and kept for the next time.

    An unreadable or unwritable cache is no error: the arrays are simply made.
    """
    directory = cache_directory()
    path = None if directory is None else directory / kind / f"{key}.npz"
    if path is not None:
        try:
            with np.load(path, allow_pickle=False) as archive:
                kept = {name: archive[name] for name in archive.files}
            if sorted(kept.pop(_NAMES).tolist()) == sorted(kept):
                return kept
        except Exception:  # there is none, its server is away, or whatever is said of a damaged one
            pass
    arrays = make()
    if path is not None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(path) as part:
                content: dict[str, Any] = {**arrays, _NAMES: np.array(list(arrays))}
                np.savez_compressed(part, **content)
        except (OSError, FileRefused):
            pass
    return arrays


def _candidates() -> list[Path]:
    named = os.environ.get("CONTACT_CACHE")
    if named:
        return [Path(named)]
    if sys.platform == "win32":
        system = os.environ.get("LOCALAPPDATA") or "~/AppData/Local"
    elif sys.platform == "darwin":
        system = "~/Library/Caches"
    else:
        system = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    user = os.getuid() if hasattr(os, "getuid") else "user"
    places = [Path(tempfile.gettempdir()) / f"contact-core-{user}"]
    with contextlib.suppress(RuntimeError):  # the user of a container may have no home
        places.insert(0, Path(system).expanduser() / "contact-core")
    return places
