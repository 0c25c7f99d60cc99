"""Opening and saving stages. All that we write goes into one layer of our own, the root of our stage.

A file that is not ours becomes the sublayer of a new root and is never written. A file of ours (it says so in its
customLayerData) is opened as a private copy, so an unsaved edit is never seen through USD's shared layer registry.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from contact_core.errors import ContactError, FileRefused
from contact_core.host import SceneSpace
from contact_core.whole_file import replacing

SUFFIXES = (".usda", ".usdc", ".usd", ".usdz")
WRITABLE = (".usda", ".usdc", ".usd")
OWNED = "contactOwned"  # key in customLayerData; the number of the layout
LAYOUT = 1


@dataclass(frozen=True)
class OwnedStage:
    """A stage whose strongest layer is ours. source: the file that was opened, if any; ours: the file was ours."""

    stage: Usd.Stage
    layer: Sdf.Layer
    source: Path | None
    ours: bool
    notes: tuple[str, ...] = ()


def new_stage(space: SceneSpace) -> OwnedStage:
    """An empty stage in memory."""
    layer = _owned_layer()
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, space.meters_per_unit)
    UsdGeom.SetStageUpAxis(stage, space.up_axis)
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
        if OWNED in head.customLayerData:
            return _open_ours(path)
        source = Sdf.Layer.FindOrOpen(str(path))
        layer = _owned_layer()
        notes = _copy_metadata(source, layer)
        layer.subLayerPaths = [str(path)]
        return OwnedStage(Usd.Stage.Open(layer), layer, path, ours=False, notes=notes)


def on_stage(stage: Usd.Stage) -> OwnedStage:
    """A stage that a DCC has open: our layer goes under its session layer, stronger than all files."""
    layer = _owned_layer()
    stage.GetSessionLayer().subLayerPaths.insert(0, layer.identifier)
    return OwnedStage(stage, layer, None, ours=False)


def space_of(stage: Usd.Stage) -> SceneSpace:
    """Units and axes; frames are the stage's time codes."""
    notes = []
    if stage.GetTimeCodesPerSecond() != stage.GetFramesPerSecond():
        notes.append(
            f"frames are time codes: {stage.GetTimeCodesPerSecond():g} of them are one second,"
            f" and the stage plays {stage.GetFramesPerSecond():g} frames in it."
        )
    return SceneSpace(
        UsdGeom.GetStageMetersPerUnit(stage),
        str(UsdGeom.GetStageUpAxis(stage)),  # type: ignore[arg-type]
        stage.GetTimeCodesPerSecond(),
        tuple(notes),
    )


def default_target(owned: OwnedStage) -> Path:
    """Where to save when nobody says: over our own file, or beside the source."""
    if owned.source is None:
        raise FileRefused("this stage came from no file; say where to save it.")
    return owned.source if owned.ours else owned.source.with_name(f"{owned.source.stem}.contact.usda")


def save(owned: OwnedStage, path: Path) -> None:
    """Write our layer to a file, its sublayers by relative paths. Raises FileRefused, never half a file."""
    path = path.absolute()
    if path.suffix.lower() not in WRITABLE:
        raise FileRefused(f"cannot write {path.name}: our layer is saved as one of {', '.join(WRITABLE)}.")
    used = {layer.realPath for layer in owned.stage.GetUsedLayers() if layer.realPath}
    if str(path) in used or os.path.realpath(path) in {os.path.realpath(item) for item in used}:
        raise FileRefused(
            f"{path} is a layer of this scene that is not ours; it is never written. Choose a new name."
        )
    copy = Sdf.Layer.CreateAnonymous()
    copy.TransferContent(owned.layer)
    copy.subLayerPaths = [_relative(item, path.parent) for item in copy.subLayerPaths]
    with refusing(path), replacing(path) as temporary:
        if not copy.Export(str(temporary)):
            raise OSError(f"USD could not write {temporary.name}")


@contextlib.contextmanager
def refusing(path: Path) -> Iterator[None]:
    """USD's own errors as sentences."""
    try:
        yield
    except ContactError:
        raise
    except (Tf.ErrorException, RuntimeError, AttributeError, UnicodeDecodeError) as error:
        raise FileRefused(f"{path} cannot be used as a USD layer: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """The last line of USD's message; a damaged file may be quoted in it, bytes and all."""
    try:
        lines = str(error).strip().splitlines()
    except UnicodeDecodeError:
        lines = []
    return lines[-1].strip() if lines else "it is damaged."


def _open_ours(path: Path) -> OwnedStage:
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    version = layer.customLayerData[OWNED]
    if version != LAYOUT:
        raise FileRefused(
            f"{path} has contact layout {version}, this release reads {LAYOUT}: install a newer contact-core."
        )
    layer.subLayerPaths = [_absolute(item, path.parent) for item in layer.subLayerPaths]
    return OwnedStage(Usd.Stage.Open(layer), layer, path, ours=True)


def _owned_layer() -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous("contact.usda")
    layer.customLayerData = {OWNED: LAYOUT}
    return layer


def _copy_metadata(source: Sdf.Layer, layer: Sdf.Layer) -> tuple[str, ...]:
    """Units, axes and rates hold only in a root layer: what the source says, else what its sublayers say."""
    UsdUtils.CopyLayerMetadata(source, layer, skipSublayers=True)
    layer.customLayerData = {**layer.customLayerData, OWNED: LAYOUT}
    notes = []
    stage = Usd.Stage.Open(source)  # held, for its layers come as weak handles that end with it
    stack = [item for item in stage.GetLayerStack(includeSessionLayers=False) if item != source]
    for key in (UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis):
        if layer.pseudoRoot.HasInfo(key):
            continue
        teller = next((item for item in stack if item.pseudoRoot.HasInfo(key)), None)
        if teller is not None:
            value = teller.pseudoRoot.GetInfo(key)
            layer.pseudoRoot.SetInfo(key, value)
            notes.append(
                f"{source.GetDisplayName()} says no {key}, which USD would take for its fallback; its sublayer"
                f" {teller.GetDisplayName()} says {value}, and that is used."
            )
    return tuple(notes)


def _relative(asset: str, folder: Path) -> str:
    if Sdf.Layer.IsAnonymousLayerIdentifier(asset) or not Path(asset).is_absolute():
        return asset
    try:
        return Path(os.path.relpath(asset, folder)).as_posix()
    except ValueError:  # another drive
        return asset


def _absolute(asset: str, folder: Path) -> str:
    return asset if Path(asset).is_absolute() else os.path.normpath(folder / asset)
