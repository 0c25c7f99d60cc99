"""The default: along a long patch, along the bone of a round one, and always the same way round."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from contact_builtins.axes.along_bone import bone_heading
from contact_builtins.axes.consistent import Consistent, drawn_heading
from contact_builtins.axes.straight import (
    Flattened,
    elongation,
    flatten,
    principal_heading,
    projected_heading,
    through_centre,
)
from contact_builtins.axes.thumb import towards_thumb
from contact_core.contact.axis_generator import AxisRequest
from contact_core.geometry import SurfacePoints
from contact_core.settings import HasSettings, setting

_TELLS = 0.3  # a guide nearly square to the axis tells nothing: the cosine below which it is not asked


@dataclass(frozen=True)
class Guided(HasSettings):
    """A stroke says by its shape where its axis goes and a dab does not. The bone gives the sign: an axis does
    not run against it, and one that lies rather across it runs away from the thumb. Where no digit is like a thumb,
    it goes the way of the axes that are drawn already, as a round patch without a bone does. None of these knows a
    left hand from a right one, so the mirror image of a hand gets the mirror image of its axes."""

    name: ClassVar[str] = "guided"
    default_for: ClassVar[str] = "paint"
    summary: ClassVar[str] = (
        "along a long patch, along the bone of a round one, never against the bone, across it from the thumb on"
    )
    elongated: float = setting(
        1.5, low=1.0, high=100.0, help="a patch that is longer than wide by this factor tells more than its bone"
    )

    def generate(self, request: AxisRequest) -> SurfacePoints:
        flat = flatten(request)
        along = bone_heading(request, flat)
        if elongation(flat) < self.elongated:
            return Consistent().generate(request) if along is None else through_centre(flat, along)
        heading = principal_heading(flat)
        for guide in _guides(request, flat, heading, along):
            way = (heading * guide.conjugate()).real
            if abs(way) > _TELLS:
                return through_centre(flat, heading if way > 0.0 else -heading)
        return through_centre(flat, heading)


def _guides(request: AxisRequest, flat: Flattened, heading: complex, along: complex | None) -> Iterator[complex]:
    """Unit headings that an axis should rather go with than against, the most important one first."""
    if along is None:
        return
    turn = heading * along.conjugate()
    if abs(turn.real) > abs(turn.imag):
        yield along
    thumb = towards_thumb(request)
    away = None if thumb is None else projected_heading(flat, -thumb)
    if away is not None:
        yield away
    drawn = drawn_heading(request, flat, along)
    if drawn is not None:
        yield drawn
