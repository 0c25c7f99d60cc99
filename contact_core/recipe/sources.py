"""Finding and reading what a recipe names: files by name and sha256, built-in samples, sidecars."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from contact_core.document.asset import Asset
from contact_core.errors import FileRefused
from contact_core.plugins.manager import PluginManager
from contact_core.plugins.reading import SAMPLE, read_asset
from contact_core.recipe.recipe import AssetSource, Recipe


def read_source(source: AssetSource, plugins: PluginManager, folder: Path | None = None) -> Asset:
    """The asset that a recipe names. Raises FileRefused, InvalidInput."""
    if source.sample is not None:
        return read_asset(SAMPLE + source.sample, plugins)
    path = find_file(source, folder)
    sidecar = None
    if source.sidecar is not None:
        sidecar = (folder or Path.cwd()) / source.sidecar
        if not sidecar.is_file():
            raise FileRefused(f"there is no rig sidecar {sidecar}; name a file that is, relative to the recipe.")
    return read_asset(path, plugins, sidecar=sidecar)


def find_file(source: AssetSource, folder: Path | None = None) -> Path:
    """Where a recipe's file is: beside the recipe, else among the assets, by name; its sha256 is checked.

    Raises FileRefused with a sentence on where to get it.
    """
    name = str(source.file)
    found = next(_candidates(name, folder), None)
    if found is None:
        raise FileRefused(
            f"{name} is not beside the recipe, not in $CONTACT_ASSETS and not in ../shared/assets. Set"
            " CONTACT_ASSETS to the folder that holds it; examples/ASSETS.md says where each file comes from."
        )
    if source.sha256 is not None:
        try:
            digest = hashlib.sha256(found.read_bytes()).hexdigest()
        except OSError as error:
            raise FileRefused(f"cannot read {found}: {error.strerror or error}.") from error
        if digest != source.sha256:
            raise FileRefused(
                f"{found} is another version of {name} than the recipe was made for: sha256 {digest[:12]}..., not"
                f" {source.sha256[:12]}... . Get that version, or take the sha256 out of the recipe."
            )
    return found


def _candidates(name: str, folder: Path | None) -> Iterator[Path]:
    """Files of that name or path, the nearest first."""
    here = folder or Path.cwd()
    if (here / name).is_file():
        yield here / name
    places = [Path(os.environ["CONTACT_ASSETS"])] if os.environ.get("CONTACT_ASSETS") else []
    places += [Path.cwd().parent / "shared" / "assets", here.resolve().parent.parent / "shared" / "assets"]
    plain = Path(name).name
    for place in places:
        if place.is_dir() and plain == name:
            yield from sorted(path for path in place.rglob(plain) if path.is_file())


def inputs_of(recipe: Recipe) -> dict[str, dict[str, str]]:
    """What a result was made from, by role: the SHA-256 of the recipe's content and of each file, or the sample."""
    content = json.dumps({**asdict(recipe), "folder": None}, sort_keys=True).encode()
    found = {"recipe": {"name": recipe.name, "sha256": hashlib.sha256(content).hexdigest()}}
    sources = {spec.name: spec.source for spec in recipe.manipulators}
    sources |= {spec.name: spec.source for spec in recipe.objects}
    for role, source in sources.items():
        found[role] = {"sample": source.sample} if source.sample else _file_facts(source, recipe.folder)
        if source.sidecar is not None:
            path = (recipe.folder or Path.cwd()) / source.sidecar
            found[f"{role} rig"] = {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    return found


def _file_facts(source: AssetSource, folder: Path | None) -> dict[str, str]:
    try:
        path = find_file(source, folder)
        return {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    except (FileRefused, OSError):  # it was read a moment ago, and is gone
        return {"file": str(source.file)}
