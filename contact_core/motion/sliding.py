"""A patch that slides over its surface by keys, smooth in time as a whole.

Each point of a patch ends a geodesic from its axis, and while the patch slides the geodesic comes to pass a vertex
on the other side: the point jumps, at any rate of sampling, by up to the patch's own size on a rough surface.
So the points are smoothed in space over time (a Gaussian) and put back onto the surface. At keys they are exact:
what smoothing takes there is given back, eased from key to key. Where landing on the surface makes many points hop
together, the whole patch is shifted so that its centre moves at most 1.25 times as far in a frame as its root at
its fastest; single points may still hop over folds of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from contact_core.arrays import BoolArray, FloatArray
from contact_core.contact.tracer import PatchTracer, ShapedPatch
from contact_core.geometry.mesh import TriangleMesh
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.motion.placement_keys import PlacementKeys

SIGMA = 2.0  # frames
REACH = 3  # times sigma: beyond, a Gaussian counts nothing
CALM = 1.25  # how much farther than its root, at their fastest, the centre of a patch may move in a frame
ROUNDS = 6  # of holding the centre back
RELAXATIONS = 200  # within a round


@dataclass(frozen=True, eq=False)
class _Run:
    """Frames in which a patch slides without a jump: whole steps from `first` to `last`, and by how much all its
    points are shifted at each (n, 3), nothing at keys. calm: the largest step of the centre over the root's."""

    frames: FloatArray
    shifts: FloatArray
    calm: float

    @property
    def ends(self) -> tuple[float, float]:
        return float(self.frames[0]), float(self.frames[-1])

    def shift(self, frame: float) -> FloatArray:
        """(3,)"""
        return np.array([np.interp(frame, self.frames, self.shifts[:, axis]) for axis in range(3)])


@dataclass(eq=False)
class SlidingPatch:
    """A patch and its keys on a mesh. Keeps what it traced."""

    mesh: TriangleMesh
    patch: ShapedPatch
    keys: PlacementKeys
    _traced: dict[float, tuple[SurfacePoints, FloatArray]] = field(default_factory=dict, repr=False)
    _runs: dict[tuple[float, float], _Run] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        self._tracer = PatchTracer(self.mesh, [self.patch])
        self._steps = np.arange(-REACH * SIGMA, REACH * SIGMA + 1.0)
        weights = np.exp(-0.5 * (self._steps / SIGMA) ** 2)
        self._weights = weights / weights.sum()

    def points(self, frame: float) -> SurfacePoints:
        """(k) the points at a frame, held beyond the ends; at a key, exactly those of its placement."""
        if self._is_exact(frame):
            return self._trace(frame)[0]
        run = self._run(frame)
        return self._landed(frame, run.ends, run.shift(frame))

    def traced(self, frame: float) -> SurfacePoints:
        """(k) the points as the patch's geodesics end at a frame, without smoothing."""
        return self._trace(frame)[0]

    def calm(self, frame: float) -> float:
        """How far the centre moves in a frame, at its fastest in the slide that a frame is in, over the root's
        farthest: CALM or below but where the surface is too rough; 0 where nothing slides."""
        return 0.0 if self._is_exact(frame) else self._run(frame).calm

    def _trace(self, frame: float) -> tuple[SurfacePoints, FloatArray]:
        """Points without smoothing, and their positions and normals (k, 6)."""
        frame = float(np.clip(frame, self.keys.frames[0], self.keys.frames[-1]))
        if frame not in self._traced:
            root = self.keys.at(self.mesh, frame)
            points = self._tracer.trace(root.point(), np.array([root.heading])).points
            seen = np.concatenate([points.positions(self.mesh), points.normals(self.mesh)], axis=1)
            self._traced[frame] = points, seen
        return self._traced[frame]

    def _is_exact(self, frame: float) -> bool:
        """Whether nothing is smoothed at a frame: at and beyond keys, and where one is held."""
        key = self.keys.keys[self.keys.share(frame)[0]]
        return frame <= key.frame or key.way is None or key.interpolation == "hold"

    def _landed(self, frame: float, ends: tuple[float, float], shift: FloatArray) -> SurfacePoints:
        """The smoothed points, put onto the side of the surface that they come from."""
        raw = self._trace(frame)[0]
        space, normals = np.split(self._smoothed(frame, ends), 2, axis=1)
        found = Locator.of(self.mesh).closest(space + shift, facing=-normals, facing_limit=0.0)
        faces = np.where(found.found, found.points.faces, raw.faces)
        return SurfacePoints(faces, np.where(found.found[:, None], found.points.barycentric, raw.barycentric))

    def _smoothed(self, frame: float, ends: tuple[float, float]) -> FloatArray:
        """(k, 6) the mean over time, and what it takes from the keys on both sides, given back."""
        index, _ = self.keys.share(frame)
        first, then = self.keys.frames[index : index + 2]
        t = (frame - first) / (then - first)
        eased = t * t * (3.0 - 2.0 * t)
        off = [self._trace(at)[1] - self._mean(at, ends) for at in (first, then)]
        return np.asarray(self._mean(frame, ends) + (1.0 - eased) * off[0] + eased * off[1])

    def _mean(self, frame: float, ends: tuple[float, float]) -> FloatArray:
        """(k, 6) the Gaussian mean round a frame, of frames between the ends."""
        times = np.clip(frame + self._steps, *ends)
        parts = (w * self._trace(float(time))[1] for w, time in zip(self._weights, times, strict=True))
        return np.asarray(sum(parts))

    def _run(self, frame: float) -> _Run:
        """The slide round a frame, up to the ends or to a held key on either side."""
        keys = self.keys.keys
        first = last = self.keys.share(frame)[0]
        while first > 0 and keys[first - 1].interpolation != "hold":
            first -= 1
        while last < len(keys) - 1 and keys[last].interpolation != "hold":
            last += 1
        ends = keys[first].frame, keys[last].frame
        if ends not in self._runs:
            self._runs[ends] = self._calmed(ends)
        return self._runs[ends]

    def _calmed(self, ends: tuple[float, float]) -> _Run:
        """A slide whose centre is held back where landing on the surface makes it leap."""
        whole = np.append(np.arange(ends[0], ends[1]), ends[1])
        frames = np.unique([*whole.tolist(), *(f for f in self.keys.frames if ends[0] <= f <= ends[1])])
        exact = np.array([self._is_exact(frame) or frame == ends[1] for frame in frames.tolist()])
        roots = self.keys.sampled(self.mesh, frames.tolist())[0].positions(self.mesh)
        fastest = max(_largest_step(roots), 1e-12 * self.mesh.bounding_box_diagonal)
        best = _Run(frames, np.zeros((len(frames), 3)), np.inf)
        shifts = best.shifts
        for _ in range(ROUNDS):
            centres = np.array(
                [
                    (self._trace(frame)[0] if still else self._landed(frame, ends, shift))
                    .positions(self.mesh).mean(axis=0)
                    for frame, still, shift in zip(frames.tolist(), exact, shifts, strict=True)
                ]
            )  # fmt: skip
            calm = _largest_step(centres) / fastest
            if calm < best.calm:
                best = _Run(frames, shifts, calm)
            if calm <= CALM:
                break
            shifts = shifts + _held_back(centres, exact, 0.95 * CALM * fastest) - centres
        return best


def _held_back(path: FloatArray, fixed: BoolArray, longest: float) -> FloatArray:
    """A path (n, 3) near the given one without steps beyond the longest: steps that are too long are shortened from
    both ends in turn, fixed places stay (Mueller et al. 2007, distance constraints)."""
    result = path.copy()
    share = np.where(fixed, 0.0, 1.0)
    for _ in range(RELAXATIONS):
        for parity in (0, 1):
            first = np.arange(parity, len(path) - 1, 2)
            way = result[first + 1] - result[first]
            length = np.linalg.norm(way, axis=1)
            both = share[first] + share[first + 1]
            excess = np.where((length > longest) & (both > 0.0), 1.0 - longest / np.maximum(length, longest), 0.0)
            move = way * (excess / np.maximum(both, 1.0))[:, None]
            result[first] += share[first, None] * move
            result[first + 1] -= share[first + 1, None] * move
    return result


def _largest_step(positions: FloatArray) -> float:
    """Between neighbours of positions (n, 3)."""
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).max(initial=0.0))
