"""`place = "naive"`: the open hand, each pad to the closest point of the object, whatever faces what.

What a tool without a placer does; here as the yardstick that "from pose" is measured against.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contact_builtins.placers.closing import Approaching
from contact_builtins.placers.from_pose import place_pads
from contact_core.plugins.slots import PlacementRequest, PlacementResult
from contact_core.solve.body import manipulator_length


@dataclass(frozen=True)
class Naive(Approaching):
    """Closest points of the hand as it is."""

    name: ClassVar[str] = "naive"
    summary: ClassVar[str] = "each pad of the open hand to the closest point, whatever faces what"

    def place(self, request: PlacementRequest) -> PlacementResult:
        """Raises InvalidInput when the hand passes the object by."""
        hand = self.approached(request)
        reach = np.inf if request.reach is None else request.reach * manipulator_length(request.rig)
        return place_pads(request, hand, reach, facing=None)
