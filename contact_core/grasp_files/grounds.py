"""What else is in the file of a prop, and is nothing that a hand takes hold of: grounds, and what lies far away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.document.asset import Asset
from contact_core.geometry.mesh import TriangleMesh

WIDE = 20.0  # hand lengths: a flat part wider than this is a ground or a wall, where there are other parts
VAST = 1000.0  # hand lengths: a part larger than this is a landscape, flat or not
FLAT = 0.03  # of its width, how high a flat part is


def without_grounds(asset: Asset, length: float) -> tuple[Asset, str | None]:
    """The object without its grounds and a note, or as it is where it is nothing else. length: of the hand, in the
    object's units.

    Surfaces are looked at in places as many on equal areas, so a ground leaves none for the prop on it.
    """
    mesh = asset.mesh
    extent = np.ptp(mesh.points[mesh.used_points], axis=0)
    if not float(extent.max()) > WIDE * length:
        return asset, None
    part_of, low, high = _parts(mesh)
    large = _grounds(high - low, length)
    if large.all():
        return asset, None
    told = []
    if large.any():
        across = float((high - low)[large].max()) / length
        told.append(
            f"{asset.name} holds a ground, {across:.2g} hand lengths across, which no hand holds: it was left out."
            " Grasps may reach through it."
        )
    left = large | _strays(mesh, part_of, low, high, ~large, VAST * length, WIDE * length)
    if strays := int(np.count_nonzero(left & ~large)):
        told.append(
            f"{strays} parts of {asset.name} lie more than {WIDE:g} hand lengths away from its largest: they were"
            " left out. To hold one of them, give a file of it."
        )
    if not told:
        return asset, None
    kept = np.flatnonzero(~left[part_of])
    faces = None if asset.source_faces is None else asset.source_faces[kept]
    return replace(asset, mesh=TriangleMesh(mesh.points, mesh.faces[kept]), source_faces=faces), " ".join(told)


def _parts(mesh: TriangleMesh) -> tuple[IntArray, FloatArray, FloatArray]:
    """The part of each face (m,), and the lowest and highest corners of the parts, (k, 3) each."""
    a, b, c = mesh.faces.T
    count = len(mesh.points)
    edges = coo_matrix((np.ones(2 * len(a), np.int8), (np.r_[a, b], np.r_[b, c])), shape=(count, count))
    number, part = connected_components(edges, directed=False)
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    np.minimum.at(low, part, mesh.points)
    np.maximum.at(high, part, mesh.points)
    there, part_of = np.unique(part[a], return_inverse=True)
    return part_of.reshape(-1), low[there], high[there]


def _strays(
    mesh: TriangleMesh,
    part_of: IntArray,
    low: FloatArray,
    high: FloatArray,
    among: BoolArray,
    vast: float,
    near: float,
) -> BoolArray:
    """(k,) parts that lie far from the largest by area, where the parts `among` are spread over more than `vast`:
    distances are kept in a grid over all of them, in which a hand would be smaller than a cell."""
    none = np.zeros(len(low), bool)
    if np.ptp(np.concatenate([low[among], high[among]]), axis=0).max() <= vast:
        return none
    areas = np.where(among, np.bincount(part_of, mesh.face_areas, len(low)), -1.0)
    largest = int(areas.argmax())
    gaps = np.maximum(np.maximum(low - high[largest], low[largest] - high), 0.0)
    return np.asarray(among & (np.linalg.norm(gaps, axis=1) > near))


def _grounds(sides: FloatArray, length: float) -> BoolArray:
    """(k,) whether a part of these extents is a ground."""
    low, middle, high = np.sort(sides, axis=1).T
    flat = (low < FLAT * middle) & (middle > WIDE * length)
    return np.asarray(flat | (high > VAST * length))
