"""Where the schema files are, without pxr: for launchers that must set a path before USD starts."""

from __future__ import annotations

from pathlib import Path

ENVIRONMENT_VARIABLE = "PXR_PLUGINPATH_NAME"


def schema_dir() -> Path:
    """The folder with plugInfo.json. A host that loads USD before Python sets PXR_PLUGINPATH_NAME to it."""
    return Path(__file__).resolve().parent / "schema"
