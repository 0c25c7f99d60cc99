"""From a file's own polygons to a surface: welded, triangulated, without loose points, with both ways back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.triangulate import triangulate
from contact_core.geometry.weld import weld


@dataclass(frozen=True, eq=False)
class Polygons:
    """What a file says. points: (n, 3). sizes: (f,) corners per polygon. indices: (sum of sizes,). notes: sentences
    on what the file holds besides."""

    points: FloatArray
    sizes: IntArray
    indices: IntArray
    notes: tuple[str, ...] = ()

    @classmethod
    def of_triangles(cls, points: FloatArray, faces: IntArray) -> Polygons:
        return cls(points, np.full(len(faces), 3), np.asarray(faces, np.int64).ravel())


@dataclass(frozen=True, eq=False)
class Surface:
    """points: (k, 3). faces: (m, 3). source_vertices: (n,) surface point of each file vertex, -1 where unused.
    first_source: (k,) one file vertex behind each point. source_faces: (m,) polygon of each triangle."""

    points: FloatArray
    faces: IntArray
    source_vertices: IntArray
    first_source: IntArray
    source_faces: IntArray
    notes: tuple[str, ...]


def surface_of(polygons: Polygons, weld_groups: IntArray | None = None) -> Surface:
    """Weld by position, triangulate, drop points that no face uses. Raises InvalidInput.

    weld_groups: (n,) labels; points of different labels never merge (skins whose weights differ at a seam).
    """
    points, indices = polygons.points, polygons.indices
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        raise InvalidInput(f"faces name vertex {int(indices.max())} or {int(indices.min())} of {len(points)}")
    used = np.unique(indices)
    finite = np.isfinite(points[used]).all(axis=1)
    if not finite.all():
        bad = int(used[np.argmin(finite)])
        raise InvalidInput(f"vertex {bad} is at {points[bad].tolist()}, which is not finite, and a face uses it")
    welded, group = weld(points[used])
    if weld_groups is not None:
        group = np.unique(np.stack([group, weld_groups[used]]), axis=1, return_inverse=True)[1].reshape(-1)
    point_of = np.full(len(points), -1)
    point_of[used] = group
    triangles, source_faces, notes = triangulate(polygons.sizes, point_of[indices], points[used][_firsts(group)])
    kept = np.unique(triangles)
    renumber = np.full(int(group.max(initial=-1)) + 2, -1)
    renumber[kept] = np.arange(len(kept))
    source_vertices = renumber[point_of]  # -1 reads the last entry, which is -1
    firsts = np.flatnonzero(source_vertices >= 0)
    first_source = firsts[_firsts(source_vertices[firsts])]
    if not len(triangles):
        raise InvalidInput("it holds no faces")
    return Surface(
        points=points[first_source],
        faces=renumber[triangles],
        source_vertices=source_vertices,
        first_source=first_source,
        source_faces=source_faces,
        notes=(*_weld_notes(len(points), len(used), len(welded)), *notes),
    )


def _firsts(group: IntArray) -> IntArray:
    """(groups,) position of the first member of each group 0, 1, 2..."""
    return np.unique(group, return_index=True)[1]


def _weld_notes(total: int, used: int, welded: int) -> list[str]:
    notes = []
    if used > welded:
        notes.append(f"{used} vertices lie at {welded} positions; they were welded.")
    if total > used:
        notes.append(f"{total - used} vertices that no face uses were left out.")
    return notes
