"""Where a patch lies: at a root of its own, or as the child of another patch, linked to it by a geodesic.

Plain numbers, no arrays: a placement is compared, hashed and stored as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from contact_core.errors import InvalidInput
from contact_core.geometry.surface_point import SurfacePoints


@dataclass(frozen=True, slots=True)
class Root:
    """The first axis point on its surface, and the direction in which the axis leaves it.

    heading: unit complex number in the tangent frame of the point (paper: a1 and T(1)).
    """

    json_union: ClassVar[bool] = True  # stored with its class name, for it comes in unions
    face: int
    barycentric: tuple[float, float, float]
    heading: complex

    def __post_init__(self) -> None:
        length = abs(self.heading)
        total = math.fsum(self.barycentric)
        if not 1e-9 < length < 1e9:
            raise InvalidInput(f"a heading is a unit complex number, but got {self.heading}.")
        if len(self.barycentric) != 3 or not min(self.barycentric) >= -1e-6 or not abs(total - 1.0) <= 1e-6:
            raise InvalidInput(f"barycentric coordinates are non-negative and sum to 1; got {self.barycentric}.")
        if self.face < 0:
            raise InvalidInput(f"a face index is not negative, but got {self.face}.")
        if abs(length - 1.0) > 1e-15:
            object.__setattr__(self, "heading", self.heading / length)

    @classmethod
    def at(cls, point: SurfacePoints, heading: complex) -> Root:
        """From a batch of one point. Raises InvalidInput for any other number of points."""
        if len(point) != 1:
            raise InvalidInput(f"a root is one surface point, but got {len(point)}.")
        a, b, c = point.barycentric[0].tolist()
        return cls(int(point.faces[0]), (a, b, c), complex(heading))

    def point(self) -> SurfacePoints:
        """The root as a batch of one point."""
        return SurfacePoints([self.face], [self.barycentric])

    def heading_to(self, heading: complex) -> Root:
        """The same point, another heading."""
        return replace(self, heading=complex(heading))


@dataclass(frozen=True, slots=True)
class Link:
    """A child's place relative to its parent's axis: a geodesic from one axis point to the other.

    The path leaves axis point `parent_point` of `parent` at `direction` from the axis tangent there (radians),
    runs lengths[0], turns by turns[0] at a saddle vertex, runs lengths[1], and so on (surface units, radians),
    and ends at the child's axis point `own_point`, whose tangent lies at `heading` (radians) from the path's
    ending direction. The angles are those of this surface: a mirrored transfer negates them once.
    """

    json_union: ClassVar[bool] = True
    parent: str
    direction: float
    lengths: tuple[float, ...]
    turns: tuple[float, ...]
    heading: float
    parent_point: int = 0
    own_point: int = 0

    def __post_init__(self) -> None:
        check_chain(self.lengths, self.turns, (self.direction, self.heading), "a link")
        if min(self.parent_point, self.own_point) < 0:
            raise InvalidInput("the axis points of a link are not negative.")

    def mirrored(self) -> Link:
        """The mirror image: every angle negated."""
        turns = tuple(-turn for turn in self.turns)
        return replace(self, direction=-self.direction, turns=turns, heading=-self.heading)

    def scaled(self, factor: float) -> Link:
        """All lengths times `factor`: the same link on a surface in other units."""
        return replace(self, lengths=tuple(factor * length for length in self.lengths))


@dataclass(frozen=True, slots=True)
class Walk:
    """A place on the way between two roots, as patches have while they slide from one key to the next.

    The walk leaves `start` at `direction` from its heading (radians), runs lengths[0], turns by turns[0] at a
    saddle vertex, and so on (surface units, radians); the heading lies at `heading` from its ending direction. The
    walk alone says where it ends: it never goes over to another shortest path.
    """

    json_union: ClassVar[bool] = True
    start: Root
    direction: float
    lengths: tuple[float, ...]
    turns: tuple[float, ...]
    heading: float

    def __post_init__(self) -> None:
        check_chain(self.lengths, self.turns, (self.direction, self.heading), "a walk")

    @property
    def face(self) -> int:
        """Where it starts."""
        return self.start.face


def check_chain(lengths: tuple[float, ...], turns: tuple[float, ...], angles: tuple[float, ...], what: str) -> None:
    """Straight legs with a turn between each two of them. Raises InvalidInput."""
    if len(lengths) != len(turns) + 1:
        raise InvalidInput(f"{what} of {len(turns)} turns has one length more, but got {len(lengths)} lengths.")
    if not all(map(math.isfinite, (*angles, *lengths, *turns))):
        raise InvalidInput(f"the angles and lengths of {what} are finite numbers.")
    if min(lengths) < 0.0:
        raise InvalidInput(f"the lengths of {what} are not negative.")


Placement = Root | Link | Walk
