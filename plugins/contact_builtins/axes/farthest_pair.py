"""The paper's first default axis: the two farthest points of the patch, joined by a geodesic."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist, squareform

from contact_builtins.axes.straight import require
from contact_core.arrays import FloatArray, IntArray
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints


class FarthestPair:
    """Farthest in a straight line: the paper does not say by which distance, and this one needs no n^2 geodesics.
    The axis starts at the end where the patch is wider, so that it depends on the patch alone."""

    name = "farthest_pair"
    summary = "the two farthest points of the patch, joined by a geodesic (the paper's first)"

    def generate(self, request: AxisRequest) -> SurfacePoints:
        positions = require(request)
        candidates = _hull(positions)
        apart = squareform(pdist(positions[candidates]))  # (h, h)
        start, end = (int(candidates[k]) for k in np.unravel_index(np.argmax(apart), apart.shape))
        along = (positions - positions.mean(axis=0)) @ (positions[end] - positions[start])  # (n,)
        return request.points[[start, end] if (along**3).sum() >= 0.0 else [end, start]]


def _hull(positions: FloatArray) -> IntArray:
    """Indices of the points that can be farthest: those of the convex hull, all of them where it is flat."""
    try:
        return np.asarray(np.sort(ConvexHull(positions).vertices), np.int64)
    except QhullError:  # fewer than four points, or all in one plane
        return np.arange(len(positions))
