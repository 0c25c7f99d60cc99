"""A clip: what a file calls an animation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from contact_core.errors import InvalidInput
from contact_core.rig.pose_keys import PoseKeys


@dataclass(frozen=True, eq=False)
class Clip:
    """Keys of several rigs and objects in one film. rate: frames per second.

    keys: one for each that moves, `rig` being the name of its asset. What has no rig moves as one joint, its world
    transform.
    """

    name: str
    rate: float
    keys: tuple[PoseKeys, ...]

    def __post_init__(self) -> None:
        if not 0.0 < self.rate < math.inf:
            raise InvalidInput(f"the rate is a positive number of frames per second, but got {self.rate}.")
        names = [keys.rig for keys in self.keys]
        if len(set(names)) != len(names) or not all(keys.frames for keys in self.keys):
            raise InvalidInput(f"a clip has keys, once for each that moves, but got {names}.")
