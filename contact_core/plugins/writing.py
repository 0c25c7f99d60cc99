"""Writing posed assets by whichever plugin writes that kind of file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.registry import FORMATS
from contact_core.rig.rig import Pose


def write_model(path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose], plugins: PluginManager) -> bool:
    """Write assets in poses, by name, into one file whose suffix says its kind; whether any plugin writes that."""
    writer = next((f for f in plugins.offers(FORMATS).values() if f.can_write and path.suffix in f.suffixes), None)
    if writer is not None:
        writer.write(path, assets, poses)
    return writer is not None
