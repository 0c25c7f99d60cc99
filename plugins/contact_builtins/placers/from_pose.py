"""`place = "from pose"`: contacts go where the pads of a coarsely closed hand look.

Its settings are what the recipe's table [placer] holds beside `name`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.placers.closing import OPPOSE, Approaching, close, search_thumb
from contact_builtins.placers.hand_pose import HandPose, dominant_joint, matching
from contact_builtins.placers.pads import Pad, pads_of, place_pad
from contact_core.arrays import IntArray
from contact_core.errors import NotManifold
from contact_core.geometry.raycast import Locator
from contact_core.geometry.surface_point import SurfacePoints
from contact_core.plugins.slots import PatchPlacement, PlacementRequest, PlacementResult
from contact_core.settings import setting
from contact_core.solve.body import manipulator_length

FACING = -0.3  # n.n' of a face that a pad may land on: never the far wall of a cup


@dataclass(frozen=True)
class FromPose(Approaching):
    """Approach, auto-close, thumb search, then each pad to the closest point among faces that face it."""

    name: ClassVar[str] = "from pose"
    summary: ClassVar[str] = "where the pads of a coarsely closed hand look"
    default_for: ClassVar[tuple[str, ...]] = ("settle", "recipe")
    close: tuple[str, ...] = setting((), help="joint patterns, one for each digit that is curled until it touches")
    thumb: str | None = setting(
        None, help="joint pattern of the digit that is searched over starts of its first joint"
    )
    oppose: float = setting(
        OPPOSE,
        low=0.0,
        unit="manipulator lengths",
        help="the distance it is worth that the thumb opposes the fingers",
    )
    far: float = setting(
        0.06, above=0.0, unit="manipulator lengths", help="pads farther away than this are left out and named"
    )

    def place(self, request: PlacementRequest) -> PlacementResult:
        """Raises InvalidInput for settings that do not fit the rig, and when the hand cannot reach the object."""
        hand = self.approached(request)
        rig = request.rig
        for pattern in self.close:
            close(hand, matching(rig, (pattern,), "placer.close"))
        if self.thumb is not None:
            joints = matching(rig, (self.thumb,), "placer.thumb")
            mine, others = _pads_on_and_off(request, joints, dominant_joint(rig))
            search_thumb(hand, joints, mine, others, self.oppose)
        reach = self.far if request.reach is None else request.reach
        return place_pads(request, hand, reach * manipulator_length(rig), facing=FACING)


def place_pads(request: PlacementRequest, hand: HandPose, reach: float, facing: float | None) -> PlacementResult:
    """Each pad of a posed hand to its closest point on the object, within `reach` (object units)."""
    locator = Locator.of(request.object_mesh)
    placed: dict[str, PatchPlacement] = {}
    left_out: dict[str, str] = {}
    for name, pad in pads_of(request, hand).items():
        found = _closest(locator, pad, facing)
        if found is None:
            left_out[name] = "no face of the object faces it"
        elif found[1] > reach:
            left_out[name] = (
                f"{100 * found[1] / manipulator_length(request.rig):.1f} % of the length away from the object"
            )
        else:
            try:
                placed[name] = place_pad(request.object_mesh, pad, found[0])
            except NotManifold as error:  # one broken edge costs the pad beside it, not the grasp
                left_out[name] = str(error)
    return PlacementResult(placed, left_out, hand.pose())


def _closest(locator: Locator, pad: Pad, facing: float | None) -> tuple[SurfacePoints, float] | None:
    """The closest point to a pad's centre and its distance; among faces that face it with `facing`."""
    if facing is None:
        found = locator.closest(pad.centre)
    else:
        found = locator.closest(pad.centre, facing=pad.normal, facing_limit=facing)
    return (found.points, float(found.distance[0])) if found.found[0] else None


def _pads_on_and_off(
    request: PlacementRequest, joints: IntArray, owner: IntArray
) -> tuple[list[SurfacePoints], list[SurfacePoints]]:
    """The patches that lie mostly on skin of the given joints, and the others."""
    mine: list[SurfacePoints] = []
    others: list[SurfacePoints] = []
    for points in request.patch_points.values():
        on = np.isin(owner[request.rig.faces[points.faces]], joints).mean() > 0.5
        (mine if on else others).append(points)
    return mine, others
