"""The convex hull of a mesh: a filled solid for what is hollow."""

from __future__ import annotations

import numpy as np

from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh


def convex_hull(
    mesh: TriangleMesh,
    low: tuple[float, float, float] | None = None,
    high: tuple[float, float, float] | None = None,
) -> TriangleMesh:
    """The convex hull of the mesh's points, of those within a box where one is given: a filled proxy.

    Raises InvalidInput when the box leaves too little for a hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    points = mesh.points[mesh.used_points]
    if low is not None:
        points = points[(points >= np.asarray(low)).all(axis=1)]
    if high is not None:
        points = points[(points <= np.asarray(high)).all(axis=1)]
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise InvalidInput(f"the box leaves {len(points)} points, which span no hull; widen it.") from error
    faces = hull.simplices.copy()
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("mi,mi->m", normal, hull.equations[:, :3]) < 0  # qhull's normals point out
    faces[inward] = faces[inward][:, ::-1]
    return TriangleMesh(points, faces)
