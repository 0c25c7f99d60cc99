"""Hypothesis strategies over surfaces: families, points inside faces, on edges, on vertices, tangent vectors."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from hypothesis import strategies as st

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.testing import meshes


@lru_cache(maxsize=32)
def cached_family(name: str) -> TriangleMesh:
    """One shared instance per family, so that lazily built topology is built once."""
    return meshes.family(name)


def family_names(*, without: tuple[str, ...] = ()) -> st.SearchStrategy[str]:
    """Names of mesh families."""
    return st.sampled_from([name for name in meshes.FAMILIES if name not in without])


@st.composite
def surface_points(
    draw: st.DrawFn, mesh: TriangleMesh, count: int = 1, *, inside_only: bool = False
) -> SurfacePoints:
    """`count` points: most inside faces, some exactly on edges or vertices unless `inside_only`."""
    faces = draw(st.lists(st.integers(0, len(mesh.faces) - 1), min_size=count, max_size=count))
    weights = np.empty((count, 3))
    for k in range(count):
        raw = np.array(draw(st.tuples(*3 * [st.floats(0.02, 1.0)])))
        kind = 0 if inside_only else draw(st.sampled_from([0, 0, 0, 1, 2]))
        corner = draw(st.integers(0, 2))
        if kind == 1:
            raw[corner] = 0.0
        elif kind == 2:
            raw = np.eye(3)[corner]
        weights[k] = raw / raw.sum()
    return SurfacePoints(np.array(faces, np.int64), weights)


def headings() -> st.SearchStrategy[complex]:
    """Unit complex numbers, the axes among them."""
    angles = st.one_of(st.sampled_from([0.0, np.pi / 2, np.pi, -np.pi / 2]), st.floats(-np.pi, np.pi))
    return angles.map(lambda angle: complex(np.cos(angle), np.sin(angle)))
