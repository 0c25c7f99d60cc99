"""The starter library: the common types of grasps on the built-in hand, shipped with the package.

`job.starter` says what they are, `contact library make` makes them.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from contact_core.library.shelf import Library

FOLDER = "starter"


def starter_library() -> Library:
    """The library that comes with the package; it is only read."""
    return Library(Path(str(files("contact_core.library"))) / FOLDER)
