"""Joining polygons along their open edges, so that no edge and no vertex gets more faces than a surface has there.

After Gueziec, Taubin, Lazarus and Horn, "Cutting and Stitching: Converting Sets of Polygons to Manifold Surfaces"
(2001): not points are merged but open edges are paired, and a point is what paired edges share. An edge that has
its two faces takes no third one, two solids that touch in an edge stay two, and points that meet alone stay apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from contact_core.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of polygons, one a corner. face: (h,). tail, head: (h,) the points that a side runs between."""

    face: IntArray
    tail: IntArray
    head: IntArray

    @classmethod
    def of(cls, sizes: IntArray, indices: IntArray) -> Sides:
        """sizes: (f,) corners per polygon. indices: (sum of sizes,) points, polygon after polygon."""
        from contact_core.geometry.side_kernels import walk_round

        indices = np.ascontiguousarray(indices)
        face, head = np.empty(len(indices), np.int64), np.empty(len(indices), np.int64)
        walk_round(np.ascontiguousarray(sizes), indices, face, head)
        return cls(face, indices, head)

    def between(self, group: IntArray) -> Sides:
        """The sides with group[point] for each point."""
        if np.array_equal(group, np.arange(len(group))):
            return self
        return Sides(self.face, group[self.tail], group[self.head])

    def picked(self, chosen: IntArray | BoolArray) -> Sides:
        return Sides(self.face[chosen], self.tail[chosen], self.head[chosen])

    @cached_property
    def edges(self) -> tuple[IntArray, IntArray]:
        """(h,) an index of the edge of each side, equal for equal ends; and (edges,) how many sides each has.
        Sides without two ends have an edge of their own kind, which counts 0."""
        from contact_core.geometry.side_kernels import number_edges

        tail, head = np.ascontiguousarray(self.tail), np.ascontiguousarray(self.head)
        points, sides = int(max(tail.max(initial=-1), head.max(initial=-1))) + 1, len(tail)
        edge, count = np.empty(sides, np.int64), np.empty(sides, np.int64)
        degree, first = np.zeros(points, np.int64), np.full(points, -1, np.int64)
        link, far = np.empty(sides, np.int64), np.empty(sides, np.int64)
        count = count[: number_edges(tail, head, degree, first, link, far, edge, count)]
        count[edge[tail == head]] = 0
        return edge, count

    @cached_property
    def crowd(self) -> IntArray:
        """(h,) how many sides there are at the edge of each side, itself included."""
        edge, count = self.edges
        return count[edge]

    @cached_property
    def open(self) -> IntArray:
        """(b,) sides whose edge has no other face."""
        return np.flatnonzero(self.crowd == 1)

    @cached_property
    def edge_ends(self) -> tuple[IntArray, IntArray]:
        """(edges,) the first and the last side at each edge."""
        from contact_core.geometry.side_kernels import ends_of_edges

        edge, count = self.edges
        first, last = np.full(len(count), -1, np.int64), np.empty(len(count), np.int64)
        ends_of_edges(edge, first, last)
        return first, last


def pairs_of_open_sides(
    points: FloatArray, sides: Sides, loose: IntArray, group: IntArray, *, either_sense: bool
) -> IntArray:
    """(p, 2) open sides to join: those at one edge between groups of points.

    Two at an edge are a pair (either_sense: also where they run the same direction, as faces of mixed winding do).
    Where there are more, a side is paired with the next one round the edge on the inner side of its face, so that
    each solid keeps its own. loose: (b,) the open sides. group: (n,) of each point; groups lie at one place.
    """
    met = sides.between(group).picked(loose)
    edge, count = met.edges
    order = np.argsort(edge, kind="stable")
    firsts = np.flatnonzero(np.diff(edge[order], prepend=-1))
    twos = firsts[count[edge[order[firsts]]] == 2]
    pairs = np.stack([order[twos], order[twos + 1]], axis=1)
    if not either_sense:
        pairs = pairs[met.tail[pairs[:, 0]] == met.head[pairs[:, 1]]]
    crowded = np.flatnonzero(count[edge] > 2)
    if len(crowded):
        pairs = np.concatenate([pairs, crowded[_round_edges(points, sides, loose, met, edge, crowded)]])
    pairs = pairs[met.face[pairs[:, 0]] != met.face[pairs[:, 1]]]
    return loose[pairs]


def _round_edges(
    points: FloatArray, sides: Sides, loose: IntArray, met: Sides, edge: IntArray, crowded: IntArray
) -> IntArray:
    """(q, 2) positions in `crowded` of sides that bound one solid wedge."""
    forward = met.tail[crowded] < met.head[crowded]
    own = sides.picked(loose[crowded])
    # one axis per edge, taken from its first side, so that all its sides are measured alike
    _, first, run = np.unique(edge[crowded], return_index=True, return_inverse=True)
    axes = points[own.head[first]] - points[own.tail[first]]
    axes = np.where(forward[first], 1.0, -1.0)[:, None] * axes  # (edges, 3)
    axes /= np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-300)
    across = np.cross(axes, np.eye(3)[np.abs(axes).argmin(axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    up = np.cross(axes, across)
    run = run.reshape(-1)
    inward = np.cross(face_normals(points, sides)[own.face], axes[run]) * np.where(forward, 1.0, -1.0)[:, None]
    angle = np.arctan2((inward * up[run]).sum(axis=1), (inward * across[run]).sum(axis=1))
    order = np.lexsort((forward, angle, run))
    starts = np.flatnonzero(np.diff(run[order], prepend=-1))
    before = np.arange(len(order)) - 1
    before[starts] = np.append(starts[1:], len(order)) - 1  # round the edge
    meets = forward[order] & ~forward[order[before]]
    return np.stack([order[meets], order[before[meets]]], axis=1)


def face_normals(points: FloatArray, sides: Sides) -> FloatArray:
    """(f, 3) twice the vector area of each polygon (Newell)."""
    from contact_core.geometry.side_kernels import vector_areas

    area = np.zeros((int(sides.face.max(initial=-1)) + 1, 3))
    face, tail, head = (np.ascontiguousarray(ids) for ids in (sides.face, sides.tail, sides.head))
    vector_areas(points, face, tail, head, area)
    return area


def joined_points(count: int, sides: Sides, group: IntArray, pairs: IntArray) -> IntArray:
    """(count,) label of each point after joining the ends of paired sides, in the order of first appearance."""
    one, other = pairs.T
    same = group[sides.tail[one]] == group[sides.tail[other]]
    a = np.concatenate([sides.tail[one], sides.head[one]])
    b = np.concatenate(
        [
            np.where(same, sides.tail[other], sides.head[other]),
            np.where(same, sides.head[other], sides.tail[other]),
        ]
    )
    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    _, first, dense = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[dense.reshape(-1)]


def without_crowds(count: int, sides: Sides, group: IntArray, pairs: IntArray) -> tuple[IntArray, IntArray]:
    """The pairs that can be joined without a third face at any edge, and the label of each point (count,).

    Where joining would bring another edge of the file to an edge that has its faces, it is left open: at that edge
    first, and where that is not enough round both its ends.
    """
    own, _ = sides.edges
    while True:
        label = joined_points(count, sides, group, pairs)
        after, uses = sides.between(label).edges
        several = np.zeros(len(uses), bool)  # edges of more than one edge of the file
        some = np.full(len(uses), -1)
        some[after] = own
        several[after[some[after] != own]] = True
        crowded = several & (uses > 2)
        if not crowded.any() or not len(pairs):
            return pairs, label
        pairs = without(pairs, sides.between(label), after, crowded)


def without(pairs: IntArray, joined: Sides, edge: IntArray, wrong: BoolArray) -> IntArray:
    """The pairs without those at wrong edges; where there are none, without those at their ends."""
    at = wrong[edge]
    kept = pairs[~at[pairs].any(axis=1)]
    if len(kept) < len(pairs):
        return kept
    ends = np.zeros(int(max(joined.tail.max(initial=0), joined.head.max(initial=0))) + 1, bool)
    ends[joined.tail[at]] = ends[joined.head[at]] = True
    touching = ends[joined.tail] | ends[joined.head]
    kept = pairs[~touching[pairs].any(axis=1)]
    return kept if len(kept) < len(pairs) else pairs[:0]
