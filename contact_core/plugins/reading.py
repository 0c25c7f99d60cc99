"""Reading assets by the formats and samples of plugins."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS, SAMPLES

SAMPLE = "sample:"  # what the name of a built-in sample begins with where a file could be named, too
_IN_A_HOST = "Open it in Blender or in the program that made it and paint there, or export a .glb from there"
_ELSEWHERE = {
    ".fbx": f"FBX is not read. {_IN_A_HOST} (Blender: File > Import > FBX, then File > Export > glTF 2.0).",
    **dict.fromkeys(
        (".blend", ".ma", ".mb", ".max", ".c4d", ".hip", ".hiplc", ".hipnc", ".ztl", ".skp"),
        f"that is the file of a program, which is not read. {_IN_A_HOST}.",
    ),
    ".abc": f"Alembic is not read. {_IN_A_HOST}, or a .usda or .obj of the frame that you want.",
    ".vrm": "VRM is glTF under another name: copy it to a name in .glb.",
    ".zip": "an archive is not read. Unpack it, and name the model in it.",
}


def read_asset(source: Path | str, plugins: PluginManager | None = None, *, sidecar: Path | None = None) -> Asset:
    """The asset in a file, read by the format that its suffix names, or a sample: "sample:human".

    plugins: by default those that are installed. Raises FileRefused, and InvalidInput for a sample that there is
    not.
    """
    plugins = plugins or PluginManager()
    if str(source).startswith(SAMPLE):  # also of a Path, which is what a command line makes of it
        return plugins.get(SAMPLES, str(source).removeprefix(SAMPLE)).build()
    path = Path(source)
    suffix = path.suffix.lower()
    readers = [format_ for format_ in plugins.offers(FORMATS).values() if format_.can_read]
    for reader in readers:
        if suffix in reader.suffixes:
            return reader.read(path, sidecar=sidecar)
    raise FileRefused(f"no reader for {path.name}: {unread(path, (s for r in readers for s in r.suffixes))}")


def unread(path: Path, known: Iterable[str]) -> str:
    """Why a file's name is none that is read, and what to do about it. known: the suffixes that are."""
    suffix = path.suffix.lower()
    if suffix in _ELSEWHERE:
        return _ELSEWHERE[suffix]
    return f"{suffix or 'a name without suffix'} is none of {', '.join(sorted(set(known)))}."
