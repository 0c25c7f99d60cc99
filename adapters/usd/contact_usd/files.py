"""USD as a file format: one rig, or all surfaces of a stage as one mesh, for recipes and `contact inspect`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.document.asset import Asset
from contact_core.errors import FileRefused, InvalidInput, MissingExtra
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.transform import transform_points
from contact_core.rig.clip import Clip
from contact_core.rig.rig import Pose

if TYPE_CHECKING:
    from contact_usd.host import UsdHost


class UsdFiles:
    """Reads any stage; writes text and binary layers. pxr is imported when a file is read or written."""

    name = "usd"
    summary = "meshes, skeletons and animations of USD stages"
    suffixes = (".usda", ".usdc", ".usd", ".usdz")
    can_read = True
    can_write = True

    def read(self, path: Path, *, sidecar: Path | None = None) -> Asset:
        """The one rig of a stage, else its surfaces as one mesh in the world. Raises FileRefused, MissingExtra."""
        host = _host(path)
        from contact_usd.stage_io import refusing

        with refusing(path):  # binary layers are read when somebody asks, and may be damaged there
            return self._read(host, path, sidecar)

    def _read(self, host: UsdHost, path: Path, sidecar: Path | None) -> Asset:
        if sidecar is not None:
            raise FileRefused(
                f"{path} keeps its joint limits on the skeleton (contact:jointFreedoms), so the rig sidecar"
                f" {sidecar} has no place. Leave it out."
            )
        items = host.objects()
        rigs = [item.id for item in items if item.kind == "rig"]
        try:
            if len(rigs) == 1:
                rig = host.read_rig(rigs[0])
                beside = [item.id for item in items if item.kind != "rig"]
                told = [f"meshes beside the rig, which are not part of it: {named(beside)}."] if beside else []
                return replace(rig, notes=(*host.space().notes, *rig.notes, *told, *host.losses()))
            if rigs or not items:
                found = f"{len(rigs)} rigs ({', '.join(rigs[:6])})" if rigs else "no meshes"
                told = [*host.space().notes, *host.losses()]
                found += "".join(f" ({note.rstrip('.')})" for note in told[:3])
                raise FileRefused(
                    f"{path} has {found}; as a file it is read where it has one rig, or meshes alone."
                )
            from contact_usd.mesh import is_empty
            from contact_usd.primitives import drawn

            kept, left = drawn({item.id: host.stage.GetPrimAtPath(item.id) for item in items})
            empty = [key for key in kept if is_empty(host.stage.GetPrimAtPath(key))]
            if empty:
                left.append(f"meshes without points or faces, left out: {named(empty)}.")
                kept = [key for key in kept if key not in set(empty)]
            if not kept:
                raise FileRefused(f"{path} draws nothing: {' '.join(left)}")
            asset = _one_mesh(host, path, kept)
            return replace(asset, notes=(*asset.notes, *left, *host.losses()))
        except InvalidInput as error:
            raise FileRefused(f"{path} cannot be read: {error}") from error

    def read_clips(self, path: Path, *, sidecar: Path | None = None, rate: float | None = None) -> tuple[Clip, ...]:
        """What moves in a stage, by the names of its prims. rate: None is the stage's own. Raises FileRefused."""
        host = _host(path)
        from contact_usd.clips import read_clip

        try:
            clip = read_clip(host, Path(path).stem)
        except InvalidInput as error:
            raise FileRefused(f"{path} cannot be read: {error}") from error
        return () if clip is None else (replace(clip, rate=rate or clip.rate),)

    def write(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose]) -> None:
        """A new stage with every asset, rigs in their pose by a SkelAnimation. Raises FileRefused, MissingExtra."""
        self.write_clip(path, assets, poses, None)

    def write_clip(self, path: Path, assets: Sequence[Asset], poses: Mapping[str, Pose], clip: Clip | None) -> None:
        """As `write`, with a clip as time samples. Raises FileRefused, InvalidInput, MissingExtra."""
        if not Path(path).absolute().parent.is_dir():
            raise FileRefused(f"{path} cannot be written: there is no folder {Path(path).parent}. Make it first.")
        units = {asset.meters_per_unit for asset in assets if asset.meters_per_unit is not None}
        up_axis = assets[0].up_axis if assets else "Y"
        host = _host(None, min(units, default=1.0), up_axis, 24.0 if clip is None else clip.rate)
        from contact_usd import clips

        moving = {} if clip is None else {keys.rig: keys for keys in clip.keys}
        strangers = sorted(set(moving) - {asset.name for asset in assets})
        if strangers:
            raise InvalidInput(f"the clip moves {strangers[0]!r}, but no such asset is written.")
        for asset in assets:
            key = host.add(asset)
            if asset.name in moving:
                clips.write_keys(host, key, asset, moving[asset.name])
            elif asset.name in poses and asset.rig is not None:
                clips.pose_rig(host, key, asset, poses[asset.name])
            elif asset.name in poses:
                clips.place(host, key, poses[asset.name].local[0])
        if clip is not None and clip.keys:
            clips.tell_range(host.stage, clip)
        host.save(Path(path))


def named(paths: Sequence[str]) -> str:
    """The first paths of a list for a sentence, and how many there are besides."""
    return ", ".join(paths[:8]) + (f" and {len(paths) - 8} more" if len(paths) > 8 else "")


def _host(
    path: Path | None,
    meters_per_unit: float = 1.0,
    up_axis: Literal["X", "Y", "Z"] = "Y",
    frames_per_second: float = 24.0,
) -> UsdHost:
    try:
        from contact_usd.host import UsdHost
    except ImportError as error:
        raise MissingExtra("Reading and writing USD", "usd") from error
    from contact_core.scene.host import SceneSpace

    if path is not None:
        return UsdHost(path)
    return UsdHost(space=SceneSpace(meters_per_unit, up_axis, frames_per_second))


def _one_mesh(host: UsdHost, path: Path, ids: list[str]) -> Asset:
    """All surfaces where they stand, one below the other; the maps go to the stage's own points and faces.

    A mesh that cannot be read is left out with a note. Raises InvalidInput where none can.
    """
    parts, places, odd = list[Asset](), list[FloatArray](), list[str]()
    for key in tuple(ids):
        try:
            part, place = host.read_surface(key), host.placement(key)
        except InvalidInput as error:
            if key == ids[-1] and not parts:
                raise
            odd.append(str(error).rstrip("."))
            ids = [other for other in ids if other != key]
            continue
        parts.append(part)
        places.append(place)
    placed = [transform_points(m, p.mesh.points) for p, m in zip(parts, places, strict=True)]
    starts = np.cumsum([0, *(len(points) for points in placed)])[:-1]
    space = host.space()
    sources = [np.asarray(part.source_vertices) + start for part, start in zip(parts, starts, strict=True)]
    return Asset(
        name=Path(path).stem,
        mesh=TriangleMesh(
            np.concatenate(placed),
            np.concatenate([part.mesh.faces + start for part, start in zip(parts, starts, strict=True)]),
        ),
        source_vertices=np.concatenate(sources),
        source_faces=parts[0].source_faces if len(parts) == 1 else None,
        meters_per_unit=space.meters_per_unit,
        up_axis=space.up_axis,
        notes=(
            *space.notes,
            *([f"meshes that cannot be read were left out: {'; '.join(odd[:4])}."] if odd else ()),
            *(f"{key}: {note}" for key, part in zip(ids, parts, strict=True) for note in part.notes),
        ),
        details={"format": "usd", "prims": ids},
    )
