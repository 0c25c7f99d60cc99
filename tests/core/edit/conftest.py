"""A session on two small surfaces with a few patches: what tests of the verbs start from."""

from __future__ import annotations

import numpy as np
import pytest

from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.session import Session
from contact_core.testing.strategies import cached_family


def disk(mesh: TriangleMesh, face: int, count: int, reach: float, seed: int = 0) -> SurfacePoints:
    """Random points in the faces within `reach` (of the bounding box) round a face."""
    centres = mesh.points[mesh.faces].mean(axis=1)
    distance = np.linalg.norm(centres - centres[face], axis=1)
    near = np.flatnonzero(distance <= reach * mesh.bounding_box_diagonal)
    random = np.random.default_rng(seed)
    return SurfacePoints(random.choice(near, count), random.dirichlet(np.ones(3), count))


def on_the_line(points: SurfacePoints, mesh: TriangleMesh) -> SurfacePoints:
    """The two points farthest apart: an axis."""
    where = points.positions(mesh)
    first = int(np.argmax(np.linalg.norm(where - where.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(where - where[first], axis=1)))
    return points[[first, second]]


@pytest.fixture
def session() -> Session:
    """Surfaces "torus" (in cm) and "sphere" (in m); patches palm, thumb, tip on the torus."""
    session = Session(discover=False)
    torus, sphere = cached_family("torus"), cached_family("sphere")
    session.surfaces.add("torus", torus, meters_per_unit=0.01)
    session.surfaces.add("sphere", sphere.with_points(0.01 * sphere.points))
    for number, (name, face) in enumerate([("palm", 100), ("thumb", 140), ("tip", 180)]):
        points = disk(torus, face, 25, 0.09, number)
        session.patches.paint(name, points, surface="torus", axis=on_the_line(points, torus))
    return session
