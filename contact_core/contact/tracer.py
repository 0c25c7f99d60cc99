"""Reconstructs several patches on one mesh in one batch, for callers that move them again and again (a solver).

`reconstruct_patch` prepares and traces one patch per call. A `PatchTracer` prepares everything that does not depend
on the roots once; each `trace` is then two batches of geodesics, one for all axes and one for all points, however
many patches there are. The points are bitwise those of `reconstruct_patch`.
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
    """A patch without its root. axis: in place of the shape's own, as `reconstruct_patch` takes it."""

    shape: PatchShape
    axis: AxisShape | None = None

    @property
    def traced_axis(self) -> AxisShape:
        """The axis that its points are traced from."""
        return self.axis or self.shape.axis


class TracedPatches(NamedTuple):
    """The points (k) of all patches, concatenated in the order of the patches.

    headings: (k,) unit complex, the direction in which the geodesic from the axis arrives at each point, in the
    point's tangent frame; at a point of the axis itself, the direction of the axis.
    """

    points: SurfacePoints
    headings: ComplexArray


class _Walks(NamedTuple):
    """Geodesics of all patches, concatenated. origin: (w,) index of each one's start among the points known so far.

    legs: (w,) complex first legs relative to the tangent at the start. offsets, turns, lengths: the legs that
    follow, as `trace_chains` takes them.
    """

    origin: IntArray
    legs: ComplexArray
    offsets: IntArray
    turns: FloatArray
    lengths: FloatArray


class PatchTracer:
    """Patches on a mesh, prepared to be traced from any roots. patch_of_point: (k,) index of each point's patch."""

    def __init__(self, mesh: TriangleMesh, patches: Sequence[ShapedPatch]) -> None:
        self.mesh = mesh
        counts = [len(patch.shape.coordinates) for patch in patches]
        self.patch_of_point: IntArray = np.repeat(np.arange(len(patches)), counts)
        axes = [axis_chains(patch.traced_axis) for patch in patches]
        self._bends = _joined([bends for _, bends in axes], complex)
        self._axis_walks = _concatenated(
            (np.full(len(bends), i), chains.first.astype(complex), chains.offsets, chains.turns, chains.lengths)
            for i, (chains, bends) in enumerate(axes)
        )
        ends = np.cumsum([0, *(len(bends) for _, bends in axes)]) + len(
            patches
        )  # where each axis starts, after all roots
        parts = []
        for i, patch in enumerate(patches):
            coordinates = patch.shape.coordinates
            anchors = coordinates.anchors
            legs, turns, lengths = patch_chains(coordinates, patch.traced_axis)
            origin = np.where(anchors == 0, i, ends[i] + anchors - 1)
            parts.append((origin, legs, coordinates.chain_starts, turns, lengths))
        self._point_walks = _concatenated(parts)

    def trace(self, roots: SurfacePoints, headings: ComplexArray) -> TracedPatches:
        """The points of n patches at roots (n), whose axes start along headings (n,), unit complex."""
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


def _concatenated(
    parts: Iterable[tuple[IntArray, ComplexArray, IntArray, FloatArray, FloatArray]],
) -> _Walks:
    """The geodesics of several patches, concatenated."""
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
