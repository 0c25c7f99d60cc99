"""Skin weights by bone heat (Baran and Popovic 2007): heat flows over the surface from the nearest bone.

Unlike a falloff by plain distance it never leaks from one finger to its neighbour.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh


def bone_heat_weights(
    mesh: TriangleMesh, owner: IntArray, distance: FloatArray, bones: int, stiffness: float = 1.0
) -> FloatArray:
    """(n, bones) weights that sum to 1, of the equilibrium -laplace(w) + H w = H p.

    owner: (n,) the bone that heats each vertex. distance: (n,) to it, surface units. H = stiffness / distance^2:
    more stiffness, sharper borders.
    """
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    laplacian, mass = cotangent_laplacian(mesh)
    heat = mass * stiffness / np.maximum(distance, 1e-3 * mesh.bounding_box_diagonal) ** 2
    source = np.zeros((len(mesh.points), bones))
    source[np.arange(len(owner)), owner] = heat
    weights = splu((laplacian + diags_array(heat)).tocsc()).solve(source)
    weights = np.maximum(weights, 0.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def cotangent_laplacian(mesh: TriangleMesh) -> tuple[Any, FloatArray]:
    """The cotangent Laplacian (n, n), sparse, semi-definite (cotangents clipped at 0), and vertex areas (n,)."""
    from scipy.sparse import coo_array, diags_array

    n = len(mesh.points)
    rows, columns, values = [], [], []
    mass = np.zeros(n)
    for k in range(3):
        i, j, o = mesh.faces[:, (k + 1) % 3], mesh.faces[:, (k + 2) % 3], mesh.faces[:, k]
        u, v = mesh.points[i] - mesh.points[o], mesh.points[j] - mesh.points[o]
        cotangent = np.einsum("ij,ij->i", u, v) / np.linalg.norm(np.cross(u, v), axis=1)
        rows += [i, j]
        columns += [j, i]
        values += [0.5 * np.maximum(cotangent, 0.0)] * 2
        np.add.at(mass, o, mesh.face_areas / 3.0)
    adjacency = coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n)
    ).tocsr()
    return diags_array(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency, mass


def strongest(weights: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """(n, count) joints and weights: the strongest influences of each vertex, renormalised."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    kept = np.take_along_axis(weights, joints, axis=1)
    kept[kept < 1e-4] = 0.0
    return joints.astype(np.int64), kept / kept.sum(axis=1, keepdims=True)
