"""What the halfedges and vertices of a topology are: plain numbers, for the topology and for kernels."""

from __future__ import annotations

from typing import Final

BOUNDARY: Final = -1  # a twin: no face on the other side
BLOCKED: Final = -2  # a twin: the edge is not manifold, or its face has no three corners
UNVISITED: Final = -3  # UNVISITED - h, a twin: halfedge h, whose face no query has come to yet
INTERIOR_VERTEX: Final = 0
BOUNDARY_VERTEX: Final = 1
BLOCKED_VERTEX: Final = 2  # its faces do not form one fan
UNUSED_VERTEX: Final = 3

EXCESS: Final = 1e-11  # radians by which a vertex must exceed a flat one for paths to bend round it
