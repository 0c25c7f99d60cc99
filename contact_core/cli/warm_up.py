"""`contact warm-up`: compile the kernels ahead of time, so that the first edit does not wait."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contact_core.plugins.manager import PluginManager


class WarmUp:
    name = "warm-up"
    summary = "compile the kernels now; they are kept for this machine"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """No options of its own."""

    def run(self, arguments: argparse.Namespace) -> int:
        from contact_core.solve.warm_up import warm_up

        seconds = warm_up() + _closing(arguments.plugins)
        arguments.output.answer({"seconds": seconds}, f"the kernels are ready ({seconds:.1f} s)")
        return 0


def _closing(plugins: PluginManager) -> float:
    """Close the first sample hand once, which compiles the kernels of grasping; seconds."""
    import time

    import numpy as np

    from contact_core.geometry.distance_field import DistanceField
    from contact_core.grasping.closing import close_hands
    from contact_core.grasping.hand import hand_of
    from contact_core.hands.describe import describe_hand
    from contact_core.plugins.registry import SAMPLES

    began = time.perf_counter()
    for sample in plugins.offers(SAMPLES).values():
        rig = sample.build().rig if sample.kind == "manipulator" else None
        if rig is not None:
            field = DistanceField.of(rig.surface, resolution=8)
            close_hands(hand_of(rig, describe_hand(rig)), field, np.eye(4)[None], np.zeros((1, 3)))
            break
    return time.perf_counter() - began
