"""Reading assets by the formats and samples of plugins."""

from __future__ import annotations

from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS, SAMPLES

SAMPLE = "sample:"  # what the name of a built-in sample begins with where a file could be named, too


def read_asset(source: Path | str, plugins: PluginManager | None = None, *, sidecar: Path | None = None) -> Asset:
    """The asset in a file, read by the format that its suffix names, or a sample: "sample:human".

    plugins: by default those that are installed. Raises FileRefused, and InvalidInput for a sample that there is
    not.
    """
    plugins = plugins or PluginManager()
    if isinstance(source, str) and source.startswith(SAMPLE):
        return plugins.get(SAMPLES, source.removeprefix(SAMPLE)).build()
    path = Path(source)
    suffix = path.suffix.lower()
    readers = [format_ for format_ in plugins.offers(FORMATS).values() if format_.can_read]
    for reader in readers:
        if suffix in reader.suffixes:
            return reader.read(path, sidecar=sidecar)
    known = ", ".join(sorted({s for reader in readers for s in reader.suffixes}))
    raise FileRefused(f"no reader for {path.name}: {suffix or 'a name without suffix'} is none of {known}.")
