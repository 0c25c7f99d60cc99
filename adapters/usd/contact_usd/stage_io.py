"""Opening and saving stages. All that we write goes into one layer of our own, the root of our stage.

A file that is not ours becomes the sublayer of a new root and is never written. A file of ours (it says so in its
customLayerData) is opened as a private copy, so an unsaved edit is never seen through USD's shared layer registry.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdUtils

from contact_core.atomic_file import replacing
from contact_core.errors import ContactError, FileRefused, InvalidInput, shortened
from contact_core.scene.host import SceneSpace

SUFFIXES = (".usda", ".usdc", ".usd", ".usdz")
WRITABLE = (".usda", ".usdc", ".usd")
OWNED = "contactOwned"  # key in customLayerData; the number of the layout
LAYOUT = 1
TOLD_GAPS = 8  # of what composition did not find, so that a broken shot does not bury all other notes


@dataclass(frozen=True)
class OwnedStage:
    """A stage whose strongest layer is ours. source: the file that was opened, if any; ours: the file was ours.

    beside: absolute paths that our file names from its own folder.
    """

    stage: Usd.Stage
    layer: Sdf.Layer
    source: Path | None
    ours: bool
    notes: tuple[str, ...] = ()
    beside: frozenset[str] = frozenset()


def new_stage(space: SceneSpace) -> OwnedStage:
    """An empty stage in memory. USD knows no X for up; it becomes Y, to which assets are turned."""
    layer = _owned_layer()
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, space.meters_per_unit)
    UsdGeom.SetStageUpAxis(stage, "Y" if space.up_axis == "X" else space.up_axis)
    stage.SetTimeCodesPerSecond(space.frames_per_second)
    stage.SetFramesPerSecond(space.frames_per_second)
    return OwnedStage(stage, layer, None, ours=False)


def open_stage(path: Path) -> OwnedStage:
    """The stage of a file, with our layer on top. Raises FileRefused."""
    path = path.absolute()
    if path.suffix.lower() not in SUFFIXES or not path.is_file():
        raise FileRefused(
            f"{path} is no USD file; wanted is an existing file with a name in {', '.join(SUFFIXES)}."
        )
    with refusing(path):
        head = Sdf.Layer.OpenAsAnonymous(str(path), metadataOnly=True)
        if head is not None and OWNED in head.customLayerData:
            return _open_ours(path)
        source = None if head is None else Sdf.Layer.FindOrOpen(str(path))
        if source is None:
            raise FileRefused(f"{path} cannot be used as a USD layer: it is empty, or no USD at all.")
        layer = _owned_layer()
        UsdUtils.CopyLayerMetadata(source, layer, skipSublayers=True)
        layer.customLayerData = {**layer.customLayerData, OWNED: LAYOUT}
        layer.subLayerPaths = [str(path)]
        stage = _composed(layer, path)
        return OwnedStage(stage, layer, path, ours=False, notes=(*_take_units(stage, source), *_gaps(stage)))


def on_stage(stage: Usd.Stage) -> OwnedStage:
    """A stage that a DCC has open: our layer goes under its session layer, stronger than all files.

    Where another host put one there before, that is ours too: a stage has one document. Raises InvalidInput for a
    stage without a session layer.
    """
    session = stage.GetSessionLayer()
    if session is None:
        raise InvalidInput(
            "this stage was opened without a session layer, so there is no place above its files for the contact"
            " layer; open it with one, which is what Usd.Stage.Open does by itself."
        )
    there = (Sdf.Layer.Find(identifier) for identifier in session.subLayerPaths)
    layer = next((item for item in there if item is not None and OWNED in item.customLayerData), None)
    if layer is None:
        layer = _owned_layer()
        session.subLayerPaths.insert(0, layer.identifier)
    return OwnedStage(stage, layer, None, ours=False)


def space_of(stage: Usd.Stage) -> SceneSpace:
    """Units and axes; frames are the stage's time codes. What no unit or axis can be becomes USD's fallback."""
    notes = []
    unit, rate = UsdGeom.GetStageMetersPerUnit(stage), stage.GetTimeCodesPerSecond()
    up: Literal["Y", "Z"] = "Z" if UsdGeom.GetStageUpAxis(stage) == "Z" else "Y"
    if not (math.isfinite(unit) and unit > 0.0):
        notes.append(f"metersPerUnit is {unit:g}, which is no length; USD's fallback of 0.01 is used.")
        unit = float(UsdGeom.LinearUnits.centimeters)
    if UsdGeom.GetStageUpAxis(stage) not in ("Y", "Z"):
        notes.append(f"upAxis is {UsdGeom.GetStageUpAxis(stage)}, which USD does not know; Y is used.")
    if not (math.isfinite(rate) and rate > 0.0):
        notes.append(f"timeCodesPerSecond is {rate:g}, which is no rate; USD's fallback of 24 is used.")
        rate = 24.0
    elif rate != stage.GetFramesPerSecond():
        notes.append(
            f"frames are time codes: {rate:g} of them are one second,"
            f" and the stage plays {stage.GetFramesPerSecond():g} frames in it."
        )
    return SceneSpace(unit, up, rate, tuple(notes))


def default_target(owned: OwnedStage) -> Path:
    """Where to save when nobody says: over our own file, or beside the source."""
    if owned.source is None:
        raise FileRefused("this stage came from no file; say where to save it.")
    return owned.source if owned.ours else owned.source.with_name(f"{owned.source.stem}.contact.usda")


def save(owned: OwnedStage, path: Path, folder: Path | None = None) -> None:
    """Write our layer to a file, its sublayers by relative paths. Raises FileRefused, never half a file.

    Files that somebody named in our layer from its old folder are named from the new one. folder: where the file
    will be brought to, if it does not stay.
    """
    written, path = path.absolute(), (path if folder is None else folder / path.name).absolute()
    if path.suffix.lower() not in WRITABLE:
        raise FileRefused(f"cannot write {path.name}: our layer is saved as one of {', '.join(WRITABLE)}.")
    used = {layer.realPath for layer in owned.stage.GetUsedLayers() if layer.realPath}
    if str(path) in used or os.path.realpath(path) in {os.path.realpath(item) for item in used}:
        raise FileRefused(
            f"{path} is a layer of this scene that is not ours; it is never written. Choose a new name."
        )
    copy = Sdf.Layer.CreateAnonymous()
    copy.TransferContent(owned.layer)
    UsdUtils.ModifyAssetPaths(copy, lambda asset: _relative(asset, path.parent) if asset in owned.beside else asset)
    copy.subLayerPaths = [_relative(item, path.parent) for item in copy.subLayerPaths]
    with refusing(path), replacing(written) as temporary:
        if not copy.Export(str(temporary)):
            raise OSError(f"USD could not write {temporary.name}")


@contextlib.contextmanager
def refusing(path: Path) -> Iterator[None]:
    """USD's own errors as sentences."""
    try:
        yield
    except ContactError:
        raise
    except (Tf.ErrorException, RuntimeError, UnicodeError) as error:
        raise FileRefused(f"{path} cannot be used as a USD layer: {reason(error)}") from error


def reason(error: Exception) -> str:
    """What USD says is wrong, without the places in its sources; a damaged file may be quoted, bytes and all."""
    if isinstance(error, UnicodeEncodeError):
        return "USD has no way to say a name that is not Unicode. Rename it."
    try:
        said = error.args[0].commentary if isinstance(error, Tf.ErrorException) and error.args else str(error)
    except UnicodeDecodeError:
        said = ""
    told = " ".join(re.sub(r"matching \S*(?=.* at ')|pxrInternal_\w*::", "", said).split())
    return shortened(told) or "it is damaged."


def _open_ours(path: Path) -> OwnedStage:
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    version = layer.customLayerData[OWNED]
    if version != LAYOUT:
        raise FileRefused(
            f"{path} has contact layout {version}, this release reads {LAYOUT}: install a newer contact-core."
        )
    beside: set[str] = set()

    def absolute(asset: str) -> str:  # an anonymous layer has no folder that files could be named from
        where = _absolute(asset, path.parent)
        if where == asset or not (asset.startswith(("./", "../")) or Path(where).is_file()):
            return asset  # a search path, an address
        beside.add(where)
        return where

    UsdUtils.ModifyAssetPaths(layer, absolute)
    layer.subLayerPaths = [_absolute(item, path.parent) for item in layer.subLayerPaths]
    below = Path(layer.subLayerPaths[0]) if layer.subLayerPaths else path
    stage = _composed(layer, below)
    return OwnedStage(stage, layer, path, ours=True, notes=_gaps(stage), beside=frozenset(beside))


def _composed(layer: Sdf.Layer, source: Path) -> Usd.Stage:
    """The stage of our layer, which has no folder of its own: search paths start where they do for the source."""
    return Usd.Stage.Open(layer, _context(source))


def _context(source: Path) -> Ar.ResolverContext:
    """Where the assets of a shot are sought. A studio's own resolver decides it by itself; USD's looks beside the
    shot, then in CONTACT_ASSETS, then where PXR_AR_DEFAULT_SEARCH_PATH says."""
    assets = os.environ.get("CONTACT_ASSETS")
    if assets and type(Ar.GetUnderlyingResolver()) is Ar.DefaultResolver:
        return Ar.ResolverContext(Ar.DefaultResolverContext([str(source.absolute().parent), assets]))
    return Ar.GetResolver().CreateDefaultContextForAsset(str(source))


def _owned_layer() -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous("contact.usda")
    layer.customLayerData = {OWNED: LAYOUT}
    return layer


def _take_units(stage: Usd.Stage, source: Sdf.Layer) -> tuple[str, ...]:
    """Units and axes hold in a root layer only: where the source says none, take over what its sublayers say."""
    notes = []
    ours = stage.GetRootLayer()
    for key in (UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis):
        tellers = [item for item in stage.GetLayerStack(False) if item.pseudoRoot.HasInfo(key)]
        if not tellers or tellers[0] in (ours, source):
            continue
        value = tellers[0].pseudoRoot.GetInfo(key)
        ours.pseudoRoot.SetInfo(key, value)
        notes.append(
            f"{source.GetDisplayName()} says no {key}, which USD would take for its fallback; its sublayer"
            f" {tellers[0].GetDisplayName()} says {value}, and that is used."
        )
    return tuple(notes)


def _gaps(stage: Usd.Stage) -> tuple[str, ...]:
    """What the files name and composition did not find or could not use, in USD's words."""
    if not hasattr(stage, "GetCompositionErrors"):  # before 24.8 or so USD only prints them
        return ()
    said = dict.fromkeys(" ".join(str(error).split()) for error in stage.GetCompositionErrors())
    told = [f"the scene is not whole: {text}" for text in said][:TOLD_GAPS]
    more = len(said) - len(told)
    return (*told, *([f"and {more} more such gaps."] if more else []))


def _relative(asset: str, folder: Path) -> str:
    if Sdf.Layer.IsAnonymousLayerIdentifier(asset) or not Path(asset).is_absolute():
        return asset
    try:
        relative = Path(os.path.relpath(asset, folder)).as_posix()
    except ValueError:  # another drive
        return asset
    return relative if relative.startswith("../") else f"./{relative}"


def _absolute(asset: str, folder: Path) -> str:
    return asset if Path(asset).is_absolute() else os.path.normpath(folder / asset)
