"""The ground below a prop: part of its file, and nothing that a hand takes hold of."""

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
    part_of, sides = _parts(mesh)
    large = _grounds(sides, length)
    if not large.any() or large.all():
        return asset, None
    kept = np.flatnonzero(~large[part_of])
    across = float(sides[large].max()) / length
    note = (
        f"{asset.name} holds a ground, {across:.2g} hand lengths across, which no hand holds: it was left out."
        " Grasps may reach through it."
    )
    faces = None if asset.source_faces is None else asset.source_faces[kept]
    return replace(asset, mesh=TriangleMesh(mesh.points, mesh.faces[kept]), source_faces=faces), note


def _parts(mesh: TriangleMesh) -> tuple[IntArray, FloatArray]:
    """The part of each face (m,), and the extents of the parts (k, 3)."""
    a, b, c = mesh.faces.T
    count = len(mesh.points)
    edges = coo_matrix((np.ones(2 * len(a), np.int8), (np.r_[a, b], np.r_[b, c])), shape=(count, count))
    number, part = connected_components(edges, directed=False)
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    np.minimum.at(low, part, mesh.points)
    np.maximum.at(high, part, mesh.points)
    there, part_of = np.unique(part[a], return_inverse=True)
    return part_of.reshape(-1), (high - low)[there]


def _grounds(sides: FloatArray, length: float) -> BoolArray:
    """(k,) whether a part of these extents is a ground."""
    low, middle, high = np.sort(sides, axis=1).T
    flat = (low < FLAT * middle) & (middle > WIDE * length)
    return np.asarray(flat | (high > VAST * length))
