"""The records that describe a hand. Positions and directions are in the rig's space at rest, surface units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from contact_core.arrays import FloatArray
from contact_core.geometry.surface_point import SurfacePoints

Segment = Literal["metacarpal", "proximal", "intermediate", "distal"]


@dataclass(frozen=True, eq=False)
class DigitBone:
    """One joint of a digit and the bone that starts there.

    joint: index in the rig. frame: (3, 3) in the joint's own axes; columns x along the bone, y to the palm side,
    z = x cross y the flexion axis: a positive turn about z closes the hand. flexes: whether the joint bends the
    digit (a finger's metacarpal and a robot's sideways hinge do not).
    """

    joint: int
    segment: Segment
    frame: FloatArray
    flexes: bool = True


@dataclass(frozen=True, eq=False)
class Digit:
    """A digit from the palm outwards. tip: (3,) where its skin ends. tip_joint: a last joint that only marks
    the tip, -1 for none. role: "thumb", "index", ..., or "digit 1", ... round a claw."""

    role: str
    bones: tuple[DigitBone, ...]
    tip: FloatArray
    tip_joint: int = -1

    @property
    def is_thumb(self) -> bool:
        return self.role == "thumb"

    @property
    def joints(self) -> tuple[int, ...]:
        """All joints from the palm outwards, the tip's included."""
        return (*(bone.joint for bone in self.bones), *((self.tip_joint,) if self.tip_joint >= 0 else ()))


@dataclass(frozen=True, eq=False)
class Palm:
    """point: (3,) on the skin. normal: (3,) unit, out of the palm. fingers: (3,) unit, the way they point.
    is_plane: False for a claw, whose digits stand round an axis: normal and fingers are then that axis."""

    point: FloatArray
    normal: FloatArray
    fingers: FloatArray
    is_plane: bool = True


@dataclass(frozen=True, eq=False)
class Pad:
    """A round place of the skin that touches: where a disk of `radius` would be painted.

    joint: the rig's joint below it. centre: one surface point; normal: (3,) outwards there. axis: two surface
    points, from one rim to the other as the default generator of axes draws a round patch: along the bone.
    """

    name: str
    role: str
    joint: int
    centre: SurfacePoints
    normal: FloatArray
    axis: SurfacePoints
    radius: float


@dataclass(frozen=True, eq=False)
class HandDescription:
    """A hand: digits in order, thumb first, then from its side on.

    hub: the joint at which the digits part. side: which hand it is, "" where it cannot be told (claws). opposition:
    (3,) unit, from the thumb's tip to the middle of the other tips; None without a thumb. confidence: 0 to 1, how
    much it is like a hand and how clearly the palm's side shows. notes: sentences on what could not be told.
    """

    hub: int
    side: Literal["left", "right", ""]
    palm: Palm
    digits: tuple[Digit, ...]
    pads: tuple[Pad, ...]
    opposition: FloatArray | None = None
    confidence: float = 1.0
    notes: tuple[str, ...] = ()

    @property
    def thumb(self) -> Digit | None:
        return next((digit for digit in self.digits if digit.is_thumb), None)

    @property
    def fingers(self) -> tuple[Digit, ...]:
        """The digits but the thumb."""
        return tuple(digit for digit in self.digits if not digit.is_thumb)


@dataclass(frozen=True)
class HandWords:
    """What a rig's author says about a hand and overrides what is told from its shape (`[[hand]]` in rig.toml).

    hub: joint name. thumb: name of a joint of the thumb, "" for "it has none", None to tell it. side: "left" or
    "right". palm: (x, y, z) out of the palm, in rig space. digits: role -> name of a joint of that digit.
    """

    hub: str
    thumb: str | None = None
    side: Literal["left", "right", ""] = ""
    palm: tuple[float, float, float] | None = None
    digits: dict[str, str] = field(default_factory=dict)
