"""The built-in samples: what each is, how it is modelled, and the models that come with the package.

A model comes with the package because it hangs by last bits: which edges collapse is another choice under another
release of numpy or on another processor, and a hand that is modelled in Blender would be another asset in the
application (docs/adr/0119).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from importlib.resources import files
from typing import Literal

import numpy as np

from contact_builtins.samples.packing import unpack
from contact_core.document.asset import Asset

PACKAGE = "contact_builtins.samples"
MODELS = "models"  # folder of the archives


@dataclass(frozen=True)
class GeneratedSample:
    """A sample whose module in this package has `build() -> Asset`."""

    name: str
    kind: Literal["manipulator", "object"]
    summary: str
    builder: str = field(repr=False)  # "module:function"

    def build(self) -> Asset:
        """The asset that comes with the package."""
        with (files(PACKAGE) / MODELS / f"{self.name}.npz").open("rb") as file, np.load(file) as arrays:
            return unpack(arrays)

    def generate(self) -> Asset:
        """Model the asset anew (seconds; the extra `samples`)."""
        module, function = self.builder.split(":")
        make: Callable[[], Asset] = getattr(import_module(f"{PACKAGE}.{module}"), function)
        return make()

    def version(self) -> str:
        """Digest of what models this sample: all of this package but the modules of other samples, and what keeps
        models."""
        others = {sample.builder.split(":")[0] for sample in ALL} - {self.builder.split(":")[0]}
        state = hashlib.sha256()
        for source in sorted(files(PACKAGE).iterdir(), key=lambda entry: entry.name):
            module, _, ending = source.name.partition(".")
            if ending == "py" and module not in others and module not in _KEEPERS:
                state.update(source.read_bytes().replace(b"\r\n", b"\n"))
        return state.hexdigest()[:16]


_KEEPERS = ("__init__", "__main__", "catalogue", "packing")
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
