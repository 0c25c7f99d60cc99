"""The memory that a log-map query works in: allocated once per mesh, resident only where queries have been."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.geometry.mesh import TriangleMesh

_POPS = 4  # queue_kernels.POPS; importing that would import numba


class Workspace:
    """Arrays for one query at a time on a mesh of n points and m faces.

    Nothing is cleared between queries: a row whose first entry is not the epoch of the query counts as empty. The
    arrays begin as untouched zero pages, so memory grows with the regions visited, not with the mesh.

    reach: (n, 2) epoch, distance.  origin: (n, 4) root, wedge, 1 once the vertex is a root itself, 1 where the
    last leg touches the rim of its window.
    leg: (n, 3) last leg to the vertex in the root's wedge frame; angle round the vertex of the way back.
    claim: (3m, 5) per entered halfedge: epoch, distance to the apex, where the ray to the apex crosses, interval.
    listed: (m, 2) epoch, first target of the face.
    floats, integers: window records, as in `window_kernels`.  keys, items, state: the queue and counters, as in
    `queue_kernels`.
    """

    def __init__(self, point_count: int, face_count: int) -> None:
        self.epoch = 0.0
        self.reach: FloatArray = np.zeros((point_count, 2))
        self.leg: FloatArray = np.zeros((point_count, 3))
        self.origin: IntArray = np.zeros((point_count, 4), np.int64)
        self.claim: FloatArray = np.zeros((3 * face_count, 5))
        self.listed: FloatArray = np.zeros((face_count, 2))
        self.state: IntArray = np.zeros(7, np.int64)
        self.reserve(4096)

    def reserve(self, windows: int) -> None:
        """Make room for so many windows at once."""
        self.floats: FloatArray = np.empty((windows, 10))
        self.integers: IntArray = np.empty((windows, 4), np.int64)
        self.keys: FloatArray = np.empty(2 * windows)
        self.items: IntArray = np.empty(2 * windows, np.int64)

    def grow(self) -> None:
        """Four times the room, and a new epoch: the query that overflowed starts again from nothing."""
        self.epoch += 1.0
        self.reserve(4 * len(self.floats))

    @property
    def pops(self) -> int:
        """What the last query took from its heap."""
        return int(self.state[_POPS])

    @classmethod
    @contextmanager
    def lent(cls, mesh: TriangleMesh) -> Iterator[Workspace]:
        """A workspace of the mesh, for one query; concurrent queries get one each."""
        pool: list[Workspace] = mesh.__dict__.setdefault("_workspaces", [])
        try:
            workspace = pool.pop()
        except IndexError:
            workspace = cls(len(mesh.points), len(mesh.faces))
        workspace.epoch += 1.0
        try:
            yield workspace
        finally:
            pool.append(workspace)
