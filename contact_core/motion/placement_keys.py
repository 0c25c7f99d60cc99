"""Where a patch is over time: keys on the surface, and the geodesics that lead from one to the next.

A key keeps the way to the next key as a chain of straight legs, so that finding the placement at a frame only
walks: it is exact at keys, and never flips to another shortest path. The heading is transported along the way
(straight through its bends), and what it still lacks at the end is turned evenly.
"""

from __future__ import annotations

import cmath
import itertools
import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from contact_core.arrays import ComplexArray
from contact_core.contact.placement import Root, Walk, check_chain
from contact_core.errors import InvalidInput
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.surface_point import SurfacePoints

Interpolation = Literal["smooth", "linear", "hold"]
INTERPOLATIONS: tuple[str, ...] = get_args(Interpolation)


@dataclass(frozen=True, slots=True)
class Way:
    """A geodesic from one key to the next: it leaves at `direction` from the heading of the first (radians), runs
    lengths[0], turns by turns[0] at a saddle vertex, and so on (surface units, radians), and the second key's
    heading lies at `heading` (radians) from its ending direction. Plain numbers, as in `contact.placement.Link`."""

    direction: float
    lengths: tuple[float, ...]
    turns: tuple[float, ...]
    heading: float

    def __post_init__(self) -> None:
        check_chain(self.lengths, self.turns, (self.direction, self.heading), "a way")

    @property
    def length(self) -> float:
        """Surface units."""
        return math.fsum(self.lengths)

    @property
    def twist(self) -> float:
        """Radians, -pi..pi: by how much the heading turns on the way, beyond being transported."""
        return math.remainder(self.heading + self.direction + math.fsum(self.turns), 2.0 * math.pi)

    @classmethod
    def between(cls, mesh: TriangleMesh, first: Root, second: Root) -> Way:
        """The shortest. Raises InvalidInput where the surface does not connect the two."""
        from contact_core.geometry.exact_geodesics import log_map

        log = log_map(mesh, first.point(), second.point())
        if log.anchor[0] < 0:
            raise InvalidInput("two keys of a placement lie on parts of the surface that are not connected.")
        if log.distance[0] == 0.0:
            return cls(0.0, (0.0,), (), cmath.phase(second.heading / first.heading))
        leg = complex(log.first_leg[0])
        return cls(
            cmath.phase(leg / first.heading),
            (abs(leg), *log.lengths.tolist()),
            tuple(log.turning_angles.tolist()),
            cmath.phase(second.heading / complex(log.headings[0])),
        )


@dataclass(frozen=True, slots=True)
class PlacementKey:
    """root: where the patch is at a frame. way: to the next key, None at the last. interpolation: up to the next
    key, smooth (speeds run on through keys, Fritsch and Carlson 1980, and rest at the ends), linear, or hold."""

    json_union: ClassVar[bool] = True
    frame: float
    root: Root
    way: Way | None = None
    interpolation: Interpolation = "smooth"

    def __post_init__(self) -> None:
        if not math.isfinite(self.frame):
            raise InvalidInput(f"a frame is a finite number, but got {self.frame}.")
        if self.interpolation not in INTERPOLATIONS:
            raise InvalidInput(f'keys are joined by "smooth", "linear" or "hold", but got {self.interpolation!r}.')


@dataclass(frozen=True)
class PlacementKeys:
    """Keys in the order of their frames, at least one. Immutable: edits return new keys."""

    keys: tuple[PlacementKey, ...]

    def __post_init__(self) -> None:
        frames = [key.frame for key in self.keys]
        if not frames or frames != sorted(set(frames)):
            raise InvalidInput(f"placement keys need rising frames, at least one, but got {frames[:6]}.")
        if any(key.way is None for key in self.keys[:-1]) or self.keys[-1].way is not None:
            raise InvalidInput("every placement key but the last holds the way to the next.")

    @classmethod
    def of(
        cls, mesh: TriangleMesh, keys: Iterable[tuple[float, Root] | tuple[float, Root, Interpolation]]
    ) -> PlacementKeys:
        """From frames, roots and interpolations, joined by shortest ways over the surface."""
        ordered = sorted((PlacementKey(float(k[0]), k[1], None, *k[2:]) for k in keys), key=lambda key: key.frame)
        return cls(_joined(mesh, ordered))

    @property
    def frames(self) -> tuple[float, ...]:
        """Of the keys."""
        return tuple(key.frame for key in self.keys)

    def with_key(
        self, mesh: TriangleMesh, frame: float, root: Root, interpolation: Interpolation = "smooth"
    ) -> PlacementKeys:
        """With a key at a frame, in place of the one that is there; only the ways beside it are found anew."""
        new = PlacementKey(float(frame), root, None, interpolation)
        others = [key for key in self.keys if key.frame != new.frame]
        return PlacementKeys(_joined(mesh, sorted([*others, new], key=lambda key: key.frame), near=new.frame))

    def without_key(self, mesh: TriangleMesh, frame: float) -> PlacementKeys:
        """Without the key at a frame. Raises InvalidInput when there is none, or no other."""
        others = [key for key in self.keys if key.frame != frame]
        if len(others) in (0, len(self.keys)):
            raise InvalidInput(
                f"there is no key at frame {frame:g} besides another one; keys are at {list(self.frames)[:8]}."
            )
        return PlacementKeys(_joined(mesh, others, near=float(frame)))

    def share(self, frame: float) -> tuple[int, float]:
        """Which key a frame comes after (0 before the first), and the share 0..1 of the way to the next."""
        at = bisect_right(self.frames, frame) - 1
        if at < 0 or at == len(self.keys) - 1:
            return max(at, 0), 0.0
        key, gap = self.keys[at], self.keys[at + 1].frame - self.keys[at].frame
        t = (frame - key.frame) / gap
        if key.interpolation != "smooth" or key.way is None:
            return at, t if key.interpolation == "linear" else 0.0
        length = key.way.length
        starts, ends = (self._speed(i) * gap / length if length > 0.0 else 0.0 for i in (at, at + 1))
        rest = 1.0 - t
        return at, t * rest * rest * starts + t * t * (3.0 - 2.0 * t) - t * t * rest * ends

    def _speed(self, index: int) -> float:
        """Surface units per frame at a key: the weighted harmonic mean of both sides', 0 where one side rests."""
        if not 0 < index < len(self.keys) - 1:
            return 0.0
        before, key, after = self.keys[index - 1 : index + 2]
        if before.interpolation != "smooth" or key.interpolation != "smooth":
            return 0.0
        assert before.way is not None
        assert key.way is not None
        gaps = key.frame - before.frame, after.frame - key.frame
        speeds = before.way.length / gaps[0], key.way.length / gaps[1]
        if min(speeds) < 1e-100:  # rests on one side
            return 0.0
        weights = 2.0 * gaps[1] + gaps[0], gaps[1] + 2.0 * gaps[0]
        return sum(weights) / (weights[0] / speeds[0] + weights[1] / speeds[1])

    def at(self, mesh: TriangleMesh, frame: float) -> Root:
        """Where the patch is at a frame, held beyond the ends; at a key, the key's own root."""
        points, headings = self.sampled(mesh, [frame])
        index, share = self.share(frame)
        return self.keys[index].root if share == 0.0 else Root.at(points, complex(headings[0]))

    def placement_at(self, frame: float) -> Root | Walk:
        """The same as a placement, for which no mesh is needed: at a key its root, else a walk from one."""
        index, share = self.share(frame)
        key = self.keys[index]
        direction, lengths, turns, heading = _walk(key, share)
        if share == 0.0:
            return key.root
        bearing = cmath.phase(direction / key.root.heading)
        return Walk(key.root, bearing, tuple(lengths), tuple(turns), heading)

    def sampled(self, mesh: TriangleMesh, frames: Sequence[float]) -> tuple[SurfacePoints, ComplexArray]:
        """Roots (n) and headings (n,) at frames, walked in one batch."""
        from contact_core.geometry.tracing import trace_chains

        where = [self.share(frame) for frame in frames]
        walks = [_walk(self.keys[index], share) for index, share in where]
        offsets = np.cumsum([0, *(len(walk[1]) - 1 for walk in walks)])
        starts = SurfacePoints.concatenate([self.keys[index].root.point() for index, _ in where])
        trace = trace_chains(
            mesh,
            starts,
            np.array([walk[0] * walk[1][0] for walk in walks]),
            offsets,
            np.array([turn for walk in walks for turn in walk[2]]),
            np.array([length for walk in walks for length in walk[1][1:]]),
        )
        still = np.array([walk[1][0] == 0.0 for walk in walks])  # a walk of no length has no direction of its own
        base = np.where(still, [walk[0] for walk in walks], trace.headings)
        headings = base * np.exp(1j * np.array([walk[3] for walk in walks]))
        return trace.points, headings / np.abs(headings)


def _walk(key: PlacementKey, share: float) -> tuple[complex, list[float], list[float], float]:
    """The walk to a share of the way: its direction, the lengths of its legs, the turns between them, and the angle
    from its ending direction to the heading there."""
    way = key.way
    if way is None or share == 0.0:
        return key.root.heading, [0.0], [], 0.0
    left, lengths, turns = share * way.length, [], []
    for index, length in enumerate(way.lengths):
        lengths.append(min(length, left))
        left -= lengths[-1]
        if left <= 0.0 or index == len(way.turns):
            break
        turns.append(way.turns[index])
    start = key.root.heading * cmath.exp(1j * way.direction)
    return start, lengths, turns, share * way.twist - way.direction - math.fsum(turns)


def _joined(
    mesh: TriangleMesh, keys: Sequence[PlacementKey], near: float | None = None
) -> tuple[PlacementKey, ...]:
    """Keys with the ways between them; those that are not beside the frame `near` are kept."""
    result = []
    for key, then in itertools.pairwise(keys):
        kept = near is not None and key.way is not None and not key.frame <= near <= then.frame
        result.append(key if kept else replace(key, way=Way.between(mesh, key.root, then.root)))
    return (*result, replace(keys[-1], way=None)) if keys else ()
