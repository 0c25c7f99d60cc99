"""The built-in samples: what each is, how it is made, and the cache that makes the second call instant."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.resources import files
from typing import Literal

import numpy as np

from contact_builtins.samples.packing import pack, unpack
from contact_core.cache import cached_arrays
from contact_core.document.asset import Asset
from contact_core.errors import InvalidInput

PACKAGE = "contact_builtins.samples"


@dataclass(frozen=True)
class GeneratedSample:
    """A sample whose module in this package has `build() -> Asset`."""

    name: str
    kind: Literal["manipulator", "object"]
    summary: str
    builder: str = field(repr=False)  # "module:function"

    def build(self) -> Asset:
        """The asset, out of the cache or made now (seconds)."""
        try:
            return unpack(cached_arrays("samples", f"{self.name}-{self.version()}", lambda: pack(self.generate())))
        except InvalidInput:  # the cache holds something else under this name: it costs time, nothing more
            return self.generate()

    def generate(self) -> Asset:
        """Make the asset, whatever the cache holds."""
        module, function = self.builder.split(":")
        make: Callable[[], Asset] = getattr(import_module(f"{PACKAGE}.{module}"), function)
        return make()

    def version(self) -> str:
        """Digest of what makes this sample: a changed generator never meets an old cache.

        All of this package but the modules of other samples, and this catalogue; and numpy's release, whose last
        bits decide which edges collapse (1.26 makes a human hand of 5,207 points, 2.4 one of 5,214), so that hosts
        which share a cache do not take each other's hands.
        """
        others = {sample.builder.split(":")[0] for sample in ALL} - {self.builder.split(":")[0]}
        state = hashlib.sha256(np.lib.NumpyVersion(np.__version__).version.encode())
        for source in sorted(files(PACKAGE).iterdir(), key=lambda entry: entry.name):
            module, _, ending = source.name.partition(".")
            if ending == "py" and module not in others and module != "catalogue":
                state.update(source.read_bytes())
        return state.hexdigest()[:16]


HUMAN_HAND = GeneratedSample(
    "human_hand", "manipulator", "a right human hand, 18 cm, 25 joints, open and relaxed", "human_hand:build"
)
WITCH_HAND = GeneratedSample(
    "witch_hand",
    "manipulator",
    "a witch's right hand with long knobbly fingers and claws, 25 joints",
    "witch_hand:build",
)
ALIEN_HAND = GeneratedSample(
    "alien_hand", "manipulator", "a three-fingered alien hand with bulbous pads, 15 joints", "alien_hand:build"
)
TENTACLE = GeneratedSample(
    "tentacle", "manipulator", "a tentacle of 21 joints, tapered, its inner side flat", "tentacle:build"
)
HUMAN_BODY = GeneratedSample(
    "human_body", "manipulator", "a full body, 1.76 m, 26 joints, that can sit", "human_body:build"
)
MUG = GeneratedSample("mug", "object", "a mug with a handle (genus 1)", "mug:build")
BASEBALL = GeneratedSample("baseball", "object", "a baseball with its seam", "baseball:build")
SCISSORS = GeneratedSample("scissors", "object", "closed scissors (genus 2)", "scissors:build")
RABBIT = GeneratedSample("rabbit", "object", "a sitting rabbit, 22 cm", "rabbit:build")
POLE = GeneratedSample("pole", "object", "an upright pole, 1.2 m", "furniture:pole")
CHAIR = GeneratedSample("chair", "object", "a wooden chair, seat at 45 cm", "furniture:chair")
FLOOR = GeneratedSample("floor", "object", "a floor of 3 m by 3 m", "furniture:floor")
ALL = (
    HUMAN_HAND,
    WITCH_HAND,
    ALIEN_HAND,
    TENTACLE,
    HUMAN_BODY,
    MUG,
    BASEBALL,
    SCISSORS,
    RABBIT,
    POLE,
    CHAIR,
    FLOOR,
)
