"""Polygons of a file as one sound surface: joined at seams, doubles dropped, wound outwards.

Files split points along texture seams, write loose triangles, list faces twice or wind them inwards. One function
mends that for every reader and host, and says what it did.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import BoolArray, FloatArray, IntArray, frozen
from contact_core.geometry.stitch import (
    Sides,
    joined_points,
    pairs_of_open_sides,
    without,
    without_crowds,
)
from contact_core.geometry.triangulate import check_polygons
from contact_core.geometry.weld import close_points
from contact_core.geometry.winding import Winding, facing_inwards, wound_alike

ROUNDING = (
    8 * 2.0**-23
)  # relative: copies of a point that went through float32 differ by a few units in the last place
SHARE_OF_EDGE = 0.1  # of the shortest edge at a point: what lies farther is another point


@dataclass(frozen=True, eq=False)
class SoundPolygons:
    """point_of: (n,) new point of each old one, numbered by first appearance. first: (k,) the old point behind
    each. sizes: (g,) and indices: the polygons that remain, of new points. face_of: (g,) which ones they were."""

    point_of: IntArray
    first: IntArray
    sizes: IntArray
    indices: IntArray
    face_of: IntArray
    notes: tuple[str, ...]


def sound_polygons(
    points: Any,
    sizes: Any,
    indices: Any,
    *,
    apart: IntArray | None = None,
    exact: bool = False,
    clockwise: bool = False,
) -> SoundPolygons:
    """Join, drop doubles, turn. points: (n, 3) finite. sizes: (f,) corners per polygon. indices: their points.

    apart: (n,) labels; points of different labels never become one. exact: only bit-equal positions are joined.
    clockwise: polygons are wound so seen from outside. What is manifold stays so (`stitch`). Raises InvalidInput.
    """
    points = frozen(points, np.float64, (None, 3), "points")
    sizes = frozen(sizes, np.int64, (None,), "face sizes")
    indices = frozen(indices, np.int64, (None,), "face indices")
    check_polygons(sizes, indices, len(points))
    shape = Sides.of(sizes, indices)
    reach = np.zeros(len(points)) if exact else _reach(points, shape)
    joining = _joining(points, sizes, indices, shape, _groups(points, shape, reach, apart), either_sense=True)
    notes = list[str]()
    if not exact:
        joining = _across_noise(points, sizes, indices, shape, apart, joining, notes)
    kept, sides = joining.kept, joining.sides
    winding, label = _wound(joining)
    first = _first_of_each(label)
    turned = _turned_outwards(points[first], sides.between(label), winding, clockwise, notes)
    corners = _reversed_where(turned, sides)
    return SoundPolygons(
        point_of=label,
        first=first,
        sizes=sizes[kept],
        indices=corners if _is_each_its_own(label) else label[corners],
        face_of=np.flatnonzero(kept),
        notes=(*_joining_notes(sides.tail, label), *joining.notes, *notes, *_loose_notes(winding)),
    )


def _reach(points: FloatArray, sides: Sides) -> FloatArray:
    """(n,) how far the copies of a point may lie apart (surface units): a few roundings of float32 at the size of
    the coordinates, and never a noticeable part of the shortest edge at the point."""
    size = np.abs(points).max(axis=1, initial=0.0)
    typical = float(np.median(size)) if len(size) else 0.0
    rounding = ROUNDING * np.maximum(size, typical)
    return np.asarray(np.minimum(rounding, SHARE_OF_EDGE * _shortest_edges(points, sides)))


def _shortest_edges(points: FloatArray, sides: Sides) -> FloatArray:
    """(n,) length of the shortest edge of some length at each point; inf where there is none."""
    length = np.linalg.norm(points[sides.tail] - points[sides.head], axis=1)
    shortest = np.full(len(points), np.inf)
    long = length > 0.0
    for ends in (sides.tail, sides.head):
        np.minimum.at(shortest, ends[long], length[long])
    return shortest


def _groups(points: FloatArray, sides: Sides, reach: FloatArray, apart: IntArray | None) -> IntArray:
    """(n,) group of each point that lies at one place: equal positions, on open sides also close ones."""
    on_border = np.zeros(len(points), bool)
    loose = sides.open
    on_border[sides.tail[loose]] = on_border[sides.head[loose]] = True
    group = close_points(points, np.where(on_border, np.where(np.isfinite(reach), reach, 0.0), 0.0))
    if apart is None and _is_each_its_own(group):
        return group
    shrunk = np.flatnonzero(group[sides.tail] == group[sides.head])
    shrunk = shrunk[(points[sides.tail[shrunk]] != points[sides.head[shrunk]]).any(axis=1)]
    if not len(shrunk) and apart is None:
        return group
    if len(shrunk):  # chains of close points swallowed an edge: only equal positions join there
        equal = close_points(points, np.zeros(len(points)))
        lost = np.isin(group, group[sides.tail[shrunk]])
        group = np.where(lost, equal + len(points), group)
    if apart is not None:
        group = np.unique(np.stack([group, apart]), axis=1, return_inverse=True)[1].reshape(-1)
    return np.unique(group, return_inverse=True)[1].reshape(-1)


def _single_faces(group: IntArray, sizes: IntArray, indices: IntArray, notes: list[str]) -> BoolArray:
    """(f,) which faces have three corners or more in different places, and are the first to lie there."""
    from contact_core.geometry.side_kernels import corners_of_faces

    corners, mixed = np.empty(len(sizes), np.int64), np.empty(len(sizes), np.int64)
    corners_of_faces(sizes, group[indices], np.full(len(group), -1, np.int64), corners, mixed)
    kept = corners >= 3
    if not kept.all():
        notes.append(f"{np.count_nonzero(~kept)} faces with fewer than 3 different corners were dropped.")
    ordered = np.sort(mixed)
    twice = ordered[1:][ordered[1:] == ordered[:-1]]  # those few are compared in full
    suspects = np.flatnonzero(kept & np.isin(mixed, twice)) if len(twice) else np.zeros(0, np.int64)
    doubles = _doubles(suspects, group, sizes, indices) if len(suspects) else []
    if doubles:
        kept[doubles] = False
        notes.append(f"{len(doubles)} faces lay on another face with the same corners and were dropped.")
    return kept


def _doubles(suspects: IntArray, group: IntArray, sizes: IntArray, indices: IntArray) -> list[int]:
    """Faces on another one: of the same points, or of a part that the file does not connect with the other's."""
    starts = np.cumsum(sizes) - sizes
    first = indices[np.minimum(np.repeat(starts, sizes), len(indices) - 1)]
    count = len(group)
    graph = coo_array((np.ones(len(indices), np.int8), (indices, first)), shape=(count, count))
    _, part = connected_components(graph, directed=False)
    parts: dict[
        tuple[int, ...], int
    ] = {}  # of the faces kept in each place: all those of one place are of one part
    seen: set[tuple[int, ...]] = set()
    doubles = list[int]()
    for face in suspects.tolist():
        corners = tuple(np.sort(indices[starts[face] : starts[face] + sizes[face]]).tolist())
        own = int(part[corners[0]])
        if corners in seen or parts.setdefault(tuple(sorted(group[list(corners)].tolist())), own) != own:
            doubles.append(face)
        else:
            seen.add(corners)
    return doubles


@dataclass(frozen=True, eq=False)
class _Joining:
    """kept: (f,) faces that remain. sides: theirs. group: (n,) place of each point. pairs: (p, 2) joined sides.
    label: (n,) each point after that."""

    kept: BoolArray
    sides: Sides
    group: IntArray
    pairs: IntArray
    label: IntArray
    notes: tuple[str, ...]


def _joining(
    points: FloatArray, sizes: IntArray, indices: IntArray, shape: Sides, group: IntArray, *, either_sense: bool
) -> _Joining:
    notes: list[str] = []
    kept = _single_faces(group, sizes, indices, notes)
    sides = shape if kept.all() else Sides.of(sizes[kept], indices[np.repeat(kept, sizes)])
    pairs, label = np.zeros((0, 2), np.int64), np.arange(len(points))
    loose = sides.open
    if len(loose):
        pairs = pairs_of_open_sides(points, sides, loose, group, either_sense=either_sense)
    if len(pairs):
        pairs, label = without_crowds(len(points), sides, group, pairs)
    return _Joining(kept, sides, group, pairs, label, tuple(notes))


def _across_noise(
    points: FloatArray,
    sizes: IntArray,
    indices: IntArray,
    sides: Sides,
    apart: IntArray | None,
    so_far: _Joining,
    notes: list[str],
) -> _Joining:
    """The same after joining open sides that nearly meet, where that closes most of what is open.

    Then the gaps are noise of whatever wrote the file, and no part of the shape. Sides that run the same direction
    are joined in heaps of loose faces only: the borders of two layers of cloth run so, too.
    """
    still = so_far.sides.between(so_far.label).open
    if not len(still):
        return so_far
    border = np.unique(np.concatenate([so_far.sides.tail[still], so_far.sides.head[still]]))
    reach = SHARE_OF_EDGE * _shortest_edges(points, sides)
    gap = _gaps(points[border], so_far.label[border])
    near = gap <= reach[border]
    if np.count_nonzero(near) < _MOST * len(border):
        return so_far
    widest = float(gap[near].max())
    group = _groups(points, sides, np.minimum(reach, 2.0 * widest), apart)  # twice: copies lie all round a point
    heap = len(still) > _HEAP * len(so_far.sides.face)
    wider = _joining(points, sizes, indices, sides, group, either_sense=heap)
    left = len(wider.sides.between(wider.label).open)
    if left > (1.0 - _MOST) * len(still):
        return so_far
    notes.append(
        f"{len(still) - left} of {len(still)} open edges met another one up to {widest:.3g} away and were joined"
        " with it: the copies of their points differ by more than rounding."
    )
    return wider


_MOST, _HEAP = 0.75, 0.25  # share of open sides, see _across_noise


def _gaps(places: FloatArray, label: IntArray) -> FloatArray:
    """(b,) distance from each place to the nearest one of another label."""
    from scipy.spatial import cKDTree

    _, one = np.unique(label, return_index=True)
    if len(one) < 2:
        return np.full(len(places), np.inf)
    distance, _ = cKDTree(places[one]).query(places[one], k=2)
    return np.asarray(distance[np.unique(label, return_inverse=True)[1].reshape(-1), 1])


def _wound(joining: _Joining) -> tuple[Winding, IntArray]:
    """The winding, and the labels: a one-sided surface is left open where it was joined, not against itself."""
    sides, pairs, label = joining.sides, joining.pairs, joining.label
    faces = int(np.count_nonzero(joining.kept))
    own, _ = sides.edges
    while True:
        met = sides.between(label)
        winding = wound_alike(met, faces, own)
        if not len(pairs) or not winding.against.any():
            return winding, label
        edge, count = met.edges
        several = np.zeros(len(count), bool)
        one = np.full(len(count), -1)
        one[edge] = own
        several[edge[one[edge] != own]] = True
        wrong = several & (np.bincount(edge, winding.against, len(count)) > 0)
        if not wrong.any():
            return winding, label
        pairs = without(pairs, met, edge, wrong)
        label = joined_points(len(label), sides, joining.group, pairs)


def _turned_outwards(
    points: FloatArray, sides: Sides, winding: Winding, clockwise: bool, notes: list[str]
) -> BoolArray:
    """(f,) faces to turn round, in all."""
    turned, wound = winding.turned, sides
    if turned.any():
        back = turned[sides.face]
        wound = Sides(sides.face, np.where(back, sides.head, sides.tail), np.where(back, sides.tail, sides.head))
    inwards = facing_inwards(points, wound, winding.piece, clockwise=clockwise)
    both = turned ^ inwards[winding.piece]
    if both.any():
        outwards = " and closed surfaces face outwards" if inwards.any() else ""
        notes.append(
            f"{np.count_nonzero(both)} of {len(both)} faces were turned round, so that neighbours agree{outwards}."
        )
    return both


def _reversed_where(turned: BoolArray, sides: Sides) -> IntArray:
    """The corners of all faces, those of turned ones in the other direction."""
    if not turned.any():
        return sides.tail
    where = np.arange(len(sides.face))
    starts = np.searchsorted(sides.face, np.arange(len(turned)))
    ends = np.append(starts[1:], len(where))
    backwards = (starts + ends - 1)[sides.face] - where
    return sides.tail[np.where(turned[sides.face], backwards, where)]


def _first_of_each(label: IntArray) -> IntArray:
    """(k,) the first point of each of the labels 0..k-1."""
    first = np.empty(int(label.max(initial=-1)) + 1, np.int64)
    first[label[::-1]] = np.arange(len(label) - 1, -1, -1)  # what is written last stays
    return first


def _joining_notes(used: IntArray, label: IntArray) -> list[str]:
    """used: points, with repeats (np.unique of so many takes as long as all the rest)."""
    if _is_each_its_own(label):
        return []
    is_used, is_left = np.zeros(len(label), bool), np.zeros(len(label), bool)
    is_used[used] = is_left[label[used]] = True
    before, after = np.count_nonzero(is_used), np.count_nonzero(is_left)
    return [f"{before} vertices lie at {after} positions; they were welded."] if after < before else []


def _is_each_its_own(label: IntArray) -> bool:
    """Whether labels, numbered by first appearance, join nothing: most files need no welding."""
    return int(label.max(initial=-1)) + 1 == len(label)


def _loose_notes(winding: Winding) -> list[str]:
    """A word on what stays a heap of loose faces."""
    pieces, faces = int(winding.piece.max(initial=-1)) + 1, len(winding.piece)
    if pieces < 100 or pieces < faces / 4:
        return []
    return [
        f"Its {faces} faces fall into {pieces} pieces whose edges do not meet, and a brush stays on one piece."
        " Merge vertices by distance in a modelling program, and export again."
    ]
