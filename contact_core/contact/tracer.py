"""Several patches on one surface, traced together: for who moves them again and again.

`reconstruct_patch` takes each apart anew and walks it on its own. Here what does not change with the roots is laid
out once, and a trace is two batches of walks, however many patches there are; the points are bitwise the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from contact_core.arrays import ComplexArray, FloatArray, IntArray
from contact_core.contact.axis import axis_chains
from contact_core.contact.patch import patch_chains
from contact_core.contact.shape import AxisShape, PatchShape
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.geometry.tracing import trace_chains


@dataclass(frozen=True, eq=False)
class ShapedPatch:
    """A patch but for its root, as `reconstruct_patch` takes it."""

    shape: PatchShape
    axis: AxisShape | None = None
    mirrored: bool = False
    unit: float = 1.0


class TracedPatches(NamedTuple):
    """The points of all patches, one patch below the other. headings: (k,) unit complex, the direction in which
    each path ends; that of the axis where the point lies on it."""

    points: SurfacePoints
    headings: ComplexArray


class _Walks(NamedTuple):
    """Walks of all patches, one below the other. origin: (w,) where each starts, among points known before.

    legs: (w,) complex first legs relative to the tangent there. offsets, turns, lengths: the legs after.
    """

    origin: IntArray
    legs: ComplexArray
    offsets: IntArray
    turns: FloatArray
    lengths: FloatArray


class PatchTracer:
    """Patches on a mesh, ready to be traced from any roots. patch_of_point: (k,) which patch each point is of."""

    def __init__(self, mesh: TriangleMesh, patches: Sequence[ShapedPatch]) -> None:
        self.mesh = mesh
        counts = [len(patch.shape.coordinates) for patch in patches]
        self.patch_of_point: IntArray = np.repeat(np.arange(len(patches)), counts)
        axes = [axis_chains(p.axis or p.shape.axis, mirrored=p.mirrored, unit=p.unit) for p in patches]
        self._bends = _joined([bends for _, bends in axes], complex)
        self._axis_walks = _below(
            (np.full(len(bends), i), chains.first.astype(complex), chains.offsets, chains.turns, chains.lengths)
            for i, (chains, bends) in enumerate(axes)
        )
        ends = np.cumsum([0, *(len(bends) for _, bends in axes)]) + len(patches)  # of the axes, behind all roots
        parts = []
        for i, patch in enumerate(patches):
            coordinates = patch.shape.coordinates
            anchors = coordinates.anchors
            legs, turns, lengths = patch_chains(
                coordinates, patch.axis or patch.shape.axis, mirrored=patch.mirrored, unit=patch.unit
            )
            origin = np.where(anchors == 0, i, ends[i] + anchors - 1)
            parts.append((origin, legs, coordinates.chain_starts, turns, lengths))
        self._point_walks = _below(parts)

    def trace(self, roots: SurfacePoints, headings: ComplexArray) -> TracedPatches:
        """The points with the patches at roots (n,), their axes heading along unit complex numbers (n,)."""
        axes, walks = self._axis_walks, self._point_walks
        walked = trace_chains(
            self.mesh, roots[axes.origin], axes.legs * headings[axes.origin], axes.offsets, axes.turns, axes.lengths
        )
        known = SurfacePoints.concatenate([roots, walked.points])
        tangents = np.concatenate([headings, walked.headings * self._bends])
        tangents = (tangents / np.abs(tangents))[walks.origin]  # (k,)
        ended = trace_chains(
            self.mesh, known[walks.origin], walks.legs * tangents, walks.offsets, walks.turns, walks.lengths
        )
        return TracedPatches(ended.points, np.where(walks.legs == 0.0, tangents, ended.headings))


def _below(
    parts: Iterable[tuple[IntArray, ComplexArray, IntArray, FloatArray, FloatArray]],
) -> _Walks:
    """Walks of several patches, one below the other."""
    rows = list(parts)
    counts = [np.diff(offsets) for _, _, offsets, _, _ in rows]
    offsets = np.concatenate([[0], np.cumsum(_joined(counts, np.int64))]).astype(np.int64)
    return _Walks(
        _joined([row[0] for row in rows], np.int64),
        _joined([row[1] for row in rows], complex),
        offsets,
        _joined([row[3] for row in rows], float),
        _joined([row[4] for row in rows], float),
    )


def _joined(parts: Sequence[Any], dtype: Any) -> Any:
    return np.concatenate([np.zeros(0, dtype), *parts]).astype(dtype)
