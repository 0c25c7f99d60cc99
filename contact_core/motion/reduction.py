"""Few editable keys in place of a pose per frame, judged by how far the skin moves.

Keys are whole poses, set one after the other where the skin is farthest off, until no vertex at any frame is
farther off than the tolerance; then every key that is not needed after all goes again. With cubic curves the speeds
at the keys are those that fit the frames best in the least-squares sense, all channels with one system.
Tolerances per channel fit worse with more keys: half a degree at the hip is a centimetre at the toes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from contact_core.arrays import BoolArray, FloatArray, IntArray
from contact_core.errors import InvalidInput
from contact_core.progress import NO_PROGRESS, Progress
from contact_core.rig.chart import pose_on
from contact_core.rig.pose_keys import (
    PoseCurves,
    PoseKeys,
    channels,
    hermite_weights,
    quaternion_slopes,
    turning_of,
)
from contact_core.rig.rig import Pose, Rig
from contact_core.rig.skinning import vertex_track
from contact_core.solve.penetration import thinned

MILLIMETRE = 1e-3
SAMPLES = 500  # vertices that stand for the skin while keys are chosen; all of it has the last word
NEARLY_HALF_A_CIRCLE = 0.05  # cosine of half the angle
HELD_SHARE = 0.1  # of the tolerance, for skin that holds something
STIFFNESS = 1e-3  # how strongly speeds keep to finite differences where frames do not say


@dataclass(frozen=True, eq=False)
class Reduction:
    """keys: fewer of them. error: the largest distance of any skin vertex at any frame from where it was, and
    errors: (n,) the largest per frame, in surface units."""

    keys: PoseKeys
    error: float
    errors: FloatArray


def reduce_poses(
    rig: Rig,
    frames: Sequence[float],
    poses: Sequence[Pose],
    *,
    tolerance: float | None = None,
    interpolation: Literal["cubic", "linear"] = "cubic",
    keep: Iterable[float] = (),
    held: Sequence[IntArray] | None = None,
    progress: Progress = NO_PROGRESS,
) -> Reduction:
    """Keys that give back poses at frames within a tolerance of the skin.

    tolerance: surface units, by default a millimetre. interpolation: "cubic" for curves with handles, "linear" for
    formats that blend straight. keep: frames that get a key whatever the tolerance, such as authored poses.
    held: per frame the vertices that hold something, which may be a tenth of the tolerance off: within a whole
    millimetre a planted foot could skate from frame to frame.
    Raises InvalidInput for frames that do not rise, or frames to keep that are not there; Cancelled from progress.
    """
    tolerance = MILLIMETRE / rig.meters_per_unit if tolerance is None else tolerance
    if not tolerance > 0.0 or interpolation not in ("cubic", "linear"):
        raise InvalidInput(
            f'a reduction needs a tolerance above 0 and "cubic" or "linear", but got {tolerance} and'
            f" {interpolation!r}."
        )
    given = _Given(rig, frames, poses)
    kept = {0, len(given.frames) - 1, *map(given.row, keep)}
    chosen, held_skin = set(kept), _HeldSkin.of(rig, given, held)

    def fits(skin: _Skin, rows: list[int]) -> bool:
        near = given.too_far(rows) is None
        curves = given.curves(rows, interpolation)
        return near and bool(skin.errors(curves).max() <= tolerance and held_skin.errors(curves).max() <= tolerance)

    everything = np.arange(len(rig.bind_points))
    for vertices in (thinned(rig.surface, SAMPLES)[0], everything):
        skin = _Skin(rig, given, vertices)
        while True:
            far = given.too_far(sorted(chosen))
            if far is not None:
                chosen.add(far)
                continue
            curves = given.curves(sorted(chosen), interpolation)
            errors = np.maximum(skin.errors(curves), held_skin.errors(curves))
            worst = int(errors.argmax())
            if errors[worst] <= tolerance or worst in chosen:
                break
            chosen.add(worst)
            progress.tell(None, f"{len(chosen)} keys, skin {errors[worst]:.3g} off")
        if vertices is not everything:
            _drop(chosen, kept, partial(fits, skin))
    rows = sorted(chosen)
    errors = skin.errors(given.curves(rows, interpolation))
    return Reduction(given.keys(rows, interpolation), float(errors.max()), errors)


def skin_errors(rig: Rig, frames: Sequence[float], poses: Sequence[Pose], keys: PoseKeys) -> FloatArray:
    """(n,) the largest distance of any skin vertex at each frame between poses and keys, surface units."""
    given = _Given(rig, frames, poses)
    return _Skin(rig, given, np.arange(len(rig.bind_points))).errors(PoseCurves.of(rig, keys))


def _drop(chosen: set[int], kept: set[int], is_good: Callable[[list[int]], bool]) -> None:
    """Take out keys that are not needed, the earliest first."""
    for row in sorted(chosen - kept):
        if is_good(sorted(chosen - {row})):
            chosen.remove(row)


class _Given:
    """The poses to be given back, as channels."""

    def __init__(self, rig: Rig, frames: Sequence[float], poses: Sequence[Pose]) -> None:
        self.rig, self.frames = rig, np.array(frames, float)
        if len(poses) != len(self.frames) or not len(poses) or (np.diff(self.frames) <= 0.0).any():
            raise InvalidInput(
                f"a reduction needs one pose per frame and rising frames, but got {len(poses)} poses at"
                f" {list(frames)[:6]}."
            )
        self.local = np.array([pose_on(rig, pose) for pose in poses])
        self.translations, self.quaternions, self.stretches = channels(self.local)

    def row(self, frame: float) -> int:
        """Of a frame that gets a key."""
        at = np.flatnonzero(self.frames == frame)
        if not len(at):
            raise InvalidInput(f"frame {frame:g} was to keep a key, but there is no pose at it.")
        return int(at[0])

    def too_far(self, rows: list[int]) -> int | None:
        """A frame halfway between two keys between which a joint turns through nearly half a circle or more, where
        the signs of the quaternions of the keys alone no longer say which way round; None where there is none."""
        keyed = self.quaternions[rows]
        cosines = np.einsum("kji,kji->kj", keyed[1:], keyed[:-1]).min(axis=1, initial=1.0)
        for first, second, cosine in zip(rows[:-1], rows[1:], cosines, strict=True):
            if cosine < NEARLY_HALF_A_CIRCLE and second - first > 1:
                return (first + second) // 2
        return None

    def curves(self, rows: list[int], interpolation: str) -> PoseCurves:
        """With keys at some of the frames."""
        at, keyed = self.frames[rows], (self.translations[rows], self.quaternions[rows], self.stretches[rows])
        if interpolation == "linear" or len(rows) < 2:
            return PoseCurves(at, *keyed)
        j = len(self.rig.joints)
        values = np.concatenate([self.translations, self.quaternions], axis=2).reshape(len(self.frames), -1)
        slopes = _fitted_slopes(self.frames, values, np.array(rows)).reshape(len(rows), j, 7)
        turning = turning_of(keyed[1], slopes[..., 3:])  # the curves of keys know no other slopes
        return PoseCurves(at, *keyed, slopes[..., :3], quaternion_slopes(keyed[1], turning))

    def keys(self, rows: list[int], interpolation: str) -> PoseKeys:
        """The same as keys."""
        curves = self.curves(rows, interpolation)
        frames = tuple(self.frames[rows].tolist())
        poses = tuple(Pose(self.rig.joints, self.local[row]) for row in rows)
        if curves.translation_slopes is None or curves.quaternion_slopes is None:
            return PoseKeys(self.rig.name, frames, poses)
        turning = turning_of(curves.quaternions, curves.quaternion_slopes)
        return PoseKeys(
            self.rig.name, frames, poses, tuple(np.concatenate([curves.translation_slopes, turning], axis=2))
        )


def _fitted_slopes(frames: FloatArray, values: FloatArray, rows: IntArray) -> FloatArray:
    """(k, c) the slopes at the keys `rows` with which Hermite curves through them fit values (n, c) best."""
    n, k = len(frames), len(rows)
    first = np.clip(np.searchsorted(rows, np.arange(n), side="right") - 1, 0, k - 2)
    gap = frames[rows[first + 1]] - frames[rows[first]]
    one, two, slope_one, slope_two = hermite_weights((frames - frames[rows[first]]) / gap, gap)
    left = values - one[:, None] * values[rows[first]] - two[:, None] * values[rows[first + 1]]
    system = np.zeros((n, k))
    system[np.arange(n), first] = slope_one
    system[np.arange(n), first + 1] = slope_two
    guess = np.gradient(values, frames, axis=0)[rows] if n > 1 else np.zeros((k, values.shape[1]))
    normal = system.T @ system
    stiffness = STIFFNESS * np.diag(np.maximum(np.diagonal(normal), 1e-6))
    return np.asarray(np.linalg.solve(normal + stiffness, system.T @ left + stiffness @ guess))


class _Skin:
    """Some vertices of the skin at all frames."""

    def __init__(self, rig: Rig, given: _Given, vertices: IntArray) -> None:
        self.rig, self.frames = rig, given.frames
        self.track = vertex_track(rig, vertices)
        self.bones = _bones(rig, given.local)  # (n, 4 j, 3)

    def errors(self, curves: PoseCurves, counted: BoolArray | None = None) -> FloatArray:
        """(n,) the largest distance at each frame. counted: (n, v) which vertices count; all by default."""
        off = _bones(self.rig, curves.sampled(self.frames.tolist())) - self.bones
        columns = off[:, self.track.columns]  # (n, 4 b, 3)
        result = np.empty(len(off))
        step = max(1, 4_000_000 // max(len(self.track), 1))  # frames at a time: some hundred megabytes
        for start in range(0, len(off), step):
            some = columns[start : start + step].transpose(1, 0, 2)  # (4 b, frames, 3)
            moved = self.track.times(some.reshape(len(some), -1)).reshape(len(self.track), -1, 3).swapaxes(0, 1)
            squares = np.einsum("nvi,nvi->nv", moved, moved)
            if counted is not None:
                squares = np.where(counted[start : start + step], squares, 0.0)
            result[start : start + step] = np.sqrt(squares.max(axis=1, initial=0.0))
        return result


class _HeldSkin:
    """The vertices that hold something at some frame, with errors counted against their own tolerance."""

    def __init__(self, skin: _Skin, held: BoolArray) -> None:
        self.skin, self.held = skin, held  # (n, v)

    @classmethod
    def of(cls, rig: Rig, given: _Given, held: Sequence[IntArray] | None) -> _HeldSkin:
        """Raises InvalidInput for another number of frames."""
        rows = held if held is not None else [np.zeros(0, np.int64)] * len(given.frames)
        if len(rows) != len(given.frames):
            raise InvalidInput(f"held vertices are said per frame, but got {len(rows)} for {len(given.frames)}.")
        vertices = np.unique(np.concatenate([np.zeros(0, np.int64), *rows]))
        mask = np.array([np.isin(vertices, row) for row in rows]).reshape(len(rows), len(vertices))
        return cls(_Skin(rig, given, vertices), mask)

    def errors(self, curves: PoseCurves) -> FloatArray:
        """(n,) the largest distance of what is held at each frame, over the share of the tolerance that it has."""
        if not self.held.any():
            return np.zeros(len(self.held))
        return self.skin.errors(curves, self.held) / HELD_SHARE


def _bones(rig: Rig, local: FloatArray) -> FloatArray:
    """(n, 4 j, 3) transposed world_from_joint matrices of local ones (n, j, 4, 4), one below the other."""
    world = np.array(local)
    for joint, parent in enumerate(rig.parents):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ local[:, joint]
    return np.asarray(world[:, :, :3].swapaxes(-1, -2).reshape(len(local), -1, 3))
