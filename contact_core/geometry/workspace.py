"""The memory that a log-map query works in: allocated once per mesh, and kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray, sparse_zeros
from contact_core.geometry.kernel_arrays import Labels, Queue, Targets, Windows
from contact_core.geometry.mesh import TriangleMesh

_POPS = 4  # queue_kernels.POPS; importing that would import numba
TOUCHED = 2**26  # bytes: 350,000 faces


class Workspace:
    """Arrays for one query at a time on a mesh of n points and m faces, in the groups that kernels take.

    Nothing is cleared between queries: a row whose first entry is not the epoch of the query counts as empty. Up to
    TOUCHED bytes the pages are written to at once, so that the first query in a region costs no page faults; of a
    larger mesh they become resident where queries go, and memory grows with the regions visited.
    """

    def __init__(self, point_count: int, face_count: int) -> None:
        sizes = (point_count, 2), (point_count, 3), (point_count, 4), (3 * face_count, 6), (face_count, 2)
        touched = 8 * sum(rows * columns for rows, columns in sizes) <= TOUCHED
        reach, leg, origin, self._occupied, self._waiting = map(np.empty if touched else sparse_zeros, sizes)
        if touched:
            for array in (reach, leg, origin, self._occupied, self._waiting):
                array.fill(0)
        self.labels = Labels(0.0, reach, leg, origin.view(np.int64))
        self._state: IntArray = np.zeros(7, np.int64)
        self.reserve(4096)

    def reserve(self, windows: int) -> None:
        """Make room for so many windows at once."""
        self.windows = Windows(np.empty((windows, 10)), np.empty((windows, 4), np.int64), self._occupied)
        self.queue = Queue(np.empty(2 * windows), np.empty(2 * windows, np.int64), self._state)
        fresh: tuple[Any, ...] = (self.windows.floats, self.windows.integers, self.queue.keys, self.queue.items)
        for array in fresh:
            array.fill(0)

    def targets(self, count: int) -> Targets:
        """Records for so many targets."""
        return Targets(np.empty((count, 12)), np.empty((count, 7), np.int64), self._waiting)

    def begin(self) -> None:
        """A new epoch: whatever an earlier query wrote counts as empty."""
        self.labels = self.labels._replace(epoch=self.labels.epoch + 1.0)

    def label(self, vertices: IntArray, distances: FloatArray) -> None:
        """Give vertices (k,) the distances (k,) that an earlier query found, before this one begins.

        They have no paths: only distances may be read from a query that began so.
        """
        reach = self.labels.reach
        reach[vertices, 0], reach[vertices, 1] = self.labels.epoch, distances
        self.labels.origin[vertices, 2] = 0

    def grow(self) -> None:
        """Four times the room, and a new epoch: the query that overflowed starts again from nothing."""
        self.begin()
        self.reserve(4 * len(self.windows.floats))

    @property
    def pops(self) -> int:
        """What the last query took from its heap."""
        return int(self.queue.state[_POPS])

    @classmethod
    @contextmanager
    def lent(cls, mesh: TriangleMesh) -> Iterator[Workspace]:
        """A workspace of the mesh, for one query; concurrent queries get one each."""
        pool: list[Workspace] = mesh.__dict__.setdefault("_workspaces", [])
        try:
            workspace = pool.pop()
        except IndexError:
            workspace = cls(len(mesh.points), len(mesh.faces))
        workspace.begin()
        try:
            yield workspace
        finally:
            pool.append(workspace)
