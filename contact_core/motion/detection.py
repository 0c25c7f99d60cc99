"""Contacts found in an animation that exists: where skin touches an object and stays on it.

A part of the skin is in contact while its nearest points are close to the surface and slow over it, seen from the
object. It comes on within the inner thresholds and goes off beyond the outer ones (hysteresis, as a foot that is
planted is released later than it was caught), so noise does not cut a contact into pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.chart import pose_on
from contact_core.rig.rig import Pose, Rig, forward_kinematics
from contact_core.rig.skinning import vertex_track
from contact_core.solve.penetration import thinned


@dataclass(frozen=True)
class DetectionOptions:
    """Lengths are shares of the largest extent of the skin's rest box. near: distance at which a contact comes on,
    far: beyond which it goes off. slow, fast: the same of speed over the object, per second. shortest: seconds that
    a contact lasts at least; gaps shorter than `bridge` seconds are closed. samples: vertices of the skin."""

    near: float = 0.01
    far: float = 0.02
    slow: float = 0.15
    fast: float = 0.3
    shortest: float = 0.12
    bridge: float = 0.08
    samples: int = 1500

    def __post_init__(self) -> None:
        if not (0.0 < self.near <= self.far and 0.0 < self.slow <= self.fast):
            raise InvalidInput(
                "detection needs 0 < near <= far and 0 < slow <= fast, but got"
                f" {self.near}, {self.far}, {self.slow}, {self.fast}."
            )


@dataclass(frozen=True, eq=False)
class ContactSpan:
    """A contact that is proposed. joint: whose skin touches. on, off: its first and last frame.

    vertices: (k,) of the skin that touch, object_points: (k) where each touches the object, taken at the frame of
    least mean distance, `closest`. distance: that mean, and speed: the mean over the span (surface units of the
    object, per second).
    """

    joint: str
    on: float
    off: float
    vertices: IntArray
    object_points: SurfacePoints
    closest: float
    distance: float
    speed: float


def detect_contacts(
    rig: Rig,
    frames: Sequence[float],
    poses: Sequence[Pose],
    target: TriangleMesh,
    object_from_rig: FloatArray,
    *,
    rate: float = 24.0,
    options: DetectionOptions | None = None,
    progress: Progress = NO_PROGRESS,
) -> tuple[ContactSpan, ...]:
    """The contacts between an animated rig and an object, in the order in which they come on.

    object_from_rig: (n, 4, 4) takes rig space into the object's surface space at each frame: the object may move.
    Raises InvalidInput for arrays that do not fit; Cancelled from progress.
    """
    options = options or DetectionOptions()
    times, placed = np.asarray(frames, float) / rate, np.asarray(object_from_rig, float)
    if len(poses) != len(times) or placed.shape != (len(times), 4, 4) or (np.diff(times) <= 0.0).any():
        raise InvalidInput(
            f"detection needs a pose and a placement (4, 4) at each of rising frames, but got {len(poses)} poses"
            f" and placements {placed.shape} for {len(times)} frames."
        )
    if not len(times):
        return ()
    seen = _Seen(rig, poses, placed, target, times, options, progress)
    spans = [
        seen.span(joint, first, last, frames)
        for joint in np.unique(seen.owner).tolist()
        for first, last in _spans(seen.touches(joint), times, options)
    ]
    return tuple(sorted(spans, key=lambda span: (span.on, span.joint)))


class _Seen:
    """Vertices (v) of the skin at all frames (n), seen from the object. owner: (v,) the joint that holds each most.

    distances, speeds: (n, v). faces, barycentric: (n, v), (n, v, 3) of the closest points of the object.
    """

    def __init__(
        self,
        rig: Rig,
        poses: Sequence[Pose],
        placed: FloatArray,
        target: TriangleMesh,
        times: FloatArray,
        options: DetectionOptions,
        progress: Progress,
    ) -> None:
        self.rig, self.options = rig, options
        self.vertices, _ = thinned(rig.surface, options.samples)
        self.owner: IntArray = rig.skin_joints[self.vertices, rig.skin_weights[self.vertices].argmax(axis=1)]
        points = _skin_over_time(rig, poses, placed, self.vertices)
        self.distances, self.faces, self.barycentric = _distances(target, points, progress)
        self.speeds = _speeds(points, times)
        scale = float(np.abs(np.linalg.det(placed[0, :3, :3])) ** (1.0 / 3.0))
        self.extent = scale * float(np.ptp(rig.surface.points, axis=0).max())

    def near_and_slide(self, joint: int) -> tuple[FloatArray, FloatArray]:
        """(n,), (n,) mean distance and speed of the nearest fifth of a joint's vertices: of what would touch."""
        rows = np.flatnonzero(self.owner == joint)
        count = max(1, len(rows) // 5)
        touching = np.argpartition(self.distances[:, rows], count - 1, axis=1)[:, :count]
        near, slide = (
            np.take_along_axis(values[:, rows], touching, axis=1).mean(axis=1)
            for values in (self.distances, self.speeds)
        )
        return near, slide

    def touches(self, joint: int) -> BoolArray:
        """(n,) whether the skin of a joint is in contact."""
        near, slide = self.near_and_slide(joint)
        options, extent = self.options, self.extent
        return _hysteresis(
            (near <= options.near * extent) & (slide <= options.slow * extent),
            (near <= options.far * extent) & (slide <= options.fast * extent),
        )

    def span(self, joint: int, first: int, last: int, frames: Sequence[float]) -> ContactSpan:
        """The contact of a joint from one row to another."""
        near, slide = self.near_and_slide(joint)
        row = first + int(near[first : last + 1].argmin())
        rows = np.flatnonzero(self.owner == joint)
        close = rows[self.distances[row, rows] <= self.options.far * self.extent]
        return ContactSpan(
            joint=self.rig.joints[joint],
            on=float(frames[first]),
            off=float(frames[last]),
            vertices=self.vertices[close],
            object_points=SurfacePoints(self.faces[row, close], self.barycentric[row, close]),
            closest=float(frames[row]),
            distance=float(near[row]),
            speed=float(slide[first : last + 1].mean()),
        )


def _skin_over_time(rig: Rig, poses: Sequence[Pose], placed: FloatArray, vertices: IntArray) -> FloatArray:
    """(n, v, 3) vertices (v,) in the object's space."""
    track = vertex_track(rig, vertices)
    points = np.empty((len(poses), len(vertices), 3))
    for row, pose in enumerate(poses):
        world = placed[row] @ forward_kinematics(rig.parents, pose_on(rig, pose))
        points[row] = track.carried(world[:, :3].swapaxes(1, 2).reshape(-1, 3))
    return points


def _distances(
    target: TriangleMesh, points: FloatArray, progress: Progress
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Distances (n, v), and the faces (n, v) and barycentric coordinates (n, v, 3) of the closest points."""
    n, v, _ = points.shape
    distances, faces, barycentric = np.empty((n, v)), np.empty((n, v), np.int64), np.empty((n, v, 3))
    locator = Locator.of(target)
    for row in range(n):
        progress.tell(row / n, f"frame {row + 1} of {n}")
        found = locator.closest(points[row])
        distances[row], faces[row], barycentric[row] = (
            found.distance, found.points.faces, found.points.barycentric,
        )  # fmt: skip
    return distances, faces, barycentric


def _speeds(points: FloatArray, times: FloatArray) -> FloatArray:
    """(n, v) how fast points move in the object's space, by central differences."""
    if len(times) < 2:
        return np.zeros(points.shape[:2])
    return np.asarray(np.linalg.norm(np.gradient(points, times, axis=0), axis=2))


def _hysteresis(catch: BoolArray, keep: BoolArray) -> BoolArray:
    """(n,) on from where `catch` holds for as long as `keep` does, forwards and backwards in time."""
    state = catch.copy()
    for k in range(1, len(state)):
        state[k] |= state[k - 1] & keep[k]
    for k in range(len(state) - 2, -1, -1):
        state[k] |= state[k + 1] & keep[k]
    return state


def _spans(state: BoolArray, times: FloatArray, options: DetectionOptions) -> list[tuple[int, int]]:
    """First and last rows of the spans where the state is on, bridged and long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], state.astype(int), [0]])))
    spans: list[tuple[int, int]] = []
    for first, last in zip(edges[0::2].tolist(), (edges[1::2] - 1).tolist(), strict=True):
        if spans and times[first] - times[spans[-1][1]] <= options.bridge:
            spans[-1] = spans[-1][0], last
        else:
            spans.append((first, last))
    return [(a, b) for a, b in spans if times[b] - times[a] >= options.shortest]
