"""Shots whose assets got other triangles: their contacts are projected onto them, where the old surface is known.

A document holds no mesh, so a batch keeps beside its results the surfaces on which contacts were painted.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from contact_core.atomic_file import replacing
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.scene.binding import BoundSurface
from contact_core.session import Session

KEPT = "surfaces.npz"


def rebind_changed(session: Session, kept_file: Path) -> tuple[list[str], Mapping[str, TriangleMesh]]:
    """Bind what is missing to the prim that it had, contacts projected onto its new triangles.

    kept_file: what `keep` wrote beside earlier results. Returns notes on what moved, and the surfaces as the
    contacts were painted, to be kept beside the new ones.
    """
    kept, notes, painted = _read(kept_file), list[str](), dict[str, TriangleMesh]()
    remembered = session.document.extras.get(session.binding.key, {})
    for name in tuple(session.binding.missing):
        old = kept.get(session.document.surface(name).topology_digest)
        if old is None or name not in remembered:
            continue
        try:
            notes.append(_rebind(session, name, str(remembered[name]), old))
        except InvalidInput as error:  # the prim is gone: that it is missing stays
            session.binding.missing[name] = str(error)
            continue
        painted[name] = old
    for name, found in session.binding.surfaces.items():
        painted.setdefault(name, found.asset.mesh)
    return notes, painted


def _rebind(session: Session, name: str, prim: str, old: TriangleMesh) -> str:
    asset = session.host.read_surface(prim)
    surface = session.document.surface(name)
    rig = session.rigs.get(name)
    session.surfaces.add(
        name, old, meters_per_unit=surface.meters_per_unit, up_axis=surface.up_axis, rig=rig,
        world_from_surface=surface.world_from_surface,
    )  # fmt: skip
    report = session.surfaces.rebind(name, asset.mesh)
    session.binding.surfaces[name] = BoundSurface(prim, asset)
    session.binding.missing.pop(name)
    if asset.rig is not None:
        session.rigs[name] = asset.rig
    size = asset.mesh.bounding_box_diagonal or 1.0
    return (
        f"{name} has other triangles now ({len(old.faces)} before, {len(asset.mesh.faces)} now); its contacts were"
        f" projected onto them and moved by at most {100 * report.largest_move / size:.2g} % of its size."
    )


def _read(path: Path) -> Mapping[str, TriangleMesh]:
    """Meshes by topology digest; none of a file that is absent or damaged."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            count = sum(name.startswith("points") for name in archive.files)
            meshes = [TriangleMesh(archive[f"points{k}"], archive[f"faces{k}"]) for k in range(count)]
    except Exception:  # whatever a damaged archive makes zipfile, zlib, numpy and its tokenizer say
        return {}
    return {mesh.topology_digest: mesh for mesh in meshes}


def keep(path: Path, surfaces: Mapping[str, TriangleMesh]) -> None:
    """Write surfaces for the next `rebind_changed`."""
    arrays: dict[str, Any] = {}
    for number, mesh in enumerate(surfaces.values()):
        arrays |= {f"points{number}": mesh.points, f"faces{number}": mesh.faces}
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **arrays)
