"""How much a transfer stretches, squeezes and folds a patch, per point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.contact.area import triangle_areas
from contact_core.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class Distortion:
    """A patch there against the patch here, n points.

    length_ratio: (n,) mean length of the edges at a point, there over here. area_ratio: (n,) area of the
    triangles at a point, there over here. folded: (n,) points of a triangle that lies with its other side up.
    folds: how many triangles do. 1 everywhere and no fold where the surfaces are isometric; nan where a point has
    no triangle.
    """

    length_ratio: FloatArray
    area_ratio: FloatArray
    folded: BoolArray
    folds: int

    @property
    def worst_length_ratio(self) -> float:
        """The largest stretch or squeeze of lengths, as a factor of at least 1."""
        return _worst(self.length_ratio)

    @property
    def worst_area_ratio(self) -> float:
        """The largest growth or loss of area, as a factor of at least 1."""
        return _worst(self.area_ratio)


def measure_distortion(
    triangles: IntArray,
    positions: FloatArray,
    normals: FloatArray,
    positions_there: FloatArray,
    normals_there: FloatArray,
    *,
    mirrored: bool = False,
) -> Distortion:
    """Distortion of triangles (t, 3) over points (n, 3) with surface normals (n, 3) here and there.

    Positions are in the same units. mirrored: an even copy turns each triangle round.
    """
    if positions.shape != positions_there.shape:
        raise InvalidInput(f"expected as many points on both, but got {len(positions)} and {len(positions_there)}.")
    n = len(positions)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ends = np.concatenate([edges[:, 0], edges[:, 1]])

    def mean_length(where: FloatArray) -> FloatArray:
        length = np.linalg.norm(where[edges[:, 0]] - where[edges[:, 1]], axis=1)
        return np.asarray(np.bincount(ends, weights=np.concatenate([length, length]), minlength=n), dtype=float)

    def area(where: FloatArray) -> FloatArray:
        per_triangle = triangle_areas(where, triangles)
        return np.asarray(
            np.bincount(triangles.ravel(), weights=np.repeat(per_triangle, 3), minlength=n), dtype=float
        )

    turned = _facing(triangles, positions_there, normals_there) * _facing(triangles, positions, normals)
    folds = (turned > 0.0) if mirrored else (turned < 0.0)  # (t,)
    folded = np.zeros(n, dtype=bool)
    folded[triangles[folds]] = True
    return Distortion(
        _ratio(mean_length(positions_there), mean_length(positions)),
        _ratio(area(positions_there), area(positions)),
        folded,
        int(folds.sum()),
    )


def _facing(triangles: IntArray, positions: FloatArray, normals: FloatArray) -> FloatArray:
    """(t,) positive where a triangle turns counter-clockwise seen from outside, negative where clockwise."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    return np.asarray(np.einsum("ti,ti->t", np.cross(b - a, c - a), normals[triangles].sum(axis=1)))


def _ratio(there: FloatArray, here: FloatArray) -> FloatArray:
    return np.divide(there, here, out=np.full(len(here), np.nan), where=here > 0.0)


def _worst(ratio: FloatArray) -> float:
    known = ratio[np.isfinite(ratio) & (ratio > 0.0)]
    return float(np.exp(np.abs(np.log(known)).max())) if len(known) else 1.0
