"""Points on skin as linear maps of the bones, which is what linear-blend skinning is.

A point at fixed barycentric coordinates of a skinned face is a weighted sum of bone matrices times constant
vectors: p_i = sum_b W_b h_ib, with W_b the world_from_joint of bone b and h_ib homogeneous in that joint.
So a set of k points is one constant matrix H (k, 4b), sparse since few bones carry a point, and

    points = H @ bones,   dp/dtheta = H @ dbones,   sum_i w_i |dp_i|^2 = dbones^T (H^T W H) dbones,

exact for the interpolated skin. Points on a rigid or fixed body are the same with one bone. The difference of two
tracks is a track: a pair of contacts with gradients at both ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from contact_core.arrays import FloatArray, IntArray
from contact_core.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class Gram:
    """What a weighted sum of squares needs of a track: sum_i w_i h_i h_i^T (width b, width b), and, where rows are
    watched, the weights w (k,) themselves."""

    matrix: FloatArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Track:
    """k vectors that the bones carry: points (`width` 4) or normals (`width` 3), not normalised.

    bones: (b,) which bones of the problem (columns over all its bodies). Row i is the sum over e from starts[i]
    (k + 1,) on to starts[i + 1] of what bone `bones[bone_of_entry[e]]` makes of `entries[e]` (n, width).
    watched: (k, m) sparse, what is added of the points or normals that black boxes evaluate; None: nothing.
    """

    bones: IntArray
    starts: IntArray
    bone_of_entry: IntArray
    entries: FloatArray
    watched: Any = None

    def __len__(self) -> int:
        return len(self.starts) - 1

    @property
    def width(self) -> int:
        """4 for points, 3 for normals."""
        return int(self.entries.shape[1])

    @cached_property
    def columns(self) -> IntArray:
        """(width b,) the rows of the stacked bones of a problem that the track multiplies."""
        return (self.bones[:, None] * self.width + np.arange(self.width)).ravel()

    @cached_property
    def blocks(self) -> FloatArray:
        """(k, b, width) the dense matrix, by bones."""
        result = np.zeros((len(self), len(self.bones), self.width))
        np.add.at(result, (np.repeat(np.arange(len(self)), np.diff(self.starts)), self.bone_of_entry), self.entries)
        return result

    def carried(self, carrier: FloatArray) -> FloatArray:
        """(k, 3) by the bones of a problem (width j, 3), transposed, one below the other; nothing is watched."""
        from contact_core.rig import track_kernels

        result = np.empty((len(self), 3))
        track_kernels.carry(_plain(self.starts), self._carriers, self._arrays[2], _plain(carrier), result)
        return result

    @cached_property
    def _carriers(self) -> IntArray:
        """(n,) of each entry, the first of its bone's rows below one another."""
        return np.asarray(self.width * self.bones[self.bone_of_entry])

    def times(self, dense: FloatArray) -> FloatArray:
        """(k, m) the product with a matrix (width b, m), which has rows for the bones of this track alone."""
        from contact_core.rig import track_kernels

        result = np.zeros((len(self), dense.shape[1]))
        track_kernels.times(*self._arrays, _plain(dense), result)
        return result

    def gathered_by_bones(self, rows: FloatArray) -> FloatArray:
        """(width b, 3) the product of the transposed matrix with rows (k, 3): forces, summed for each bone."""
        from contact_core.rig import track_kernels

        result = np.zeros((self.width * len(self.bones), 3))
        track_kernels.gather(*self._arrays, _plain(rows), result)
        return result

    def gram(self, weights: FloatArray) -> Gram:
        """Of weights (k,): all that a weighted sum of squares needs of k rows."""
        from contact_core.rig import track_kernels

        size = self.width * len(self.bones)
        result = np.zeros((size, size))
        track_kernels.gram(*self._arrays, _plain(weights), result)
        return Gram(result, weights)

    @cached_property
    def _arrays(self) -> tuple[IntArray, IntArray, FloatArray]:
        """What kernels take."""
        return _plain(self.starts), _plain(self.bone_of_entry), _plain(self.entries)

    def combined(self, other: Track, factor: float = 1.0) -> Track:
        """The track of self + factor * other, row by row."""
        if len(self) != len(other) or self.width != other.width:
            raise InvalidInput(
                f"tracks add row by row, but one has {len(self)} rows of {self.width} and the other"
                f" {len(other)} of {other.width}."
            )
        bones = np.union1d(self.bones, other.bones)
        starts = self.starts + other.starts
        bone_of_entry = np.empty(starts[-1], np.int64)
        entries = np.empty((starts[-1], self.width))
        for track, places, by in (
            (self, _spread(self.starts, starts[:-1]), 1.0),
            (other, _spread(other.starts, starts[:-1] + np.diff(self.starts)), factor),
        ):
            bone_of_entry[places] = np.searchsorted(bones, track.bones)[track.bone_of_entry]
            entries[places] = by * track.entries
        parts = [part for part in (self.watched, _times(factor, other.watched)) if part is not None]
        watched = None if not parts else parts[0] if len(parts) == 1 else parts[0] + parts[1]
        return Track(bones, starts, bone_of_entry, entries, watched)

    def rows(self, index: IntArray) -> Track:
        """The track of some of the rows, in the order of `index` (m,)."""
        lengths = np.diff(self.starts)[index]
        starts = np.concatenate([[0], np.cumsum(lengths)])
        taken = _spread(starts, self.starts[index])
        watched = None if self.watched is None else self.watched[index]
        return Track(self.bones, starts, self.bone_of_entry[taken], self.entries[taken], watched)

    def scaled(self, factors: FloatArray) -> Track:
        """The track with each row times its factor (k,)."""
        entries = self.entries * np.repeat(factors, np.diff(self.starts))[:, None]
        watched = None if self.watched is None else self.watched.multiply(factors[:, None]).tocsr()
        return replace(self, entries=entries, watched=watched)

    def summed(self, weights: FloatArray) -> Track:
        """The track of one row, the sum of all by weights (k,). Of bones alone, with nothing that is watched."""
        return replace(self.scaled(weights), starts=np.array([0, len(self.entries)]))

    @classmethod
    def empty(cls, width: int) -> Track:
        """The track of nothing."""
        return cls.without_bones(0, width)

    @classmethod
    def without_bones(cls, count: int, width: int, watched: Any = None) -> Track:
        """A track of `count` rows that no bone carries."""
        none = np.zeros(0, np.int64)
        return cls(none, np.zeros(count + 1, np.int64), none, np.zeros((0, width)), watched)

    @classmethod
    def axes(cls, bones: IntArray) -> Track:
        """The track (3 b) of the three axes of each bone (b,), one below the other."""
        count = len(bones)
        return cls(bones, np.arange(3 * count + 1), np.repeat(np.arange(count), 3), np.tile(np.eye(3), (count, 1)))

    @classmethod
    def gathered(cls, rows: IntArray, bones: IntArray, entries: FloatArray, count: int) -> Track:
        """A track of `count` rows out of n entries: their rows (n,), bones of the problem (n,), and `entries`
        (n, width). Those of one bone in one row are added up."""
        used = np.flatnonzero(np.bincount(bones)) if len(bones) else np.zeros(0, np.int64)
        key = rows * max(len(used), 1) + np.searchsorted(used, bones)
        order = np.argsort(key, kind="stable")
        first = np.flatnonzero(np.diff(key[order], prepend=-1))
        row, bone_of_entry = np.divmod(key[order][first], max(len(used), 1))
        summed = np.add.reduceat(entries[order], first, axis=0) if len(first) else entries[:0]
        starts = np.searchsorted(row, np.arange(count + 1))
        return cls(used, starts, bone_of_entry, summed)

    @classmethod
    def stacked(cls, tracks: Sequence[Track]) -> Track:
        """Several tracks below one another."""
        bones = tracks[0].bones
        for track in tracks[1:]:
            bones = bones if np.array_equal(bones, track.bones) else np.union1d(bones, track.bones)
        ends = np.cumsum([0, *(len(track.entries) for track in tracks)])
        starts = [track.starts[:-1] + end for track, end in zip(tracks, ends[:-1], strict=True)]
        return cls(
            bones,
            np.concatenate([*starts, ends[-1:]]),
            np.concatenate([np.searchsorted(bones, track.bones)[track.bone_of_entry] for track in tracks]),
            np.concatenate([track.entries for track in tracks]),
            _stacked_watched(tracks),
        )


def watched_track(first: int, count: int, total: int, width: int) -> Track:
    """The track of `count` points or normals that a black box evaluates, the `first`.. of all `total`."""
    from scipy.sparse import csr_matrix

    shares = csr_matrix((np.ones(count), (np.arange(count), np.arange(first, first + count))), shape=(count, total))
    return Track.without_bones(count, width, shares)


def _plain(array: Any) -> Any:
    """The array as kernels are compiled for it, contiguous and writeable: they are compiled again for each kind."""
    return np.require(array, requirements=("C", "W"))


def _spread(starts: IntArray, firsts: IntArray) -> IntArray:
    """(n,) where the entries of rows go when row i, which has those from starts[i] (k + 1,) on, goes to firsts[i]
    (k,) and on."""
    return np.arange(starts[-1]) + np.repeat(firsts - starts[:-1], np.diff(starts))


def _times(factor: float, watched: Any) -> Any:
    return None if watched is None else factor * watched


def _stacked_watched(tracks: Sequence[Track]) -> Any:
    total = next((track.watched.shape[1] for track in tracks if track.watched is not None), None)
    if total is None:
        return None
    from scipy.sparse import csr_matrix, vstack

    parts = [csr_matrix((len(t), total)) if t.watched is None else t.watched for t in tracks]
    return vstack(parts, format="csr")
