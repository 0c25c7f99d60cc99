"""The picture of a proxy: the mesh with what is broken of it, and the proxy round the mesh."""

from __future__ import annotations

from typing import Literal

import numpy as np

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.report import report
from contact_core.geometry.topology import Topology
from contact_core.scene.picture import Picture, PictureMesh

MESH, PROXY = (0.86, 0.80, 0.74), (0.45, 0.66, 0.83)
BROKEN, OPEN = (0.80, 0.10, 0.15), (0.95, 0.60, 0.10)
_VIEWS = {"Y": (0.6, 0.45, 1.0), "Z": (0.6, -1.0, 0.45), "X": (0.45, 0.6, 1.0)}


def proxy_pictures(mesh: TriangleMesh, proxy: TriangleMesh, up_axis: Literal["X", "Y", "Z"]) -> list[Picture]:
    """A mesh with its open and its broken edges, and its proxy."""
    found = report(mesh)
    up = tuple(float(axis == up_axis) for axis in "XYZ")
    edges = mesh.points[np.asarray(found.non_manifold_edges, np.int64).reshape(-1, 2)]
    bad = mesh.points[np.asarray(found.non_manifold_vertices, np.int64)]
    border = Topology.of(mesh).boundary_halfedges
    ends = np.stack([mesh.faces.ravel()[border], np.roll(mesh.faces, -1, axis=1).ravel()[border]], axis=1)
    before = Picture(
        meshes=(PictureMesh(mesh, MESH),),
        points=((bad, BROKEN),) if len(bad) else (),
        lines=((mesh.points[ends], OPEN), (edges, BROKEN)),
        camera_from=_VIEWS[up_axis],
        up=(up[0], up[1], up[2]),
        caption=f"as it came: {found.faces} faces, {found.components} parts, {found.boundary_loops} holes",
        legend=(("open edges", OPEN), ("not manifold", BROKEN)),
    )
    after = Picture(
        meshes=(PictureMesh(proxy, PROXY),),
        camera_from=_VIEWS[up_axis],
        up=before.up,
        caption=f"its proxy, closed and manifold: {len(proxy.faces)} faces, {report(proxy).components} parts",
    )
    return [before, after]
