"""What kernels take, in groups: numba passes a named tuple at the cost of its members.

The compiled code depends on the order of the fields, so this file is a part of the stamp of all kernels (`jit`).
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from contact_core.arrays import BoolArray, FloatArray, IntArray

Group = TypeVar("Group", bound=tuple[object, ...])


def plain(group: Group) -> Group:
    """The group as a plain tuple, to hand to a kernel from Python; the kernel names the members again.

    numba recognises a plain tuple of arrays in a third of the time of a named one, 1 us less for each.
    """
    return tuple(group)  # type: ignore[return-value]


class Halfedges(NamedTuple):
    """Connectivity and intrinsic geometry of a mesh: see `topology.Topology`, which says what the arrays are.

    Of a large mesh they are written where queries come. Kernels go from face to face by `topology_kernels.twin_of`,
    and begin in a face by `visit` or `first_of`; until then a twin is UNVISITED - h, a record of `shape` is 0 and
    an `angle_sum` is negative.
    bends: (n,) whether shortest paths can bend round a vertex, which a blocked one counts as doing.
    points: (n, 3), from which records are made.
    """

    tail: IntArray
    twin: IntArray
    shape: FloatArray
    first: IntArray
    angle_sum: FloatArray
    kind: IntArray
    bends: BoolArray
    points: FloatArray


class Labels(NamedTuple):
    """What a query of the log map has found out about the vertices.

    A row of `reach` that does not begin with the epoch of the query counts as empty, and then so do the vertex's
    other rows: nothing is cleared between queries.

    reach: (n, 2) epoch, distance of the vertex.
    leg: (n, 3) last leg to the vertex, in the root's wedge frame; angle round the vertex of the direction back.
    origin: (n, 4) root, wedge, 1 once the vertex is a pseudo-source, 1 where the last leg touches the rim of its
        window.
    """

    epoch: float
    reach: FloatArray
    leg: FloatArray
    origin: IntArray


class Windows(NamedTuple):
    """Records of w windows, whose columns are named in `window_kernels`, and who occupies which apex.

    floats: (w, 10). integers: (w, 4).
    occupied: (3m, 6) per halfedge that windows entered a face through: epoch; distance at the apex of the window
        that occupies it, where its ray to the apex crosses the halfedge, its interval, the distance of its root.
    """

    floats: FloatArray
    integers: IntArray
    occupied: FloatArray


class Queue(NamedTuple):
    """keys (q,), items (q,): heap and stack in one; state (7,): counters. See `queue_kernels`."""

    keys: FloatArray
    items: IntArray
    state: IntArray


class Targets(NamedTuple):
    """Records of t targets, whose columns are named in `log_map_kernels`, and the list of each face.

    floats: (t, 12). integers: (t, 7). waiting: (m, 2) epoch, first target in the face's list.
    """

    floats: FloatArray
    integers: IntArray
    waiting: FloatArray


class Points(NamedTuple):
    """Surface points: faces (k,), barycentric (k, 3). A buffer for polylines that nobody asked for has no rows."""

    faces: IntArray
    barycentric: FloatArray


class Grid(NamedTuple):
    """A distance field (`distance_field.DistanceField`), in surface units.

    values: (nx, ny, nz) at nodes that lie `spacing` apart, the first at origin (3,).
    """

    values: FloatArray
    origin: FloatArray
    spacing: float


class Goal(NamedTuple):
    """The place that a search is for, where it is for one alone.

    points: (n, 3) of the mesh. x, y, z: the place. sought: 1 where there is one, else 0.
    """

    points: FloatArray
    x: float
    y: float
    z: float
    sought: int


class Window(NamedTuple):
    """A window that is about to enter a face, in the frame of the halfedge that it enters through.

    b0, b1: its interval on the halfedge. sx, sy: where the root lies, straight back (sy <= 0). sigma: distance from
    the source to the root. cos, sin: rotation from this frame to that of the root's wedge. slack: radians by which
    a ray may miss what it still meets. split_distance, split_crossing: distance at the apex of the parent's
    face, and where the ray to that apex crosses, if the parent split there; else -1 and 0. root, wedge, side: as
    in the record.
    """

    b0: float
    b1: float
    sx: float
    sy: float
    sigma: float
    cos: float
    sin: float
    slack: float
    split_distance: float
    split_crossing: float
    root: int
    wedge: int
    side: int


class Path(NamedTuple):
    """A path from a source to a vertex or a target, by its last leg.

    distance: of the whole path. root, wedge, zx, zy: the leg starts at the root along (zx, zy) in the frame of
    halfedge `wedge`. halfedge, x, y: at the end, a direction in the frame of `halfedge` (at a vertex back along the
    leg, at a target onward). touches: 1 if the leg touches the rim of its window, else 0.
    """

    distance: float
    root: int
    wedge: int
    zx: float
    zy: float
    halfedge: int
    x: float
    y: float
    touches: int
