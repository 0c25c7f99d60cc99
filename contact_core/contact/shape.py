"""The intrinsic shape of a patch: its axis as lengths and turning angles, its points as coordinates from the axis.

A shape knows no surface. A root and a heading place it on one (`contact.patch.reconstruct_patch`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from contact_core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, digest, frozen
from contact_core.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class AxisShape:
    """An axis of s segments up to its root and heading.

    lengths: (s,) surface units; empty for an axis of one point. turning_angles: (s - 1,) radians at the interior
    points, from the ending direction of one segment to the initial direction of the next (paper: phi).
    along: factor on all lengths along the axis. spread: factor on distances across it. mirrored: traced as the
    mirror image: turning angles, and the sides that patch points lie on, change sign.
    """

    lengths: FloatArray
    turning_angles: FloatArray
    along: float = 1.0
    spread: float = 1.0
    mirrored: bool = False

    def __post_init__(self) -> None:
        lengths = frozen(self.lengths, np.float64, (None,), "lengths of an axis")
        object.__setattr__(self, "lengths", lengths)
        angles = frozen(self.turning_angles, np.float64, (max(len(lengths) - 1, 0),), "turning_angles of an axis")
        object.__setattr__(self, "turning_angles", angles)
        if len(lengths) and lengths.min() < 0.0:
            raise InvalidInput(f"the lengths of an axis are not negative, but got {lengths.min()}.")
        if not (0.0 < self.along < np.inf and 0.0 < self.spread < np.inf):
            raise InvalidInput(f"along and spread are positive factors, but got {self.along} and {self.spread}.")

    @property
    def point_count(self) -> int:
        """Number of axis points."""
        return len(self.lengths) + 1

    @property
    def length(self) -> float:
        """Length of the whole axis, `along` included (surface units)."""
        return float(self.lengths.sum()) * self.along

    @cached_property
    def digest(self) -> str:
        """Content digest."""
        content = digest(self.lengths, self.turning_angles, np.array([self.along, self.spread]))
        return f"{content} mirrored" if self.mirrored else content

    @property
    def traced_turns(self) -> FloatArray:
        """(s - 1,) turning angles as they are traced, in radians: negated where the axis is mirrored."""
        return -self.turning_angles if self.mirrored else self.turning_angles

    def transformed(self, *, mirrored: bool = False, unit: float = 1.0) -> AxisShape:
        """The axis as it is traced on another surface. mirrored: as the mirror image of this one. unit: of that
        surface's lengths per unit of these."""
        if not mirrored and unit == 1.0:
            return self
        return replace(self, along=self.along * unit, spread=self.spread * unit, mirrored=self.mirrored != mirrored)

    def bent(self, point: int, angle: float) -> AxisShape:
        """The same axis with turning angle `angle` (radians) at interior point `point`."""
        self.check_bend(point)
        angles = self.turning_angles.copy()
        angles[point - 1] = angle
        return replace(self, turning_angles=angles)

    def check_bend(self, point: int) -> None:
        """Raises InvalidInput unless the axis can bend at `point`."""
        if not 1 <= point <= len(self.turning_angles):
            inner = f"1..{len(self.turning_angles)}" if len(self.turning_angles) else "none"
            raise InvalidInput(f"an axis bends at its interior points ({inner}), but got point {point}.")


@dataclass(frozen=True, eq=False)
class PatchCoordinates:
    """n patch points, each a geodesic from its closest axis point.

    anchors: (n,) index of the axis point. legs: (n,) complex, the first straight leg of the path from the
    anchor, relative to the axis tangent there (surface units; paper: z). A shortest path that passes saddle
    vertices turns there: path i goes on with chain_angles and chain_lengths of
    chain_starts[i]:chain_starts[i + 1] (radians from the straight continuation; surface units).
    """

    anchors: IntArray
    legs: ComplexArray
    chain_starts: IntArray
    chain_angles: FloatArray
    chain_lengths: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "anchors", frozen(self.anchors, np.int64, (None,), "anchors"))
        n = len(self.anchors)
        put(self, "legs", frozen(self.legs, np.complex128, (n,), "legs"))
        put(self, "chain_starts", frozen(self.chain_starts, np.int64, (n + 1,), "chain_starts"))
        put(self, "chain_angles", frozen(self.chain_angles, np.float64, (None,), "chain_angles"))
        c = len(self.chain_angles)
        put(self, "chain_lengths", frozen(self.chain_lengths, np.float64, (c,), "chain_lengths"))
        starts = self.chain_starts
        if starts[0] != 0 or starts[-1] != c or (starts[1:] < starts[:-1]).any():
            raise InvalidInput("chain_starts must rise from 0 to the number of chain_angles.")
        if n and self.anchors.min() < 0:
            raise InvalidInput("anchors are not negative.")

    def __len__(self) -> int:
        return len(self.anchors)

    @cached_property
    def digest(self) -> str:
        """Content digest."""
        return digest(self.anchors, self.legs, self.chain_starts, self.chain_angles, self.chain_lengths)

    def select(self, keep: BoolArray) -> PatchCoordinates:
        """The points where `keep` (n,) holds, in order."""
        counts = np.diff(self.chain_starts)
        in_chain = np.repeat(keep, counts)
        starts = np.concatenate([[0], np.cumsum(counts[keep])])
        return PatchCoordinates(
            self.anchors[keep], self.legs[keep], starts, self.chain_angles[in_chain], self.chain_lengths[in_chain]
        )

    @classmethod
    def concatenate(cls, first: PatchCoordinates, second: PatchCoordinates) -> PatchCoordinates:
        """The points of both, in order; both are relative to the same axis."""
        return cls(
            np.concatenate([first.anchors, second.anchors]),
            np.concatenate([first.legs, second.legs]),
            np.concatenate([first.chain_starts, first.chain_starts[-1] + second.chain_starts[1:]]),
            np.concatenate([first.chain_angles, second.chain_angles]),
            np.concatenate([first.chain_lengths, second.chain_lengths]),
        )


@dataclass(frozen=True, eq=False)
class PatchShape:
    """The shape of a patch: what a patch and all its transferred copies share.

    weights: (n,) non-negative, by default each point's share of the area of the surface it was painted on.
    meters_per_unit: of the surface it was painted on; lengths are converted when it is placed on another.
    """

    axis: AxisShape
    coordinates: PatchCoordinates
    weights: FloatArray
    meters_per_unit: float = field(default=1.0)

    def __post_init__(self) -> None:
        weights = frozen(self.weights, np.float64, (len(self.coordinates),), "weights of a patch")
        object.__setattr__(self, "weights", weights)
        if len(weights) and weights.min() < 0.0:
            raise InvalidInput(f"the weights of a patch are not negative, but got {weights.min()}.")
        anchors = self.coordinates.anchors
        if len(anchors) and anchors.max() >= self.axis.point_count:
            raise InvalidInput(
                f"anchors index the {self.axis.point_count} axis points, but got {int(anchors.max())} among them."
            )
        if not 0.0 < self.meters_per_unit < np.inf:
            raise InvalidInput(f"meters_per_unit is a positive number, but got {self.meters_per_unit}.")

    def __len__(self) -> int:
        return len(self.coordinates)

    @cached_property
    def digest(self) -> str:
        """Content digest of all that shapes the reconstruction (the weights do not)."""
        return self.axis.digest + self.coordinates.digest + repr(self.meters_per_unit)

    def with_axis(self, axis: AxisShape) -> PatchShape:
        """The same coordinates over another axis of as many points."""
        return replace(self, axis=axis)

    def select(self, keep: BoolArray) -> PatchShape:
        """The points where `keep` (n,) holds."""
        return replace(self, coordinates=self.coordinates.select(keep), weights=self.weights[keep])

    def extended(self, coordinates: PatchCoordinates, weights: FloatArray) -> PatchShape:
        """More points on the same axis."""
        together = PatchCoordinates.concatenate(self.coordinates, coordinates)
        return replace(self, coordinates=together, weights=np.concatenate([self.weights, weights]))
