"""`place = "naive"`: the open hand, each pad to the closest point of the object, whatever faces what.

What a tool without a placer does; here as the yardstick that "from pose" is measured against.
Settings: approach and without, as of "from pose".
"""

from __future__ import annotations

import numpy as np

from contact_builtins.placers.closing import approach
from contact_builtins.placers.from_pose import place_pads
from contact_builtins.placers.hand_pose import HandPose, matching
from contact_core.job.table import Table
from contact_core.plugins.slots import PlacementRequest, PlacementResult


class Naive:
    """Closest points of the hand as it is."""

    name = "naive"

    def place(self, request: PlacementRequest) -> PlacementResult:
        """Raises InvalidInput for wrong settings."""
        options = Table(dict(request.options), "placer")
        direction = options.vector("approach", None, direction=True)
        without = options.texts("without", ())
        options.done()
        hand = HandPose(request)
        if direction is not None:
            approach(hand, np.array(direction), matching(request.rig, without, "placer.without"))
        return place_pads(request, hand, np.inf, facing=None)
