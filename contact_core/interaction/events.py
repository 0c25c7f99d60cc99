"""What pointer and keyboard did, as values. Positions are in pixels of the view from its top left corner.

(0.5, 0.5) is the centre of the first pixel. Pixels are those that the view's own `rays` and `project` count in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from contact_core.arrays import FloatArray
from contact_core.errors import InvalidInput

PointerKind: TypeAlias = Literal["press", "move", "release", "wheel", "leave"]
Button: TypeAlias = Literal["left", "middle", "right", "none"]
Modifier: TypeAlias = Literal["ctrl", "alt", "shift"]

POINTER_KINDS: tuple[PointerKind, ...] = ("press", "move", "release", "wheel", "leave")
BUTTONS: tuple[Button, ...] = ("left", "middle", "right", "none")
MODIFIERS: tuple[Modifier, ...] = ("ctrl", "alt", "shift")  # in the order in which a chord is spelt
NO_MODIFIERS: frozenset[Modifier] = frozenset()
KEY_NAMES = frozenset(
    (
        "Escape",
        "Enter",
        "Space",
        "Tab",
        "Backspace",
        "Delete",
        "Home",
        "End",
        "Left",
        "Right",
        "Up",
        "Down",
        "F1",
        "F2",
    )
)
_SPELT = {"ctrl": "Ctrl", "alt": "Alt", "shift": "Shift"}


@dataclass(frozen=True)
class Pointer:
    """Something that the pointer did.

    kind: a "move" without a button held is hovering; "leave" is the end of that. x, y: pixels. button: the one that
    went down or up; "none" for other kinds. modifiers: held meanwhile; the command key of a Mac counts as "ctrl".
    pressure: 0 to 1 of a pen, 1 of a mouse. time: seconds of any steady clock. wheel: notches, away from the user
    positive. Raises InvalidInput for a position that is not finite, and for names that are none of these.
    """

    kind: PointerKind
    x: float
    y: float
    button: Button = "none"
    modifiers: frozenset[Modifier] = NO_MODIFIERS
    pressure: float = 1.0
    time: float = 0.0
    wheel: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in POINTER_KINDS or self.button not in BUTTONS:
            raise InvalidInput(
                f"a pointer event is one of {', '.join(POINTER_KINDS)} with one of the buttons"
                f" {', '.join(BUTTONS)}, but got {self.kind!r} with {self.button!r}."
            )
        if not all(map(math.isfinite, (self.x, self.y, self.pressure, self.time, self.wheel))):
            raise InvalidInput(f"the numbers of a pointer event are finite, but got {self}.")
        _check_modifiers(self.modifiers)
        object.__setattr__(self, "pressure", min(max(self.pressure, 0.0), 1.0))

    @property
    def pixel(self) -> FloatArray:
        """(2,) where it is."""
        return np.array([self.x, self.y], float)

    def holds(self, modifier: Modifier) -> bool:
        """Whether a modifier is held."""
        return modifier in self.modifiers


@dataclass(frozen=True)
class Key:
    """A key that went down, or repeats. There is no event for a key that goes up: no action needs one.

    name: a printable character as it is engraved, letters in capitals ("B", "[", "?"), or one of KEY_NAMES.
    Raises InvalidInput for another name.
    """

    name: str
    modifiers: frozenset[Modifier] = NO_MODIFIERS
    time: float = 0.0

    def __post_init__(self) -> None:
        name = self.name.upper() if len(self.name) == 1 else self.name
        object.__setattr__(self, "name", "Space" if name == " " else name)
        if not (self.name in KEY_NAMES or (len(self.name) == 1 and self.name.isprintable())):
            raise InvalidInput(
                f"a key is one printable character or one of {', '.join(sorted(KEY_NAMES))}, but got {self.name!r}."
            )
        _check_modifiers(self.modifiers)

    @property
    def chord(self) -> str:
        """As tables spell it: "Ctrl+Shift+Z"."""
        return "+".join([*(_SPELT[each] for each in MODIFIERS if each in self.modifiers), self.name])


Event: TypeAlias = Pointer | Key


def _check_modifiers(modifiers: frozenset[Modifier]) -> None:
    unknown = sorted(set(modifiers) - set(MODIFIERS))
    if unknown:
        raise InvalidInput(f"modifiers are some of {', '.join(MODIFIERS)}, but got {unknown[0]!r}.")
