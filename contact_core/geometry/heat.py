"""Smoothed distance on a part of a surface by the heat method, and its gradient.

Crane, Weischedel and Wardetzky, "Geodesics in Heat" (TOG 2013). The distance is smooth where an exact one has
its ridge, which is what the smoothed medial axis of a patch needs (paper, default axes); only the patch's
own faces enter the sparse systems, so the cost is the patch's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags
from scipy.sparse.linalg import splu

from contact_core.arrays import FloatArray, IntArray, frozen
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh


@dataclass(frozen=True, eq=False)
class HeatField:
    """A scalar field over some faces of a mesh.

    vertices: (v,) mesh vertices of the region, ascending. distance: (v,) smoothed distance to the sources,
    surface units, smallest value 0. faces: (r,) the region's faces with area. gradient: (r, 3) of the distance
    in each of them, about unit length away from ridges.
    """

    vertices: IntArray
    distance: FloatArray
    faces: IntArray
    gradient: FloatArray


def heat_distance(mesh: TriangleMesh, faces: Any, sources: Any, *, smoothing: float = 1.0) -> HeatField:
    """Smoothed distance from source vertices over a region of faces.

    faces: (r,) indices of the region's faces. sources: (s,) mesh vertices within the region. smoothing: the
    heat flow's time in squared mean edge lengths; larger is smoother. Natural (Neumann) boundary conditions.
    Parts of the region that hold no source get infinity. Raises InvalidInput.
    """
    region = np.unique(frozen(faces, np.int64, (None,), "faces"))
    source = np.unique(frozen(sources, np.int64, (None,), "sources"))
    if not len(region) or region[0] < 0 or region[-1] >= len(mesh.faces):
        raise InvalidInput(
            f"the region needs face indices in 0..{len(mesh.faces) - 1}, but got {region[:3].tolist()} ..."
        )
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise InvalidInput(f"smoothing must be positive, but got {smoothing}.")
    region = region[mesh.face_areas[region] > 0.0]
    vertices, local = np.unique(mesh.faces[region], return_inverse=True)
    triangles = local.reshape(-1, 3)  # (r, 3) indices into vertices
    seeds = np.searchsorted(vertices, source)
    if not len(source) or (seeds >= len(vertices)).any() or (vertices[seeds] != source).any():
        raise InvalidInput("sources must be vertices of the region with area, at least one.")

    corners = mesh.points[vertices[triangles]]  # (r, 3, 3)
    area = mesh.face_areas[region]  # (r,)
    gradients = _hat_gradients(corners, area)  # (r, 3, 3): of the hat function of each corner
    stiffness = _stiffness(triangles, gradients, area, len(vertices))
    mass = np.bincount(triangles.ravel(), weights=np.repeat(area / 3.0, 3), minlength=len(vertices))  # (v,)
    edge = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).mean()

    delta = np.zeros(len(vertices))
    delta[seeds] = 1.0
    heat = splu(csc_matrix(diags(mass) + smoothing * edge * edge * stiffness)).solve(delta)
    flow = -np.einsum("rci,rc->ri", gradients, heat[triangles])  # (r, 3) down the heat
    length = np.linalg.norm(flow, axis=1, keepdims=True)
    flow = np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)
    divergence = np.bincount(
        triangles.ravel(), weights=(area[:, None] * np.einsum("rci,ri->rc", gradients, flow)).ravel(),
        minlength=len(vertices),
    )  # fmt: skip
    # The constant is free on every connected part: a trace of mass makes the system definite.
    distance = splu(csc_matrix(stiffness + 1e-9 * diags(mass) / mass.mean())).solve(divergence)
    distance = _from_sources(distance, seeds, stiffness)
    finite = np.where(np.isfinite(distance), distance, 0.0)
    gradient = np.einsum("rci,rc->ri", gradients, finite[triangles])
    return HeatField(vertices, distance, region, gradient)


def _hat_gradients(corners: FloatArray, area: FloatArray) -> FloatArray:
    """(r, 3, 3) gradient of each corner's hat function: the opposite edge turned inwards, over twice the area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # (r, 3, 3) edge facing each corner
    return np.asarray(np.cross(normal[:, None, :], opposite) / (2.0 * area)[:, None, None])


def _stiffness(triangles: IntArray, gradients: FloatArray, area: FloatArray, size: int) -> csc_matrix:
    """(v, v) cotangent stiffness matrix, positive semi-definite."""
    blocks = np.einsum("rai,rbi->rab", gradients, gradients) * area[:, None, None]  # (r, 3, 3)
    rows = np.repeat(triangles, 3, axis=1).ravel()
    columns = np.tile(triangles, (1, 3)).ravel()
    return csc_matrix(coo_matrix((blocks.ravel(), (rows, columns)), shape=(size, size)))


def _from_sources(distance: FloatArray, seeds: IntArray, stiffness: csc_matrix) -> FloatArray:
    """Shift each connected part so that its lowest source is 0; parts without a source become infinite."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(stiffness, directed=False)
    shift = np.full(count, np.inf)
    np.minimum.at(shift, label[seeds], distance[seeds])
    reached = np.isfinite(shift[label])
    return np.where(reached, np.maximum(distance - np.where(reached, shift[label], 0.0), 0.0), np.inf)
