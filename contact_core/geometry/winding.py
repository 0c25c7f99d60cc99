"""Which direction polygons are wound: neighbours alike, closed surfaces outwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.geometry.stitch import Sides, face_normals

NEARLY_CLOSED = 0.1  # share of its area that the holes of a surface may have, so that it has an outside
_LEAST_VOLUME = 0.01  # of area^1.5, for a surface with holes; a ball has 0.094
_ROUNDING = 1e-9  # of area^1.5, for a closed one


@dataclass(frozen=True, eq=False)
class Winding:
    """turned: (f,) faces to be wound the other direction. piece: (f,) connected surface of each face.
    against: (h,) sides whose edge joins faces that cannot be wound alike (one-sided surfaces)."""

    turned: BoolArray
    piece: IntArray
    against: BoolArray


def wound_alike(sides: Sides, faces: int, own_edge: IntArray) -> Winding:
    """Turn the fewest faces (by number) of each piece so that neighbours agree. own_edge: (h,) the file's edges.

    A surface with one side is left against itself somewhere, at joined edges rather than at the file's own.
    """
    edge, count = sides.edges
    shared = np.flatnonzero(count == 2)
    one, other = (side[shared] for side in sides.edge_ends)
    a, b = sides.face[one], sides.face[other]
    differ = (sides.tail[one] == sides.tail[other]) & (a != b)
    if not differ.any():
        from contact_core.geometry.side_kernels import number_pieces

        piece = np.arange(faces)
        number_pieces(a, b, piece)
        return Winding(np.zeros(faces, bool), piece, np.zeros(len(edge), bool))
    weight = np.where(own_edge[one] == own_edge[other], 1.0, np.where(differ, 3.0, 2.0))
    turned, piece = _along_tree(a, b, differ, weight, faces)
    wrong = (turned[a] ^ turned[b]) != differ
    against = np.zeros(len(edge), bool)
    against[one[wrong]] = against[other[wrong]] = True
    most = np.bincount(piece, turned, minlength=1) * 2 > np.bincount(piece, minlength=1)
    return Winding(turned ^ most[piece], piece, against)


def _graph(a: IntArray, b: IntArray, weight: FloatArray, count: int) -> coo_array:
    """(count, count) weights by pairs of nodes; SciPy before 1.15 spans trees over 32-bit indices only."""
    return coo_array((weight, (a.astype(np.int32), b.astype(np.int32))), shape=(count, count))


def _along_tree(
    a: IntArray, b: IntArray, differ: BoolArray, weight: FloatArray, faces: int
) -> tuple[BoolArray, IntArray]:
    """(f,) whether a face is turned against the first of its piece, along a lightest spanning tree; (f,) pieces."""
    apart = a != b
    low, high = np.minimum(a, b)[apart], np.maximum(a, b)[apart]
    differ, weight = differ[apart], weight[apart]
    order = np.lexsort((weight, high, low))
    fresh = np.ones(len(order), bool)
    fresh[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    order = order[fresh]
    low, high, differ, weight = low[order], high[order], differ[order], weight[order]
    _, piece = connected_components(_graph(low, high, weight, faces), directed=False)
    _, root = np.unique(piece, return_index=True)
    tree = minimum_spanning_tree(
        _graph(
            np.concatenate([low, root]),
            np.concatenate([high, np.full(len(root), faces)]),
            np.concatenate([weight, np.ones(len(root))]),
            faces + 1,
        )
    )
    _, parent = breadth_first_order(tree, faces, directed=False)
    parent = np.asarray(parent, np.int64)
    parent[faces] = faces
    odd = np.zeros(faces + 1, bool)
    child = np.arange(faces)
    inner = parent[:faces] < faces
    key = np.minimum(child, parent[:faces]) * (faces + 1) + np.maximum(child, parent[:faces])
    place = np.searchsorted(low * (faces + 1) + high, key[inner])
    odd[np.flatnonzero(inner)] = differ[place]
    while (parent != faces).any():  # each step doubles how far up a face looks
        odd, parent = odd ^ odd[parent], parent[parent]
    return odd[:faces], piece


def facing_inwards(points: FloatArray, sides: Sides, piece: IntArray, *, clockwise: bool = False) -> BoolArray:
    """(pieces,) whether a closed piece, or one whose holes are small, has its faces wound inwards.

    points: of the labels in `sides`. clockwise: faces are wound so where seen from outside. A closed piece within
    another one goes with it: the wall of a hollow is wound inwards rightly. Large holes leave no outside.
    """
    count = int(piece.max(initial=-1)) + 1
    volume, area, holes = _capped(points, sides, piece, count)
    crowded = np.zeros(count, bool)
    crowded[piece[sides.face[sides.crowd > 2]]] = True
    least = np.where(holes > 0.0, _LEAST_VOLUME, _ROUNDING)
    solid = ~crowded & (holes <= NEARLY_CLOSED * area) & (np.abs(volume) > least * area**1.5)
    inwards = solid & ((volume > 0.0) if clockwise else (volume < 0.0))
    if not inwards.any() or np.count_nonzero(solid) < 2:
        return inwards
    return _with_their_shells(points, sides, piece, solid, inwards)


def _capped(
    points: FloatArray, sides: Sides, piece: IntArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(count,) signed volume of each piece with its holes closed by cones, its area, the area of those cones."""
    from contact_core.geometry.side_kernels import volumes_of_pieces

    normal = face_normals(points, sides)
    centre, volume, area = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
    face, tail = np.ascontiguousarray(sides.face), np.ascontiguousarray(sides.tail)
    volumes_of_pieces(points, face, tail, normal, piece, np.zeros(count), centre, volume, area)
    border = sides.open
    if not len(border):
        return volume / 6.0, area / 2.0, np.zeros(count)
    of_border = piece[sides.face[border]]
    _, loop = connected_components(
        _graph(sides.tail[border], sides.head[border], np.ones(len(border)), len(points)), directed=False
    )
    key, loop = np.unique(loop[sides.tail[border]] * count + of_border, return_inverse=True)
    loop = loop.reshape(-1)
    tails, heads = points[sides.tail[border]], points[sides.head[border]]
    size = np.bincount(loop, minlength=len(key))
    middle = np.stack([np.bincount(loop, tails[:, k], len(key)) / size for k in range(3)], axis=1)[loop]
    cap = np.cross(heads - middle, tails - middle)
    volume += np.bincount(of_border, ((middle - centre[of_border]) * cap).sum(axis=1), count)
    return volume / 6.0, area / 2.0, np.bincount(of_border, np.linalg.norm(cap, axis=1), count) / 2.0


def _with_their_shells(
    points: FloatArray, sides: Sides, piece: IntArray, solid: BoolArray, inwards: BoolArray
) -> BoolArray:
    """The same, with each piece that lies within another one turned exactly when that one is."""
    order = np.argsort(piece[sides.face], kind="stable")
    starts = np.searchsorted(piece[sides.face][order], np.arange(len(solid) + 1))
    own = {int(k): sides.picked(order[starts[k] : starts[k + 1]]) for k in np.flatnonzero(solid)}
    low = {k: points[own[k].tail].min(axis=0) for k in own}
    high = {k: points[own[k].tail].max(axis=0) for k in own}
    ordered = sorted(own, key=lambda k: -float(np.linalg.norm(high[k] - low[k])))
    lows, highs = np.array([low[k] for k in ordered]), np.array([high[k] for k in ordered])
    result, outermost = inwards.copy(), np.ones(len(ordered), bool)
    for place, k in enumerate(ordered):
        around = outermost[:place] & (lows[:place] <= low[k]).all(axis=1) & (highs[:place] >= high[k]).all(axis=1)
        for shell in np.flatnonzero(around):
            if abs(_turns_round(points[own[k].tail[0]], points, own[ordered[shell]])) > 0.5:
                result[k], outermost[place] = result[ordered[shell]], False
                break
    return result


def _turns_round(point: FloatArray, points: FloatArray, sides: Sides) -> float:
    """Winding number of a surface about a point, its polygons cut into fans (van Oosterom and Strackee 1983)."""
    face = sides.face - sides.face.min()
    first = np.full(int(face.max()) + 1, -1)
    first[face[::-1]] = sides.tail[::-1]
    a, b, c = (points[index] - point for index in (first[face], sides.tail, sides.head))
    na, nb, nc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = (a * np.cross(b, c)).sum(axis=1)
    below = na * nb * nc + (a * b).sum(axis=1) * nc + (b * c).sum(axis=1) * na + (c * a).sum(axis=1) * nb
    return float(np.arctan2(above, below).sum() / (2.0 * np.pi))
