"""From a file's own polygons to a surface: welded, triangulated, without loose points, with both ways back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contact_builtins.formats.refusal import NO_FACES, NoSurface
from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.sound import sound_polygons
from contact_core.geometry.triangulate import triangulate


@dataclass(frozen=True, eq=False)
class Polygons:
    """What a file says. points: (n, 3). sizes: (f,) corners per polygon. indices: (sum of sizes,). notes: sentences
    on what the file holds besides. kept: (f,) polygons that are part of the surface; None for all."""

    points: FloatArray
    sizes: IntArray
    indices: IntArray
    notes: tuple[str, ...] = ()
    kept: BoolArray | None = None

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
    """Make the polygons sound (`geometry.sound`), triangulate, drop points that no face uses. Raises InvalidInput.

    weld_groups: (n,) labels; points of different labels never merge (skins whose weights differ at a seam).
    """
    points, sizes, indices = polygons.points, polygons.sizes, polygons.indices
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        raise InvalidInput(f"faces name vertex {int(indices.max())} or {int(indices.min())} of {len(points)}")
    numbers = np.arange(len(sizes))
    if polygons.kept is not None:
        numbers = numbers[polygons.kept]
        sizes, indices = sizes[numbers], indices[np.repeat(polygons.kept, sizes)]
    sizes, indices, numbers, odd = _finite(points, sizes, indices, numbers)
    used, corners = np.unique(indices, return_inverse=True)
    apart = None if weld_groups is None else weld_groups[used]
    sound = sound_polygons(points[used], sizes, corners.reshape(-1), apart=apart)
    triangles, cut, notes = triangulate(sound.sizes, sound.indices, points[used[sound.first]])
    if not len(triangles):
        raise NoSurface(NO_FACES)
    kept = np.unique(triangles)
    renumber = np.full(len(sound.first) + 1, -1)
    renumber[kept] = np.arange(len(kept))
    source_vertices = np.full(len(points), -1)
    source_vertices[used] = renumber[sound.point_of]
    first_source = used[sound.first[kept]]
    return Surface(
        points=points[first_source],
        faces=renumber[triangles],
        source_vertices=source_vertices,
        first_source=first_source,
        source_faces=numbers[sound.face_of[cut]],
        notes=(*odd, *_unused_notes(len(points) - len(used)), *sound.notes, *notes),
    )


def _finite(
    points: FloatArray, sizes: IntArray, indices: IntArray, numbers: IntArray
) -> tuple[IntArray, IntArray, IntArray, list[str]]:
    """Polygons without those that have a corner at no place, and a note. Raises InvalidInput where none is left."""
    finite = np.asarray(np.isfinite(points[indices]).all(axis=1))
    if finite.all():
        return sizes, indices, numbers, []
    polygon = np.repeat(np.arange(len(sizes)), sizes)
    sound = np.ones(len(sizes), bool)
    sound[polygon[~finite]] = False
    if not sound.any():
        bad = int(indices[np.argmin(finite)])
        raise InvalidInput(f"vertex {bad} is at {points[bad].tolist()}, which is not finite, and a face uses it")
    note = f"{np.count_nonzero(~sound)} faces with corners that are not finite were left out."
    return sizes[sound], indices[sound[polygon]], numbers[sound], [note]


def _unused_notes(unused: int) -> list[str]:
    return [f"{unused} vertices that no face uses were left out."] if unused else []
